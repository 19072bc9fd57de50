"""The frame minus its background, from which the wire stands out: on the lumen's box, at the lumen's voxels alone.

Where no reference scan shows the background, the grey under the wire is taken from beside it (:func:`levelled`).
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import ndimage
from scipy.special import ndtr

from pipeline.arrays.grids import in_memory_order, spread
from pipeline.arrays.jets import Blurred, gaussian_taps, smooth_voxels, values_at
from pipeline.arrays.lattice import sparse_zeros
from pipeline.model import Array, Lumen, Volume
from pipeline.trace._kernels.runs import subtract
from pipeline.trace._kernels.tube import active_voxels
from pipeline.trace.copied import copied_share
from pipeline.trace.gain import matched
from pipeline.trace.region import HALO_VOXELS, SearchRegion, background_of, region_of, voxels_of, wall_blur
from solver.grid import Grid

BLUR_VOXELS = 0.8
"""The scanner's blur over the smallest voxel, from which the shape of the blur in thick slices is taken."""
CREST_VOXELS = 0.7
"""Blur in which grey is read along a curve."""
CLEAR_BLURS = 3.5
"""Distance from the wire's axis, in its blurs, from which grey is taken for the lumen's: 0.2 % of the peak is left."""
DEEP_VOXELS = 1.0
"""Depth in the lumen from which a voxel shows the lumen's own grey: nearer the wall its blur mixes in."""
BLOCK = 4
"""Edge (voxels) of the blocks in which grey is averaged first."""
SMOOTH_BLOCKS = 1.25
"""Gaussian over block means: 5 voxels, wide enough to reach across the wire, short against changes of contrast."""
LEAST_SHARE = 0.02
"""Share of the voxels of a full block below which the smoothed blocks say nothing and the level is left alone."""

CORRELATED = 1.5
"""Noise of blurred grey over that of blurred white noise from which noise counts as correlated."""
UNEVEN = 0.82
"""Least share of its contrast, anywhere along it, of a vessel that counts as filled evenly."""


