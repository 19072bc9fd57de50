"""Whether the points of a polyline come in the order of a curve: what turns back, jumps away and back, or scatters."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pipeline.model import Array

BACK = -0.5
"""Cosine of a step to the one before, below which it goes back: by 120 degrees and more."""
JUMP = 8.0
"""How many times the median a step is that jumps; steps of a hand that clicks more densely in bends differ by less."""
MANY_JUMPS = 3
"""Jumps over a polyline's other points that are told without a turn: two pieces that were exchanged make three."""
BRIDGED = 1.0 / 3.0
"""A step passes over other points where these lead from its one end to the other by steps of this share of it."""
NEIGHBOURS = 8


def turned_back(points: Array, least: float) -> NDArray[np.int64]:
    """Numbers of the points (from 0) of a polyline (n, 2 or 3) at which it goes back.

    least : length of a step, in the points' unit, up to which it is rounding and passed over.
    """
    steps = np.diff(points, axis=0)
    length = np.linalg.norm(steps, axis=1)
    long = np.flatnonzero(length > least)
    units = steps[long] / length[long, None]
    return np.asarray(long[np.flatnonzero(np.sum(units[1:] * units[:-1], axis=1) < BACK)] + 1)


def disordered(points: Array, tremble: float) -> tuple[int, int] | None:
    """Two successive points (numbers from 0) between which a *projected* polyline (n, 2 or 3) is in no order; or None.

    tremble : what points may lie off by drawing and rounding, in their unit; nothing is said of steps of twice it.
    A projection may turn straight back (a hairpin seen edge on), cross itself, or stand still (a wire along the ray),
    and a hand may leave out what it does not see. None of them steps back over points that come elsewhere in the
    polyline, or leaves for one point far away.
    """
    kept = thinned(points, tremble)
    thin = points[kept]
    length = np.linalg.norm(np.diff(thin, axis=0), axis=1)
    turns = np.zeros(len(thin), dtype=bool)
    turns[turned_back(thin, 0.0)] = True
    jumps = length > JUMP * np.median(length) if len(length) > 3 else np.zeros(len(length), dtype=bool)
    healed = np.linalg.norm(thin[2:] - thin[:-2], axis=1) < BRIDGED * np.minimum(length[1:], length[:-1])
    wild = np.flatnonzero(jumps[1:] & jumps[:-1] & turns[1:-1] & healed)
    if len(wild):
        return _longest(points, kept, int(wild[0]))
    back = turns[:-1] & turns[1:] & (length > 2.0 * tremble)
    # a stretch left out next to a bend is one jump with one turn; a piece that was turned round is two
    for some, enough in ((back, 1), (jumps & (turns[:-1] | turns[1:]), 2), (jumps, MANY_JUMPS)):
        found = _over_others(points, kept, length, np.flatnonzero(some), enough)
        if found is not None:
            return found
    return None


def thinned(points: Array, apart: float) -> NDArray[np.int64]:
    """Numbers of points, the first and each next one that lies ``apart`` from the last one taken."""
    taken = [0]
    for n in range(1, len(points)):
        away = points[n] - points[taken[-1]]
        if away @ away >= apart * apart:
            taken.append(n)
    return np.array(taken)


def _over_others(
    points: Array, kept: NDArray[np.int64], length: Array, steps: NDArray[np.int64], enough: int
) -> tuple[int, int] | None:
    """The first of ``enough`` of the steps (their numbers) that pass over points elsewhere; None where fewer do.

    kept : the numbers of the points between which steps are.     length : of each of these steps.
    """
    if len(steps) < enough:
        return None
    places, which = np.unique(points, axis=0, return_inverse=True)
    near, other = (np.ravel(x) for x in cKDTree(places).query(places, k=min(NEIGHBOURS, len(places))))
    rows = np.repeat(np.arange(len(places)), len(near) // len(places))
    found: list[int] = []
    # the longest tell most; of points in no order nearly all of them do
    for step in steps[np.argsort(-length[steps], kind="stable")][: 20 * enough]:
        short = near <= BRIDGED * length[step]
        links = coo_array((np.ones(short.sum()), (rows[short], other[short])), shape=(len(places),) * 2)
        part = connected_components(links, directed=False)[1]
        ends = which.ravel()[kept[step : step + 2]]
        if part[ends[0]] == part[ends[1]]:
            found.append(int(step))
    return _longest(points, kept, min(found)) if len(found) >= enough else None


def _longest(points: Array, kept: NDArray[np.int64], step: int) -> tuple[int, int]:
    """The two successive points that are farthest apart in a step of the thinned polyline."""
    first = int(kept[step])
    apart = np.linalg.norm(np.diff(points[first : kept[step + 1] + 1], axis=0), axis=1)
    worst = first + int(np.argmax(apart))
    return worst, worst + 1
