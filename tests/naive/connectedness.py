"""Fuzzy connectedness the slow and obvious way: max-min Dijkstra with a heap over voxels."""

from __future__ import annotations

import heapq

import numpy as np
from scipy import ndimage


def affinities(one, other, tables):
    """Quantised affinities 0..255 of pairs of grey levels: sqrt(H O), from the tables' definition."""
    h = tables.homogeneity[np.abs(one - other)].astype(np.float32)
    o = tables.feature[one + other].astype(np.float32)
    return ((h * o).astype(float) + 0.5).astype(int)


def links_of(level, offsets, tables):
    """For every offset the affinity of each voxel to its neighbour there; 0 where that is outside."""
    found, inner = [], tuple(slice(1, -1) for _ in level.shape)
    padded = np.pad(level, 1, constant_values=-1)
    for step in offsets:
        other = np.roll(padded, [-int(s) for s in step], axis=(0, 1, 2))[inner]
        found.append(np.where(other < 0, 0, affinities(level, np.maximum(other, 0), tables)))
    return np.stack(found, axis=-1)


def quantised(values, tables):
    """Grey levels 0..1023 of values that are not smoothed (one tap)."""
    return np.clip(np.floor((values.astype(float) - tables.low) * tables.scale + 0.5), 0, 1023).astype(int)


def smoothed(values, taps):
    """Every voxel smoothed by the separable kernel, last axis first, the border voxel repeated outside."""
    out = values.astype(float)
    for axis in (2, 1, 0):
        out = ndimage.correlate1d(out, taps.astype(float), axis=axis, mode="nearest")
    return out


def strengths(values, seeds, tables, offsets, threshold: int):
    """Strength of the best path from any seed to every voxel; 0 below the threshold."""
    links = links_of(quantised(values, tables), offsets, tables)
    links = np.where(links < threshold, 0, links).reshape(-1, len(offsets)).tolist()
    strides = [int(np.dot(step, [values.shape[1] * values.shape[2], values.shape[2], 1])) for step in offsets]
    best, heap = [0] * values.size, []
    for seed in seeds:
        here = int(np.ravel_multi_index(tuple(seed), values.shape))
        best[here] = 255
        heapq.heappush(heap, (-255, here))
    while heap:
        negative, here = heapq.heappop(heap)
        if -negative < best[here]:
            continue
        for link, step in zip(links[here], strides, strict=True):
            reached = min(-negative, link)
            if reached and reached > best[here + step]:
                best[here + step] = reached
                heapq.heappush(heap, (-reached, here + step))
    return np.array(best).reshape(values.shape)
