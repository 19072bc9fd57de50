"""Simulated predictors: the simulator without the roll, or without the tip's curve; they show what these are worth.

Both have everything else of the simulated wire, the clamp and the depths too. ``roll_unknown`` is the mean, at equal
arc length, of twelve wires 30 degrees apart: of all guesses that with the least expected squared error.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.arrays.polyline import at_arc, samples
from pipeline.model import Array
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.simulate import insertion_of, simulate
from pipeline.simulate.config import SimulateConfig

ROLLS = 12


Wires = list[Array | None]
"""The wire of each frame that was simulated; None where it did not come to rest."""


def _simulated(known: Known) -> list[Frame]:
    return [f for f in known.frames if f.simulated is not None and len(f.simulated.joints_mm) > 1]


def rival_ways(run: Context, known: Known) -> list[tuple[SimulateConfig, float]]:
    """Settings and extra roll (degrees) of each simulation: one without the tip's curve, then ROLLS turned ones.

    Empty where they are switched off, nothing was simulated, or the wire is straight at rest: without a curve to leave
    out or to turn, both are the simulated wire again, which no simulator beats.
    """
    if not run.config.compare.simulated_nulls or not run.case.wire.curved:
        return []
    if not _simulated(known) or not np.isfinite(known.segment_mm):
        return []
    plain = run.config.simulate
    return [(replace(plain, rest_curvature_scale=0.0), 0.0), *((plain, 360.0 * i / ROLLS) for i in range(ROLLS))]


def simulated_rivals(run: Context, known: Known, wires: Sequence[Wires]) -> dict[int, dict[str, Array]]:
    """By frame and by name, the wires (n, 3) of both predictors; a frame that was not simulated has none.

    wires : of each of ``rival_ways``.
    """
    if not wires:
        return {}
    straight, *turned = wires
    found: dict[int, dict[str, Array]] = {}
    for i, frame in enumerate(_simulated(known)):
        arc = samples(frame.depth_mm, run.config.compare.sample_mm)
        known_rolls = [at_arc(wire, arc) for one in turned if (wire := one[i]) is not None]
        mean = np.mean(known_rolls, axis=0) if len(known_rolls) > ROLLS // 2 else None
        both = {"roll_unknown": mean, "no_tip_curve": straight[i]}
        found[frame.index] = {name: np.asarray(wire) for name, wire in both.items() if wire is not None}
    return found


def rival_wires(run: Context, known: Known, config: SimulateConfig, turn_deg: float) -> Wires:
    """The wires under one of ``rival_ways``: other settings, every roll turned by ``turn_deg``."""
    case, lumen, clamp, frames = run.case, known.lumen, known.clamp, _simulated(known)
    assert lumen is not None
    assert clamp is not None
    settings = replace(run.config.solver, segment_mm=known.segment_mm, finest_mm=run.config.solver.step_mm)
    insertion = insertion_of(case.wire, case.wall, lumen, clamp, settings, config, case.catheter)
    tips = [min(f.catheter_mm, f.depth_mm) for f in frames] if case.catheter else None
    rolls = [frame.roll_deg + turn_deg for frame in frames]
    wires = simulate(insertion, [frame.depth_mm for frame in frames], rolls, tips)
    return [np.asarray(wire.joints_mm) if wire.converged else None for wire in wires]
