"""Which of several simulators is the nearest to the traced wires, in sentences, from rows of simulators.csv."""

import math
from collections.abc import Container, Mapping, Sequence
from typing import Any

import pandas as pd

from reports.case_files import counted

SAME = "the same error at every point"
"""What the note of a pair of simulators says that cannot be told apart."""


def farther_mm(row: Mapping[Any, Any]) -> float:
    """The larger of a simulator's rms distances to the traced wires and from them."""
    return max((float(row[name]) for name in ("rms_mm", "back_rms_mm") if pd.notna(row.get(name))), default=math.inf)


def nearer(rows: Sequence[Mapping[Any, Any]], off: Container[str] = ()) -> list[str]:
    """Of the simulator with the least error how it stands to every other one, a sentence each.

    The error is the larger of the two ways. One with failed frames, which it leaves out, is held against one without.
    rows : of simulators.csv.     off : simulators that are left out, since rms_mm does not judge them.
    """
    own = [row for row in rows if pd.isna(row.get("against")) and row["simulator"] not in off and row["frames_ok"] > 0]
    if not own:
        return []
    best = min(own, key=lambda row: (row["frames_ok"] < row["frames"], farther_mm(row)))["simulator"]
    others = [row["simulator"] for row in own]
    pairs = [row for row in rows if row["simulator"] in others and row.get("against") in others]
    of_best = [row for row in pairs if row["against"] == best]
    alike = [row for row in pairs if best not in (row["simulator"], row["against"]) and SAME in str(row["interval"])]
    once = [row for row in alike if others.index(row["against"]) < others.index(row["simulator"])]
    return [beside(row) for row in (*of_best, *once)]


def beside(row: Mapping[Any, Any]) -> str:
    """Whether the simulator of a row is farther from the traced wires than that of ``against``: both ways, or not."""
    one, other = row["simulator"], row["against"]
    if SAME in str(row["interval"]):
        return f"{one} and {other} have {SAME} of all {counted(int(row['common_frames']), 'frame')}: is one a copy?"
    (value, low, high), back = (_with_ends(row, name) for name in ("rms_ratio", "back_ratio"))
    farther = low > 1.0 and (math.isnan(back[0]) or back[1] > 1.0)
    closer = high < 1.0 and (math.isnan(back[0]) or back[2] < 1.0)
    head = f"{other} is nearer than {one}" if farther else f"{one} is nearer than {other}" if closer else ""
    head = head or f"{other} is not shown to be nearer than {one}"
    one_way = (low > 1.0 or high < 1.0) and not (farther or closer)
    known = "; ".join(filter(None, ("rms_ratio" * one_way, _interval(low, high), str(row["interval"]))))
    where = counted(int(row["common_frames"]), "frame")
    said = f"{head}: on {where} {one} lies {value:.2f} times as far from the traced wires ({known})"
    return said + (_the_other_way(one, other, value, back) if one_way else ".")


def _the_other_way(one: str, other: str, value: float, back: tuple[float, float, float]) -> str:
    """The end of a sentence of which the ratio ``value`` of rms_mm is told, and that of back_rms_mm does not bear out.

    Of two that lie to either side of 1 the one that is nearer by rms_mm may owe it to what its wires leave out.
    """
    early = one if value < 1.0 < back[0] else other if back[0] < 1.0 < value else ""
    told = "; ".join(filter(None, ("back_ratio", _interval(*back[1:]))))
    said = f", {'but' if early else 'and'} the traced wires lie {back[0]:.2f} times as far from {one} ({told})"
    return said + (f": does {early} end early?" if early else ".")


def _interval(low: float, high: float) -> str:
    """An interval in words; empty where it has no two ends."""
    return f"95 % interval {low:.2f} to {high:.2f}" if low <= high else ""


def _with_ends(row: Mapping[Any, Any], name: str) -> tuple[float, float, float]:
    """A ratio and the ends of its interval; NaN for what is empty."""
    values = (row.get(name + end) for end in ("", "_low", "_high"))
    value, low, high = (math.nan if pd.isna(one) else float(one) for one in values)
    return value, low, high
