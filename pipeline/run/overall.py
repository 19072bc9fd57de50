"""The whole run as one row: frames that count, read back from the folders of all validation cases, and pooled.

Two runs are compared by the ratio of their errors on the frames that count in both, insertion by insertion.
"""

from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.cluster.hierarchy import DisjointSet

from pipeline.compare import intervals
from pipeline.compare.pooled import Scored, by_insertion, is_pooled, numbers, pooled, skill, squares_of, within
from pipeline.model import Array
from pipeline.run import ledger
from pipeline.run.ratio import Ratio
from pipeline.run.results import Result, found_results, lost, untold
from pipeline.run.stages.known import UP_TO_TRACE
from reports import tables
from reports.case_files import find_cases
from reports.schema import ALL, ERRORS, POINTS


@dataclass(frozen=True, eq=False)
class Found:
    """A case found on disk: its frames that count, by their numbers, and the depths of all whose trace is trusted.

    insertion : that it belongs to, as ``insertions_of`` names it.
    """

    result: Result
    frames: Mapping[int, Scored]
    traced_mm: Mapping[int, float] = field(default_factory=dict)
    insertion: str = ""


def found_cases(out: Path) -> list[Found]:
    """Every case below an output folder; one whose tables cannot be read counts as damaged and hides no other."""
    results = found_results(out)
    insertions = insertions_of(results)
    return [_found(out, result, insertions[result.case]) for result in results]


def frames_in(found: Sequence[Found]) -> set[tuple[str, int]]:
    """The frames of validation cases that count, by case and number."""
    return {(case.result.case, number) for case in validation(found) for number in case.frames}


def on_frames(found: Sequence[Found], frames: Set[tuple[str, int]]) -> list[Found]:
    """The cases with these frames alone, of those that count."""
    return [
        replace(c, frames={n: frame for n, frame in c.frames.items() if (c.result.case, n) in frames}) for c in found
    ]


def golden_cases(out: Path) -> list[Found]:
    """Every case of a baseline folder, which keeps errors.csv and points.csv.gz alone and no result.

    Where none has points frames alone can be held against; where some have, one without is damaged.
    """
    folders = [f for f in find_cases(out) if not (f / ledger.RESULT).exists()]
    if not any((folder / POINTS.file).exists() for folder in folders):
        return []
    return [_found(out, untold(folder.name), folder.name) for folder in folders]


def insertions_of(results: Iterable[Result]) -> dict[str, str]:
    """The insertion of each case: its group, else itself; cases that share a scan are one, whatever they state."""
    return _joined([(result.case, result.group or result.case, result.scans) for result in results])


def phantoms_of(results: Iterable[Result]) -> dict[str, str]:
    """The phantom of each case that has one, called after a case: the same file, voxels or stated name."""
    return _joined([(result.case, result.case, result.vessel) for result in results if result.vessel])


def _joined(cases: Sequence[tuple[str, str, Iterable[str]]]) -> dict[str, str]:
    """A label for each case, one for all that have something in common, be it through others.

    cases : each with a label of its own and what it may have in common with others.
    """
    sets: DisjointSet[tuple[str, bool]] = DisjointSet()
    for _, own, tokens in cases:
        sets.add((own, True))
        for token in tokens:
            sets.add((token, False))
            sets.merge((own, True), (token, False))
    label: dict[tuple[str, bool], str] = {}
    return {case: label.setdefault(sets[own, True], own) for case, own, _ in cases}


def shared_scans(results: Sequence[Result]) -> list[str]:
    """Sentences on cases that state different insertions but have scans or curves in common."""
    insertions, stated = insertions_of(results), dict[str, dict[str, str]]()
    for result in results:
        stated.setdefault(insertions[result.case], {})[result.case] = result.group or result.case
    return [
        f"cases {', '.join(groups)} have scans or curves in common and count as one insertion; what they share is "
        "pooled as often as it is listed"
        for groups in stated.values()
        if len(set(groups.values())) > 1
    ]


def strangers(scored: Sequence[Result]) -> list[str]:
    """That no insertion is known to be into the phantom of another, where there are several; else nothing."""
    insertions, phantoms = insertions_of(scored), phantoms_of(scored)
    pairs = {(phantom, insertions[case]) for case, phantom in phantoms.items()}
    if len(set(insertions.values())) < 2 or len({phantom for phantom, _ in pairs}) < len(pairs):
        return []
    return [
        "no two insertions have one lumen, or a reference of the same voxels, so that none is a guess for another; "
        'name the phantom in the cases into the same one, as phantom = "A"'
    ]


def damaged(found: Sequence[Found]) -> dict[str, str]:
    """The damaged cases, each with the message that says which file is wrong and why."""
    return {c.result.case: str(c.result.failures[0]["message"]) for c in found if c.result.status == "damaged"}


def _found(out: Path, result: Result, insertion: str) -> Found:
    if result.status == "damaged":  # its message says why; altered tables are not read
        return Found(result, {})
    folder = out / "cases" / result.case
    try:
        return Found(result, *_scored(folder, result, insertion), insertion)
    except ValueError as error:
        return Found(lost(result.case, "damaged", str(error), result), {})


