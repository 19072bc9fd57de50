"""How long the segments of a fit are: as long as leaves all its wires where segments half as long lay them.

With segments of 1 mm, of a soft tip that stiffens at once in a tight siphon, roll, rest curvature and friction came out
6 to 8 of their standard deviations off and were called seen; with 0.5 mm, within 1.4.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from pipeline.calibrate.search import Fit
from pipeline.calibrate.trials import lengths_of, quick, replayed
from pipeline.model import Wire
from pipeline.simulate.config import SolverConfig
from pipeline.simulate.resolution import AGREED_MM, moved_mm
from solver import Solution


class Segments(NamedTuple):
    """The segments of a fit: their length, mm, how it was chosen, and a doubt of it; empty where there is none."""

    mm: float
    reason: str
    doubt: str = ""


def resolved(fit_with: Callable[[SolverConfig], Fit], wire: Wire, solver: SolverConfig) -> tuple[Fit, Segments]:
    """The fit to insertions of a wire with segments as short as it needs. fit_with : called with the settings."""
    lengths, at = lengths_of(wire, solver), 0
    while True:
        fit = fit_with(quick(solver, lengths[at]))
        if len(lengths) == 1:
            return fit, Segments(lengths[0], "as stated")
        found, segments = _needed(fit, lengths, at, solver)
        if found == at:
            return fit, segments
        at = found


def _needed(fit: Fit, lengths: Sequence[float], at: int, solver: SolverConfig) -> tuple[int, Segments]:
    """Which of the lengths a fit with that ``at`` a position needs: that one or a shorter one, and what is said of it.

    A length does where all wires that are fitted lie where those with segments half as long do that are simulated as
    in a run, with repeated steps. Also those near a snap, which a run leaves out: one that lies elsewhere is fitted.
    """
    apart: list[bool] = []
    for n in range(min(at, len(lengths) - 2), len(lengths) - 1):
        both = (_wires(fit, s) for s in (quick(solver, lengths[n]), replace(solver, segment_mm=lengths[n + 1])))
        apart = [not _agree(*pair) for pair in zip(*both, strict=True)]
        if not any(apart):
            reason = f"halving them moved no fitted wire by more than {AGREED_MM} mm"
            return max(n, at), Segments(lengths[max(n, at)], reason)
    shortest, reason = lengths[-1], f"at {sum(apart)} of {len(apart)} depths the wire still depends on their length"
    doubt = f"segments of {shortest:g} mm, the shortest, may be too long: {reason}; parameters may be off by more than"
    return len(lengths) - 1, Segments(shortest, reason, f"{doubt} their standard deviations")


def _wires(fit: Fit, solver: SolverConfig) -> list[Solution]:
    """The wires of all fitted frames at a fit's parameters."""
    points = fit.problem.points(fit.linear.x)
    pairs = [(one.trial, point) for one, point in zip(fit.problem.evidence, points, strict=True)]
    return [wire for of_one in replayed(pairs, solver) for wire in of_one]


def _agree(coarse: Solution, fine: Solution) -> bool:
    """Whether two wires lie in one place, or neither came to rest."""
    return moved_mm(coarse, fine) <= AGREED_MM or not (coarse.converged or fine.converged)
