"""The simulator with one thing otherwise than stated: two predictors, and wires that the traces may speak for.

Without the roll, or without the tip's curve, it is a predictor, which shows what these are worth. With another curve of
the tip, or without the stated catheter, its wires are held against the traces alone (``contradicted``). The predictors
have everything else of the simulated wire, the clamp and the depths too. ``roll_unknown`` is the mean, at equal
arc length, of twelve wires 30 degrees apart: of all guesses that with the least expected squared error.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pipeline.arrays.polyline import at_arc, samples
from pipeline.model import Array
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.run.stages.way import way_of
from pipeline.simulate import insertion_of, simulate
from pipeline.simulate.config import SimulateConfig

ROLLS = 12


Wires = list[Array | None]
"""The wire of each frame that was simulated; None where it did not come to rest."""


def simulated_frames(known: Known) -> list[Frame]:
    """The frames with a simulated wire of more than a point."""
    return [f for f in known.frames if f.simulated_wire is not None]


class SimulatedVariant(NamedTuple):
    """What a wire is simulated with that is not as stated.

    turn_deg : by which every roll is turned.  bent : times the stated curve of the tip.
    """

    without: str
    config: SimulateConfig
    turn_deg: float = 0.0
    bent: float = 1.0

    @property
    def catheter(self) -> bool:
        """Whether a stated catheter lies over the wire."""
        return self.without != CATHETER


TIP_CURVE, ROLL, CATHETER, BENT = "no_tip_curve", "roll_unknown", "no_catheter", "tip_otherwise_bent"
TIMES = 0.5, 2.0, 5.0
"""The curve of the tip, over the stated one, that may speak against it."""


def variants_of(run: Context, known: Known) -> list[SimulatedVariant]:
    """What is simulated: with a straight tip, ROLLS turned ones, a tip bent TIMES as much, without a catheter.

    Empty where they are switched off or nothing was simulated. A wire that is straight at rest has no curve to leave
    out or to turn: both would be the simulated wire again, which no simulator beats.
    """
    if not run.config.compare.simulated_nulls or not simulated_frames(known) or not np.isfinite(known.segment_mm):
        return []
    plain, ways = run.config.simulate, []
    if run.case.wire.curved:
        ways = [SimulatedVariant(TIP_CURVE, replace(plain, rest_curvature_scale=0.0))]
        ways += [SimulatedVariant(ROLL, plain, 360.0 * i / ROLLS) for i in range(ROLLS)]
        stated = plain.rest_curvature_scale
        ways += [
            SimulatedVariant(BENT, replace(plain, rest_curvature_scale=times * stated), bent=times) for times in TIMES
        ]
    return ways + [SimulatedVariant(CATHETER, plain)] * any(
        frame.catheter_mm > 0.0 for frame in simulated_frames(known)
    )


def simulated_rivals(
    run: Context, known: Known, ways: Sequence[SimulatedVariant], wires: Sequence[Wires]
) -> dict[int, dict[str, Array]]:
    """By frame and by name, the wires (n, 3) of the predictors; a frame that was not simulated has none.

    wires : of each of ``ways``.
    """
    straight = [wire for way, wire in zip(ways, wires, strict=True) if way.without == TIP_CURVE]
    turned = [wire for way, wire in zip(ways, wires, strict=True) if way.without == ROLL]
    found: dict[int, dict[str, Array]] = {}
    for i, frame in enumerate(simulated_frames(known)):
        arc = samples(frame.depth_mm, run.config.compare.sample_mm)
        known_rolls = [at_arc(wire, arc) for one in turned if (wire := one[i]) is not None]
        mean = np.mean(known_rolls, axis=0) if len(known_rolls) > ROLLS // 2 else None
        both = {ROLL: mean, TIP_CURVE: straight[0][i] if straight else None}
        found[frame.index] = {name: np.asarray(wire) for name, wire in both.items() if wire is not None}
    return found


def variant_wires(run: Context, known: Known, way: SimulatedVariant) -> Wires:
    """The wires under one of ``variants_of``; none where the solver has no such wire, as of five times a sharp bend."""
    case, frames = run.case, simulated_frames(known)
    settings = run.config.solver.quick(known.segment_mm)
    catheter = case.catheter if way.catheter else None
    try:
        insertion = insertion_of(case.wire, case.wall, known.vessel, known.held, settings, way.config, catheter)
    except ValueError:
        return [None] * len(frames)
    whole = replace(way_of(run, known.frames, frames).turned(way.turn_deg), sheathed=catheter is not None)
    wires = simulate(insertion, whole)
    return [np.asarray(wire.joints_mm) if wire.converged else None for wire in wires]