def _scored(folder: Path, result: Result, insertion: str) -> tuple[dict[int, Scored], dict[int, float]]:
    """The frames that count, and the depths of those whose trace is trusted."""
    if not (folder / ERRORS.file).exists():
        if (folder / POINTS.file).exists():
            raise ValueError(f"{folder / ERRORS.file}: no such file, though {POINTS.file} is there; copy it again")
        return {}, {}
    points, errors = tables.read_if_there(folder / POINTS.file, POINTS), tables.read(folder / ERRORS.file, ERRORS)
    frame, error, arc = (points[name].to_numpy(dtype=float) for name in ("frame", "error_mm", "arc_mm"))
    if errors["frame"].isna().any() or not {*np.unique(frame)} <= {*errors["frame"]}:
        raise ValueError(f"{folder / ERRORS.file}: not every frame that {POINTS.file} has points of; copy it again")
    bare = errors.loc[errors["rms_mm"].notna() & ~errors["frame"].isin(frame[np.isfinite(error)]), "frame"]
    if len(bare):
        raise ValueError(
            f"{folder / POINTS.file}: no points of frame {bare.iloc[0]}, which has an error; copy it again"
        )
    own = {number: frame == number for number in errors["frame"]}
    # field by field: pandas takes ten times as long for the few rows of a case
    rows = [{str(k): None if v is pd.NA or v != v else v for k, v in row.items()} for row in errors.to_dict("records")]
    mine = [own[row["frame"]] for row in rows]
    scored = [Scored(row, error[m], arc[m], insertion, case=result.case) for row, m in zip(rows, mine, strict=True)]
    pooled = {int(one.row["frame"]): one for one in scored if is_pooled(one.row, one.error_mm)}
    trusted = {frame.get("frame") for frame in result.frames if frame.get("stage") not in UP_TO_TRACE}
    known = errors[errors["frame"].isin(trusted) & errors["insertion_mm"].notna()]
    return pooled, dict(zip(known["frame"].astype(int), known["insertion_mm"].astype(float), strict=True))


def validation(found: Sequence[Found]) -> list[Found]:
    """The cases that numbers over the whole run are made of.

    A calibration case says nothing about the model, and one without scans has nothing to be compared with.
    """
    return [case for case in found if case.result.role != "calibration" and case.result.status != "simulated"]


def frames_of(found: Sequence[Found]) -> list[Scored]:
    """The frames that count, of all these cases."""
    return [frame for case in found for frame in case.frames.values()]


COUNTED = ("frames", "frames_ok", "frames_failed", "frames_fitted", "warnings")


def overall(
    found: Sequence[Found], missing: Sequence[Result] = (), common: Set[tuple[str, int]] | None = None
) -> dict[str, Any]:
    """The row of all validation cases, with the columns of summary.csv; empty where no frame counts.

    missing : cases without a result, whose frames were planned all the same.     common : frames, by case and number,
    that skill_strongest is over; None is all.
    """
    used = validation(found)
    frames = frames_of(used)
    if not frames:
        return {}
    rows = [case.result.summary for case in used] + [result.summary for result in missing]
    counts = {name: sum(row.get(name) or 0 for row in rows) for name in COUNTED}
    good = all(case.result.ok for case in used) and not any(result.frame_count for result in missing)
    head = {"case": ALL, "role": "validation", "status": "ok" if good else "frames_failed", **counts}
    share = within([frame.row for frame in frames], counts["frames"])
    judged = frames if common is None else frames_of(on_frames(used, common))
    return head | pooled(frames, judged) | {"within_1mm": share, "cases": len(used)}


SAME_DEPTH_MM = 2.0
"""How far apart two runs may have one frame: a depth may be stated in one and traced in the other, but frames of other
numbers are other scans."""


def pairs(before: Sequence[Found], after: Sequence[Found]) -> list[tuple[Scored, Scored]]:
    """The frames that count in both runs, of validation cases; a number that has another depth is another frame."""
    old = {case.result.case: case.frames for case in validation(before)}
    both = [
        (old[case.result.case][number], frame)
        for case in validation(after)
        for number, frame in case.frames.items()
        if number in old.get(case.result.case, {})
    ]
    apart = np.abs(np.subtract(*(numbers([pair[k] for pair in both], "insertion_mm") for k in (0, 1))))
    return [pair for pair, mm in zip(both, apart, strict=True) if not mm > SAME_DEPTH_MM]


def ratio(before: Sequence[Found], after: Sequence[Found]) -> Ratio | None:
    """Pooled rms of ``after`` over that of ``before``, on the frames that count in both; None where there are none."""
    both = pairs(before, after)
    if not both:
        return None
    first, second = [a for a, _ in both], [b for _, b in both]
    ways = [squares_of(frames) / [len(f.error_mm) for f in frames] for frames in (first, second)]
    back = [numbers(frames, "back_rms_mm") ** 2 for frames in (first, second)]
    note = intervals.note(len({frame.insertion for frame in second}))
    return Ratio(*_of_squares(second, *ways), len(both), note, _of_squares(second, *back))


def _of_squares(frames: Sequence[Scored], before: Array, after: Array) -> tuple[float, float, float]:
    """Root of the ratio of two runs' mean squares (frames,), with its interval; NaN where a frame lacks one."""
    if not np.isfinite(before + after).all():
        return (float("nan"),) * 3
    # wires of other lengths have other numbers of points: both runs' mean squares are weighted by those of ``after``
    points = np.array([float(len(frame.error_mm)) for frame in frames])
    return intervals.root_ratio(*by_insertion(frames, after * points, before * points, points))


def skill_beside(before: Sequence[Found], after: Sequence[Found], null: str) -> dict[str, float]:
    """Skill of ``after``, with its interval, against a predictor's errors in ``before``, the same for all points.

    Empty without a predictor, or without a frame that counts in both.
    """
    both = pairs(before, after) if null else []
    if not both:
        return {}
    second = [frame._replace(guesses=first.guesses) for first, frame in both]
    points = np.array([float(len(frame.error_mm)) for frame in second])
    nulls = points * numbers([frame for frame, _ in both], f"null_{null}_rms_mm") ** 2
    return skill(second, squares_of(second), nulls, null)
