"""register: how far the phantom moved between the reference and a frame, so that the frame can be put back in place.

A cheap look at the lumen's wall comes first (least squares at a few thousand points); only a frame that moved by more
than a tenth of a voxel is registered: by least squares from coarse to fine, or from SimpleITK's result where these do
not agree. The cheap look then says what is left.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.grids import unflattened
from pipeline.model import Array, Lumen, Volume
from pipeline.register.bent import Bent, bent
from pipeline.register.branches import Branch, Shell, branch_in, shell_of
from pipeline.register.left import left_of
from pipeline.register.padding import Padding, off_the_rim, padding_in, unpadded
from pipeline.register.patches import LEAST_MM, SPAN_RADII
from pipeline.register.rigid import Motion, edge_mask, rigid
from pipeline.register.shift import MOST_METAL, Fit, Solved, StaticPoints, farthest, fit_motion, look, static_points
from pipeline.register.slide import hidden, slid
from pipeline.register.wider import Wider, wider
from solver.grid import Grid

__all__ = ["Anchor", "Motion", "Registration", "anchor", "register"]

POINTS = 4000
"""Points at the wall that the first look takes: they show a shift of 0.01 voxel at a contrast of 9 noises."""
NEAR_VOXELS = 1.5
"""The width of a blurred wall: up to there least squares is the more exact (0.03 voxel where SimpleITK alone leaves
0.07) and fifty times faster; beyond, coarse fits look first."""
CLEARLY = 0.8
"""Least squares without SimpleITK is believed where its misfit is smaller by this factor."""
STRUCTURE_POINTS = 12000
"""Points on walls and bones that a moved frame is fitted at."""
COARSE = (4.0, 1500), (2.0, 4000)
"""Blurs, voxels, and points on walls and bones of the coarse fits by which a larger motion is looked for: they see 5
voxels and more, in a thirtieth of SimpleITK's time."""
AGREES_VOXELS = 0.5
"""How far from there the fine fit may end, to be believed: where both are right they are 0.1 voxel apart."""
HELD_VOXELS = 0.5
"""What the wall alone still asks for, from which it is believed: the sides of a block that slid along itself, in air,
held the vessel back by 1.6 to 2.5 voxels."""
FULL_STEP = 0.95, 0.05
"""Quantiles of grey in the wall's band between which the vessel's contrast lies."""
WALL_POINTS = 200
"""Fewer points show no motion."""
BAND_VOXELS = 2.0
"""How far from the wall the first look's points lie: a blurred wall is as wide."""
ROOMY = 0.45
"""Points of the band inside the wall over those outside, from which a wire is no wall: 2.6 voxels radius. Beside one of
1.5 times the vessel's contrast in thinner vessels the wall looked 0.25 to 0.4 voxel narrower."""
LOOSE_MM = 0.5
"""Motion that the frame does not show from which that is said: a tip of a well traced wire is known to 0.1 mm."""
BAD_MISFIT_VOXELS = 0.6
"""Residual of the first look from which it is not believed: a wall elsewhere altogether leaves more than 1."""


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


class Rest(Protocol):
    """What a frame shows that no rigid motion of the phantom explains."""

    @property
    def told(self) -> bool:
        """Whether it is more than noise."""

    @property
    def size(self) -> float:
        """By which the worst frame is found."""

    def sentence(self, frame: int) -> str:
        """A warning, by the worst frame."""


@dataclass(frozen=True, eq=False)
class Registration:
    """The motion of one frame against the reference; ``applied`` False where it is too small or not ``trusted``.

    moved_voxels : largest displacement of a wall point.  left_voxels : what a fit of the wall alone still asks for.
    misfit_voxels : residual of that fit, as the uncertainty of one point.  centre_shift_mm : (3,) of the
    wall's centroid; the motion's own shift is that of the world's origin, which may be far away.  loose_mm : how far
    along (or about) itself the vessel may have moved besides, and the frame shows it as well.  noise_voxels : what
    noise alone makes of the misfit, where it is not ``trusted``; else 0.
    """

    motion: Motion = field(default_factory=Motion)
    applied: bool = False
    moved_voxels: float = 0.0
    left_voxels: float = 0.0
    misfit_voxels: float = 0.0
    centre_shift_mm: Array = field(default_factory=lambda: np.zeros(3))
    loose_mm: float = 0.0
    noise_voxels: float = 0.0
    bent: Bent = field(default_factory=Bent)
    wider: Wider = field(default_factory=Wider)
    branch: Branch = field(default_factory=Branch)

    @property
    def rests(self) -> tuple[Rest, ...]:
        """What the motion does not explain, in the order in which it is told."""
        return self.bent, self.wider, self.branch

    @property
    def trusted(self) -> bool:
        """Whether the walls of the frame lie where the reference has them, once the motion is taken into account."""
        return self.misfit_voxels < BAD_MISFIT_VOXELS

    @property
    def sentence(self) -> str:
        """What was done, for the report."""
        if not self.trusted and self.misfit_voxels < np.hypot(BAD_MISFIT_VOXELS, self.noise_voxels):
            return (
                "no registration applied: noise hides where the walls lie (they miss the reference's by "
                f"{self.misfit_voxels:.1f} voxels, {self.noise_voxels:.1f} by noise alone; {BAD_MISFIT_VOXELS} are "
                "allowed): the phantom is taken not to have moved; scan with less noise, or set trace.register = off"
            )
        if not self.trusted:
            far = f"misfit {self.misfit_voxels:.1f} voxels, allowed {BAD_MISFIT_VOXELS}"
            seen = far if np.isfinite(self.misfit_voxels) else "none is seen where the lumen has it"
            return (
                f"no registration applied: the walls fit the reference in no place ({seen}); a phantom that moved is "
                "not put back, and traces lie off by that: look at the frame, fill the vessel, or hold the phantom in "
                "its place and set trace.register = off"
            )
        if not self.applied:
            return f"no registration applied: the phantom moved by {self.moved_voxels:.2f} voxel"
        shift = ", ".join(f"{s:.3f}" for s in self.centre_shift_mm)
        return (
            f"registered: phantom moved by ({shift}) mm and {self.motion.angle_deg:.2f} degrees, "
            f"{self.moved_voxels:.2f} voxel at most; {self.left_voxels:.2f} voxel left{self.doubt}"
        )

    @property
    def doubt(self) -> str:
        """What the vessel does not show of the motion, where it is more than LOOSE_MM; empty where nothing."""
        said = f"; along, or about, itself the vessel may lie {self.loose_mm:.1f} mm off: the frame shows no difference"
        return said * (self.loose_mm > LOOSE_MM)


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


