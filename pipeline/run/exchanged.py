"""Simulated wires that were given to the wrong insertions: each fits the real wires of another one, round in a ring.

That a wire is nearer to another insertion's real wire than to its own is nothing: of many insertions one lies there by
chance. Where wires were exchanged, that other insertion's own simulated wires do not fit it either.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pipeline.arrays.polyline import at_arc, samples
from pipeline.compare.config import CompareConfig
from pipeline.compare.metrics import point_to_curve, scored
from pipeline.model import Array, arc_length
from pipeline.run.another import Others, of_one_phantom
from pipeline.run.overall import Found
from pipeline.run.traced import arrays_of, compare_of, traces_of
from reports.case_files import thinned

LOOKED_AT, FEWEST, NEARER, IN_ALL = 6, 3, 0.7, 0.5
"""Frames, spread over a case, that are looked at; how many of them, all but one, must be nearer to the other insertion;
and by which share of the distance from its own, in a case and over the whole ring. Wires that were not exchanged (one
shape for all, 1 mm or 0.2 mm off at random, 3 to 24 insertions) stand in such a ring in 0 to 7 %."""


class Fit(NamedTuple):
    """The insertion that a case's simulated wires fit, and their distances from its real wires and from its own, mm."""

    insertion: str
    other_mm: float
    own_mm: float


def exchanged(out: Path, found: Sequence[Found]) -> list[str]:
    """A sentence for each case whose simulated wires fit another insertion, which somebody else's fit, and so round.

    found : the validation cases of an output folder.
    """
    said = []
    for cases in of_one_phantom(found):
        traces = {case.result.case: traces_of(out, case) for case in cases}
        config, fits = compare_of(out, cases[0]), dict[str, Fit]()
        for case in cases:
            kin = [(c.insertion, traces[c.result.case]) for c in cases if c.insertion != case.insertion]
            own, simulated = traces[case.result.case], arrays_of(out, case, "simulated_mm")
            numbers = sorted(case.frames.keys() & own.keys() & simulated.keys())
            looked_at = [numbers[k] for k in thinned(len(numbers), LOOKED_AT)]
            seen = [(*own[n], simulated[n]) for n in looked_at]
            fit = fit_of(seen, Others(kin, own), config)
            if fit is not None:
                fits[case.result.case] = fit
        ring = in_a_ring(fits, {case.result.case: case.insertion for case in cases})
        said += [
            f"the simulated wires of case {case!r} lie far nearer to the real wires of insertion {fit.insertion!r} "
            f"({fit.other_mm:.2g} mm) than to its own ({fit.own_mm:.2g} mm), whose wires fit another one in turn: were "
            "wires, rolls or scans exchanged?"
            for case, fit in ring.items()
        ]
    return said


def fit_of(seen: Sequence[tuple[float, Array, Array]], others: Others, config: CompareConfig) -> Fit | None:
    """The insertion whose traces simulated wires are far nearer to than to their own, nearly all of them.

    seen : depth in mm, trace (n, 3) and simulated wire (m, 3) of a few frames.
    """
    squares: dict[str, list[tuple[float, float]]] = {}
    for depth, curve, wire in seen:
        nearest: dict[str, tuple[float, float]] = {}
        for insertion, trace in others.nearest(depth, curve):
            # as long as both traces: the depths are nearly the same
            shortest_mm = min(float(arc_length(c)[-1]) for c in (curve, trace, wire))
            arc = scored(samples(shortest_mm, config.sample_mm), config.skip_mm)
            other, own = (float(np.mean(point_to_curve(at_arc(wire, arc), c)[0] ** 2)) for c in (trace, curve))
            nearest[insertion] = min(nearest.get(insertion, (np.inf, np.inf)), (other, own))
        for insertion, pair in nearest.items():
            squares.setdefault(insertion, []).append(pair)
    found = []
    for insertion, pairs in squares.items():
        other_mm, own_mm = map(float, np.sqrt(np.mean(pairs, axis=0)))
        count = sum(other < NEARER**2 * own for other, own in pairs)
        if count >= max(FEWEST, len(seen) - 1) and other_mm < NEARER * own_mm:
            found.append(Fit(insertion, other_mm, own_mm))
    return min(found, key=lambda fit: fit.other_mm, default=None)


def in_a_ring(fits: Mapping[str, Fit], insertions: Mapping[str, str]) -> dict[str, Fit]:
    """Those of the cases that fit an insertion of which a case fits another one, and so on, back to the first.

    insertions : of all cases.
    """
    left = dict(fits)
    while True:
        accused = {insertions[case] for case in left}
        fitted = {fit.insertion for fit in left.values()}
        kept = {case: fit for case, fit in left.items() if fit.insertion in accused and insertions[case] in fitted}
        if len(kept) == len(left):
            break
        left = kept
    squares = np.array([[fit.other_mm, fit.own_mm] for fit in kept.values()]).reshape(-1, 2) ** 2
    other, own = squares.sum(axis=0)
    return kept if other < IN_ALL**2 * own else {}
