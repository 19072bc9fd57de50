"""The grey levels and noise that a segmentation method starts from, and the region that it finds.

A method is a function like :func:`fuzzy.fuzzy_region`.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chndtr

from pipeline.arrays.grids import unflattened
from pipeline.model import Counters
from pipeline.segment._kernels.voxels import rebased
from pipeline.status import FrameStatus, StageError
from solver.grid import Grid

THICK = 5.0
"""Depth over blur from which the grey in the middle of a vessel reaches its plateau."""
BRIGHTER = 1.25
"""Contrast, over that at the seed, from which a voxel is bone or metal: bone 1.3 times as bright, connected to a lumen
of 0.6 mm voxels, was taken for the lumen's plateau, and the wall came out 0.43 voxels too narrow."""
BRIGHT_SHARE = 0.1
"""Share of the deepest voxels that may be so bright before they are left out."""


Index = NDArray[np.int64]


@dataclass(frozen=True)
class GreyLevels:
    """Grey values of the object and of what surrounds it, and the noise.

    noise : of one voxel beside the next.  noise_left : its standard deviation by how often 1-2-1 has smoothed it.
    seed, at_seed : the voxel around which they were first estimated, and ``inside`` as it was there.
    brightest, foreign : the grey above which a voxel is no vessel, and the share of the deepest voxels that are
    brighter; set only where that is more than BRIGHT_SHARE.
    """

    inside: float
    outside: float
    noise: float
    noise_left: tuple[float, ...]
    seed: tuple[int, ...] | None = None
    at_seed: float = float("nan")
    brightest: float = float("inf")
    foreign: float = 0.0

    @property
    def contrast(self) -> float:
        """Inside minus outside."""
        return self.inside - self.outside

    @property
    def half(self) -> float:
        """The level of the wall."""
        return 0.5 * (self.inside + self.outside)

    def share(self, grey: NDArray[Any]) -> NDArray[Any]:
        """Grey as a share of the contrast: 0 outside, 1 inside."""
        return np.asarray((grey - self.outside) / self.contrast)

    def noise_after(self, taps: NDArray[Any]) -> float:
        """Standard deviation of the noise in grey smoothed by binomial taps; from twice on as after twice."""
        return self.noise_left[min(len(taps) // 2, len(self.noise_left) - 1)]


def box_around(grid: Grid, index: NDArray[Any], half_mm: float, least: int) -> tuple[slice, slice, slice]:
    """The voxels within ``half_mm`` (at least ``least`` voxels) of a voxel, clipped to the grid."""
    half = np.maximum(np.ceil(half_mm / grid.spacing_mm).astype(int), least)
    a, b, c = (
        slice(max(0, int(i - h)), min(n, int(i + h) + 1)) for i, h, n in zip(index, half, grid.shape, strict=True)
    )
    return a, b, c


def box_from(corner: Index, shape: tuple[int, ...] | Index) -> tuple[slice, ...]:
    """The voxels of a scan that a box of this shape holds, which begins at a voxel."""
    return tuple(slice(int(first), int(first) + int(n)) for first, n in zip(corner, shape, strict=True))


def median(values: NDArray[Any], otherwise: float) -> float:
    """The median of values; otherwise of fewer than eight."""
    return float(np.median(values)) if values.size >= 8 else otherwise


def scanner_blur(blur_mm: float, taps: NDArray[Any], voxel: float) -> float:
    """The whole blur less the smoothing by ``taps`` and by the spline, mm; 0.3 voxel at least."""
    reach = np.arange(len(taps)) - len(taps) // 2
    smoothing = float(np.sum(reach**2 * taps)) + 1.0 / 3.0
    return float(np.sqrt(max(blur_mm**2 - smoothing * voxel**2, (0.3 * voxel) ** 2)))


@dataclass(frozen=True, eq=False)
class Vessel:
    """A vessel in its scan: the signed distance (mm) from its wall, on a box of the scan, and its grey levels.

    taps : the smoothing in which it was found.
    """

    scan: Grid
    distance: Grid
    levels: GreyLevels
    taps: NDArray[np.float32]

    @cached_property
    def corner(self) -> Index:
        """The scan's voxel at which the box begins."""
        return np.asarray(np.rint(self.scan.to_index(self.distance.origin_mm)), np.int64)

    @property
    def box(self) -> tuple[slice, ...]:
        """The scan's voxels in the box."""
        return box_from(self.corner, self.distance.shape)

    def deep(self, blurs_mm: float, most: int) -> Index:
        """Indices (n, 3), in the box, of the voxels deeper than that below the wall, or so many of them."""
        flat = np.flatnonzero(self.distance.values < -blurs_mm)
        return unflattened(flat[:: max(1, len(flat) // most)], self.distance.shape)

    def grey_around(self, index: Index) -> NDArray[np.float64]:
        """Mean grey (n,) of the 3^3 voxels around voxels (n, 3) of the box."""
        return grey_around(self.scan, index + self.corner)


def plateau(vessel: Vessel, blur_mm: float) -> GreyLevels:
    """The levels estimated again, from the deepest part of the whole segmented vessel.

    blur_mm : the scanner's.  A tube no thicker than its blur never reaches its plateau: its grey is divided by the
    profile of a blurred cylinder (non-central chi^2). What is too bright for the vessel does not count.
    """
    scan, distance, levels = vessel.scan, vessel.distance, vessel.levels
    inside = np.flatnonzero(distance.values < 0)
    if not np.isfinite(blur_mm) or not len(inside):
        return levels
    there = rebased(inside, distance.shape, vessel.corner, scan.shape)
    off_wall, grey = -distance.values.reshape(-1)[inside], scan.values.reshape(-1)[there]
    depth, core = _deepest(off_wall)
    limit = _brightest(vessel, blur_mm)
    some = core[:: max(1, len(core) // 500)]
    foreign = float(np.mean(grey_around(scan, unflattened(there[some], scan.shape)) > limit))
    if foreign > BRIGHT_SHARE:
        some = np.arange(0, len(grey), max(1, len(grey) // 20_000))
        some = some[grey_around(scan, unflattened(there[some], scan.shape)) <= limit]
        levels = replace(levels, brightest=limit, foreign=foreign)
        if not len(some):
            return levels
        off_wall, grey = off_wall[some], grey[some]
        depth, core = _deepest(off_wall)
    if depth > THICK * blur_mm:
        return replace(levels, inside=median(grey[core], levels.inside))
    core = core[:: max(1, len(core) // 500)]
    radius = depth + 0.15 * blur_mm * float(np.exp(-depth / blur_mm))
    off_axis = np.maximum(radius - off_wall[core], 0.0)
    aside = ((off_axis / blur_mm) ** 2 + 1e-9).astype(np.float64)
    share = chndtr((radius / blur_mm) ** 2, 2, aside)
    peak = median((grey[core] - levels.outside) / np.maximum(share, 0.4), levels.contrast)
    return replace(levels, inside=levels.outside + peak)


def _deepest(off_wall: NDArray[Any]) -> tuple[float, Index]:
    """Depth of a vessel (99th percentile, mm), and positions of its voxels that are deeper than 0.7 of that."""
    depth = float(np.percentile(off_wall, 99))
    return depth, np.flatnonzero(off_wall > 0.7 * depth)


def grey_around(scan: Grid, index: Index) -> NDArray[np.float64]:
    """Mean grey (n,) of the 3^3 voxels around voxels (n, 3): a single one is too noisy to be called bright."""
    last = np.array(scan.shape) - 1
    steps = np.indices((3, 3, 3)).reshape(3, -1).T - 1
    grey = [scan.values[tuple(np.clip(index + step, 0, last).T)] for step in steps]
    return np.asarray(np.mean(grey, axis=0, dtype=np.float64))


def _brightest(vessel: Vessel, blur_mm: float) -> float:
    """The grey above which a voxel is no vessel: BRIGHTER times the contrast at the seed, corrected for its blur."""
    distance, levels = vessel.distance, vessel.levels
    if levels.seed is None:
        return float("inf")
    seed = box_around(distance, np.array(levels.seed) - vessel.corner, 0.0, 1)
    depth = -float(distance.values[seed].min(initial=0.0))
    # grey at the seed was smoothed by 1-2-1, of variance 1/2
    share = 1.0 - np.exp(-0.5 * depth**2 / (blur_mm**2 + 0.5 * float(np.mean(distance.spacing_mm)) ** 2))
    return levels.outside + BRIGHTER * (levels.at_seed - levels.outside) / max(float(share), 0.4)


def brighter(levels: GreyLevels, wire: bool) -> tuple[str, ...]:
    """One sentence for the report where the vessel is connected to something brighter, or none.

    wire : the scan shows a wire, which is that itself where it is thick or bright.
    """
    if not levels.foreign:
        return ()
    return (
        f"segment: {100 * levels.foreign:.0f} % of the deepest voxels are more than {BRIGHTER:g} times as bright as "
        f"the vessel at its seed: {'the wire in it, or ' * wire}bone or metal hangs together with it; the wall's level "
        "is taken from the rest; where they touch there is no wall: look at the picture, scan with smaller voxels, "
        "subtract the bone, or give the lumen as a file (manifest key lumen)",
    )


@dataclass(frozen=True, eq=False)
class Region:
    """The voxels of a vessel (flat indices of the scan), and what is needed to find its wall.

    thin : flat indices of branches too thin for a wall at half height.  levels : grey inside and outside.  taps : the
    separable smoothing of the grey in which the wall is looked for.  necks : axes (n, 3), voxels, of the necks passed.
    passing : the voxels (3,) where other thin vessels pass by.  faint : one of each branch that is left out since
    it is filled too little.
    """

    voxels: Index
    thin: Index
    levels: GreyLevels
    taps: NDArray[np.float32]
    counters: Counters
    necks: tuple[NDArray[np.float64], ...] = ()
    passing: tuple[Index, ...] = ()
    faint: tuple[Index, ...] = ()


def failed(got: str, allowed: str, do: str) -> StageError:
    """The error that says why there is no lumen."""
    return StageError(FrameStatus.SEGMENT_FAILED, f"segment: {got}; expected {allowed}; {do}")


def seed_voxels(grid: Grid, seeds_mm: ArrayLike) -> Index:
    """The voxels (n, 3) of the seeds that lie in the volume; raises StageError where none does."""
    points = np.atleast_2d(np.asarray(seeds_mm, float))
    index = np.rint(grid.to_index(points)).astype(np.int64)
    outside = np.any((index < -1) | (index > np.array(grid.shape)), axis=1)
    if outside.all():
        got = f"seeds: got {np.round(points, 1).tolist()} mm"
        low, high = grid.to_mm([0, 0, 0]), grid.to_mm(np.array(grid.shape) - 1)
        allowed = f"a point inside the scan, {np.round(low, 1).tolist()} to {np.round(high, 1).tolist()} mm"
        raise failed(got, allowed, "check entry_mm or lumen_seed_mm (LPS mm)")
    return np.asarray(np.clip(index[~outside], 0, np.array(grid.shape) - 1))
