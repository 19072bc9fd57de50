"""Points on structures that do not move against each other, with what the reference's blurred grey is there."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.grids import in_memory_order, unflattened
from pipeline.arrays.jets import Blurred, jets_at
from pipeline.model import Array, Volume
from pipeline.register.patches import TINY, means, parted, spread_out

BLUR_VOXELS = 1.0
"""Gaussian in which grey is read: wide enough to see a wall 2 voxels away, and it takes noise to 0.15."""
BORDER_VOXELS = 3.0
"""Points nearer to the edge of a scan have no full Gaussian."""
FLAT, FLAT_POINTS = 0.25, 4000
"""Share of a scan's voxels that lie in nothing but noise at the least, and how many are looked at."""
OF_FLAT = 1.2125
"""That quantile of the squared length of three normal numbers."""


Shading = Literal["one", "sloping", "own"]
"""How a frame's grey differs from the reference's: by one gain, one that slopes over the scan, or each patch's own."""


@dataclass(frozen=True, eq=False)
class StaticPoints:
    """Points (n, 3) LPS mm on structures that do not move against each other, with the reference's blurred grey (n,)
    and its gradient (n, 3) per mm; blur_mm : of both; voxel_mm : the unit in which motion is judged; noise : standard
    deviation of each of the gradient's components by noise alone; starts : first point of each patch (see ``patches``);
    sloped : whether offset and gain of grey are linear in the place (``ramps``).
    """

    points_mm: Array
    grey: Array
    gradient: Array
    blur_mm: float
    voxel_mm: float
    noise: float
    starts: NDArray[np.intp]
    sloped: bool = False

    @cached_property
    def centred(self) -> Array:
        """Grey (n,) less that of each point's patch at the mean."""
        return np.asarray(self.grey - spread_out(means(self.grey, self.starts), self.starts, len(self.grey)))

    @cached_property
    def ramps(self) -> Array:
        """What a patch's offset and gain of grey are made of, (n, 1 or 4): a number, and slopes along the axes."""
        one = np.ones((len(self.grey), 1))
        away = (self.points_mm - self.centre_mm) / self.lever_mm
        return np.column_stack([one, away]) if self.sloped else one

    @cached_property
    def shades(self) -> Array:
        """The columns (n, 2 or 8) of a patch's offset and gain."""
        return np.column_stack([self.ramps, self.ramps * self.centred[:, None]])

    def shade(self, of_patches: Array) -> tuple[Array, Array]:
        """The grey (n,) of the patches' offsets and gains (k, 2 or 8), and the gain (n,)."""
        each = spread_out(of_patches, self.starts, len(self.grey))
        gains = each[:, self.ramps.shape[1] :]
        return np.sum(self.shades * each, axis=1), np.sum(self.ramps * gains, axis=1)

    @cached_property
    def in_one(self) -> "StaticPoints":
        """The same points in one patch: one gain for all of the scan, with which far motions are found best."""
        return replace(self, starts=np.zeros(1, np.intp))

    @cached_property
    def sloping(self) -> "StaticPoints":
        """The same in one patch whose grey may slope, for what is left of a motion.

        A field that rises by the vessel's contrast over 18 mm, flat in the reference, moved the wall by 0.4 voxel. From
        far, slopes explain a motion's grey as well: of motions of 3 to 5 voxels, 11 in 18 were not found.
        """
        return replace(self.in_one, sloped=True)

    def shaded(self, shading: Shading) -> "StaticPoints":
        """The same points, of a frame that is shaded so."""
        return {"one": self.in_one, "sloping": self.sloping, "own": self}[shading]

    @cached_property
    def centre_mm(self) -> Array:
        """Centroid (3,)."""
        return np.asarray(self.points_mm.mean(axis=0))

    @cached_property
    def radius_mm(self) -> float:
        """Root mean square distance from the centroid: what turns an angle into a displacement."""
        return float(np.sqrt(np.mean(np.sum((self.points_mm - self.centre_mm) ** 2, axis=1))))

    @property
    def lever_mm(self) -> float:
        """The radius, by which turns are made shifts; that of one point is a voxel."""
        return max(self.radius_mm, self.voxel_mm)

    @cached_property
    def steepness(self) -> float:
        """Root mean square gradient, per mm."""
        return float(np.sqrt(np.mean(np.sum(self.gradient**2, axis=1))))

    def noise_voxels(self, of_frame: float) -> float:
        """The misfit of a frame by noise alone. of_frame : the frame's own, as ``noise``.

        White noise leaves sqrt(2) times as much in blurred grey as in its gradient times the blur. Correlated over 0.7
        voxel it was within 15 %.
        """
        both = float(np.hypot(self.noise, of_frame))
        return float(np.sqrt(2.0)) * both * self.blur_mm / max(self.voxel_mm * self.steepness, TINY)


def inside(scan: Volume, points_mm: Array) -> NDArray[np.bool_]:
    """Which points (n, 3) lie well inside a scan."""
    index = scan.to_index(points_mm)
    return np.asarray(np.all((index > BORDER_VOXELS) & (index < np.array(scan.shape) - 1 - BORDER_VOXELS), axis=1))


def static_points(
    reference: Volume, points_mm: Array, patch_mm: float, blur_voxels: float = BLUR_VOXELS
) -> StaticPoints:
    """Read the reference at the points (n, 3) that lie well inside it; patch_mm : extent of two patches."""
    points = points_mm[inside(reference, points_mm)]
    order, starts = parted(points, patch_mm)
    points = np.ascontiguousarray(points[order])
    grid, _ = in_memory_order(reference)
    voxel = grid.voxel_mm
    field = Blurred(grid.values, grid.spacing_mm, blur_voxels * voxel)
    jets = jets_at(field, grid.to_index(points) * grid.spacing_mm)
    anywhere = unflattened(np.arange(0, grid.values.size, 1 + grid.values.size // FLAT_POINTS), grid.shape)
    steep = np.sum(jets_at(field, anywhere * grid.spacing_mm)[:, 1:4] ** 2, axis=1)
    steep = steep[steep > 1e-12 * float(steep.max(initial=0.0))]  # not the padding around what was reconstructed
    noise = float(np.sqrt(np.quantile(steep, FLAT) / OF_FLAT)) if len(steep) else 0.0
    return StaticPoints(points, jets[:, 0], jets[:, 1:4] @ grid.direction.T, blur_voxels * voxel, voxel, noise, starts)
