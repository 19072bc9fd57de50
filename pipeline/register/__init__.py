"""register: how far the phantom moved between the reference and a frame, so that the frame can be put back in place.

A cheap look at the lumen's wall comes first (least squares at a few thousand points); only a frame that moved by more
than a tenth of a voxel is registered: by least squares from coarse to fine, or from SimpleITK's result where these do
not agree. The cheap look then says what is left.
"""

from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from pipeline.model import Array, Volume
from pipeline.register.bent import Bent, bent
from pipeline.register.branches import Branch, branch_in
from pipeline.register.left import left_of
from pipeline.register.padding import padding_in, unpadded
from pipeline.register.points import static_points
from pipeline.register.reference import WALL_POINTS, Anchor, anchor
from pipeline.register.rigid import Motion
from pipeline.register.search import BAD_MISFIT_VOXELS, shaded_best
from pipeline.register.shift import MOST_METAL, Fit, Solved, farthest, fit_motion, look
from pipeline.register.slide import slid
from pipeline.register.wider import Wider, wider

__all__ = ["Anchor", "Motion", "Registration", "anchor", "register"]

HELD_VOXELS = 0.5
"""What the wall alone still asks for, from which it is believed: the sides of a block that slid along itself, in air,
held the vessel back by 1.6 to 2.5 voxels."""
AS_WELL = 1.02
"""A phantom that rests fits as well as one that moved where its misfit is no more than that many times the other's."""
LOOSE_MM = 0.5
"""Motion that the frame does not show from which that is said: a tip of a well traced wire is known to 0.1 mm."""


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
    branch = branch_in(frame, to.shell, found.motion, float(np.median(last.gain)), to.contrast)
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
    first = fit_motion(frame, wall.in_one, rounds=1)
    moved = farthest(first.motion, wall)
    if moved < skip_voxels and first.misfit_voxels < BAD_MISFIT_VOXELS:
        return _still(frame, to, first, moved)
    motion, shading = shaded_best(frame, to)
    motion, loose = slid(frame, to.structures.shaded(shading), motion)
    last, _ = look(frame, wall, motion)
    left = farthest(last.motion.after(motion), wall)
    if left > HELD_VOXELS:
        motion = fit_motion(frame, wall.in_one, motion).motion
        last, _ = look(frame, wall, motion)
        left = farthest(last.motion.after(motion), wall)
    if last.misfit_voxels > BAD_MISFIT_VOXELS:
        noise = wall.noise_voxels(static_points(frame, wall.points_mm, to.patch_mm).noise)
        return Registration(moved_voxels=moved, left_voxels=left, misfit_voxels=last.misfit_voxels, noise_voxels=noise)
    far = farthest(motion, wall)
    # only grey that is shaded otherwise looks like a motion: slopes explain those of a straight tube, too
    if far < skip_voxels or shading != "one":
        still, _ = look(frame, wall, Motion())
        near = farthest(still.motion, wall)
        if far < skip_voxels or (near < skip_voxels and still.misfit_voxels < AS_WELL * last.misfit_voxels):
            return _still(frame, to, still, min(far, near))
    shift, loose_mm = motion.displacement_mm(wall.centre_mm), loose * wall.voxel_mm
    found = Registration(motion, True, far, left, last.misfit_voxels, shift, loose_mm)
    return _with_rest(found, frame, to, last.last, taken=False)
