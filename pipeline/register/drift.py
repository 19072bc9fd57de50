"""Frames that are not registered are traced where they lie: whether the phantom moved is told.

Without a wire-free scan the first frame stands for the reference, its wire and all: metal is left out of the fit.
Nothing is put back in place.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pipeline.model import Curve, Volume
from pipeline.register import Anchor, register
from pipeline.register.reference import WALL_POINTS
from pipeline.register.search import BAD_MISFIT_VOXELS
from pipeline.register.shift import Fit, farthest, fit_motion, look
from reports.case_files import frames_named

DRIFT = "drift_voxels"
"""Level of a curve in whose scan the phantom lies elsewhere than in the earlier one: voxels at most."""
MOVED_VOXELS = 0.5
"""Motion from which that is said. In 20 frames of a phantom that lay still it is 0.03 at most, whatever their wires."""


class EarlierScan(NamedTuple):
    """The scan that frames are compared with, in words: its name, why nothing is registered to it, and what to do."""

    name: str
    why: str
    do: str

    @property
    def perhaps(self) -> str:
        """What is added to the reason for which a frame is refused whose motion is not seen."""
        return (
            f"; a phantom that moved since {self.name} looks like this, too, and its motion is not seen here: {self.do}"
        )


FIRST = EarlierScan(
    "frame 0",
    "without a reference scan nothing is registered",
    "give a scan without wire (reference), to which frames are registered, or register the scans before",
)
REFERENCE = EarlierScan(
    "the reference scan",
    "with trace.register = off nothing is registered",
    "leave trace.register at auto, or register the scans before",
)


def with_drift(curve: Curve, frame: Volume, structures: Anchor | None, earlier: EarlierScan = FIRST) -> Curve:
    """The curve, with DRIFT among its levels where the phantom moved; why it was refused then, or may have been.

    frame : its scan.  structures : what the earlier scan shows of the phantom; None where there is no such scan.
    """
    if structures is None or len(structures.wall.points_mm) < WALL_POINTS:
        return curve
    voxels = _moved_voxels(frame, structures, doubted=bool(curve.doubts))
    if np.isnan(voxels):
        return curve.reworded(lambda note: note + earlier.perhaps)
    if voxels < MOVED_VOXELS:
        return curve
    why = f"trace: phantom: got a motion of {voxels:.1f} voxels since {earlier.name}; expected {MOVED_VOXELS:g} at most"
    why += f", as {earlier.why}; {earlier.do} (what follows from it: "
    curve = curve.reworded(lambda note: f"{why}{note})")
    return replace(curve, levels={**curve.levels, DRIFT: voxels})


def _moved_voxels(frame: Volume, structures: Anchor, *, doubted: bool) -> float:
    """How far (voxels) the phantom moved at most; NaN where the scan does not show it.

    doubted : it is looked for far and wide, which takes a second, where it is not found near.
    """
    wall = structures.wall
    moved = _seen_near(fit_motion(frame, wall.in_one, rounds=1), structures)
    if not moved < MOVED_VOXELS:
        near = fit_motion(frame, wall.in_one)
        shading = look(frame, wall, near.motion)[1]
        moved = _seen_near(near if shading == "one" else fit_motion(frame, wall.shaded(shading)), structures)
    if not doubted or moved < MOVED_VOXELS:
        return moved
    found = register(frame, structures, MOVED_VOXELS)
    return found.moved_voxels if found.trusted else float("nan")


def _seen_near(fit: Fit, structures: Anchor) -> float:
    """The motion (voxels, at most) of a fit from rest; NaN where it is not to be believed."""
    return farthest(fit.motion, structures.wall) if fit.misfit_voxels < BAD_MISFIT_VOXELS else float("nan")


def of_drift(curves: Mapping[int, Curve], earlier: EarlierScan = FIRST) -> list[str]:
    """A warning where the phantom moved. curves : of each frame, by its number.  earlier : what it is compared with."""
    moved = {n: curve.levels[DRIFT] for n, curve in curves.items() if DRIFT in curve.levels}
    if not moved:
        return []
    worst = max(moved, key=lambda n: moved[n])
    where = f" (frame {worst})" * (len(moved) > 1)
    return [
        f"{frames_named([*moved])}: the phantom moved since {earlier.name}, by {moved[worst]:.1f} voxels{where},"
        f" and {earlier.why}: lumen and entry are those of {earlier.name}, traces lie off by as much; {earlier.do}"
    ]
