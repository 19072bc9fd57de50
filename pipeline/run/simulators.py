"""Several simulators of one study side by side: pooled errors, ratios of all pairs, and which one is nearer where.

Each has an output folder of its own, like any run. Ratios are over the frames that count in both; skill, and errors
along the wire and over depth, over those that count in all. Failed frames are reported, too, and shares are of the
planned frames: a simulator gains nothing by failing in the hard ones.
"""

from collections.abc import Iterator, Mapping, Sequence, Set
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pipeline.compare import intervals
from pipeline.model import Array
from pipeline.run.another import with_another
from pipeline.run.overall import Found, found_cases, frames_in, overall, ratio, validation
from pipeline.run.results import found_results
from reports import tables
from reports.case_files import listed
from reports.doubts import copied_from_traces, warnings_in
from reports.nearer import SAME, beside, nearer
from reports.origin import why_not_pooled
from reports.run_page import render_index
from reports.schema import FAILURES, OURS, POINTS, SIMULATORS, WHERE
from reports.simulators import in_common, render_simulators
from reports.tips import tips_off
from reports.verdict import COPIED, TIPS_OFF

STEPS_MM = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
MOST_BINS = 12
RATIOS = ("rms_ratio", "rms_ratio_low", "rms_ratio_high", "back_ratio", "back_ratio_low", "back_ratio_high")
FEW = 0.5
"""Share of the frames of the simulator that has most below which one's few frames are not asked of all."""
Studies = Mapping[str, Sequence[Found]]
Frames = Set[tuple[str, int]]
Off = Mapping[str, str]
"""Why simulators are never the nearest."""


SAME_END_MM = 0.25
"""Wires whose ends are no farther apart reach equally far: half a step of the points that errors are taken at."""


class Piece(NamedTuple):
    """A frame's points in one bin: insertion, sum of squares in mm^2, number of points."""

    insertion: str
    squares: float
    points: int


def write_comparison(out: Path, folders: Mapping[str, Path]) -> list[str]:
    """Write simulators.csv and where.csv from the output folders by simulator; returns sentences for the terminal."""
    studies = {name: with_another(folder, found_cases(folder)) for name, folder in folders.items()}
    mixed = why_not_pooled(*folders.values())
    pairs = [(one, other) for one in studies for other in studies if one != other and not mixed]
    alike = _alike(studies)
    common = _common(studies)
    judged = {name: found for name, found in studies.items() if common <= frames_in(found)}
    rows = [_alone(name, found, common, name in judged) for name, found in studies.items()]
    copied = {name for name, folder in folders.items() if copied_from_traces(warnings_in(folder))}
    off = {row["simulator"]: TIPS_OFF for row in rows if tips_off(row)} | dict.fromkeys(copied, COPIED)
    sentences = [mixed] * bool(mixed)
    for one, other in pairs:
        both = ratio(studies[other], studies[one])
        if both is not None:
            caveat = _caveat({name for name in (one, other) if off.get(name) == TIPS_OFF})
            same = {one, other} in alike
            caveat += [SAME] * same
            found = zip(RATIOS, (both.value, both.low, both.high, *both.back), strict=True)
            values = {name: value for name, value in found if name in RATIOS[:3] or np.isfinite(both.back[0])}
            row, told = intervals.fields(values, "; ".join([both.note, *caveat]))
            rows.append({"simulator": one, "against": other, "common_frames": both.frames, "interval": told, **row})
            if other == OURS:
                said = both.sentence.replace("the second run / the first", f"{one} / {OURS}")
                sentences.append(beside(rows[-1]) if same else "; ".join([said, *caveat]))
    sentences += nearer([row for row in rows if OURS not in (row["simulator"], row.get("against"))], off)
    tables.write(out / SIMULATORS.file, SIMULATORS, rows)
    tables.write(out / WHERE.file, WHERE, [] if mixed else list(_where(folders, judged, common, off)))
    none = [row["simulator"] for row in rows if row.get("frames_ok") == 0]
    if none and common and not mixed:
        sentences.append(f"who is nearest where is left out: no frame counts for {listed(none)}")
    return sentences


def _alike(studies: Studies) -> list[set[str]]:
    """The pairs of simulators whose errors are the same at every point of all frames, of which there are some."""
    errors = {
        name: {(case.result.case, n): frame.error_mm for case in validation(found) for n, frame in case.frames.items()}
        for name, found in studies.items()
    }
    pairs = [pair for pair in combinations(errors, 2) if errors[pair[0]] and _same(*map(errors.__getitem__, pair))]
    return [set(pair) for pair in pairs]


