"""What a run left in its folder, as pandas frames."""

import html
import math
import warnings
from collections.abc import Mapping, Sequence, Sized
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pandas as pd

from pipeline.run.provenance import working_directory
from pipeline.run.results import Result, found_results
from pipeline.status import InputError, did_you_mean
from reports import tables
from reports.case_files import CaseFiles, amiss, counted, find_cases, listed, not_run, read_case
from reports.gates import gates_in
from reports.origin import why_not_pooled
from reports.schema import ERRORS, FAILURES, OVERALL_FILE, POINTS, SIMULATORS, SUMMARY, SWEEP, WHERE, Table
from reports.simulators import folders_in
from solver import VesselWall

from ._arguments import require

_SHOWN = ["case", "status", "frames", "frames_ok", "rms_mm", "tip_median_mm", "skill_strongest", "strongest_null"]


class Cases(dict[str, CaseFiles]):
    """The folders of cases by id."""

    def __missing__(self, name: object) -> NoReturn:
        """KeyError that names what there is."""
        raise KeyError(f"no case {name!r}; {did_you_mean(str(name), self) if self else 'there is none'}")


@dataclass(frozen=True, eq=False, repr=False)
class Results:
    """What a run wrote, as pandas frames. Their columns are explained in docs/reference/columns.md.

    summary : one row per case.     overall : one row over all validation cases, with intervals.     errors : one row
    per frame of every case.     failures : what has no result, and why.     sweep : one row per value of a sweep.
    simulators, where : after a score: how good each simulator is, and which one is the nearest in which place.
    cases : the folder of each case by its id: ``results.cases["run1"].read_frame(3).simulated_mm``.
    closed : a sentence for each condition of ``fail_if`` that holds, after a score for every simulator.
    damaged : cases whose files have changed since they were written; they are left out of errors and points.
    other_tables : a sentence where summary.csv does not belong to the cases beside it, else empty.
    """

    out: Path
    summary: pd.DataFrame
    overall: pd.DataFrame
    errors: pd.DataFrame
    failures: pd.DataFrame
    sweep: pd.DataFrame
    simulators: pd.DataFrame
    where: pd.DataFrame
    cases: Cases
    closed: tuple[str, ...] = ()
    damaged: tuple[str, ...] = ()
    other_tables: str = ""

    @property
    def ok(self) -> bool:
        """Whether every case has a whole result, all frames of it ok, of the same settings, and no gate is closed.

        With ``until`` a frame is ok where nothing failed so far, compared or not.
        """
        if (
            self.closed
            or self.damaged
            or self.other_tables
            or not len(self.summary)
            or len(self.failures)
            or not_run(self.out)
            or why_not_pooled(self.out)
        ):
            return False
        return not any(amiss(case.folder) for case in self.cases.values())

    @property
    def points(self) -> pd.DataFrame:
        """Every compared point of all cases; read when asked for, since it is by far the largest table.

        Also those of frames that count in no score: ``points[points["status"] == "ok"]`` are pooled.
        """
        return _of_all({n: case.points for n, case in self.cases.items() if n not in self.damaged}, POINTS)

    def __repr__(self) -> str:
        """What a prompt shows: where it lies, the counts, a row a case, no more than ten."""
        rows = self.summary[_SHOWN].head(10).to_string(index=False) if len(self.summary) else "no summary.csv"
        more = f"\n... and {len(self.summary) - 10} more cases" if len(self.summary) > 10 else ""
        held: dict[str, Sized] = {"case": self.cases, "frame": self.errors, "failure": self.failures}
        counts = ", ".join(counted(len(of), name) for name, of in held.items())
        # as a user types it: the whole path of a notebook is of one machine
        here = working_directory()
        where = self.out.relative_to(here) if self.out.is_relative_to(here) else self.out
        return "\n".join([f"Results of {where}: {counts}", f"{rows}{more}", *self._amiss()])

    def _repr_html_(self) -> str:
        """What a notebook shows: a row a case, and below it what closed."""
        below = "".join(f"<p>{html.escape(text)}</p>" for text in self._amiss())
        return str(self.summary[_SHOWN].to_html(index=False)) + below

    def _amiss(self) -> list[str]:
        """Closed gates and damaged cases, a line each: the rows of a table do not show them."""
        damaged = f"damaged, left out: {listed(self.damaged)}"
        return [*self.closed, *[damaged] * bool(self.damaged), *filter(None, [self.other_tables])]


