"""What the table of a sweep does not show by itself: points in which frames fail, or that were not run."""

from collections.abc import Container, Mapping
from pathlib import Path

import pandas as pd

from reports.case_files import counted, listed, runs_in
from reports.schema import ALL
from reports.what_next import next_command, typed

UNCHANGED = "(plain)"
"""The parameter of the rows of sweep.csv in which nothing was changed."""


def folder_of(head: Mapping[str, str]) -> Path:
    """The folder of a point below the output. head : as run.json names it, the ``parameter`` and its ``value``."""
    return Path("sweep", f"{head['parameter']}={head['value']}".replace("/", "_"))


def not_run(out_dir: Path, of: Container[str] | None = None) -> tuple[list[Path], int]:
    """Of what the runs into a folder were to compute for a sweep: the point of each result that is not there, and how
    many were asked for. of : these cases alone.

    A run was ended before it came to them, or folders were removed.
    """
    runs = [(run.get("sweep", ()), run.get("swept", ())) for run in runs_in(out_dir)]
    every = {(folder_of(head), case) for heads, cases in runs for head in heads for case in cases}
    asked = sorted((point, case) for point, case in every if of is None or case in of)
    files = [(point, out_dir / point / "cases" / case / "result.json") for point, case in asked]
    # a ledger without a result: that is damaged, and said as such
    return [p for p, file in files if not (file.exists() or file.with_name("ledger.json").exists())], len(asked)


def not_run_sentence(out_dir: Path) -> str:
    """How much of a sweep is not there, where, and what goes on with it; empty where nothing is missing."""
    missing, asked = not_run(out_dir)
    if not missing:
        return ""
    points, words = listed([point.name for point in dict.fromkeys(missing)]), typed(out_dir)
    swept = any(word.startswith("--sweep") for word in words)  # of shards there is no one command
    again = next_command((), words) if swept else "the command with --sweep, given again,"
    return f"{len(missing)} of {counted(asked, 'result')} of the sweep not run ({points}): {again} goes on"


def silent_points(sweep: pd.DataFrame) -> list[str]:
    """A sentence for each point of which fewer frames are ok than in the plain result of the same cases."""
    good: dict[tuple[str, str], dict[str, int]] = {}
    for row in sweep[sweep["case"] != ALL].to_dict("records"):
        name = str(row["parameter"])
        point = good.setdefault((name, "" if name == UNCHANGED else str(row["value"])), {})
        point[str(row["case"])] = 0 if pd.isna(row["frames_ok"]) else int(row["frames_ok"])
    plain = good.pop((UNCHANGED, ""), {})
    # a case that was not swept, or whose result was lost, has no row at the point
    counts = {point: (sum(of.values()), sum(plain.get(case, 0) for case in of)) for point, of in good.items()}
    return [
        f"sweep point {name} = {value}: {_fewer(count, of)}"
        for (name, value), (count, of) in counts.items()
        if count < of
    ]


def _fewer(count: int, plain: int) -> str:
    """What it means for a point's row that fewer frames are ok than in the plain result."""
    if not count:
        return "no frame is ok"
    return (
        f"{counted(count, 'frame')} {'is' if count == 1 else 'are'} ok, {plain} in the plain result: its rms_mm, "
        "tip_median_mm, truth_rms_mm and skill are over those alone, its rms_ratio and skill_strongest over the frames "
        "that are ok in both; errors.csv of each of its cases says why the others failed"
    )
