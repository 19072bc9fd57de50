"""The page of a benchmark: run time against error, the settings to use, and the outcomes of a stress study.

Reads tidy CSV files; what they hold in excess of the named columns is kept in the tables of the page.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from reports._format import number
from reports._pages import write_page
from reports.figures.benchmark import BenchFiles, convergence, orders, pareto, stress_outcomes
from reports.schema import Column
from reports.sections import draw_sections
from reports.tables import empty_table, read_table, write_table

BENCH_COLUMNS: tuple[Column, ...] = (
    Column("scene", "-", "name of the scene", "text"),
    Column("method", "-", "the solver's method, or another simulator", "text"),
    Column("segment_mm", "mm", "length of the wire's segments"),
    Column("hull", "-", "how the wire's thickness meets the wall", "text"),
    Column("tolerance", "1", "stopping tolerance", "float"),
    Column("ms_per_mm", "ms/mm", "milliseconds per millimetre inserted", "float", "low"),
    Column("tip_error_mm", "mm", "distance of the tip from the converged reference's", "float", "low"),
    Column("shape_error_mm", "mm", "root mean square distance from the converged reference", "float", "low"),
    Column("iterations", "1", "iterations per millimetre or per step, as the benchmark says", "float", "low"),
)
STRESS_COLUMNS: tuple[Column, ...] = (
    Column("axis", "-", "what is extreme in the scene", "text"),
    Column("outcome", "-", "converged, or the status", "text"),
    Column("count", "1", "number of scenes; 1 where each has its own row", "integer"),
    Column("iterations_median", "1", "iterations, or sweeps of the closed form, of a scene"),
    Column("iterations_max", "1", "the most iterations of a scene"),
    Column("worst_residual", "1", "largest moment left in a wire called converged, relative to its largest"),
    Column("worst_stretch", "1", "largest change of a segment's length, relative"),
    Column("seconds_max", "s", "processor time of the slowest scene"),
    Column("slowest", "-", "number of that scene", "integer"),
)
CLAIM_COLUMNS: tuple[Column, ...] = (
    Column("claim", "-", "what is promised", "text"),
    Column("value", "1", "what was measured, in the row's unit"),
    Column("unit", "-", "unit of the value", "text"),
    Column("aim", "-", "what it should be, empty where it is only reported", "text"),
    Column("met", "-", "whether it is", "boolean"),
)
ORDER_COLUMNS: tuple[Column, ...] = (
    Column("against", "-", "scene and error: what was made smaller, with its unit", "text"),
    Column("size", "mm", "how large it was"),
    Column("error", "-", "the error there, in the row's unit", "float", "low"),
    Column("unit", "-", "unit of the error", "text"),
    Column("order", "1", "slope of the logarithms over all its rows"),
    Column("aim", "-", "what the order should be", "text"),
)
BENCH_FIGURES = {
    "pareto": pareto,
    "convergence": convergence,
    "orders": orders,
    "stress_outcomes": stress_outcomes,
}
TARGETS_MM = (0.1, 0.01)


def render_bench(
    bench_csv: Path,
    out_dir: Path,
    stress_csv: Path | None = None,
    claims_csv: Path | None = None,
    orders_csv: Path | None = None,
    *,
    note: str = "",
    embed: bool = False,
) -> Path:
    """Draw the figures and write bench.html into ``out_dir``; returns its path.

    note : what the reader must know of machine and reference. Also writes recommended.csv: the fastest setting of
    each scene whose shape error is at most 0.1 mm and 0.01 mm.
    """
    bench = read_bench(bench_csv, stress_csv, claims_csv, orders_csv)
    best = recommended(bench.rows)
    write_table(out_dir / "recommended.csv", best)
    counts = bench.stress.groupby(["axis", "outcome"], sort=False)["count"].sum().reset_index()
    page = {
        "title": "wireval benchmark",
        "note": note,
        "sections": draw_sections("bench", BENCH_FIGURES, bench, out_dir, embed),
        "recommended": _grid(best) if len(best) else None,
        "claims": _claims(bench.claims) if len(bench.claims) else None,
        "rows": _grid(bench.rows.drop(columns="on_front")),
        "stress": _grid(_crosstab(counts)) if len(counts) else None,
        "stress_numbers": _numbers(bench.stress),
        "source": bench_csv.name,
    }
    return write_page("bench.html.j2", page, out_dir / "bench.html")


def read_bench(
    bench_csv: Path,
    stress_csv: Path | None = None,
    claims_csv: Path | None = None,
    orders_csv: Path | None = None,
) -> BenchFiles:
    """Read the rows of a benchmark, marking the Pareto front of each scene, and what else there is of it."""
    rows = _numeric(read_table(bench_csv, BENCH_COLUMNS))
    rows["on_front"] = False
    for _, mine in rows.groupby("scene", sort=False):
        rows.loc[mine.index, "on_front"] = pareto_front(
            mine["shape_error_mm"].to_numpy(), mine["ms_per_mm"].to_numpy()
        )
    stress, claims, points = (
        read_table(path, columns) if path else empty_table(columns)
        for path, columns in (
            (stress_csv, STRESS_COLUMNS),
            (claims_csv, CLAIM_COLUMNS),
            (orders_csv, ORDER_COLUMNS),
        )
    )
    stress["count"] = stress["count"].fillna(1).astype(int)
    return BenchFiles(rows, stress, claims, points)


def pareto_front(
    error: np.ndarray[Any, Any], cost: np.ndarray[Any, Any]
) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Mark the points (n,) that no other point beats in error and cost; NaN is never on the front."""
    front = np.zeros(len(error), dtype=bool)
    cheapest = np.inf
    for i in np.lexsort((cost, error)):
        if np.isfinite(error[i]) and cost[i] < cheapest:
            front[i] = True
            cheapest = cost[i]
    return front