def _same(mine: Mapping[Any, Array], theirs: Mapping[Any, Array]) -> bool:
    return mine.keys() == theirs.keys() and all(np.array_equal(mine[n], theirs[n]) for n in mine)


def _caveat(off: Set[str]) -> list[str]:
    """Why a ratio of errors says nothing: wires that end elsewhere, which these do not show."""
    told = f"{TIPS_OFF} of {listed(sorted(off))}, which errors from the simulated to the traced wire do not show"
    return [told] * bool(off)


def write_failures(out: Path, folders: Mapping[str, Path]) -> None:
    """Write failures.csv into ``out`` and ``out``/simulators: the failures of every simulator, with its name."""
    rows = [
        {key: row[key] for key in row.keys() & FAILURES.names}
        | {"simulator": name, "log": (folder / row.get("log", "")).relative_to(out).as_posix()}
        for name, folder in folders.items()
        for result in found_results(folder)
        for row in result.failures
    ]
    for place in (out, out / "simulators"):
        tables.write(place / FAILURES.file, FAILURES, rows)


def side_by_side(out: Path, folders: Mapping[str, Path], embed: bool) -> list[str]:
    """Write everything that compares simulators, from the results in their folders; returns sentences for the terminal.

    folders : by simulator, the first one ``out`` itself.
    """
    write_failures(out, folders)
    said = write_comparison(out, folders)
    few = in_common(tables.read(out / SIMULATORS.file, SIMULATORS))
    render_index(out, embed)  # its failures are those of all
    return [*said, *[few] * bool(few), f"score of {', '.join(folders)}.  side by side: {render_simulators(out, embed)}"]


def _common(studies: Studies) -> Frames:
    """The frames, by case and number, that count for every simulator with at least FEW times the most frames."""
    kept = [frames_in(found) for found in studies.values()]
    most = max(map(len, kept), default=0)
    return set.intersection(*(one for one in kept if len(one) >= FEW * most)) if most else set()


def _alone(name: str, found: Sequence[Found], common: Frames, judged: bool) -> dict[str, Any]:
    """A simulator's numbers as in its own overall.csv; where no frame counts, its planned frames with none ok.

    Skill is over ``common`` frames: who lacks some would be held against another predictor, or on easier ones; who
    lacks most is not judged.
    """
    used = validation(found)
    planned = {"frames": sum(case.result.frame_count for case in used), "frames_ok": 0, "within_1mm": 0.0}
    row = planned | overall(found, common=common if judged else frozenset()) | {"common_frames": len(common)}
    return {key: value for key, value in row.items() if key in SIMULATORS.names} | {"simulator": name}


def _where(folders: Mapping[str, Path], judged: Studies, common: Frames, off: Off) -> Iterator[dict[str, Any]]:
    """For each bin of the distance from the earliest tip and of the depth, every simulator's error and who is nearest.

    off : simulators whose tips lie off, or that were made from the traces: distances to the traced wire do not show
    that, so these are never the nearest, and where they have no part others are compared all the same.     judged :
    those that have all ``common`` frames.
    """
    compared = [name for name in judged if name not in off] or list(judged)
    points = _as_far({name: dict(_points(folders[name], found, common)) for name, found in judged.items()}, compared)
    for along, place in (("distance from the earliest tip", 1), ("insertion depth", 2)):
        values = [np.max(part[place]) for parts in points.values() for part in parts]
        if not values:
            return
        step = next((s for s in STEPS_MM if max(values) / s <= MOST_BINS), STEPS_MM[-1])
        for number in range(int(max(values) / step) + 1):
            low, high = number * step, (number + 1) * step
            found = {name: _pieces(parts, place, low, high) for name, parts in points.items()}
            if all(found[name] for name in compared):
                here = {name: pieces for name, pieces in found.items() if pieces}
                head = {"along": along, "low_mm": low, "high_mm": high}
                for row in _rows(head, here, off):
                    yield row | {"middle_mm": _middle(points[row["simulator"]], place, low, high)}


Part = tuple[str, Array, Array, Array]
"""One frame: its insertion, distances from the earliest tip (n,), its depth n times (n,), errors (n,); mm."""
Key = tuple[str, int]


