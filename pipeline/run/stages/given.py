"""Inputs of every fit to an insertion: the clamp as the manifest has it, and the traces that can be trusted."""

from collections.abc import Collection, Sequence

import numpy as np

from pipeline.budget.inputs import ROLL_DEG
from pipeline.calibrate.trials import Trial
from pipeline.model import Clamp
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.run.stages.way import passed_at
from pipeline.simulate import wall_of
from pipeline.simulate.clamp import Prior, TracedFrame
from pipeline.study.manifest import Case

ENTRY_SIGMA_VOXELS = 0.5
"""Standard deviation, voxels, of an entry point picked in a scan, where the manifest states none."""


def seen_in(frames: Sequence[Frame]) -> list[TracedFrame]:
    """The frames whose traces can be trusted.

    Not those of too low a contrast: a line in noise, where there is no wire, begins at the entry, too.
    """
    return [
        TracedFrame(frame.index, curve, frame.roll_deg, frame.catheter_mm)
        for frame in frames
        if (curve := frame.trusted_curve) is not None
    ]


def entry_sigma_mm(case: Case, voxel_mm: float) -> float:
    """How well the manifest knows the entry, one standard deviation along each axis."""
    return ENTRY_SIGMA_VOXELS * voxel_mm if case.entry_sigma_mm is None else case.entry_sigma_mm


def manifest_clamp(run: Context, known: Known) -> tuple[Clamp, Prior, float]:
    """The clamp as the manifest has it, how well it knows it, and the voxels' size, mm.

    A material axis that is not stated is chosen here, once: by the direction of a clamp that is turned later, another
    world axis may be the one least along it, and every roll would change by 90 degrees.
    """
    case = run.case
    voxel = float(np.mean(known.vessel.distance.spacing_mm))
    direction = np.array(case.entry_direction) / np.linalg.norm(case.entry_direction)
    least = np.eye(3)[int(np.argmin(np.abs(direction)))]
    axis = least if case.material_axis is None else np.array(case.material_axis)
    down = None if case.down is None else np.array(case.down)
    given = Clamp(np.array(case.entry_mm), direction, axis, down)
    return given, Prior(entry_sigma_mm(case, voxel), case.entry_direction_sigma_deg), voxel


def trial_of(
    run: Context, known: Known, frames: Sequence[Frame], *, roll_free: bool, only: Collection[int] | None = None
) -> Trial:
    """The insertion as calibration takes it: the trusted traces of these frames, along their whole length.

    frames : of the whole insertion.     only : the numbers of those whose traces are fitted; None is all.
    """
    case = run.case
    given, prior, voxel_mm = manifest_clamp(run, known)
    trusted = [frame for frame in frames if frame.trusted_curve is not None and (only is None or frame.index in only)]
    force = None if case.push_force_N is None else np.array([case.push_force_N[frame.index] for frame in trusted])
    return Trial(
        name=case.id,
        group=case.group,
        vessel=wall_of(known.vessel.distance, run.config.solver.hull),
        wire=case.wire,
        wall=case.wall,
        given=given,
        prior=prior,
        seen=tuple(seen_in(trusted)),
        passed=tuple(passed_at(frames, {frame.index for frame in trusted}, run.config.simulate.depth, given)),
        voxel_mm=voxel_mm,
        roll_free=roll_free,
        roll_sigma_deg=ROLL_DEG if case.roll_sigma_deg is None else case.roll_sigma_deg,
        lumen_bias_mm=case.uncertainty.lumen_bias_mm,
        lumen_mm=case.uncertainty.lumen_mm,
        catheter=case.catheter,
        force_N=force,
        force_sigma_N=case.push_force_sigma_N,
    )
