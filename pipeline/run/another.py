"""The predictor ``another``: how the wire lay in other insertions into the same phantom at the nearest depth.

It needs the traces of all cases, so it is computed after them and stands in overall.csv alone.
"""

import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.cluster.hierarchy import DisjointSet

from pipeline.arrays.polyline import at_arc, samples
from pipeline.compare.config import CompareConfig
from pipeline.compare.metrics import point_to_curve, scored
from pipeline.compare.nulls import ANOTHER
from pipeline.compare.pooled import Scored
from pipeline.model import Array
from pipeline.run.kin import SAME_ENTRY_MM, by_phantom, with_kin
from pipeline.run.overall import Found
from pipeline.run.stages.repeated import ALIKE, ONE_WIRE, OWN_MM
from pipeline.run.traced import Traces, compare_of, traces_of
from reports.case_files import listed
from reports.doubts import COUNT_AS

WRITTEN = "are one scan, written again"
OR_ELSE = ", or each a group of its own name where the wire was drawn out and pushed in again between the scans"
RESCANNED = "tell no more than one insertion that was scanned again"
MOST_OWN_MM = 0.2
"""Most that own traces, the least being OWN_MM, are taken to be known to: half a voxel of 0.4 mm."""
NEAREST_MM = 2.0
"""How far off the nearest depth may be, at the least; else half as far as one of its frames is from the next: a trace
that is farther off stands in for one that is missing, and what is lost would make the wire look better."""
ANOTHER_ROLL_DEG = 0.1
"""Rolls that differ by less are one: nobody reads them to that, and 0.02 degrees made three insertions of one."""
MOST_OTHERS = 24
"""Most traces in a guess, those of the nearest depths: with all of 500 cases in one phantom it would take ten minutes,
and the root mean square over 24 is known to about a seventh of itself (1 / sqrt(48))."""


def with_another(out: Path, found: Sequence[Found]) -> list[Found]:
    """The cases, with the predictor's error added to the frames' rows where other insertions share the phantom.

    Also where nobody says so, but wires lie in one place (``with_kin``).
    """
    found = with_kin(out, found)
    shared = of_one_phantom(found)
    own = {case.result.case: cases for cases in shared for case in cases}
    traces = {case.result.case: traces_of(out, case) for cases in shared for case in cases}
    config = compare_of(out, shared[0][0]) if shared else CompareConfig()
    return [_with_another(c, own[c.result.case], traces, config) if c.result.case in own else c for c in found]


def of_one_phantom(found: Sequence[Found]) -> list[list[Found]]:
    """The cases of each phantom that several share."""
    return [cases for cases in by_phantom(found) if len(cases) > 1]


def copies(found: Sequence[Found]) -> list[str]:
    """A sentence for insertions, two or more, whose traces lie nearer to each other than those of several do.

    found : of ``with_another``. A scan that was written again (another format, rounded, with a grey more of noise) is
    traced alike to a hundredth of a voxel; another scan of one wire has noise of its own, and one that was drawn out
    and pushed in again lies elsewhere.
    """
    pairs: dict[tuple[str, ...], list[tuple[float, float]]] = {}
    for case in found:
        rows = [frame for frame in case.frames.values() if frame.guesses]
        sigma = _known_to(case, rows)
        for other in sorted({name for frame in rows for name in frame.guesses}):
            squares, count = np.sum([frame.guesses[other] for frame in rows if other in frame.guesses], axis=0)
            both = tuple(sorted((case.insertion, other)))
            pairs.setdefault(both, []).append((float(np.sqrt(squares / count)), sigma))
    farthest = {both: max(ways) for both, ways in pairs.items()}
    written = {both: way for both, way in farthest.items() if way[0] < ALIKE * way[1]}
    near = {both: way for both, way in farthest.items() if ALIKE * way[1] <= way[0] < ONE_WIRE * way[1]}
    alike = {both: way for both, way in near.items() if not _stated_apart(both, found)}
    return [
        f"insertions {listed([*map(repr, names)])} are traced to within {apart:.2g} mm of another of them, where "
        f"traces are known to {known_to:.2g} mm: they {what}{COUNT_AS}{len(names)}; give their cases one "
        f"group{or_else}"
        for found_alike, what, or_else in ((written, WRITTEN, ""), (alike, RESCANNED, OR_ELSE))
        for names, apart, known_to in _together(found_alike)
    ]


def _known_to(case: Found, rows: Sequence[Scored]) -> float:
    """What the traces of these frames are known to, mm, median; of those that were given, what is stated, in bounds.

    traces_mm may be 0 or left out, of which copies were not told, or 0.5 mm, of which two insertions were told that lie
    1.4 mm apart.
    """
    known = float(np.median([frame.row.get("trace_sigma_mm") or math.nan for frame in rows] or [math.nan]))
    if any((frame.get("trace") or {}).get("given") for frame in case.result.frames):
        return float(np.clip(np.nan_to_num(known, nan=OWN_MM), OWN_MM, MOST_OWN_MM))
    return known