def recommended(rows: pd.DataFrame) -> pd.DataFrame:
    """The fastest row of each scene within each target error, the row itself unchanged; none where none is.

    All shorter segments with the same other settings must be within it too: where a wire may come to rest in several
    places, a long one can be right by luck.
    """
    found, worst = [], _worst_from_here(rows)
    for target in TARGETS_MM:
        within = rows[(worst <= target) & rows["ms_per_mm"].notna()]
        if len(within):
            fastest = rows.loc[within.groupby("scene", sort=False)["ms_per_mm"].idxmin()]
            found.append(fastest.drop(columns="on_front", errors="ignore").assign(target_mm=target))
    if not found:
        return pd.DataFrame(columns=["target_mm", *rows.columns])
    table = pd.concat(found, ignore_index=True)
    return table[["target_mm", *[c for c in table.columns if c != "target_mm"]]]


def _worst_from_here(rows: pd.DataFrame) -> pd.Series[float]:
    """Largest shape error of each row and of the shorter segments with the same other settings; a failure is inf."""
    same = [c for c in ("scene", "method", "hull", "quadrature", "tolerance") if c in rows]
    error = rows["shape_error_mm"].fillna(np.inf)
    order = rows.sort_values("segment_mm").index
    worst = error[order].groupby([rows.loc[order, c] for c in same], dropna=False, sort=False).cummax()
    return worst.reindex(rows.index)


def _numeric(rows: pd.DataFrame) -> pd.DataFrame:
    """Columns beyond the named ones are numbers where every value of theirs is."""
    known = {c.name for c in BENCH_COLUMNS}
    extra = {c: pd.to_numeric(rows[c], errors="coerce") for c in rows.columns if c not in known}
    return rows.assign(**{c: v for c, v in extra.items() if v.notna().equals(rows[c].notna())})


def _crosstab(counts: pd.DataFrame) -> pd.DataFrame:
    """One row per axis, one column per outcome, and the sum."""
    table = counts.pivot_table(index="axis", columns="outcome", values="count", fill_value=0, sort=False)
    table = table.astype(int)
    table["all"] = table.sum(axis=1)
    return table.reset_index()


def _numbers(stress: pd.DataFrame) -> dict[str, Any] | None:
    """How much and how well, by outcome, over all scenes; None where the table has counts alone."""
    whole = stress[stress["axis"] == "all"].drop(columns="axis")
    return _grid(whole) if len(whole) and whole["iterations_max"].notna().any() else None


def _claims(claims: pd.DataFrame) -> dict[str, Any]:
    """The table of promises; a broken one is marked."""
    words = {True: "met", False: "NOT MET"}
    verdicts = ["" if pd.isna(met) else words[bool(met)] for met in claims["met"]]
    grid = _grid(claims.assign(met=pd.array(verdicts, dtype="string")).fillna({"aim": ""}))
    for row, verdict in zip(grid["rows"], verdicts, strict=True):
        row["bad"] = verdict == words[False]
    return grid


def _grid(table: pd.DataFrame) -> dict[str, Any]:
    meanings = {c.name: c.meaning for c in (*BENCH_COLUMNS, *STRESS_COLUMNS, *CLAIM_COLUMNS)}
    kept = [str(c) for c in table.columns if table[c].notna().any()]
    text = {c: not pd.api.types.is_numeric_dtype(table[c]) for c in kept}
    heads = [{"name": c, "meaning": meanings.get(c, ""), "text": text[c]} for c in kept]
    rows = [
        {
            "cells": [{"value": number(r[c]), "text": text[c], "link": "", "detail": ""} for c in kept],
            "bad": False,
        }
        for r in table.to_dict("records")
    ]
    return {"columns": heads, "rows": rows}