@dataclass(frozen=True, eq=False)
class Subtraction:
    """Grey above the background (float32, on the region's box, valid on ``region.runs``) and its noise.

    noise : robust standard deviation of one voxel.  without_reference : there was no reference scan, or none
    with less noise than the frame alone.  wall_blur_mm : the scanner's.  scan : the frame, in the order of the box's
    axes.  uneven : the lumen's contrast changes so much along it that no wire is found before that is taken away.
    Points and directions are in kernel coordinates: index along the box's axes times ``spacing``.
    """

    region: SearchRegion
    grey: NDArray[np.float32]
    noise: float
    without_reference: bool
    wall_blur_mm: float
    scan: Grid
    uneven: bool = False
    counters: dict[str, float] = field(default_factory=dict)
    levels: dict[str, float] = field(default_factory=dict)
    noises: dict[float, float] = field(default_factory=dict)
    samples: dict[float, NDArray[np.float32]] = field(default_factory=dict)

    @cached_property
    def spacing(self) -> Array:
        """Voxel size along the box's axes in the coordinates of the kernels, mm.

        Slices thicker than the pixels are drawn together until the wire's blur is as wide along every axis (scanner
        0.8 of the smallest voxel, and the slice's own box): the kernels know one blur. Equal voxels are left alone.
        """
        size = self.region.box.spacing_mm
        blur = np.hypot(BLUR_VOXELS * size.min(), size / np.sqrt(12))
        return np.asarray(size * blur.min() / blur)

    @cached_property
    def voxel(self) -> float:
        """Smallest of ``spacing``, mm."""
        return float(self.spacing.min())

    @property
    def modelled(self) -> bool:
        """Whether the background is a model's in part: without a reference scan, or with one of another contrast."""
        return self.without_reference or self.levels["gain"] != 1.0

    @property
    def thick_slices(self) -> bool:
        """Whether slices are so much thicker than pixels that a round wire does not look it."""
        return bool(np.max(self.spacing) > 1.5 * self.voxel)

    @cached_property
    def wall_greys(self) -> tuple[float, float]:
        """Median grey of the frame well inside the lumen and just outside it."""
        grey, distance = self.region.sampled(self.scan), self.region.sample_depth
        h = self.region.box.voxel_mm
        deep, out = distance < -h, distance > 2 * h
        inside = float(np.median(grey[deep if deep.any() else distance < h]))
        return inside, float(np.median(grey[out])) if out.any() else inside

    @property
    def edges_mm(self) -> tuple[float, float]:
        """Largest and smallest voxel edge of the scan."""
        size = self.region.box.spacing_mm
        return float(np.max(size)), float(np.min(size))

    def noise_in(self, blur_voxels: float) -> float:
        """Standard deviation of the noise in grey blurred by so many voxels, measured: correlation counts."""
        if blur_voxels not in self.noises:
            self.noises[blur_voxels] = max(spread(self.sampled_in(blur_voxels)[::2]), 1e-6)
        return self.noises[blur_voxels]

    def sampled_in(self, blur_voxels: float) -> NDArray[np.float32]:
        """Grey blurred by so many voxels, as it is now, at a sample of places: enough for its noise."""
        if blur_voxels not in self.samples:
            places = self.region.within[::4]
            self.samples[blur_voxels] = smooth_voxels(self.grey, gaussian_taps(blur_voxels), places)
        return self.samples[blur_voxels]

    @property
    def correlation(self) -> float:
        """Noise of blurred grey over that of blurred white noise: 1 where it is white."""
        white = float(np.sum(gaussian_taps(CREST_VOXELS) ** 2)) ** 1.5
        return max(1.0, float(self.noise_in(CREST_VOXELS) / (white * self.noise)))

    @property
    def correlated(self) -> bool:
        """Whether the noise is so correlated that smoothing leaves it."""
        return self.correlation > CORRELATED

    def local(self, points_mm: ArrayLike) -> Array:
        """LPS mm -> kernel coordinates."""
        return np.ascontiguousarray(self.region.box.to_index(points_mm) * self.spacing)

    def world(self, points: ArrayLike) -> Array:
        """Kernel coordinates -> LPS mm."""
        return self.region.box.to_mm(np.asarray(points, float) / self.spacing)

    def in_scan(self, points: Array) -> Array:
        """Kernel coordinates (n, 3) -> voxels of the scan, between them too."""
        return np.asarray(points / self.spacing + self.region.corner)

    def from_side(self, points: Array) -> Array:
        """How many voxels points (n, 3) are inside the scan's nearest side; below 0 outside it."""
        index = self.in_scan(points)
        return np.asarray(np.minimum(index, np.array(self.scan.shape) - 1 - index).min(axis=1))

    def turned(self, direction: ArrayLike) -> Array:
        """A direction in LPS -> kernel coordinates."""
        along = np.asarray(direction, float) @ self.region.box.direction
        along = along * self.spacing / self.region.box.spacing_mm
        return np.asarray(along / np.linalg.norm(along))

    def along(self, points: Array) -> Array:
        """Blurred grey (n,) at points (n, 3)."""
        return values_at(Blurred(self.grey, self.spacing, CREST_VOXELS * self.voxel), points)

    @contextmanager
    def showing(self, voxels: NDArray[np.int64], grey: NDArray[Any]) -> Iterator[None]:
        """Put other grey at some voxels (flat) inside a ``with`` block: in place, as a copy would hold a whole box."""
        flat = self.grey.reshape(-1)
        kept = flat[voxels]
        flat[voxels] = grey
        self.samples.clear()
        try:
            yield
        finally:
            flat[voxels] = kept
            self.samples.clear()

    def deep(self, voxels: float) -> NDArray[np.int64]:
        """The lumen's voxels (flat) that are more than so many voxels inside its wall."""
        return self.region.deeper(voxels * self.voxel)

    def depth_at(self, points: Array) -> NDArray[Any]:
        """Signed distance to the wall (n,) at the voxels nearest to points (n, 3); beyond the box, that at its edge."""
        box = self.region.box
        index = np.clip(np.rint(points / self.spacing).astype(int), 0, np.array(box.shape) - 1)
        return np.asarray(box.values[tuple(index.T)])


