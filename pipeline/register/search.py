"""The motion of a frame that moved: by least squares from coarse to fine, or from SimpleITK's result."""

from pipeline.model import Volume
from pipeline.register.points import Shading
from pipeline.register.reference import Anchor
from pipeline.register.rigid import Motion, rigid
from pipeline.register.shift import farthest, fit_motion, look

NEAR_VOXELS = 1.5
"""The width of a blurred wall: up to there least squares is the more exact (0.03 voxel where SimpleITK alone leaves
0.07) and fifty times faster; beyond, coarse fits look first."""
CLEARLY = 0.8
"""Least squares without SimpleITK is believed where its misfit is smaller by this factor."""
AGREES_VOXELS = 0.5
"""How far from there the fine fit may end, to be believed: where both are right they are 0.1 voxel apart."""
BAD_MISFIT_VOXELS = 0.6
"""Residual of the first look from which it is not believed: a wall elsewhere altogether leaves more than 1."""


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


def shaded_best(frame: Volume, to: Anchor) -> tuple[Motion, Shading]:
    """The best motion, and how the frame is shaded otherwise than the reference, as far as that explains it."""
    motion = _best(frame, to)
    shading = look(frame, to.wall, motion)[1]
    return motion if shading == "one" else fit_motion(frame, to.structures.shaded(shading), motion).motion, shading
