"""Knots as close as a wire's bends ask for."""

import numpy as np

from pipeline.arrays.polyline import turns_deg
from pipeline.trace.attempt import Attempt, EntryPose, again, misfit
from pipeline.trace.knots import CLOSEST, IN_HOOKS
from pipeline.trace.subtraction import Subtraction
from pipeline.trace.tube import Tube

WIDE_KNOTS = 1.4
"""Knot distance over CLOSEST from which closer knots are tried, as below 6 noises. At 8 noises they would gain 2 % and
cost a fourth of the time."""
BENDS_SURE = 4.0
"""Standard deviations by which closer knots must save more than they do by chance."""
HOOK = 1.7
"""Radians that a curve turns from knot to knot from which it is a hook, which has closer knots if they save more than
they do by chance at all."""


def bent(image: Subtraction, attempt: Attempt, entry: EntryPose) -> Attempt:
    """The attempt with closer knots where the grey asks for them, as in bends that wide ones cut short; else itself."""
    if attempt.tube.knot_mm >= WIDE_KNOTS * CLOSEST * image.voxel:
        attempt = _closer(image, attempt, entry, CLOSEST, BENDS_SURE)
    return _closer(image, attempt, entry, IN_HOOKS, 0.0) if _turn_a_knot(attempt.tube) > HOOK else attempt


def _turn_a_knot(tube: Tube) -> float:
    """Largest angle, radians, by which a tube turns from knot to knot."""
    curve = tube.at(np.linspace(0, tube.intervals, 8 * tube.intervals + 1))
    return float(np.radians(turns_deg(curve, 8).max(initial=0.0)))


def _closer(image: Subtraction, attempt: Attempt, entry: EntryPose, knots: float, sure: float) -> Attempt:
    """The attempt with knots so far apart if that explains more than noise; else itself.

    Each further unknown takes one variance of the noise, with a standard deviation of sqrt(2), off the misfit of any
    wire; only what is ``sure`` beyond that is a bend.
    """
    closer = again(image, attempt, entry, knots)
    more = 3.0 * (closer.tube.intervals - attempt.tube.intervals)
    if more <= 0:
        return attempt
    wide, close = misfit(image, [attempt, closer])
    saved = (wide - close) / image.correlation**2
    return closer if saved > more + sure * np.sqrt(2.0 * more) else attempt
