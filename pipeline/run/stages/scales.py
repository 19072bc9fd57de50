"""Whether traced depths grow as insertion_mm states: a voxel size or a scale of depths may be wrong, or a wire slip."""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import stdtrit

from pipeline.model import Array
from pipeline.run.stages.depths import CHANCE, FEWEST, OUTSIDE, by_stated_depth, runs_down
from pipeline.run.stages.known import Frame

LEAST_SCALE = 0.01
"""By how much a scale must be off to be told."""
CLEARLY = 2.5
"""By how many times less a wrong scale must leave than a wrong zero to be told for it, where a line is not sure of its
slope: of right depths it is told of 1 to 2 in 1000, of those with a wrong zero, read to 0.5 mm, of 1 to 11."""
BENT, BY_CHANCE = 0.5, 0.01
"""Share of a scale's mean error by which its errors at the first and the last depth must differ to be no one scale (of
what grows as the square of the depth by 1 to 2, of a wrong voxel size by nothing), and how often that may be chance."""
WITHOUT_ONE = 0.05
"""How often that may be chance without the first, or the last, depth. Of scales of 1.05 with one of 30 depths misread
there by 0.6 to 1 mm this tells 2 % (without it 3 to 9 %), of slack of 2 mm, known to 0.05 mm, at 10 depths 98 %."""


def on_another_scale(frames: Sequence[Frame], depths_mm: Mapping[int, float]) -> list[str]:
    """A warning where traced depths grow faster, or slower, than insertion_mm. depths_mm : of ``traced_depths``.

    By least squares over the stated depths; a scale that is read by hand to 0.5 mm leaves a few per cent open. With
    the zero right it leaves less open, and is told where a wrong zero explains clearly less.
    """
    stated, traced = by_stated_depth(frames, depths_mm)
    if len(stated) < FEWEST:
        return []
    (slope, _), covariance = np.polyfit(stated, traced - stated, 1, cov=True)
    deviation, zero = float(np.sqrt(covariance[0, 0])), ""
    if not _scale_told(slope, deviation, len(stated) - 2):
        slope, left = _scale_from_zero(stated, traced - stated)
        deviation, if_zero = left / float(np.linalg.norm(stated)), float(np.std(traced - stated, ddof=1))
        # four depths cannot tell: of those from a wrong zero, read to 0.5 mm, it was told in 21 of 1000
        if len(stated) <= FEWEST or left * CLEARLY > if_zero or not _scale_told(slope, deviation, len(stated) - 1):
            return []
        zero = f"; {left:.2f} mm rms are left, {if_zero:.2f} if all were counted from elsewhere"
    if runs_down(stated, traced):
        return [f"the traced wires get longer where insertion_mm states less: {OUTSIDE}"]
    if bent := _on_no_one_scale(stated, traced - stated):
        return [bent]
    return [
        f"the traced wires grow {1.0 + slope:.3f} times as fast as insertion_mm states (standard deviation "
        f"{deviation:.2g}, {len(stated)} stated depths{zero}): is the scans' voxel size right, or the scale that "
        "depths were read from? With a wrong size all lengths and errors are as wrong"
    ]


def _on_no_one_scale(stated: Array, apart: Array) -> str:
    """A sentence where what stated depths (n,) are off by (n,) bends too clearly for a wrong scale; else empty.

    Also without the first depth, and without the last: one that is misread there bends a line by itself.
    """
    bends, first, last = _bend(stated, apart, BY_CHANCE)
    if not bends or abs(last - first) <= 0.5 * BENT * abs(last + first) or len(stated) <= FEWEST:
        return ""
    if not all(_bend(stated[some], apart[some], WITHOUT_ONE)[0] for some in (slice(1, None), slice(None, -1))):
        return ""
    return (
        f"the traced wires grow {1.0 + first:.3f} times as fast as insertion_mm states at {stated[0]:g} mm and "
        f"{1.0 + last:.3f} times at {stated[-1]:g} mm ({len(stated)} stated depths): no one scale explains that; does "
        "the wire slip or lie slack before the entry as it is pushed, or do traces cut corners?"
    )


def _bend(stated: Array, apart: Array, by_chance: float) -> tuple[bool, float, float]:
    """Whether chance does not bend a line so much, and by how much the scale is off at the first and the last depth."""
    (bend, slope, _), covariance = np.polyfit(stated, apart, 2, cov=True)
    limit = float(stdtrit(len(stated) - 3, 1.0 - 0.5 * by_chance) * np.sqrt(covariance[0, 0]))
    first, last = slope + 2.0 * bend * stated[[0, -1]]
    return bool(abs(bend) > limit), float(first), float(last)


def _scale_told(slope: float, deviation: float, freedom: int) -> bool:
    """Whether a scale is off by more than chance explains, and by enough to be told."""
    return abs(slope) >= max(LEAST_SCALE, float(stdtrit(freedom, 1.0 - 0.5 * CHANCE)) * deviation)


def _scale_from_zero(stated: Array, apart: Array) -> tuple[float, float]:
    """By how much of the stated depths (n,) what they are off by (n,) grows from 0, and the rms that this leaves."""
    slope = float(stated @ apart / (stated @ stated))
    return slope, float(np.linalg.norm(apart - slope * stated)) / float(np.sqrt(len(stated) - 1))
