"""Tracklets to one wire: ends are joined where one tangent leads to the other, from the entry to the tip.

A shortest path would take every short cut between strands. Ends joined by direction do not, where strands cross, run
side by side or have gaps: a tracklet ends where the image is ambiguous, and its tangent there is still good.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Array, arc_length
from pipeline.trace.crests import Tracklet

WIDEST_ANGLE = 1.2
"""Largest angle (rad) between an end's tangent and the chord of the bridge."""
DOUBLED = 1.25
"""Crest grey over the usual from which a piece is offered twice."""
LONGEST_DOUBLE = 0.2
"""Share of the length of all crests above which a bright piece is just a brighter wire."""
END_SPAN = 6
"""Crest points over which an end's tangent is averaged."""
BRIDGE_STEP_MM = 0.2
"""Distance of points put in over a gap."""
SPECK_SHARE, SPECK_MM = 0.5, 2.0
"""Crest grey, as a share of the wire's, and length at the entry below which a bright line is no wire: beside a wire of
steel a cone-beam scan has streaks 1 mm long of a quarter of its grey, one of which may lie nearer the entry."""


@dataclass(frozen=True, eq=False)
class Path:
    """The wire as crest points (n, 3) from entry to tip; ``bridged`` marks points put in over a gap."""

    points: Array
    bridged: NDArray[np.bool_]
    bridges: int


def _ends(pieces: list[Tracklet]) -> tuple[Array, Array]:
    """Positions and outward unit tangents (2 m, 3) of all ends; even: a piece's first point, odd: its last."""
    position, outward = [], []
    for p in pieces:
        n = min(END_SPAN, len(p.points))
        position += [p.points[0], p.points[-1]]
        if n > 1:
            outward += [p.points[0] - p.points[n - 1], p.points[-1] - p.points[-n]]
        else:
            outward += [-p.tangents[0], p.tangents[-1]]
    heading = np.array(outward)
    return np.array(position), heading / (np.linalg.norm(heading, axis=-1, keepdims=True) + 1e-12)


def _bridges(pieces: list[Tracklet], longest: float) -> NDArray[np.int64]:
    """Feasible bridges (m, 2) of ends of different tracklets, cheapest first.

    Cost: gap times (1 + 4 times the squares of both angles to the chord + 2 times that of the angle between the ends),
    a stand-in for the bending energy of the bridge.
    """
    position, outward = _ends(pieces)
    gap = position[None] - position[:, None]
    size = np.linalg.norm(gap, axis=2)
    chord = gap / (size[:, :, None] + 1e-9)
    here = np.arccos(np.clip(np.einsum("ia,ija->ij", outward, chord), -1, 1))
    there = np.arccos(np.clip(-np.einsum("ja,ija->ij", outward, chord), -1, 1))
    facing = np.arccos(np.clip(-outward @ outward.T, -1, 1))
    # ends that overlap or touch have no chord to speak of: their tangents alone decide
    touch = size < 0.15 * longest
    here, there = np.where(touch, 0.5 * facing, here), np.where(touch, 0.5 * facing, there)
    number = np.arange(len(size)) // 2
    good = (size < longest) & (here < WIDEST_ANGLE) & (there < WIDEST_ANGLE)
    good &= (number[:, None] < number[None, :]) & (facing < 1.5)
    cost = ((size + 0.02 * longest) * (1 + 4 * here**2 + 4 * there**2 + 2 * facing**2))[good]
    return np.argwhere(good)[np.argsort(cost, kind="stable")]


def join(pieces: list[Tracklet], longest: float) -> dict[int, int]:
    """Which end goes to which: cheapest bridges first, each end once, no rings."""
    if len(pieces) < 2:
        return {}
    taken: dict[int, int] = {}
    across = [n ^ 1 for n in range(2 * len(pieces))]  # the other end of the chain that an end is an end of
    for a, b in _bridges(pieces, longest).tolist():
        if a not in taken and b not in taken and across[a] != b:
            taken[a], taken[b] = b, a
            one, other = across[a], across[b]
            across[one], across[other] = other, one
    return taken


def hermite(p: Array, tp: Array, q: Array, tq: Array, step: float) -> Array:
    """Inner points of the cubic from p (heading tp) to q (heading tq), spaced about ``step``."""
    size = float(np.linalg.norm(q - p))
    n = int(size / step)
    if n < 1:
        return np.zeros((0, 3))
    u = np.linspace(0, 1, n + 2)[1:-1, None]
    a, b = size * tp, size * tq
    return np.asarray(
        (2 * u**3 - 3 * u**2 + 1) * p + (u**3 - 2 * u**2 + u) * a + (3 * u**2 - 2 * u**3) * q + (u**3 - u**2) * b
    )


