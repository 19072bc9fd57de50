"""What closes the gate between two runs, the worst first, and how it is told."""

import math
from typing import Any

import pandas as pd

from reports.case_files import counted
from reports.schema import ERRORS

BEFORE_COMPARE = {
    *("insertion_mm", "max_penetration_mm", "push_force_N", "iterations", "num_mm", "num_push_N"),
    *("trace_sigma_mm", "trace_mean_mm", "trace_max_mm", "trace_tip_mm"),
}
"""What a run has that ended before frames are compared: no number of it says how far a simulated wire is off."""
_ALSO = ("branch_ok", "coverage")
"""Errors that are no length: another branch, a part of the wire that is missing."""
WAYS = {"low": "more", "high": "less"}
"""By which side of a column is better, which way a change is allowed."""


def is_error(column: str) -> bool:
    """Whether a column says how far a simulated wire is off: neither overlap, force or trace, nor a skill."""
    if column not in ERRORS.names or column in BEFORE_COMPARE or column.startswith("u_"):  # u_: what is not known
        return False
    return column in _ALSO or (ERRORS[column].unit == "mm" and ERRORS[column].better == "low")


def worst_first(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of a comparison: what is missing, then errors, then other columns; in each by change over allowed change.

    An overlap with the wall that is 1.1 times what is allowed stood above errors that were allowed to the last.
    """
    times = (rows["change"].abs() / rows["allowed"]).fillna(math.inf)
    rank = 2 - rows["column"].map(is_error).astype(int) - 2 * rows["change"].isna()  # a missing frame is no error's row
    by = pd.DataFrame({"rank": rank, "times": -times})
    return rows.loc[by.sort_values(["rank", "times"], kind="stable").index]


def told(row: Any) -> str:
    """Simulator, case, frame and column of a row, its values and the allowed change. row : a Series of a comparison."""
    whose = [str(row["simulator"])] if "simulator" in row else []
    where = f"case {row['case']}" + ("" if pd.isna(row["frame"]) else f" frame {row['frame']}")
    was, now = _both(row)
    allowed = "" if pd.isna(row["allowed"]) else f" (allowed {row['allowed']:.4g})"
    return f"{', '.join([*whose, where])}, {row['column']} {was} -> {now}{allowed}"


def change_of(row: Any) -> str:
    """A row's column and values with their unit, and the change that is allowed: what a build server shows of it."""
    was, now = _both(row)
    column = ERRORS[row["column"]] if row["column"] in ERRORS.names else None
    if column is None or pd.isna(row["allowed"]):
        return f"{row['column']}: {was} -> {now}"
    unit = f" {column.unit}" * (column.unit not in ("1", "-", ""))
    way = WAYS.get(column.better, "either way")
    return f"{row['column']}: {was} -> {now}{unit} (allowed {row['allowed']:.4g}{unit} {way})"


def _both(row: Any) -> tuple[str, str]:
    """A row's values, of the first and of the second run."""
    was, now = (f"{v:.4g}" if isinstance(v, float) else str(v) for v in (row["before"], row["after"]))
    return was, now


def how_many(rows: pd.DataFrame) -> str:
    """How many frames, whole cases and simulators became worse, and in how many values. rows : of the comparison."""
    by = ["case", "frame"]  # of two simulators, too: five scans were ten frames
    bad = rows[rows["verdict"] == "regression"]
    held = rows[rows["frame"].notna() & (rows["verdict"] != "new")].drop_duplicates(by)
    frames, whole = bad[bad["frame"].notna()].drop_duplicates(by), bad[bad["frame"].isna()]
    lost, gone = whole[whole["column"] != "simulator"].drop_duplicates("case"), whole[whole["column"] == "simulator"]
    parts = [f"{len(frames)} of {counted(len(held), 'frame')}"] * (len(frames) > 0)
    parts += [counted(len(some), what) for some, what in ((lost, "case"), (gone, "simulator")) if len(some)]
    values = len(bad) - len(whole)
    return f"{' and '.join(parts)} worse" + f", in {values} values" * (values > len(frames))
