"""A sweep: the same cases with one setting changed at a time, beside the plain result.

Segmentation and tracing do not depend on the solver's settings, so the stage store answers them: a sweep costs
simulation and comparison only. An agreement that no parameter moves is suspicious.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from typing import Any

from pipeline.compare import intervals
from pipeline.run.another import with_another
from pipeline.run.overall import Found, found_cases, overall, ratio, skill_beside
from pipeline.run.results import LOST, Result, found_results, lost
from pipeline.study.manifest import Case
from pipeline.study.settings import Resolved, Setting, SettingsError, parse_assignment, resolve
from reports import tables
from reports.atomic import remove_files
from reports.case_files import listed
from reports.origin import why_not_pooled
from reports.records import read_json, run_records
from reports.schema import SWEEP
from reports.sweep import UNCHANGED, folder_of

AGAIN = "give the command with --sweep again"


@dataclass(frozen=True)
class SweepPoint:
    """One changed setting and the settings that result."""

    parameter: str
    value: str
    settings: Resolved

    @property
    def cheap(self) -> Resolved:
        """The settings without simulated predictors and without a budget, which the plain run alone computes."""
        config = self.settings.config
        compare, budget = replace(config.compare, simulated_nulls=False), replace(config.budget, members=0)
        return replace(self.settings, config=replace(config, compare=compare, budget=budget))

    @property
    def folder(self) -> Path:
        """Its sub-folder of the output."""
        return folder_of({"parameter": self.parameter, "value": self.value})


Head = dict[str, str]
"""A point as run.json and sweep.csv name it: the setting, its value here and in the plain run (unchanged)."""


def points_of(texts: Sequence[str], base: Sequence[Setting]) -> list[SweepPoint]:
    """``table.key=v1,v2`` texts as points; raises SettingsError for an unknown setting or value."""
    points: dict[tuple[str, str], SweepPoint] = {}
    for text in texts:
        written, equals, values = text.partition("=")
        name = written.strip()
        if not equals or not values.strip():
            raise SettingsError([f"--sweep {text!r}: write table.key=value1,value2"])
        if name == "compare.simulated_nulls" or name.startswith("budget."):
            why = "points are computed without simulated predictors and without a budget"
            raise SettingsError([f"--sweep {text!r}: {why}, so that this changes no number of them; use --set"])
        for value in values.split(","):
            setting = parse_assignment(f"{name}={value}", "sweep")
            point = SweepPoint(name, value.strip(), resolve([*base, setting]))
            # 0.1 and 0.10 are one point
            points.setdefault((point.parameter, repr(attrgetter(point.parameter)(point.settings.config))), point)
    return [*points.values()]


def heads_of(plain: Resolved, cases: Sequence[Case], points: Sequence[SweepPoint]) -> list[Head]:
    """The points as run.json names them."""
    named = [{"parameter": point.parameter, "value": point.value} for point in points]
    return [head | {"unchanged": unchanged(plain, cases, head["parameter"])} for head in named]


def found_heads(out: Path) -> list[Head]:
    """The points that the runs into an output folder name; ``unchanged`` is empty where shards differ in it."""
    found: dict[tuple[str, str], Head] = {}
    for path in run_records(out):
        for head in read_json(path).get("sweep", ()):
            before = found.setdefault((head["parameter"], head["value"]), head)
            if before["unchanged"] != head["unchanged"]:
                found[head["parameter"], head["value"]] = head | {"unchanged": ""}
    return list(found.values())


def _at(out: Path, head: Head, plain: Sequence[Found]) -> list[Found]:
    """Those cases at a sweep point that the plain run has, too, of the same inputs."""
    known = {case.result.case: case.result for case in plain}
    found = [case for case in found_cases(out / folder_of(head)) if case.result.case in known]
    return [case for case in found if case.result.same_inputs(known[case.result.case])]


def lost_points(out: Path, heads: Sequence[Head]) -> list[tuple[Path, Result]]:
    """Results that a sweep has lost (crashed, killed, damaged, of other inputs), each with its point's folder."""
    if not heads:
        return []
    plain, lost_ones = found_results(out), list[tuple[Path, Result]]()
    for folder in map(folder_of, heads):
        there = {result.case: result for result in found_results(out / folder)}
        both = [(case, there[case.case]) for case in plain if case.case in there]
        lost_ones += [(folder, one) for case, found in both if (one := _amiss(out / folder, case, found))]
    return lost_ones


def _amiss(place: Path, plain: Result, found: Result) -> Result | None:
    """What is to be said of a case's result at a point; None where it is one of the same inputs."""
    if found.status in LOST:
        return found
    why = f"{place}: the case's files, or what the manifest states of it, are not those of the plain result; {AGAIN}"
    return None if found.same_inputs(plain) else lost(plain.case, "outdated", why)


def write_sweep(out: Path, heads: Sequence[Head], *, earlier: bool = False) -> str:
    """Write sweep.csv: the plain result first, then every point, each of them case by case and over all of them.

    It is removed where cases were run with different settings, or where the runs name no points: an older table belongs
    to an older result. Returns a sentence where one was removed, or earlier points are left out.

    earlier : whether one of an earlier run was removed before.
    """
    if not heads or why_not_pooled(out):
        there = earlier or (out / SWEEP.file).exists()
        remove_files(out / SWEEP.file)
        again = "its points are kept, and the command with --sweep writes it again"
        return f"{out / SWEEP.file}: removed, it belongs to an earlier run: {again}" * there
    before = with_another(out, found_cases(out))
    null = str(overall(before).get("strongest_null") or "")
    rows = list(_rows({"parameter": UNCHANGED, "value": ""}, before, before, null))
    for head in heads:
        rows += _rows(head, before, _at(out, head, before), null)
    tables.write(out / SWEEP.file, SWEEP, rows)
    others = listed(sorted({path.name for path in out.glob("sweep/*")} - {folder_of(head).name for head in heads}))
    return f"{out / SWEEP.file}: without points of an earlier run, which are kept: {others}; {AGAIN}" * bool(others)


def unchanged(plain: Resolved, cases: Sequence[Case], parameter: str) -> str:
    """A setting's value in the plain run as text; for a friction that is not set, the manifest's if all cases agree."""
    table, _, key = parameter.partition(".")
    value = getattr(getattr(plain.config, table), key)
    if value is None and parameter == "simulate.friction":
        values = {case.wall.friction for case in cases}
        value = values.pop() if len(values) == 1 else None
    return "" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def _rows(head: Head, before: Sequence[Found], after: Sequence[Found], null: str) -> Iterator[dict[str, Any]]:
    """A row for each case of ``after``, and one over all where there are several, and every case of ``before``.

    Over two of six cases it stood beside a plain row over all of them, as if the setting had made the difference.
    """
    for case in after:
        yield _row(head, case.result.summary, before, [case], null)
    if 1 < len(after) == len(before) and (whole := overall(after)):
        yield _row(head, whole, before, after, null)


def _row(
    head: Head, summary: dict[str, Any], before: Sequence[Found], after: Sequence[Found], null: str
) -> dict[str, Any]:
    """A row of sweep.csv; the plain result has no ratio.

    null : the predictor that skill is measured against in all rows, the strongest one of the plain run.
    """
    row = {name: summary.get(name) for name in SWEEP.names} | head | {"case": summary["case"]}
    found = None if head["parameter"] == UNCHANGED else ratio(before, after)
    if found is not None:
        row |= {"rms_ratio": found.value, "rms_ratio_low": found.low, "rms_ratio_high": found.high}
    return intervals.fields(row | skill_beside(before, after, null))[0]
