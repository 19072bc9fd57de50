"""The page of a benchmark: run time against error, the settings to use, and the outcomes of a stress study.

Reads tidy CSV files; what they hold in excess of the named columns is kept in the tables of the page.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from reports._content import NOTHING, Grid, grid
from reports.figures.benchmark import BenchFiles
from reports.page import draw_sections, write_page
from reports.schema import BENCH, CLAIMS, ORDERS, STRESS, Column
from reports.tables import read, read_if_there, write_csv

TARGETS_MM = (0.1, 0.01)


def render_bench(bench_csv: Path, out_dir: Path, *others: Path | None, note: str = "", embed: bool = False) -> Path:
    """Draw the figures and write bench.html into ``out_dir``; returns its path.

    others : as for ``read_bench``.     note : what the reader must know of machine and reference.
    Also writes recommended.csv: the fastest setting of each scene whose shape error is at most 0.1 mm and 0.01 mm.
    """
    bench = read_bench(bench_csv, *others)
    best = recommended(bench.rows)
    write_csv(out_dir / "recommended.csv", best)
    outcomes = bench.outcomes().astype(int)
    whole = bench.stress[bench.stress["axis"] == "all"].drop(columns="axis")
    page = {
        "title": "wireval benchmark",
        "note": note,
        "sections": draw_sections("bench", bench, out_dir, embed),
        "recommended": _grid(best),
        "claims": _claims(bench.claims),
        "broken": int(bench.claims["met"].eq(other=False).sum()),
        "promised": int(bench.claims["met"].notna().sum()),
        "rows": _grid(bench.rows.drop(columns="on_front")),
        "stress": _grid(outcomes.assign(all=outcomes.sum(axis=1)).reset_index()),
        # a table that has counts alone says nothing of how much and how well
        "stress_numbers": _grid(whole) if whole["iterations_max"].notna().any() else None,
        "source": bench_csv.name,
    }
    return write_page("bench.html.j2", page, out_dir / "bench.html")


def read_bench(bench_csv: Path, *others: Path | None) -> BenchFiles:
    """Read the rows of a benchmark, marking the Pareto front of each scene, and what else there is of it.

    others : the files of its stress study, claims and orders, in this order, as far as there are any.
    """
    rows = _numeric(read(bench_csv, BENCH)).assign(on_front=False)
    for _, mine in rows.groupby("scene", sort=False):
        front = pareto_front(mine["shape_error_mm"].to_numpy(), mine["ms_per_mm"].to_numpy())
        rows.loc[mine.index, "on_front"] = front
    stress, claims, orders = map(read_if_there, (*others, None, None, None), (STRESS, CLAIMS, ORDERS))
    stress["count"] = stress["count"].fillna(1).astype(int)
    return BenchFiles(rows, stress, claims, orders)


def pareto_front(error: np.ndarray[Any, Any], cost: np.ndarray[Any, Any]) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Mark the points (n,) that no other point beats in error and cost; NaN is never on the front."""
    order = np.lexsort((cost, error))
    costs = np.where(np.isfinite(error), cost, np.nan)[order]
    front = np.zeros(len(error), dtype=bool)
    front[order] = costs < np.fmin.accumulate(np.append(np.inf, costs))[:-1]
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
            fastest.insert(0, "target_mm", target)
            found.append(fastest.drop(columns="on_front", errors="ignore"))
    nothing = pd.DataFrame(columns=["target_mm", *rows.columns])
    return pd.concat(found, ignore_index=True) if found else nothing


def _worst_from_here(rows: pd.DataFrame) -> "pd.Series[float]":
    """Largest shape error of each row and of the shorter segments with the same other settings; a failure is inf."""
    same = [c for c in ("scene", "method", "hull", "quadrature", "tolerance") if c in rows]
    error = rows["shape_error_mm"].fillna(np.inf)
    order = rows.sort_values("segment_mm").index
    worst = error[order].groupby([rows.loc[order, c] for c in same], dropna=False, sort=False).cummax()
    return worst.reindex(rows.index)


def _numeric(rows: pd.DataFrame) -> pd.DataFrame:
    """Columns beyond the named ones are numbers where every value of theirs is."""
    extra = {c: pd.to_numeric(rows[c], errors="coerce") for c in rows.columns if c not in BENCH.names}
    return rows.assign(**{c: v for c, v in extra.items() if v.notna().equals(rows[c].notna())})


def _claims(claims: pd.DataFrame) -> Grid | None:
    """The table of promises; broken ones come first and are marked."""
    verdicts = claims["met"].map({True: "met", False: "NOT MET"}).astype("string").fillna("")
    order = verdicts.ne("NOT MET").sort_values(kind="stable").index
    claims, verdicts = claims.loc[order], verdicts[order]
    units = claims["unit"].replace("1", "")  # of plain numbers
    return _grid(claims.assign(met=verdicts, unit=units).fillna({"aim": ""}), bad=verdicts == "NOT MET")


def _grid(table: pd.DataFrame, bad: Any = None) -> Grid | None:
    """Every column, with its meaning where it has one; None without rows."""
    known = {column.name: column.meaning for column in (*BENCH, *STRESS, *CLAIMS)}
    known |= {"target_mm": "the largest shape error that is asked for", "all": "scenes of that kind"}
    kinds = {n: "float" if pd.api.types.is_numeric_dtype(table[n]) else "text" for n in map(str, table.columns)}
    columns = [Column(name, "-", known.get(name, ""), kind) for name, kind in kinds.items()]
    return grid(table, columns, bad, nothing=NOTHING) if len(table) else None
