"""Tracklets to one wire: ends are joined where one tangent leads to the other, starting at the entry.

A shortest path takes every short cut between strands; ends joined by direction do not (they cross, run past each
other and over gaps), because a tracklet ends where the image is ambiguous and its tangent there is still good.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Array, arc_length
from pipeline.trace.crests import Tracklet

WIDEST_ANGLE = 1.2
"""Largest angle (rad) between an end's tangent and the chord of the bridge."""
DOUBLED = 1.25
"""Crest grey over the usual from which a piece is offered twice."""
LONGEST_DOUBLE = 0.2
"""Share of all crests above which a bright piece is just a brighter wire."""
END_SPAN = 6
"""Crest points over which an end's tangent is averaged."""


@dataclass(frozen=True, eq=False)
class Path:
    """The wire as crest points (n, 3) from entry to tip; ``bridged`` marks points put in over a gap."""

    points: Array
    bridged: NDArray[np.bool_]
    leftover_mm: float
    bridges: int


@dataclass(frozen=True, eq=False)
class _Ends:
    """All ends: position, outward tangent, and tracklet number (even index = first point, odd = last)."""

    position: Array
    outward: Array


def _unit(v: Array) -> Array:
    return np.asarray(v / (np.linalg.norm(v, axis=-1, keepdims=True) + 1e-12))


def _ends(pieces: list[Tracklet]) -> _Ends:
    position, outward = [], []
    for p in pieces:
        n = min(END_SPAN, len(p.points))
        position += [p.points[0], p.points[-1]]
        if n > 1:
            outward += [p.points[0] - p.points[n - 1], p.points[-1] - p.points[-n]]
        else:
            outward += [-p.tangents[0], p.tangents[-1]]
    return _Ends(np.array(position), _unit(np.array(outward)))


def _bridge_costs(ends: _Ends, longest: float) -> tuple[NDArray[np.int64], Array]:
    """Feasible bridges (m, 2) of ends of different tracklets and their costs, cheapest first.

    Cost: gap times (1 + squares of both angles to the chord), a stand-in for the bending energy of the bridge.
    """
    gap = ends.position[None] - ends.position[:, None]
    size = np.linalg.norm(gap, axis=2)
    chord = gap / (size[:, :, None] + 1e-9)
    here = np.arccos(np.clip(np.einsum("ia,ija->ij", ends.outward, chord), -1, 1))
    there = np.arccos(np.clip(-np.einsum("ja,ija->ij", ends.outward, chord), -1, 1))
    facing = np.arccos(np.clip(-ends.outward @ ends.outward.T, -1, 1))
    # ends that overlap or touch have no chord to speak of: their tangents alone decide
    touch = size < 0.15 * longest
    here, there = np.where(touch, 0.5 * facing, here), np.where(touch, 0.5 * facing, there)
    number = np.arange(len(size)) // 2
    good = (size < longest) & (here < WIDEST_ANGLE) & (there < WIDEST_ANGLE)
    good &= (number[:, None] < number[None, :]) & (facing < 1.5)
    pairs = np.argwhere(good)
    cost = ((size + 0.02 * longest) * (1 + 4 * here**2 + 4 * there**2 + 2 * facing**2))[good]
    rank = np.argsort(cost, kind="stable")
    return pairs[rank], cost[rank]


def join(pieces: list[Tracklet], longest: float) -> dict[int, int]:
    """Which end goes to which: cheapest bridges first, each end once, no rings."""
    if len(pieces) < 2:
        return {}
    pairs, _ = _bridge_costs(_ends(pieces), longest)
    root = list(range(len(pieces)))

    def find(n: int) -> int:
        while root[n] != n:
            root[n] = root[root[n]]
            n = root[n]
        return n

    taken: dict[int, int] = {}
    for a, b in pairs.tolist():
        if a in taken or b in taken or find(a // 2) == find(b // 2):
            continue
        taken[a], taken[b] = b, a
        root[find(a // 2)] = find(b // 2)
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
        (2 * u**3 - 3 * u**2 + 1) * p
        + (u**3 - 2 * u**2 + u) * a
        + (3 * u**2 - 2 * u**3) * q
        + (u**3 - u**2) * b
    )


def _split_at_entry(
    pieces: list[Tracklet], entry: Array, direction: Array, reach: float
) -> tuple[int, int, bool] | None:
    """The tracklet and its point where the wire passes the entry, and whether it runs along the direction.

    Nearest point first; a piece that runs across the entry direction is another strand.
    """
    best: tuple[float, int, int, bool] | None = None
    for m, piece in enumerate(pieces):
        offset = piece.points - entry
        along = offset @ direction
        far = np.linalg.norm(offset, axis=1) + np.maximum(0.0, -along)
        n = int(np.argmin(far))
        run = float(piece.tangents[n] @ direction)
        if far[n] < reach and abs(run) > 0.5 and (best is None or far[n] < best[0]):
            best = (float(far[n]), m, n, run > 0)
    return None if best is None else best[1:]


def with_doubles(pieces: list[Tracklet]) -> list[Tracklet]:
    """The pieces, and once more those so bright that two strands in contact must have merged in them."""
    if len(pieces) < 2:
        return pieces
    lengths = np.array([p.length for p in pieces])
    usual = float(np.median(np.concatenate([p.values for p in pieces])))
    again = [
        p
        for p, n in zip(pieces, lengths, strict=True)
        if float(np.median(p.values)) > DOUBLED * usual and n < LONGEST_DOUBLE * lengths.sum()
    ]
    return pieces + again


def link(pieces: list[Tracklet], entry: Array, direction: Array, longest: float, reach: float) -> Path | None:
    """The wire that starts at the entry; None when no tracklet passes within ``reach`` mm of it.

    longest : widest gap bridged, mm.  What lies before the entry along the same tracklet is kept: the fit needs it.
    """
    found = _split_at_entry(pieces, entry, direction, reach)
    if found is None:
        return None
    number, _, forward = found
    taken = join(pieces, longest)
    points: list[Array] = []
    bridged: list[NDArray[np.bool_]] = []
    used = set()
    end = 2 * number + (1 if forward else 0)
    bridges = 0
    while True:
        piece = pieces[end // 2] if end % 2 else pieces[end // 2].reversed()
        used.add(end // 2)
        points.append(piece.points)
        bridged.append(np.zeros(len(piece.points), bool))
        following = taken.get(end)
        if following is None:
            break
        after = pieces[following // 2] if following % 2 == 0 else pieces[following // 2].reversed()
        gap = hermite(piece.points[-1], piece.tangents[-1], after.points[0], after.tangents[0], 0.2)
        points.append(gap)
        bridged.append(np.ones(len(gap), bool))
        bridges += 1
        end = following ^ 1
    left = sum(float(arc_length(p.points)[-1]) for m, p in enumerate(pieces) if m not in used)
    return Path(np.concatenate(points), np.concatenate(bridged), left, bridges)