def _best(frame: Volume, to: Anchor) -> Motion:
    """The motion by least squares, from rest, from coarse fits that are borne out, or from SimpleITK's result."""
    structures = to.structures.in_one
    near = fit_motion(frame, structures)
    if near.misfit_voxels < BAD_MISFIT_VOXELS and farthest(near.motion, to.wall) < NEAR_VOXELS:
        return near.motion
    rough = Motion()
    for blurred in to.coarse:
        rough = fit_motion(frame, blurred, rough).motion
    far = fit_motion(frame, structures, rough)
    if far.misfit_voxels < BAD_MISFIT_VOXELS and farthest(far.motion.after(rough), to.wall) < AGREES_VOXELS:
        return far.motion
    rough = rigid(frame, to.reference, to.edges, to.wall.centre_mm)
    far = fit_motion(frame, structures, rough)
    return near.motion if near.misfit_voxels < CLEARLY * far.misfit_voxels else far.motion


def _with_rest(found: Registration, frame: Volume, to: Anchor, last: Solved | None, *, taken: bool) -> Registration:
    """With what the motion does not explain of the wall, and what is seen beside it. last, taken : of ``left_of``."""
    if last is None:
        return found
    left = left_of(to.wall, last, taken=taken)
    off = bent(to.wall, left)
    # a wall that bends is off on one side more than on the other: in vessels of 2 voxels radius that looked narrower
    # beside so much metal its skirts are what is left
    judged = to.roomy and not off.told and np.mean(last.clear) >= MOST_METAL
    more = wider(to.wall, left, to.brighter) if judged else Wider()
    branch = branch_in(frame, to.shell, found.motion, float(np.median(last.gains)), to.contrast)
    return replace(found, bent=off, wider=more, branch=branch)


def _still(frame: Volume, to: Anchor, fit: Fit, moved: float) -> Registration:
    """A motion that is too small to be applied."""
    found = Registration(moved_voxels=moved, left_voxels=moved, misfit_voxels=fit.misfit_voxels)
    return _with_rest(found, frame, to, fit.last, taken=True)


def register(frame: Volume, to: Anchor, skip_voxels: float) -> Registration:
    """Where the phantom lies in ``frame`` (on the reference's lattice).

    A motion below ``skip_voxels`` everywhere on the wall is measured and reported but not applied; nor is one after
    which the walls still do not fit (not ``trusted``).
    """
    wall, frame = to.wall, unpadded(frame, padding_in(frame))
    if len(wall.points_mm) < WALL_POINTS:
        return Registration(misfit_voxels=float("inf"))
    first, _ = look(frame, wall, Motion(), skip_voxels)
    moved = farthest(first.motion, wall)
    if moved < skip_voxels and first.misfit_voxels < BAD_MISFIT_VOXELS:
        return _still(frame, to, first, moved)
    motion, structures = _best(frame, to), to.structures.in_one
    if look(frame, wall, motion)[1]:
        structures = to.structures
        motion = fit_motion(frame, structures, motion).motion
    motion, loose = slid(frame, structures, motion)
    last, _ = look(frame, wall, motion)
    left = farthest(last.motion.after(motion), wall)
    if left > HELD_VOXELS:
        motion = fit_motion(frame, wall.in_one, motion).motion
        last, _ = look(frame, wall, motion)
        left = farthest(last.motion.after(motion), wall)
    if last.misfit_voxels > BAD_MISFIT_VOXELS:
        noise = wall.noise_voxels(static_points(frame, wall.points_mm, to.patch_mm).noise)
        return Registration(moved_voxels=moved, left_voxels=left, misfit_voxels=last.misfit_voxels, noise_voxels=noise)
    if (far := farthest(motion, wall)) < skip_voxels:
        return _still(frame, to, look(frame, wall, Motion())[0], far)
    shift, loose_mm = motion.displacement_mm(wall.centre_mm), loose * wall.voxel_mm
    found = Registration(motion, True, far, left, last.misfit_voxels, shift, loose_mm)
    return _with_rest(found, frame, to, last.last, taken=False)
