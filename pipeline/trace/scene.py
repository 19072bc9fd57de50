"""What a wire stands out from: the frame minus its background, on the lumen's box, at the lumen's voxels alone."""

from __future__ import annotations

import weakref
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.special import ndtr

from pipeline._kernels.ridges import subtract
from pipeline.memory_order import contiguous, in_memory_order, integer_offset, reorder
from pipeline.model import Lumen, Volume
from solver.grid import Array, Grid

HALO_MM = 1.5
"""How far outside the lumen grey is read: the blurred wire and the windows of derivatives reach that far."""
INSIDE_MM = 0.3
"""How far outside the wall the wire's axis may seem to lie: one voxel of segmentation and registration error."""
MAD = 1.4826


@dataclass(frozen=True, eq=False)
class Region:
    """The part of the frames' lattice that is looked at: the lumen's box and its voxels, in memory order.

    box : float32 signed distance on the frames' lattice.  corner : index in the frame of its voxel (0, 0, 0).
    near : flat indices within HALO_MM of the lumen.  within : those in the lumen.  allowed : uint8 box of them.
    """

    box: Grid
    corner: NDArray[np.int64]
    near: NDArray[np.int64]
    within: NDArray[np.int64]
    allowed: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Scene:
    """Grey above the background (float32, on the region's box, valid at ``region.near``) and its noise.

    noise : robust standard deviation of one voxel.  modelled : True where no reference scan was there to subtract.
    """

    region: Region
    grey: NDArray[np.float32]
    noise: float
    modelled: bool
    counters: dict[str, float] = field(default_factory=dict)

    @property
    def spacing(self) -> Array:
        """Voxel size along the box's axes, mm."""
        return np.asarray(self.region.box.spacing_mm)

    def local(self, points_mm: Any) -> Array:
        """LPS mm -> mm along the box's axes from its first voxel (the coordinates of the kernels)."""
        return np.ascontiguousarray(self.region.box.to_index(points_mm) * self.spacing)

    def world(self, points: Any) -> Array:
        """Kernel coordinates -> LPS mm."""
        return self.region.box.to_mm(np.asarray(points, float) / self.spacing)

    def turned(self, direction: Any) -> Array:
        """A direction in LPS -> kernel coordinates."""
        return np.asarray(np.asarray(direction, float) @ self.region.box.direction)


def _onto(frame: Grid, distance: Grid) -> tuple[Grid, NDArray[np.int64]]:
    """The distance on the frame's lattice and the corner of its box; interpolated only where lattices differ."""
    offset = integer_offset(frame, distance)
    if offset is not None:
        corner = offset.astype(np.int64)
        low = np.maximum(corner, 0)
        high = np.minimum(corner + distance.shape, frame.shape)
        if np.any(high <= low):
            return distance.crop((0, 0, 0), (1, 1, 1)), low
        a, b = (low - corner).tolist(), (high - corner).tolist()
        return distance.crop((a[0], a[1], a[2]), (b[0], b[1], b[2])), low
    ends = np.stack(np.meshgrid(*[(0, n - 1) for n in distance.shape], indexing="ij"), -1).reshape(-1, 3)
    index = frame.to_index(distance.to_mm(ends))
    low = np.clip(np.floor(index.min(0)), 0, np.array(frame.shape) - 1).astype(np.int64)
    high = np.clip(np.ceil(index.max(0)), low + 1, np.array(frame.shape)).astype(np.int64)
    empty = Grid(
        np.broadcast_to(np.float32(0), tuple(high - low)), frame.spacing_mm, frame.to_mm(low), frame.direction
    )
    return sampled(distance, empty, float(np.max(distance.values))), low


def sampled(grid: Grid, like: Grid, outside: float) -> Grid:
    """``grid`` interpolated (trilinear) at the voxels of ``like``, float32; ``outside`` beyond it."""
    matrix = (grid.direction.T @ like.direction) * like.spacing_mm / grid.spacing_mm[:, None]
    shift = grid.to_index(like.origin_mm)
    values = np.empty(like.shape, np.float32)
    ndimage.affine_transform(
        grid.values.astype(np.float32),
        matrix,
        shift,
        like.shape,
        output=values,
        order=1,
        mode="constant",
        cval=outside,
    )
    return like.with_values(values)


