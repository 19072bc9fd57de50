"""Projections of a scan, small enough to keep one of each frame."""

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Array, Volume

SLAB_MM = 3.0
"""Half the thickness of a slab, mm: a vessel of the head fits in, its neighbours do not."""


def projections(volume: Volume, window: tuple[float, float]) -> tuple[NDArray[np.uint8], ...]:
    """Maximum-intensity projections along the three array axes, 8 bit within the grey-value ``window``."""
    return tuple(shades(volume.values.max(axis=axis).astype(np.float32), window) for axis in range(3))


def shades(values: NDArray[np.float32], window: tuple[float, float]) -> NDArray[np.uint8]:
    """Grey values as 8 bit: 0 at the window's lower end and below, 255 at its upper end and above."""
    low, high = window
    return np.asarray(np.clip((values - low) * (255.0 / max(high - low, 1e-9)), 0, 255).astype(np.uint8))


def slabs(volume: Volume, point_mm: Array) -> tuple[NDArray[np.uint8], ...]:
    """Maximum-intensity projections of what lies within ``SLAB_MM`` of a point (3,) along each array axis, 8 bit.

    A point outside the scan is moved to its nearest voxel.
    """
    index = np.clip(np.rint(volume.to_index(point_mm)), 0, np.array(volume.values.shape) - 1).astype(int)
    half = np.maximum(1, np.rint(SLAB_MM / volume.spacing_mm)).astype(int)
    each = [slice(max(0, i - h), i + h + 1) for i, h in zip(index, half, strict=True)]
    parts = [volume.values[tuple(s if a == axis else slice(None) for a in range(3))] for axis, s in enumerate(each)]
    peaks = [part.max(axis=axis).astype(np.float32) for axis, part in enumerate(parts)]
    low, high = np.percentile(np.concatenate([peak.ravel() for peak in peaks]), (1.0, 99.9))
    return tuple(shades(peak, (low, high)) for peak in peaks)


def grey_window(volume: Volume, wire_mm: Array | None = None) -> tuple[float, float]:
    """Grey values from the darkest projection pixels to the wire's: the median of the brightest voxels along it.

    wire_mm : points (n, 3) of the wire, LPS; where it is not known, the 99.99th percentile of a projection: of a short
    wire's pixels there are fewer than one in a thousand, and a window that ends below them shows it as bright as bone.
    """
    peak = volume.values.max(axis=2)
    low, high = np.percentile(peak, (1.0, 99.99))
    if wire_mm is not None and len(wire_mm):
        high = max(np.median(_brightest_near(volume, wire_mm)), low + 1e-9)
    return float(low), float(high)


def _brightest_near(volume: Volume, points_mm: Array) -> Array:
    """The brightest of the 27 voxels about each point (n, 3): a curve may run half a voxel beside its wire."""
    around = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3), axis=-1).reshape(-1, 3)
    index = np.rint(volume.to_index(points_mm)).astype(int)[:, None] + around
    inside = np.clip(index, 0, np.array(volume.values.shape) - 1)
    return np.asarray(volume.values[tuple(np.moveaxis(inside, -1, 0))].max(axis=1), dtype=float)
