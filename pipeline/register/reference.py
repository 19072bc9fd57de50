"""What frames are registered to: the reference scan and its lumen's wall, prepared once for all frames."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.grids import unflattened
from pipeline.model import Array, Lumen, Volume
from pipeline.register.branches import Shell, shell_of
from pipeline.register.padding import Padding, off_the_rim, padding_in, unpadded
from pipeline.register.patches import LEAST_MM, SPAN_RADII
from pipeline.register.points import StaticPoints, static_points
from pipeline.register.rigid import edge_mask
from pipeline.register.slide import hidden
from solver.grid import Grid

POINTS = 4000
"""Points at the wall that the first look takes: they show a shift of 0.01 voxel at a contrast of 9 noises."""
STRUCTURE_POINTS = 12000
"""Points on walls and bones that a moved frame is fitted at."""
COARSE = (4.0, 1500), (2.0, 4000)
"""Blurs, voxels, and points on walls and bones of the coarse fits by which a larger motion is looked for: they see 5
voxels and more, in a thirtieth of SimpleITK's time."""
FULL_STEP = 0.95, 0.05
"""Quantiles of grey in the wall's band between which the vessel's contrast lies."""
WALL_POINTS = 200
"""Fewer points show no motion."""
BAND_VOXELS = 2.0
"""How far from the wall the first look's points lie: a blurred wall is as wide."""
ROOMY = 0.45
"""Points of the band inside the wall over those outside, from which a wire is no wall: 2.6 voxels radius. Beside one of
1.5 times the vessel's contrast in thinner vessels the wall looked 0.25 to 0.4 voxel narrower."""


@dataclass(frozen=True, eq=False)
class Anchor:
    """What frames are registered to: the reference scan without its padding, its lumen's signed distance, and points of
    that wall.
    """

    reference: Volume
    wall: StaticPoints
    patch_mm: float
    padding: Padding | None
    distance: Grid

    @cached_property
    def depth(self) -> Array:
        """Signed distance (n,) of the wall's points."""
        index = np.rint(self.distance.to_index(self.wall.points_mm)).astype(np.intp)
        return np.asarray(self.distance.values[tuple(index.T)], np.float64)

    @cached_property
    def brighter(self) -> float:
        """1 where the vessel is brighter than what is around it, -1 where it is darker."""
        return -1.0 if self.wall.centred @ self.depth > 0.0 else 1.0

    @cached_property
    def roomy(self) -> bool:
        """Whether a wire leaves the vessel a wall to be seen."""
        return bool(np.count_nonzero(self.depth < 0.0) > ROOMY * np.count_nonzero(self.depth > 0.0))

    @cached_property
    def shell(self) -> Shell:
        """What the reference shows beside the vessel; frames that are only asked whether they moved need none."""
        return shell_of(self.reference, self.distance)

    @cached_property
    def contrast(self) -> float:
        """Grey of the vessel less that around it."""
        return self.brighter * float(np.subtract(*np.quantile(self.wall.grey, FULL_STEP)))

    @cached_property
    def hides(self) -> bool:
        """Whether the wall may move in some way, as a straight tube along itself, without its scans showing it."""
        return len(self.wall.points_mm) >= WALL_POINTS and hidden(self.wall)

    @cached_property
    def edges(self) -> NDArray[np.bool_]:
        """Voxels of walls and bones; worked out for the first frame that moved."""
        return off_the_rim(edge_mask(self.reference, self.wall.steepness), self.padding)

    @cached_property
    def structures(self) -> StaticPoints:
        """Points on walls and bones, for the fit of a frame that moved; of few, those at the wall."""
        at = _thinned(self.reference, self.edges, STRUCTURE_POINTS)
        found = static_points(self.reference, at, self.patch_mm)
        return found if len(found.points_mm) >= WALL_POINTS else self.wall

    @cached_property
    def coarse(self) -> list[StaticPoints]:
        """The same for COARSE fits, the most blurred first; one gain for all of each; none of few points."""
        points = [(_thinned(self.reference, self.edges, count), blur) for blur, count in COARSE]
        found = [static_points(self.reference, at, self.patch_mm, blur).in_one for at, blur in points]
        return [one for one in found if len(one.points_mm) >= WALL_POINTS]


def _thinned(grid: Grid, mask: NDArray[np.bool_], count: int) -> Array:
    """``count`` of the mask's voxels, or up to twice as many, evenly taken, as LPS mm."""
    flat = np.flatnonzero(mask)
    flat = flat[:: max(1, len(flat) // count)]
    return grid.to_mm(unflattened(flat, mask.shape))


def anchor(reference: Volume, lumen: Lumen) -> Anchor:
    """The wire-free scan prepared once for all frames; ``reference`` may be the crop that holds the lumen."""
    distance, padding = lumen.distance, padding_in(reference)
    reference = unpadded(reference, padding)
    reach = BAND_VOXELS * distance.voxel_mm
    band = (distance.values < reach) & (distance.values > -reach)  # without a second box of numbers
    patch_mm = max(LEAST_MM, -SPAN_RADII * float(distance.values.min()))
    wall = static_points(reference, _thinned(distance, band, POINTS), patch_mm)
    return Anchor(reference, wall, patch_mm, padding, distance)