def subtracted(frame: Volume, lumen: Lumen, reference: Volume | None) -> Subtraction:
    """Subtract the background at the lumen's voxels; one pass over them, no copy of the frame."""
    grid, axes = in_memory_order(frame)
    region = region_of(grid, lumen, axes)
    background, still = background_of(grid, reference, region, lumen, axes)
    grey = region.greys.take()
    subtract(grid.values, background, region.corner, region.runs, grey)
    gain, copied = 1.0, 0.0
    if still is not None:
        seen = region.sampled(grid)
        gain, copied = matched(grey, background, region, seen, still), copied_share(seen, still, region.sampled_runs)
    noise = spread(grey.reshape(-1)[region.within])
    total, read = float(np.prod(grid.shape)), float(np.sum(region.runs[:, 3] - region.runs[:, 2]))
    counters = {"voxels_total": total, "voxels_read": read, "voxels_skipped": total - read}
    blur = wall_blur(lumen, region.box.voxel_mm)
    levels = {"noise": noise, "gain": gain} | ({"copied": copied} if copied else {})
    image = Subtraction(region, grey, max(noise, 1e-6), reference is None, blur, grid, counters=counters, levels=levels)
    return replace(image, uneven=image.modelled and lumen.levels.get("least_filling", 1.0) < UNEVEN)


@contextmanager
def subtracting(frame: Volume, lumen: Lumen, reference: Volume | None) -> Iterator[Subtraction]:
    """:func:`subtracted` for a ``with`` block, after which its grey is the next frame's."""
    image = subtracted(frame, lumen, reference)
    try:
        yield image
    finally:
        image.region.greys.give_back(image.grey)


@contextmanager
def numbered(image: Subtraction, curve: Array, radius: float) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int32]]]:
    """Voxels (flat) within ``radius`` mm of a curve (n, 3), and a box with the position + 1 of each, 0 elsewhere.

    The box is for a ``with`` block: then it is the next one's. After an exception, not all 0, it is nobody's.
    """
    slot = image.region.numbers.take()
    voxels = active_voxels(slot, image.spacing, np.ascontiguousarray(curve), radius)
    yield voxels, slot
    slot.reshape(-1)[voxels] = 0
    image.region.numbers.give_back(slot)


def _smooth(sums: Array, counts: Array) -> Array:
    """Mean of the blocks around each block, 0 where they hold next to nothing."""
    top, below = (ndimage.gaussian_filter(a, SMOOTH_BLOCKS, mode="constant") for a in (sums, counts))
    return np.asarray(np.where(below > LEAST_SHARE * BLOCK**3, top / np.maximum(below, 1e-9), 0.0))


def levelled(image: Subtraction, curve: Array, sigma: float) -> Subtraction:
    """The image with the lumen's own unevenness taken away: contrast that fades, mixes or settles along the vessel.

    curve : (n, 3) kernel coordinates of the wire, ``sigma`` its blur (mm). The grey of the lumen's inner voxels that
    the wire does not reach is averaged over about 5 voxels, carried under the wire, and out through the wall by the
    wall's own blurred step.
    """
    voxel = image.region.box.voxel_mm
    index = voxels_of(image.region.runs).T
    at = tuple(index)
    distance, grey = image.region.box.values[at], image.grey[at].astype(float)
    # a blur is wider than half the halo only where the wall was not found; its step is not carried further than that
    share = ndtr(-distance / min(image.wall_blur_mm, 0.5 * HALO_VOXELS * voxel))
    with numbered(image, curve, CLEAR_BLURS * sigma) as (_, wire):
        clear = (wire[at] == 0) & (distance < -DEEP_VOXELS * voxel)
    shape = tuple(-(-n // BLOCK) for n in image.grey.shape)
    block = np.ravel_multi_index(tuple(index[:, clear] // BLOCK), shape)
    counts = np.bincount(block, minlength=int(np.prod(shape))).reshape(shape).astype(float)
    sums = np.bincount(block, grey[clear], minlength=int(np.prod(shape))).reshape(shape)
    # voxel n lies at (n + 1/2) / BLOCK - 1/2 in blocks
    level = ndimage.map_coordinates(_smooth(sums, counts), (index + 0.5) / BLOCK - 0.5, order=1, mode="nearest")
    # zeros, not a copy: memory is touched at the lumen alone
    out = sparse_zeros(image.grey.shape, np.float32)
    rest = grey - share * level
    out[at] = rest
    noise = spread(rest[clear]) if np.count_nonzero(clear) > 100 else image.noise
    levels = image.levels | {"noise": noise}
    return replace(image, grey=out, noise=max(noise, 1e-6), levels=levels, noises={}, samples={})
