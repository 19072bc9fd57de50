"""The whole study: scenes in, tables out."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pandas as pd

from pipeline.benchmark.stress.isolate import LIMIT_S, run_isolated
from pipeline.benchmark.stress.plan import draw
from pipeline.benchmark.stress.scene_run import Outcome

SCENES = 5000


def run_stress(
    seed: int,
    indices: Sequence[int] = range(SCENES),
    jobs: int = 1,
    limit_s: float = LIMIT_S,
    tick: Callable[[Outcome], None] = lambda _: None,
) -> pd.DataFrame:
    """One row per scene: index, axes, outcome, fault, detail, iterations, residual, stretch, seconds, setting."""
    rows = []
    for done in run_isolated(seed, indices, jobs, limit_s):
        tick(done)
        row = {**vars(done), **draw(seed, done.index).describe()}
        row["axes"] = " ".join(done.axes)
        row["axis"] = done.axes[0]
        rows.append(row)
    return pd.DataFrame(rows)


def stress_table(rows: pd.DataFrame) -> pd.DataFrame:
    """Tidy: axis, outcome, count, iterations (median, largest), worst residual and stretch, seconds (largest).

    A scene counts at each of its axes; the axis "all" counts every scene once. A fault is an outcome of its own,
    in capitals.
    """
    rows = rows.assign(outcome=rows["outcome"].where(rows["fault"] == "", rows["fault"].str.upper()))
    each = rows.assign(axis=rows["axes"].str.split()).explode("axis")
    both = pd.concat([rows.assign(axis="all"), each], ignore_index=True)
    grouped = both.groupby(["axis", "outcome"], sort=False)
    table = grouped.agg(
        count=("index", "size"),
        iterations_median=("iterations", "median"),
        iterations_max=("iterations", "max"),
        worst_residual=("residual", "max"),
        worst_stretch=("stretch", "max"),
        seconds_max=("seconds", "max"),
    )
    return table.reset_index()