def _as_far(points: Mapping[str, Mapping[Key, Part]], compared: Sequence[str]) -> dict[str, list[Part]]:
    """Each simulator's frames as far as all ``compared`` reach, counted back from there; ``points`` have arc lengths.

    Counted from its own tip, a wire that ends 2 mm early, before the error grows, had the lead at the tip. A frame in
    which one of these has no point so far in is left out.
    """
    kept: dict[str, list[Part]] = {name: [] for name in points}
    for key in next(iter(points.values()), {}):
        end = min(float(points[name][key][1].max()) for name in compared)
        parts = {name: _up_to(end, of[key]) for name, of in points.items()}
        if all(len(parts[name][1]) for name in compared):
            for name, part in parts.items():
                kept[name] += [part] * bool(len(part[1]))
    return kept


def _up_to(end_mm: float, part: Part) -> Part:
    """The points of a frame up to an arc length, from which they are counted back."""
    insertion, arc, depth, error = part
    use = arc <= end_mm + SAME_END_MM
    return insertion, np.maximum(end_mm - arc[use], 0.0), depth[use], error[use]


def _points(folder: Path, found: Sequence[Found], common: Frames) -> Iterator[tuple[Key, Part]]:
    """The common frames, with arc lengths in the place of distances from the tip."""
    for case in validation(found):
        if not any((case.result.case, number) in common for number in case.frames):
            continue
        table = tables.read(folder / "cases" / case.result.case / POINTS.file, POINTS)
        frames, arc = table["frame"].to_numpy(dtype=int), table["arc_mm"].to_numpy(dtype=float)
        for number, frame in case.frames.items():
            if (case.result.case, number) in common:
                mine = arc[frames == number]
                depth = np.full(len(mine), float(frame.row["insertion_mm"]))
                yield (case.result.case, number), (frame.insertion, mine, depth, frame.error_mm)


def _middle(parts: Sequence[Part], place: int, low: float, high: float) -> float:
    """Where a bin's frames lie in it, each by its points' mean: depths of 25 and 35 mm are not at 22.5 and 32.5."""
    found: list[Any] = [part[place] for part in parts]
    inside = [at[(at >= low) & (at < high)] for at in found]
    return float(np.mean([np.mean(at) for at in inside if len(at)]))


def _pieces(parts: Sequence[Part], place: int, low: float, high: float) -> list[Piece]:
    pieces = []
    for part in parts:
        at: Any = part[place]
        errors = part[3][(at >= low) & (at < high)]
        if len(errors):
            pieces.append(Piece(part[0], float(np.sum(errors**2)), len(errors)))
    return pieces


def _rows(head: dict[str, Any], found: Mapping[str, Sequence[Piece]], off: Off) -> Iterator[dict[str, Any]]:
    """A row for each simulator in a bin; the nearest one that is not ``off`` also gets its lead and how sure it is."""
    mean = {name: sum(p.squares for p in pieces) / sum(p.points for p in pieces) for name, pieces in found.items()}
    # of those that are the same but for rounding the first that was given, run after run
    order = sorted((name for name in mean if name not in off), key=lambda name: float(f"{mean[name]:.6g}"))
    for name in found:
        row = head | {"simulator": name, "rms_mm": float(np.sqrt(mean[name])), "frames": len(found[name])}
        row |= {"lead": off[name]} if name in off else {}
        if len(order) > 1 and name == order[0]:
            row |= _lead(found[order[0]], found[order[1]])
        yield row


def _lead(first: Sequence[Piece], second: Sequence[Piece]) -> dict[str, Any]:
    """Error of the nearest over that of the next, with its interval over the insertions that both have there."""
    names = [n for n in dict.fromkeys(p.insertion for p in first) if any(p.insertion == n for p in second)]
    sums = [[[p for p in pieces if p.insertion == n] for n in names] for pieces in (first, second)]
    points = np.array([float(sum(p.points for p in mine)) for mine in sums[0]])
    nearest, following = (
        np.array([sum(p.squares for p in mine) / sum(p.points for p in mine) for mine in of]) * points for of in sums
    )
    value, low, high = intervals.root_ratio(nearest, following, points)
    if abs(value - 1.0) < 1e-6:
        verdict = "tie"
    else:
        verdict = "clear" if high < 1.0 else intervals.note(len(names)) if np.isnan(high) else "not clear"
    found = {"ratio_to_next": value, "ratio_to_next_low": low, "ratio_to_next_high": high}
    row, told = intervals.fields(found, verdict)
    return row | {"lead": told}
