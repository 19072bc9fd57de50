"""The whole study: scenes in, tables out. Each row is on disk as soon as its scene has ended."""

import io
import os
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from time import perf_counter
from typing import Any

import pandas as pd

from pipeline.benchmark.isolate import Lost, alone
from pipeline.benchmark.stress.axes import AXES, draw
from pipeline.benchmark.stress.plan import SHOWN
from pipeline.benchmark.stress.scene_run import SceneOutcome, run_scene
from pipeline.run.batch import run_all
from solver import warm_up
from solver._compile import hash_of

SCENES_CSV, STRESS_CSV = "stress_scenes.csv", "stress.csv"
SCENES, QUICK_SCENES = 5000, 200
LIMIT_S = 60.0
"""Processor time beyond which a scene hangs: work per depth is limited, the slowest scene takes some 15 s."""
BUSY = 10.0
"""Limit of wall-clock over processor time: a busy machine gives a process a tenth of a core; beyond, it is stuck."""


def run_isolated(seed: int, indices: Sequence[int], jobs: int = 1, limit_s: float = LIMIT_S) -> Iterator[SceneOutcome]:
    """Outcomes of the scenes as they end, ``jobs`` of them at a time."""
    warm_up(beside=True)  # compiled once, here; a worker only loads the machine code
    for done in run_all(indices, partial(_run_alone, run_scene, limit_s, seed), jobs):
        yield done.result or _failed(seed, done.job, Lost("crash", done.error))


def _run_alone(run: Callable[[int, int], SceneOutcome], limit_s: float, seed: int, index: int) -> SceneOutcome:
    """Run one scene in a fork of this process, whose kernels are loaded; a crash or a hang is its outcome."""
    _loaded()
    answer = alone("fork", partial(run, seed, index), BUSY * limit_s, limit_s)
    return _failed(seed, index, answer) if isinstance(answer, Lost) else answer


_loaded = cache(warm_up)


def _failed(seed: int, index: int, lost: Lost) -> SceneOutcome:
    return SceneOutcome(index, draw(seed, index).axes, lost.fault, lost.fault, lost.reason)


def version() -> str:
    """Ten hex digits of everything that decides how a scene ends: the solver's sources and the study's own."""
    return hash_of(Path(__file__))[:10]


def run_stress(
    path: Path, seed: int, indices: Sequence[int], say: Callable[[str], None], jobs: int = 1
) -> pd.DataFrame:
    """One row per scene: index, axes, outcome, fault, detail, iterations, residual, stretch, seconds, setting.

    path : a CSV file that gets each row as its scene ends; the rows of this seed and of the same sources that are
    there already are kept and not run again.
    say : gets a line for every fault, and one for every 250 scenes with their rate.
    """
    began, rows = perf_counter(), _rows_at(path, seed, indices)
    known = {row["index"] for row in rows}
    left = [index for index in indices if index not in known]
    with path.open("w", encoding="utf-8") as file:
        pd.DataFrame(rows, columns=COLUMNS).to_csv(file, index=False)
        for number, done in enumerate(run_isolated(seed, left, jobs), 1):
            rows.append(_row(seed, done))
            pd.DataFrame([rows[-1]]).to_csv(file, index=False, header=False)
            file.flush()
            if done.fault:
                say(f"scene {done.index}: {done.fault}: {done.detail}")
            if number % 250 == 0:
                rate = number / (perf_counter() - began)
                say(f"scene {done.index} of {len(indices)}: {number} run now, {rate:.3g} a second")
    return pd.DataFrame(rows).sort_values("index", ignore_index=True)


def _row(seed: int, done: SceneOutcome) -> dict[str, Any]:
    plan = draw(seed, done.index)
    row = {**vars(done), "axes": " ".join(done.axes), **{name: getattr(plan, name) for name in SHOWN}}
    return {**row, "axis": done.axes[0], "seed": seed, "version": version()}


COLUMNS = list(_row(0, SceneOutcome(0, ("",), "")))


def _rows_at(path: Path, seed: int, indices: Sequence[int]) -> list[dict[str, Any]]:
    """Rows of this seed and version in a table; others are left out, and so is a last line that was cut off."""
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    # the version is the last column: what follows its last occurrence is no whole line
    whole, last, _ = text.rpartition(end := f",{version()}\n")
    if not last:
        return []
    # an empty text stays a text, not NaN
    numbers = {"residual": ["", "nan"], "stretch": ["", "nan"]}
    table = pd.read_csv(io.StringIO(whole + end), dtype={"version": str}, keep_default_na=False, na_values=numbers)
    mine = table[(table["seed"] == seed) & (table["version"] == version()) & table["index"].isin(indices)]
    return [{str(name): value for name, value in row.items()} for row in mine.to_dict("records")]


def measure_stress(out: Path, say: Callable[[str], None], seed: int, count: int) -> bool:
    """Random scenes and their tables; False where one ended otherwise than it may."""
    path = out / SCENES_CSV
    rows = run_stress(path, seed, range(count), say, min(2, os.cpu_count() or 1))
    rows.to_csv(path, index=False)
    table = stress_table(rows)
    table.to_csv(out / STRESS_CSV, index=False)
    wide = table.pivot_table(index="axis", columns="outcome", values="count", fill_value=0, sort=False)
    say(wide.astype(int).to_string())
    whole = table[table["axis"] == "all"].drop(columns="axis")
    say(whole.to_string(index=False, float_format=lambda v: f"{v:.3g}"))
    faults = int((rows["fault"] != "").sum())
    say(f"{count - faults} of {count} scenes ended as they may (seed {seed}), {faults} did not")
    return faults == 0


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
