"""The lumen without wire: its voxels on the frames' lattice, in the order of memory, and the grey that they would have.

The grey is a reference scan's, or a model of the lumen's wall.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.special import ndtr

from pipeline.arrays.edges import layer_in
from pipeline.arrays.grids import contiguous, corners_mm, in_memory_order, integer_offset, reorder, sampled, spread
from pipeline.arrays.lattice import sparse_zeros
from pipeline.arrays.spare import Last, Spare
from pipeline.model import Lumen, Volume
from pipeline.trace._kernels.runs import WallModel, denoised, modelled, runs_below, subtract
from solver.grid import Grid

HALO_VOXELS = 4.0
"""How far outside the lumen grey is read: the blurred wire and the windows of derivatives reach that far."""
INSIDE_MM = 0.3
"""How far outside the wall the wire's axis may seem to lie: one voxel of segmentation and registration error."""
SAMPLE = 20000
"""Voxels of the lumen from which noise is estimated (to half a per cent)."""
TABLE_HALF = 160
"""Entries of the wall's profile on either side."""
TABLE_STEP = 0.05
"""Voxels from one to the next."""
SMOOTH_VOXELS = 1.0
"""Gaussian with which the reference's departure from the model is smoothed: its noise falls to 0.15."""


@dataclass(frozen=True, eq=False)
class SearchRegion:
    """The part of the frames' lattice that is looked at: the lumen's box and its voxels, in memory order.

    box : float32 signed distance on the frames' lattice.  corner : index in the frame of its voxel (0, 0, 0).
    runs : (n, 4) rows of voxels near the lumen: i, j, first k, stop k.  allowed : uint8 box, 1 where the wire's axis
    may lie.  axis : flat indices of those, ascending.  within : of a sample of them.  frame : shape of the frames.
    """

    box: Grid
    corner: NDArray[np.int64]
    runs: NDArray[np.int64]
    axis: NDArray[np.int64]
    within: NDArray[np.int64]
    allowed: NDArray[np.uint8]
    frame: tuple[int, ...]

    @cached_property
    def sample(self) -> NDArray[np.int64]:
        """Voxels (n, 3) of 2000 runs or so: enough for a median."""
        return voxels_of(self.sampled_runs)

    @cached_property
    def sample_depth(self) -> NDArray[np.float32]:
        """Signed distance (n,) of ``sample`` to the wall."""
        return np.asarray(self.box.values[tuple(self.sample.T)])

    @cached_property
    def _sample_in_frame(self) -> NDArray[np.int64]:
        return np.asarray(np.ravel_multi_index(tuple((self.sample + self.corner).T), self.frame))

    def sampled(self, scan: Grid) -> NDArray[Any]:
        """A frame's own grey (n,) at ``sample``."""
        return np.asarray(scan.values.reshape(-1)[self._sample_in_frame])

    @cached_property
    def sample_flat(self) -> NDArray[np.int64]:
        """Flat indices (n,) of ``sample`` in the box."""
        return np.asarray(np.ravel_multi_index(tuple(self.sample.T), self.box.shape))

    @cached_property
    def _deeper(self) -> dict[float, NDArray[np.int64]]:
        return {}

    def deeper(self, depth_mm: float) -> NDArray[np.int64]:
        """The voxels (flat) of ``within`` that are more than so many mm inside the wall."""
        if depth_mm not in self._deeper:
            self._deeper[depth_mm] = self.within[self.box.values.reshape(-1)[self.within] < -depth_mm]
        return self._deeper[depth_mm]

    @property
    def sampled_runs(self) -> NDArray[np.int64]:
        """The runs (m, 4) of ``sample``."""
        return self.runs[:: max(1, len(self.runs) // 2000)]

    @cached_property
    def holds_lumen(self) -> bool:
        """Whether a voxel of the frames lies in the lumen."""
        return bool(np.any(self.box.values < 0.0))

    @cached_property
    def inner(self) -> NDArray[np.int64]:
        """Flat indices of all voxels that are more than a voxel inside the wall."""
        return np.flatnonzero(self.box.values < -self.box.voxel_mm)

    @cached_property
    def greys(self) -> Spare:
        """Memory on the box for a frame's grey: 0 off the runs, on them whatever an earlier frame left."""
        return Spare(self.box.shape, np.float32)

    @cached_property
    def numbers(self) -> Spare:
        """Memory on the box for the numbers of voxels in a list: all 0."""
        return Spare(self.box.shape, np.int32)


def voxels_of(runs: NDArray[np.int64]) -> NDArray[np.int64]:
    """The voxels (n, 3) of runs."""
    length = runs[:, 3] - runs[:, 2]
    row = np.repeat(runs[:, :3], length, axis=0)
    row[:, 2] += np.arange(len(row)) - np.repeat(np.cumsum(length) - length, length)
    return row


def _onto(frame: Grid, distance: Grid) -> tuple[Grid, NDArray[np.int64]]:
    """The distance on the frame's lattice and the corner of its box; interpolated only where lattices differ."""
    corner = integer_offset(frame, distance)
    if corner is not None:
        low = np.maximum(corner, 0)
        high = np.minimum(corner + distance.shape, frame.shape)
        if np.any(high <= low):  # no voxel in common: one that is outside the lumen
            return distance.crop((0, 0, 0), (1, 1, 1)).with_values(np.full((1, 1, 1), np.inf, np.float32)), low
        a, b = (low - corner).tolist(), (high - corner).tolist()
        return distance.crop((a[0], a[1], a[2]), (b[0], b[1], b[2])), low
    index = frame.to_index(corners_mm(distance))
    low = np.clip(np.floor(index.min(0)), 0, np.array(frame.shape) - 1).astype(np.int64)
    high = np.clip(np.ceil(index.max(0)), low + 1, np.array(frame.shape)).astype(np.int64)
    empty = np.broadcast_to(np.float32(0), tuple(high - low))
    box = Grid(empty, frame.spacing_mm, frame.to_mm(low), frame.direction)
    return sampled(distance, box, float(np.max(distance.values))), low


def _region(frame: Grid, distance: Grid) -> SearchRegion:
    box, corner = _onto(frame, distance)
    box = contiguous(box)
    # in float64: a limit rounded up to float32 may include the distances that were cut off at it
    runs = runs_below(box.values, HALO_VOXELS * box.voxel_mm)
    allowed = box.values < INSIDE_MM
    axis = np.flatnonzero(allowed)
    within = axis[:: max(1, len(axis) // SAMPLE)]
    return SearchRegion(box, corner, runs, axis, within, allowed.view(np.uint8), frame.shape)


_regions = Last[SearchRegion]()
"""By the frames' lattice, on which they depend beside the lumen alone: frames share them."""


def region_of(frame: Grid, lumen: Lumen, axes: tuple[int, int, int]) -> SearchRegion:
    """The region for frames of this lattice (their axes reordered by ``axes``)."""
    lattice = (frame.shape, axes, frame.spacing_mm, frame.origin_mm, frame.direction)
    key = np.concatenate([np.ravel(part) for part in lattice]).tobytes()
    return _regions.of(lumen, key, lambda: _region(frame, reorder(lumen.distance, axes)))


def shows_lumen(frame: Volume, lumen: Lumen) -> bool:
    """Whether a voxel of the frame lies in the lumen."""
    grid, axes = in_memory_order(frame)
    return region_of(grid, lumen, axes).holds_lumen


def wall_blur(lumen: Lumen, voxel: float) -> float:
    """The scanner's blur (mm) as segment found it, else 0.9 voxel."""
    found = float(lumen.levels.get("scanner_blur_mm", float("nan")))
    return found if np.isfinite(found) and found > 0.3 * voxel else 0.9 * voxel


def _wall_model(
    scan: Grid, corner: NDArray[np.int64], region: SearchRegion, lumen: Lumen, *, empty: bool = False
) -> WallModel:
    """Grey over signed distance: the medians well inside and 2 to 4 voxels outside, joined by a blurred step.

    In a wall of silicone it is two steps: with one, its outer edge counted as noise, 100 grey where it was 25. empty :
    whether the scan shows no wire.
    """
    voxel = scan.voxel_mm
    at = region.sample
    grey, distance = scan.values[tuple((at + corner).T)], region.box.values[tuple(at.T)]
    deep, out = distance < -voxel, (distance > 2 * voxel) & (distance < HALO_VOXELS * voxel)
    inside = float(np.median(grey[deep if deep.any() else distance <= max(distance.min(), np.float32(-1e-9))]))
    outside = float(np.median(grey[out])) if out.any() else inside
    steps = np.arange(-TABLE_HALF, TABLE_HALF + 1) * TABLE_STEP * voxel
    # `segment` has looked; of a lumen that the user brings nobody knows, and a wire may pass for the vessel's core
    asked = "layer" in lumen.levels or (empty and not lumen.levels)
    layer = layer_in(distance / voxel, grey) if asked else None
    if layer is None:
        table = outside + (inside - outside) * ndtr(-steps / wall_blur(lumen, voxel))
    else:
        table = layer.at(steps / voxel)
    return WallModel(region.box.values, region.runs, table, TABLE_STEP * voxel)


def _on_box(reference: Volume, region: SearchRegion, axes: tuple[int, int, int]) -> tuple[Grid, NDArray[np.int64]]:
    """The reference, and where in it the region's box starts; interpolated near the lumen where lattices differ."""
    grid = reorder(reference, axes)
    corner = integer_offset(grid, region.box)
    if corner is not None and np.all(corner >= 0) and np.all(corner + region.box.shape <= np.array(grid.shape)):
        return contiguous(grid), corner
    return region.box.with_values(_interpolated(grid, region)), np.zeros(3, np.int64)


def _interpolated(scan: Grid, region: SearchRegion) -> NDArray[np.float32]:
    """A scan's grey on the region's box, at its runs alone; beyond the scan that at its edge.

    By cubic splines: halfway between voxels trilinear grey is off by 5 % of the contrast at a wall blurred by 0.7
    voxel, which was a mark as bright as a thin wire. Splines leave 2 %.
    """
    at = voxels_of(region.runs)
    splines = ndimage.spline_filter(scan.values, output=np.float32)
    out = sparse_zeros(region.box.shape, np.float32)
    index = scan.to_index(region.box.to_mm(at)).T
    out[tuple(at.T)] = ndimage.map_coordinates(splines, index, np.float32, mode="nearest", prefilter=False)
    return out


Background = tuple[NDArray[Any], NDArray[Any] | None]
"""Grey on the region's box; and, where it is a smoothed scan's, the scan's own grey at ``region.sample``."""


def _smoothed(reference: Volume, region: SearchRegion, lumen: Lumen, axes: tuple[int, int, int]) -> Background:
    scan, corner = _on_box(reference, region, axes)
    wall = _wall_model(scan, corner, region, lumen, empty=True)
    kind = np.int16 if scan.values.dtype.kind in "iu" and scan.values.dtype.itemsize <= 2 else np.float32
    rough, out = sparse_zeros(region.box.shape, kind), sparse_zeros(region.box.shape, kind)
    model = sparse_zeros(region.box.shape, np.float64)
    modelled(wall, model)
    subtract(scan.values, model, corner, region.runs, rough)
    variance = spread(rough.reshape(-1)[region.within].astype(float)) ** 2
    taps = np.exp(-0.5 * (np.arange(-2, 3) / SMOOTH_VOXELS) ** 2)
    denoised(rough, wall, taps, HALO_VOXELS * scan.voxel_mm, variance, out)
    return out, scan.values[tuple((region.sample + corner).T)]


_backgrounds = Last[Background]()
"""Of references, by the region: frames share them."""


def background_of(
    frame: Grid, reference: Volume | None, region: SearchRegion, lumen: Lumen, axes: tuple[int, int, int]
) -> Background:
    """The grey of the lumen without wire, on the region's box: the reference's there, its noise smoothed away.

    Without a reference: two grey levels of the frame itself, joined by the blurred wall.
    """
    if reference is None:
        out = sparse_zeros(region.box.shape, np.float32)
        modelled(_wall_model(frame, region.corner, region, lumen), out)
        return out, None
    return _backgrounds.of(reference, region, lambda: _smoothed(reference, region, lumen, axes))
