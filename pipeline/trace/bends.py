"""Knots as close as a wire's bends ask for."""

import numpy as np
from scipy.ndimage import maximum_filter1d

from pipeline.arrays.polyline import turns_deg
from pipeline.model import Array
from pipeline.trace.attempt import Attempt, EntryPose, again, dense, misfit
from pipeline.trace.knots import CLOSEST, IN_HOOKS
from pipeline.trace.link import resampled
from pipeline.trace.subtraction import Subtraction
from pipeline.trace.tube import Tube
from pipeline.trace.verdict import shares_of

WIDE_KNOTS = 1.4
"""Knot distance over CLOSEST from which closer knots are tried, as below 6 noises. At 8 noises they would gain 2 % and
cost a fourth of the time."""
BENDS_SURE, HOOKS_SURE = 4.0, 1.0
"""Standard deviations by which closer knots must save more than they do by chance, in bends and in hooks."""
HOOK = 1.7
"""Radians that a curve turns from knot to knot from which it is a hook."""
HOOK_ERROR = 7.0
"""Error per axis (voxel, times the contrast to noise) of a hook that turns by two radians and more in IN_HOOKS; at one
radian there is none. Half circles of 2.7 and 3.3 voxels at contrasts of 8 to 24 have 0.84 to 1.17 in the median of
error over sigma (0.57 at 24 and 2.7 voxels; 1.2 to 4.5 without it); those of 4.3 voxels, 0.2 to 0.55, as without it."""


def bent(image: Subtraction, attempt: Attempt, entry: EntryPose) -> Attempt:
    """The attempt with closer knots where the grey asks for them, as in bends that wide ones cut short; else itself."""
    if attempt.tube.knot_mm >= WIDE_KNOTS * CLOSEST * image.voxel:
        attempt = _closer(image, attempt, entry, CLOSEST, BENDS_SURE)
    return _closer(image, attempt, entry, IN_HOOKS, HOOKS_SURE) if _turn_a_knot(attempt.tube) > HOOK else attempt


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


def hook_error(image: Subtraction, attempt: Attempt, points: Array) -> Array:
    """Error (n,), mm, at points (n, 3) of the curve near bends that the prior draws outwards, more with noise."""
    half = 0.5 * image.voxel
    line, apart = resampled(dense(attempt.tube, 0.2 * half), half), round(2.0 * IN_HOOKS)
    turns = np.radians(turns_deg(line, apart))
    if len(turns) == 0:
        return np.zeros(len(points))
    share = (np.arange(len(turns)) + 0.5 * (apart + 1)) / (len(line) - 1)
    near = np.interp(shares_of(attempt.tube, points), share, maximum_filter1d(turns, 2 * apart + 1))
    return np.asarray(HOOK_ERROR * image.voxel / attempt.cnr(image) * np.clip(near - 1.0, 0.0, 1.0))