_regions: weakref.WeakKeyDictionary[Lumen, dict[Any, Region]] = weakref.WeakKeyDictionary()
_backgrounds: weakref.WeakKeyDictionary[Grid, tuple[Any, NDArray[Any]]] = weakref.WeakKeyDictionary()


def _key(grid: Grid) -> tuple[Any, ...]:
    return (grid.shape, *(tuple(np.ravel(a)) for a in (grid.spacing_mm, grid.origin_mm, grid.direction)))


def region_of(frame: Grid, lumen: Lumen, axes: tuple[int, int, int]) -> Region:
    """The region for frames of this lattice; worked out once per lumen, since frames share it."""
    known = _regions.setdefault(lumen, {})
    key = (axes, *_key(frame))
    if key not in known:
        box, corner = _onto(frame, reorder(lumen.distance, axes))
        box = contiguous(box)
        flat = box.values.reshape(-1)
        near = np.flatnonzero(flat < HALO_MM)
        within = near[flat[near] < INSIDE_MM]
        allowed = np.zeros(box.shape, np.uint8)
        allowed.reshape(-1)[within] = 1
        known.clear()
        known[key] = Region(box, corner, near, within, allowed)
    return known[key]


def _reference_box(reference: Volume, region: Region, axes: tuple[int, int, int]) -> NDArray[Any]:
    """The reference on the region's box: a crop when it shares the lattice, else interpolated; kept for the next."""
    known = _backgrounds.get(reference)
    if known is not None and known[0] is region:
        return known[1]
    grid = reorder(reference, axes)
    offset = integer_offset(grid, region.box)
    stop = None if offset is None else offset.astype(int) + np.array(region.box.shape)
    if offset is None or stop is None or np.any(offset < 0) or np.any(stop > np.array(grid.shape)):
        box = sampled(grid, region.box, 0.0).values
    else:
        window = tuple(slice(int(a), int(b)) for a, b in zip(offset, stop, strict=True))
        box = np.ascontiguousarray(grid.values[window])
    _backgrounds[reference] = (region, box)
    return box


def _model_box(frame: Grid, region: Region) -> NDArray[np.float32]:
    """A background without a reference: two grey levels joined by the blurred wall."""
    distance = region.box.values
    stop = region.corner + np.array(region.box.shape)
    grey = frame.values[tuple(slice(int(a), int(b)) for a, b in zip(region.corner, stop, strict=True))]
    h = float(np.min(frame.spacing_mm))
    deep, out = distance < -h, (distance > 2 * h) & (distance < HALO_MM)
    inside = float(np.median(grey[deep if deep.any() else distance < 0]))
    outside = float(np.median(grey[out])) if out.any() else inside
    return (outside + (inside - outside) * ndtr(-distance / (0.9 * h))).astype(np.float32)


def build_scene(frame: Volume, lumen: Lumen, reference: Volume | None) -> Scene:
    """Subtract the background at the lumen's voxels; one pass over them, no copy of the frame."""
    grid, axes = in_memory_order(frame)
    region = region_of(grid, lumen, axes)
    background = _model_box(grid, region) if reference is None else _reference_box(reference, region, axes)
    grey = np.zeros(region.box.shape, np.float32)
    subtract(grid.values, background, region.corner, region.near, grey)
    sample = grey.reshape(-1)[region.within[:: max(1, len(region.within) // 20000)]]
    middle = float(np.median(sample))
    noise = MAD * float(np.median(np.abs(sample - middle)))
    if reference is not None and abs(middle) > 0.02 * noise:
        grey.reshape(-1)[region.near] -= middle
    counters = {
        "voxels_read": float(len(region.near)),
        "voxels_total": float(np.prod(grid.shape)),
        "noise": noise,
    }
    return Scene(region, grey, max(noise, 1e-6), reference is None, counters)
