"""Without a wire-free scan frames are traced where they lie: whether the phantom moved since the first is told.

The first frame stands for the reference, its wire and all: metal is left out of the fit. Nothing is put back in place.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pipeline.model import Curve, Volume
from pipeline.register import BAD_MISFIT_VOXELS, WALL_POINTS, Anchor, Motion, register
from pipeline.register.shift import farthest, look
from reports.case_files import frames_named

DRIFT = "drift_voxels"
"""Level of a curve in whose scan the phantom lies elsewhere than in the first frame: by how many voxels at most."""
MOVED_VOXELS = 0.5
"""Motion from which that is said. In 20 frames of a phantom that lay still it is 0.03 at most, whatever their wires."""
DO = "give a scan without wire (reference), to which frames are registered, or register the scans before"
PERHAPS = f"; a phantom that moved since frame 0 looks like this, too, and its motion is not seen here: {DO}"


def with_drift(curve: Curve, frame: Volume, first: Anchor | None) -> Curve:
    """The curve, with DRIFT among its levels where the phantom moved; why it was refused then, or may have been.

    frame : its scan.  first : of the first frame; None where there is a reference, or nothing is to be registered.
    """
    if first is None or len(first.wall.points_mm) < WALL_POINTS:
        return curve
    voxels = _since(frame, first, doubted=bool(curve.doubts))
    if np.isnan(voxels):
        return curve.reworded(lambda note: note + PERHAPS)
    if voxels < MOVED_VOXELS:
        return curve
    why = f"trace: phantom: got a motion of {voxels:.1f} voxels since frame 0; expected {MOVED_VOXELS:g} at most, as "
    why += f"without a reference scan nothing is registered; {DO} (what follows from it: "
    curve = curve.reworded(lambda note: f"{why}{note})")
    return replace(curve, levels={**curve.levels, DRIFT: voxels})


def _since(frame: Volume, first: Anchor, *, doubted: bool) -> float:
    """How far (voxels) the phantom moved at most since the first frame; NaN where the scan does not show it.

    doubted : it is looked for far and wide, which takes a second, where it is not found near.
    """
    near, _ = look(frame, first.wall, Motion(), MOVED_VOXELS)
    moved, fits = farthest(near.motion, first.wall), near.misfit_voxels < BAD_MISFIT_VOXELS
    if not doubted or (fits and moved < MOVED_VOXELS):
        return moved if fits else float("nan")
    found = register(frame, first, MOVED_VOXELS)
    return found.moved_voxels if found.trusted else float("nan")


def of_drift(curves: Mapping[int, Curve]) -> list[str]:
    """A warning where the phantom moved since the first frame. curves : of each frame, by its number."""
    moved = {n: curve.levels[DRIFT] for n, curve in curves.items() if DRIFT in curve.levels}
    if not moved:
        return []
    worst = max(moved, key=lambda n: moved[n])
    return [
        f"{frames_named([*moved])}: the phantom moved since frame 0, by "
        f"{moved[worst]:.1f} voxels (frame {worst}), and without a reference scan nothing was registered: lumen and "
        f"entry are those of frame 0, traces lie off by as much; {DO}"
    ]
