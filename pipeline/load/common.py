"""Scans that are crops of one grid, each cut out otherwise: all are read within the box that each of them shows."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.load.geometry import Header, voxel_of

WHOLE_VOXELS = 0.02
"""How far from a whole number of voxels a crop's corners may lie: headers are written to 1e-4 of one."""
LEAST_SHARE = 0.5
"""Of the smallest scan's voxels along each axis that all must show: with less in common they are not of one place."""


def on_common_box(headers: Sequence[Header]) -> list[Header]:
    """The headers, of one shape where the scans are crops of one grid; as they are where they are not.

    Scans of equal shape are left alone: an origin that is off by whole voxels is no crop, and is refused.
    """
    same = list(headers)
    if len({header.shape for header in headers}) < 2:
        return same
    found = [_first_voxel(headers[0], header) for header in headers]
    offsets, shapes = [at for at in found if at is not None], np.array([header.shape for header in headers])
    if len(offsets) < len(headers):
        return same
    low, high = np.max(offsets, axis=0), np.min(np.array(offsets) + shapes, axis=0)
    if np.any(high - low < np.maximum(LEAST_SHARE * shapes.min(axis=0), 2)):
        return same
    shape = [int(n) for n in high - low]
    return [_cut(header, low - at, shape) for header, at in zip(headers, offsets, strict=True)]


def told(headers: Sequence[Header]) -> list[str]:
    """A sentence of what was assumed where scans are read in the box that all of them show."""
    if all(header.whole is None for header in headers):
        return []
    first = headers[0]
    return [
        f"the {len(headers)} scans are cut out of one grid, each otherwise: of all are read the {list(first.shape)} "
        f"voxels that every one of them shows ({first.source.path.name} has {list((first.whole or first).shape)})"
    ]


def is_crop(one: Header, other: Header) -> bool:
    """Whether another scan's voxels are those of one scan's grid, wherever it begins and ends."""
    return _first_voxel(one, other) is not None


def _first_voxel(first: Header, other: Header) -> NDArray[np.int64] | None:
    """Where in the grid of one scan another's first voxel lies (3,); None where it has other voxels."""
    last = np.subtract(other.shape, 1)
    begins, ends = (voxel_of(first, other, at) for at in (np.zeros(3), last))
    middle = voxel_of(first, other, last * [0, 1, 0])  # two corners alone do not show a turn about their line
    at = np.rint(begins)
    apart = np.abs([begins - at, ends - at - last, middle - at - last * [0, 1, 0]])
    return at.astype(np.int64) if apart.max() < WHOLE_VOXELS else None


def _cut(header: Header, start: NDArray[np.int64], shape: Sequence[int]) -> Header:
    """The header of a box of a scan. start : its first voxel (3,)."""
    if not start.any() and tuple(shape) == header.shape:
        return header
    first = (int(start[0]), int(start[1]), int(start[2]))
    size = (shape[0], shape[1], shape[2])
    return replace(header, shape=size, origin_mm=header.grid.to_mm(start), whole=header, first=first)
