"""Sensitivity: the same cases with one setting changed at a time, beside the plain result.

Segmentation and tracing do not depend on the solver's settings, so the stage store answers them: a sweep costs
simulation and comparison only. An agreement that no parameter moves is suspicious.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pipeline.run.case import Job
from pipeline.run.results import Result, found_results
from pipeline.study.settings import Resolved, Setting, SettingsError, parse_assignment, resolve
from reports import tables
from reports.schema import SWEEP


@dataclass(frozen=True)
class Point:
    """One changed setting and the settings that result."""

    parameter: str
    value: str
    settings: Resolved

    @property
    def folder(self) -> str:
        """Name of its sub-folder."""
        return f"{self.parameter}={self.value}".replace("/", "_")


def points_of(texts: Sequence[str], base: Sequence[Setting]) -> list[Point]:
    """``table.key=v1,v2`` texts as points; raises SettingsError for an unknown setting or value."""
    points = []
    for text in texts:
        name, equals, values = text.partition("=")
        if not equals or not values.strip():
            raise SettingsError([f"--sweep {text!r}: write table.key=value1,value2"])
        for value in values.split(","):
            setting = parse_assignment(f"{name}={value}", "sweep")
            points.append(Point(name.strip(), value.strip(), resolve([*base, setting])))
    return points


def jobs_of(point: Point, jobs: Sequence[Job]) -> list[Job]:
    """The same cases at one point, in a folder of its own, without pictures."""
    out = jobs[0].out / "sweep" / point.folder
    return [replace(job, settings=point.settings, out=out, pictures=False, quiet=True) for job in jobs]


def write_sweep(out: Path, points: Sequence[Point]) -> None:
    """sweep.csv: the plain result first, then every point."""
    rows = [_row("(plain)", "", result) for result in found_results(out)]
    for point in points:
        rows += [_row(point.parameter, point.value, r) for r in found_results(out / "sweep" / point.folder)]
    tables.write(out / "sweep.csv", SWEEP, rows)


def _row(parameter: str, value: str, result: Result) -> dict[str, Any]:
    own = {"parameter": parameter, "value": value, "case": result.case}
    return {name: result.summary.get(name) for name in SWEEP.names} | own
