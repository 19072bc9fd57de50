"""How long the segments of a fit are: as long as leaves wires and parameters where segments half as long have them.

With segments of 1 mm, of a soft tip that stiffens at once in a tight siphon, roll, rest curvature and friction came out
6 to 8 of their standard deviations off and were called seen; with 0.5 mm, within 1.4.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pipeline.calibrate.search import Fit
from pipeline.calibrate.trials import OWN, replayed
from pipeline.calibrate.unknowns import ROLL
from pipeline.model import Wire
from pipeline.simulate.config import SolverConfig
from pipeline.simulate.resolution import AGREED_MM, lengths_mm, moved_mm
from solver import Solution

MOST_SD = 1.0
"""Most by which halving the segments may move a parameter, in its standard deviations: of scenes of known parameters
1.5 to 1.6 where these came out 3 to 8 of them off, up to 0.6 where they came out right."""
Wires = Sequence[Sequence[Solution]]


class Segments(NamedTuple):
    """The segments of a fit: their length, mm, how it was chosen, and a doubt of it; empty where there is none."""

    mm: float
    reason: str
    doubt: str = ""


def resolved(fit_with: Callable[[SolverConfig], Fit], wire: Wire, solver: SolverConfig) -> tuple[Fit, Segments]:
    """The fit to insertions of a wire with segments as short as it needs. fit_with : called with the settings."""
    asked, at = solver.segment_mm, 0
    lengths = lengths_mm(asked, wire.rest_curvature_per_mm) if asked == "auto" else [asked]
    while True:
        fit = fit_with(solver.quick(lengths[at]))
        if len(lengths) == 1:
            return fit, Segments(lengths[0], "as stated")
        found, segments = _needed(fit, lengths, at, solver)
        if found == at:
            return fit, segments
        at = found


def _needed(fit: Fit, lengths: Sequence[float], at: int, solver: SolverConfig) -> tuple[int, Segments]:
    """Which of the lengths a fit with that ``at`` a position needs: that one or a shorter one, and what is said of it.

    A length does where ``_moved`` finds nothing against segments half as long, simulated as in a run, with repeated
    steps.
    """
    moved = ""
    for n in range(min(at, len(lengths) - 2), len(lengths) - 1):
        long, short = (_wires(fit, s) for s in (solver.quick(lengths[n]), replace(solver, segment_mm=lengths[n + 1])))
        moved = _moved(fit, long, short)
        if not moved:
            reason = f"halving them moved no fitted wire by more than {AGREED_MM} mm, near snaps apart, and no "
            reason += "parameter by more than its sd"
            return max(n, at), Segments(lengths[max(n, at)], reason)
    shortest, reason = lengths[-1], f"halving longer ones moved {moved}"
    doubt = f"segments of {shortest:g} mm, the shortest, may be too long: {reason}; parameters may be off by more than"
    return len(lengths) - 1, Segments(shortest, reason, f"{doubt} their standard deviations")


def _wires(fit: Fit, solver: SolverConfig) -> Wires:
    """The wires of all fitted frames, by case, at a fit's parameters."""
    points = fit.problem.points(fit.linear.x)
    return replayed([(one.trial, at) for one, at in zip(fit.problem.evidence, points, strict=True)], solver)


def _moved(fit: Fit, coarse: Wires, fine: Wires) -> str:
    """What is elsewhere with shorter segments, in words; empty where neither a wire nor a parameter is.

    A wire near a snap goes one way or the other with segments of any length: what it moves is asked of the parameters
    alone, by its weight. One of 55 led to segments of 0.0625 mm, five times the time and no better parameters. Wires
    that agree are not enough: in a bend of 4 mm radius 0.05 mm were 1.5 standard deviations of the rest curvature.
    """
    pairs = [pair for both in zip(coarse, fine, strict=True) for pair in zip(*both, strict=True)]
    calm = [pair for pair in pairs if not pair[1].uncertain and any(wire.converged for wire in pair)]
    apart = sum(not moved_mm(*pair) <= AGREED_MM for pair in calm)
    if apart:
        return f"{apart} of {len(pairs)} fitted wires by more than {AGREED_MM} mm"
    problem, about = fit.problem, fit.linear
    points = problem.points(about.x)
    left = [problem.left(wires, points, about.weights, about.scale) for wires in (coarse, fine)]
    change = sum(j.T @ (new - old) for j, old, new in zip(about.jacobian, *left, strict=True))
    sds = np.abs(about.covariance @ change) / np.sqrt(np.diag(about.covariance))
    asked = problem.named(sds) or {ROLL: float(sds[OWN - 1])}
    most = max(asked, key=asked.__getitem__)
    return f"{most} by {asked[most]:.1f} of its standard deviations" if asked[most] > MOST_SD else ""