def first_ahead(points: Array, end: Array, heading: Array) -> int:
    """The first of points (n, 3) that lies ahead of an end with that heading; n for none: a joint may not run back."""
    ahead = (points - end) @ heading > 0.0
    return int(np.argmax(ahead)) if ahead.any() else len(points)


def _ends_at_entry(pieces: list[Tracklet], entry: Array, direction: Array, reach: float) -> list[int]:
    """The ends, numbered as in :func:`_ends`, to which tracklets lead in the wire's direction, nearest the entry first.

    Those that pass within ``reach`` mm; one that runs across the entry direction is another strand.
    """
    found = []
    for m, piece in enumerate(pieces):
        offset = piece.points - entry
        far = np.linalg.norm(offset, axis=1) + np.maximum(0.0, -(offset @ direction))
        n = int(np.argmin(far))
        run = float(piece.tangents[n] @ direction)
        if far[n] < reach and abs(run) > 0.5:
            found.append((float(far[n]), m, 2 * m + (run > 0)))
    return [end for _, _, end in sorted(found)]


def _chain(end: int, taken: dict[int, int]) -> list[int]:
    """Ends to which the tracklets lead that follow each other from the one that leads to ``end``, which is the first.

    taken : of ``join``.
    """
    ends = [end]
    while ends[-1] in taken:
        ends.append(taken[ends[-1]] ^ 1)
    return ends


def _is_speck(chain: list[int], at_entry: list[int], pieces: list[Tracklet]) -> bool:
    """Whether a chain is short and faint beside another tracklet at the entry, to which it does not lead."""
    own = [pieces[end // 2] for end in chain]
    short = sum(piece.length for piece in own) < SPECK_MM
    most = max(piece.grey for piece in own)
    return short and any(most < SPECK_SHARE * pieces[end // 2].grey for end in at_entry)


def with_doubles(pieces: list[Tracklet]) -> list[Tracklet]:
    """The pieces, and once more those so bright that two strands in contact must have merged in them."""
    if len(pieces) < 2:
        return pieces
    most = LONGEST_DOUBLE * np.array([p.length for p in pieces]).sum()
    usual = float(np.median(np.concatenate([p.values for p in pieces])))
    return pieces + [p for p in pieces if p.grey > DOUBLED * usual and p.length < most]


def link(pieces: list[Tracklet], entry: Array, direction: Array, longest: float, reach: float) -> Path | None:
    """The wire that starts at the entry; None when no tracklet passes within ``reach`` mm of it.

    longest : widest gap bridged, mm.  What lies before the entry along the same tracklet is kept: the fit needs it.
    """
    at_entry, taken = _ends_at_entry(pieces, entry, direction, reach), join(pieces, longest)
    chains = [_chain(end, taken) for end in at_entry]
    if not chains:
        return None
    chain = next(chain for chain in chains if not _is_speck(chain, at_entry, pieces))
    follow = [pieces[end // 2] if end % 2 else pieces[end // 2].reversed() for end in chain]
    points, bridged = [follow[0].points], [np.zeros(len(follow[0].points), bool)]
    for piece, after in pairwise(follow):
        end, heading = piece.points[-1], piece.tangents[-1]
        first = min(first_ahead(after.points, end, heading), len(after.points) - 1)  # pieces may overlap at their ends
        gap = hermite(end, heading, after.points[first], after.tangents[first], BRIDGE_STEP_MM)
        points += [gap, after.points[first:]]
        bridged += [np.ones(len(gap), bool), np.zeros(len(after.points) - first, bool)]
    return Path(np.concatenate(points), np.concatenate(bridged), len(follow) - 1)


def extended(points: Array, ahead: float, step: float) -> Array:
    """The path (n, 3), continued straight by ``ahead`` mm in the direction of its last 1.5 mm (or half)."""
    arc = arc_length(points)
    back = int(np.searchsorted(arc, arc[-1] - min(1.5, 0.5 * arc[-1])))
    t = points[-1] - points[min(back, len(points) - 2)]
    t /= np.linalg.norm(t)
    # counted, as rounding of the end makes np.arange(step, ahead + step, step) one longer
    more = step * np.arange(1, round(ahead / step) + 1)[:, None] * t
    return np.concatenate([points, points[-1] + more])


def resampled(points: Array, step: float) -> Array:
    """The polyline at equal steps of arc, both ends kept."""
    arc = arc_length(points)
    keep = np.concatenate([[True], np.diff(arc) > 1e-9])
    s = np.linspace(0, arc[-1], max(2, round(arc[-1] / step) + 1))
    return np.stack([np.interp(s, arc[keep], points[keep, a]) for a in range(3)], axis=1)
