"""The whole study: scenes in, tables out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from pipeline.benchmark.stress.axes import AXES
from pipeline.benchmark.stress.isolate import LIMIT_S, run_isolated
from pipeline.benchmark.stress.ledger import Ledger, rows_at, version
from pipeline.benchmark.stress.plan import draw
from pipeline.benchmark.stress.scene_run import Outcome

SCENES = 5000


def run_stress(
    seed: int,
    indices: Sequence[int] = range(SCENES),
    jobs: int = 1,
    limit_s: float = LIMIT_S,
    tick: Callable[[Outcome], None] = lambda _: None,
    path: Path | None = None,
) -> pd.DataFrame:
    """One row per scene: index, axes, outcome, fault, detail, iterations, residual, stretch, seconds, setting.

    path : a CSV file that gets each row as its scene ends; the rows of this seed and of the same sources that are
    there already are kept and not run again.
    """
    ledger = Ledger(path, rows_at(path, seed, indices))
    known = {int(row["index"]) for row in ledger.rows}
    sources = version()
    try:
        for done in run_isolated(seed, [i for i in indices if i not in known], jobs, limit_s):
            ledger.add(_row(seed, sources, done))
            tick(done)
    finally:
        ledger.close()
    return pd.DataFrame(ledger.rows).sort_values("index", ignore_index=True)


def _row(seed: int, sources: str, done: Outcome) -> dict[str, Any]:
    row = {**vars(done), **draw(seed, done.index).describe()}
    row["axes"], row["axis"] = " ".join(done.axes), done.axes[0]
    return {**row, "seed": seed, "version": sources}


def stress_table(rows: pd.DataFrame) -> pd.DataFrame:
    """Tidy: axis, outcome, count, iterations (median, largest), worst residual and stretch, seconds and slowest scene.

    A scene counts at each of its axes; the axis "all" counts every scene once. A fault is an outcome of its own,
    in capitals.
    """
    rows = rows.assign(outcome=rows["outcome"].where(rows["fault"] == "", rows["fault"].str.upper()))
    each = rows.assign(axis=rows["axes"].str.split()).explode("axis")
    both = pd.concat([rows.assign(axis="all"), each], ignore_index=True)
    common = list(rows["outcome"].value_counts().index)
    both = both.sort_values("outcome", key=lambda names: names.map(common.index), kind="stable")
    both = both.sort_values("axis", key=lambda names: names.map(["all", *AXES].index), kind="stable")
    grouped = both.groupby(["axis", "outcome"], sort=False)
    table = grouped.agg(
        count=("index", "size"),
        iterations_median=("iterations", "median"),
        iterations_max=("iterations", "max"),
        worst_residual=("residual", "max"),
        worst_stretch=("stretch", "max"),
        seconds_max=("seconds", "max"),
    ).reset_index()
    slowest = both.loc[grouped["seconds"].idxmax(), ["axis", "outcome", "index"]]
    return table.merge(slowest.rename(columns={"index": "slowest"}), on=["axis", "outcome"], how="left")
