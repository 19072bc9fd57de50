"""Frames at which a wire may have let go or not: there the ensemble falls into two shapes.

Which of them is right depends on small causes, so a simulator is asked for their probabilities, and scored by them: the
log score is -log2 of the probability that it gave to what came (0 perfect, 1 as good as a coin); the energy score, mm,
mean |x - y| - mean |x - x'| / 2 over members x, is for all frames (Gneiting and Raftery, J. Am. Stat. Assoc. 102,
2007).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import pdist

from pipeline.model import Array

DISTAL_MM = 20.0
"""Length of the wire's end by which shapes are told apart: a tip lets go, not a whole wire."""
GAP_MM, GAP_SIGMAS = 0.1, 3.0
"""Two shapes are told apart by a gap between members along the main direction of the spread: wider than this in mm, and
than so many standard deviations within the shapes."""
LEAST_SHARE, LEAST = 0.02, 2
"""Least share of the members that a shape must have, and their least number."""


@dataclass(frozen=True, eq=False)
class Shapes:
    """Two shapes of a frame.

    simulated, real : the probabilities of the shapes that the nominal and the traced wire have; the latter is NaN where
    nothing was traced.     same : whether both have the same shape.     with_simulated : (members,) which members have
    the nominal wire's shape.
    """

    simulated: float
    real: float
    same: bool
    with_simulated: NDArray[np.bool_]


def _rms(away: Array) -> Array:
    """Root mean square (m,) over points of displacements (m, n, 3)."""
    return np.asarray(np.sqrt(np.mean(np.sum(away**2, axis=-1), axis=-1)))


def parted(wires: Array) -> NDArray[np.bool_] | None:
    """Which of the wires (members, n, 3) have one of two shapes; None where there is one shape."""
    count = len(wires)
    fewest = max(LEAST, round(LEAST_SHARE * count))
    if count < 2 * fewest + 1:
        return None
    flat = (wires - wires.mean(axis=0)).reshape(count, -1)
    power, modes = np.linalg.eigh(flat @ flat.T / wires.shape[1])
    score = modes[:, -1] * np.sqrt(max(power[-1], 0.0))
    order = np.sort(score)
    gaps = np.diff(order)[fewest - 1 : count - fewest]
    if gaps.max() <= GAP_MM:
        return None
    place = int(np.argmax(gaps)) + fewest
    first = score < 0.5 * (order[place - 1] + order[place])
    inside = np.concatenate([score[first] - score[first].mean(), score[~first] - score[~first].mean()])
    return first if gaps.max() > GAP_SIGMAS * float(inside.std()) else None


def shapes_of(wires: Array, nominal: Array, real: Array | None, arc_mm: Array) -> Shapes | None:
    """The two shapes of a frame, where there are two, and which of them the nominal and the real wire (n, 3) have."""
    distal = arc_mm >= arc_mm[-1] - DISTAL_MM
    first = parted(wires[:, distal])
    if first is None:
        return None
    means = [wires[chosen][:, distal].mean(axis=0) for chosen in (first, ~first)]
    share = (first.sum() + 0.5) / (len(first) + 1.0)
    probability = float(share), float(1.0 - share)
    simulated = int(np.argmin([_rms(nominal[distal] - mean) for mean in means]))
    seen = None if real is None else int(np.argmin([_rms(real[distal] - mean) for mean in means]))
    own = first if simulated == 0 else ~first
    return Shapes(probability[simulated], float("nan") if seen is None else probability[seen], seen == simulated, own)


def releases(snapped: Sequence[bool], shapes: Sequence[Shapes | None]) -> list[str]:
    """Of each frame, in order, what became of a release since the one before: both, missed, spurious or nothing.

    snapped : whether the simulated wire let go on the way to it.     The real wire is seen in frames alone: where there
    is one shape it is taken to let go when the simulated one does. Until both have the same shape again, it is the same
    release.
    """
    told, apart = [], False
    for let_go, both in zip(snapped, shapes, strict=True):
        differ = both is not None and not both.same and np.isfinite(both.real)
        missed = "missed" if differ and not apart else ""
        told.append(("spurious" if differ else "both") if let_go and not apart else missed)
        apart = bool(differ)
    return told


def energy_score_mm(wires: Array, real: Array) -> float:
    """Energy score of wires (members, n, 3) for the real one (n, 3), by root mean square distance at equal arc."""
    # over pairs of different members: a member is no guess of itself
    between = pdist(wires.reshape(len(wires), -1) / np.sqrt(wires.shape[1])).mean()
    return float(_rms(wires - real).mean() - 0.5 * between)