def read_results(out: str | Path) -> Results:
    """Read the folder that ``wireval run`` wrote; raises InputError where it is none.

    Warns of cases whose files have changed since they were written, and of tables that belong to other cases.
    """
    out = Path(require(out=out)["out"])
    if not out.is_dir():
        raise InputError([f"{out}: no such folder; give one that `wireval run` wrote"])
    try:
        cases = {folder.name: read_case(folder, points=False) for folder in find_cases(out)}
        closed = _closed(out)
    except ValueError as error:
        raise InputError([str(error)]) from None
    if not cases:
        raise InputError([f"{out}: no cases below it; give a folder that `wireval run` wrote"])
    results = found_results(out)
    damaged = {one.case: one.failures[0]["message"] for one in results if one.status == "damaged"}
    for message in damaged.values():
        warnings.warn(f"{message}; its errors are left out", stacklevel=2)
    found = _results(out, cases, closed, tuple(damaged))
    if others := _tables_of_others(found, [one for one in results if one.status != "damaged"]):
        warnings.warn(f"{others}; `wireval report {out}` writes them anew", stacklevel=2)
    return replace(found, other_tables=others)


def _closed(out: Path) -> tuple[str, ...]:
    """A sentence for each closed gate of a run; of a score, of every simulator that was asked."""
    of = {f"{name}: ": folder for name, folder in folders_in(out).items()} or {"": out}
    return tuple(f"{whose}{why}" for whose, folder in of.items() for why in gates_in(folder, out)["closed"])


def _tables_of_others(found: Results, results: Sequence[Result]) -> str:
    """That tables over all cases are not of these cases, as those of one shard of several; empty where they are."""
    rows = {str(row["case"]): row for row in found.summary.to_dict("records")}
    known = {one.case: one.summary for one in results}
    apart = sorted(
        name
        for name in (rows.keys() | known.keys()) - set(found.damaged)
        if name not in rows or name not in known or not _alike(rows[name], known[name])
    )
    if not rows or not apart:
        return ""
    return f"{found.out}: summary.csv and overall.csv are not of the cases beside them ({listed(apart)})"


def _alike(row: Mapping[Any, Any], other: Mapping[str, Any]) -> bool:
    """Whether the numbers that both rows of a summary have are the same, as far as a table has them; none is none."""
    names = [column.name for column in SUMMARY if column.kind != "text" and column.name in other]
    one, two = (
        pd.array([of.get(name) for name in names], dtype="Float64").to_numpy(float, na_value=math.nan)
        for of in (row, other)
    )
    return bool(np.allclose(one, two, rtol=1e-6, atol=0.0, equal_nan=True))


def wall_of(case: CaseFiles) -> VesselWall:
    """The wall that a case was simulated in, for the solver alone; raises InputError where the case left no lumen.

    Made from the surface in ``view/lumen.vtp``, with the stiffness and friction of the run. Wires replayed in
    it lie within a tenth of a voxel of the run's own, rms: 0.04 mm in voxels of 0.5 mm. As a ``lumen``,
    ``view/lumen.seg.nrrd`` is about as good: 0.01 to 0.05 mm in four studies, 0.11 mm at most.
    """
    from pipeline.load.lumens import read_lumen
    from pipeline.segment.config import SegmentConfig
    from pipeline.segment.given import given_lumen

    require(case=case)
    config, surface = SegmentConfig(), case.folder / "view" / "lumen.vtp"
    if not surface.is_file():
        raise InputError([f"{surface}: no such file; the case left no lumen, or view/ was not kept: run it again"])
    lumen = given_lumen(read_lumen(surface, config.least_voxels), config)
    stated, given = case.result["wall"], case.result["config"]["simulate"]
    friction = given["friction"]["value"]
    return VesselWall(
        lumen.distance,
        stated["stiffness_N_mm2"] * given["wall_scale"]["value"],
        stated["friction"] if friction is None else friction,
    )


def read_run(out: Path) -> Results:
    """The results that a run has just written; empty tables where it was a shard without any case."""
    return read_results(out) if find_cases(out) else _results(out, {}, _closed(out))


def _results(out: Path, cases: dict[str, CaseFiles], closed: tuple[str, ...], damaged: tuple[str, ...] = ()) -> Results:
    def table(kind: Table, name: str = "") -> pd.DataFrame:
        return tables.read_if_there(out / (name or kind.file), kind)

    if cases and not (out / SUMMARY.file).exists():
        again = f"run its command again, or `wireval report {out}`"
        warnings.warn(f"{out}: the run into it has not ended, tables over all cases are empty; {again}", stacklevel=3)
    whole = table(SUMMARY, OVERALL_FILE)
    errors = _of_all({name: case.errors for name, case in cases.items() if name not in damaged}, ERRORS)
    beside = table(FAILURES), table(SWEEP), table(SIMULATORS), table(WHERE)
    return Results(out.absolute(), table(SUMMARY), whole, errors, *beside, Cases(cases), closed, damaged)


def _of_all(by_case: dict[str, pd.DataFrame], kind: Table) -> pd.DataFrame:
    """The tables of the cases, all of one kind, below each other, with the case in front."""
    if not by_case:
        none = tables.read_if_there(None, kind)
        none.insert(0, "case", pd.Series(dtype="string"))
        return none
    whole = pd.concat(by_case, names=["case", None]).reset_index("case").reset_index(drop=True)
    return whole.astype({"case": "string"})