def _stated_apart(both: tuple[str, ...], found: Sequence[Found]) -> bool:
    """Whether two insertions are stated to be two: by groups of their own names, or by other rolls."""
    own = [[case for case in found if case.insertion == name] for name in both]
    rolls = [{frame.row.get("roll_deg") or 0.0 for c in cases for frame in c.frames.values()} for cases in own]
    grouped = [any(case.result.group != case.result.case for case in cases) for cases in own]
    return all(grouped) or _apart_deg(*rolls) > ANOTHER_ROLL_DEG


def _apart_deg(one: Set[float], other: Set[float]) -> float:
    """The most by which a roll of either is off the nearest of the other, degrees."""
    off = np.abs(np.remainder(np.subtract.outer(sorted(one), sorted(other)) + 180.0, 360.0) - 180.0)
    return float(max(off.min(axis=0).max(), off.min(axis=1).max())) if off.size else 0.0


def _together(pairs: Mapping[tuple[str, ...], tuple[float, float]]) -> list[tuple[list[str], float, float]]:
    """Insertions that pairs join, be it through others, how far those of a pair are apart at the most, and the least
    that their traces are known to. pairs : both of each, mm.
    """
    sets: DisjointSet[str] = DisjointSet()
    for one, other in pairs:
        sets.add(one)
        sets.add(other)
        sets.merge(one, other)
    found = []
    for names in sets.subsets():
        apart, known_to = zip(*(way for both, way in pairs.items() if both[0] in names), strict=True)
        found.append((sorted(names), max(apart), min(known_to)))
    return found


def _with_another(case: Found, shared: Sequence[Found], traces: Mapping[str, Traces], config: CompareConfig) -> Found:
    """The case, with the RMS distance of other insertions' nearest traces to the frame's own trace in each row.

    shared : the cases of its phantom.
    """
    kin = [(c.insertion, traces[c.result.case]) for c in shared if c.insertion != case.insertion]
    own, frames = traces[case.result.case], dict(case.frames)
    others = Others(kin, own)
    for number in frames.keys() & own:
        depth, curve = own[number]
        arc, guesses = scored(samples(depth, config.sample_mm), config.skip_mm), dict[str, tuple[float, int]]()
        for insertion, wire in others.nearest(depth, curve):
            off = point_to_curve(at_arc(wire, arc), curve)[0]
            squares, count = guesses.get(insertion, (0.0, 0))
            guesses[insertion] = squares + float(np.sum(off**2)), count + len(off)
        if guesses:
            squares, count = np.sum([*guesses.values()], axis=0)
            row = {**frames[number].row, f"null_{ANOTHER}_rms_mm": float(np.sqrt(squares / count))}
            frames[number] = frames[number]._replace(row=row, guesses=guesses)
    return replace(case, frames=frames)


def _reach_mm(traces: Traces, otherwise: float) -> float:
    """How far off in depth a trace of a case may be to be a guess. otherwise : where the case has one alone."""
    numbers = sorted(traces)
    # over the frames that were lost between two, too: they do not make its frames farther apart
    steps = np.abs(np.diff([traces[number][0] for number in numbers])) / np.diff(numbers)
    return max(NEAREST_MM, 0.5 * float(np.median(steps))) if len(steps) else otherwise


class Others:
    """The traces of other cases in one flat list, each with the number of its case and its insertion.

    own : the case's, for how far a frame is from the next where another has one alone.
    """

    def __init__(self, cases: Sequence[tuple[str, Traces]], own: Traces) -> None:
        self.traces = [(n, name, *trace) for n, (name, traces) in enumerate(cases) for trace in traces.values()]
        self.depths_mm = np.array([depth for _, _, depth, _ in self.traces])
        usual = _reach_mm(own, NEAREST_MM)
        reach_mm = [_reach_mm(traces, usual) for _, traces in cases]
        self.reach_mm = np.repeat(reach_mm, [len(traces) for _, traces in cases])

    def nearest(self, depth_mm: float, curve: Array) -> list[tuple[str, Array]]:
        """The trace of nearest depth of each other case, with its insertion, unless it begins elsewhere.

        At most MOST_OTHERS.
        """
        near: list[tuple[str, Array]] = []
        seen: set[int] = set()
        off_mm = np.abs(self.depths_mm - depth_mm)
        order = np.argsort(off_mm, kind="stable")
        for place in order[off_mm[order] <= self.reach_mm[order]]:
            owner, insertion, _, wire = self.traces[place]
            if len(near) == MOST_OTHERS:
                break
            if owner not in seen and math.dist(wire[0], curve[0]) < SAME_ENTRY_MM:
                near.append((insertion, wire))
            seen.add(owner)
        return near
