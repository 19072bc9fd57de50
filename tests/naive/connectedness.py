"""Fuzzy connectedness the slow and obvious way: max-min Dijkstra with a heap over voxels."""

from __future__ import annotations

import heapq

import numpy as np
from scipy import ndimage


def affinity(one: int, other: int, tables) -> int:
    """Quantised affinity 0..255 of two grey levels: sqrt(H O), from the tables' definition."""
    h = np.float32(tables.homogeneity[abs(one - other)])
    o = np.float32(tables.feature[one + other])
    return int(float(np.float32(h * o)) + 0.5)


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
    level = quantised(values, tables)
    best = np.zeros(values.shape, int)
    heap = []
    for seed in seeds:
        best[tuple(seed)] = 255
        heapq.heappush(heap, (-255, tuple(int(s) for s in seed)))
    while heap:
        negative, here = heapq.heappop(heap)
        if -negative < best[here]:
            continue
        for step in offsets:
            there = tuple(int(a + b) for a, b in zip(here, step, strict=True))
            if any(c < 0 or c >= n for c, n in zip(there, values.shape, strict=True)):
                continue
            link = min(-negative, affinity(level[here], level[there], tables))
            if link >= threshold and link > best[there]:
                best[there] = link
                heapq.heappush(heap, (-link, there))
    return best
