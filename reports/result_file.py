"""result.json, read: what pages and tables take from it is of the kind and the size that it should be.

A ledger tells an edited file only where the ledger was not edited, too.
"""

from collections.abc import Callable, Iterator, Mapping
from math import isfinite
from pathlib import Path
from typing import Any

from reports.records import AGAIN, read_json
from reports.schema import FAILURES, SUMMARY, Table
from reports.texts import unreadable

OWN = dict.fromkeys(("case", "role", "group", "status", "sentence", "key", "phantom", "stated", "contents"), "text")
FRAME = {"frame": "integer", "registration": "table", "trace": "table", "snaps": "list"}
FRAME |= dict.fromkeys(("status", "sentence", "stage", "message"), "text")
ROLES = ("validation", "calibration", "")
"""Roles of a case; empty where nothing is known of it."""
COUNTED = ("ok", "simulated")
"""Statuses of the frames that ``frames_ok`` counts."""
LARGEST = 2**53
"""Whole numbers from here on are not all floats."""
KINDS: Mapping[str, tuple[Callable[[Any], bool], str]] = {
    "text": (lambda value: isinstance(value, str), "a text"),
    "boolean": (lambda value: isinstance(value, bool), "true or false"),
    "integer": (lambda value: type(value) is int and 0 <= value < LARGEST, "a whole number from 0 on"),
    # infinities are written as texts, NaN as null
    "float": (lambda value: value in ("inf", "-inf") or (type(value) in (int, float) and isfinite(value)), "a number"),
    "table": (lambda value: isinstance(value, dict), "a table"),
    "list": (lambda value: isinstance(value, list), "a list"),
}
"""Of each kind whether a value is of it, and what it is called."""
Wrong = tuple[str, Any, str]
"""A key, what it holds, and what was expected there."""


def read_result(path: Path) -> dict[str, Any]:
    """Read a result.json; an absent file is an empty one. UnreadableError names the first key that is wrong."""
    result = read_json(path)
    for key, value, expected in _wrong(result):
        shown = repr(value)
        shown = f"{shown[:60]}..." if len(shown) > 60 else shown
        raise unreadable(path, f"{key}: got {shown}; expected {expected}; {AGAIN}")
    return result


def _wrong(result: Mapping[str, Any]) -> Iterator[Wrong]:
    frames, summary = result.get("frames", []), result.get("summary", {})
    yield from _of_other_kinds("", result, OWN)
    for number, row in enumerate(frames):
        yield from _of_other_kinds(f"frames[{number}].", row, FRAME)
    for number, row in enumerate(result.get("failures", [])):
        yield from _of_other_kinds(f"failures[{number}].", row, _kinds_of(FAILURES))
    yield from _of_other_kinds("summary.", summary, _kinds_of(SUMMARY))
    if result.get("role", "") not in ROLES:
        yield "role", result["role"], "validation or calibration"
    for key in ("case", "role", "group", "status"):
        if summary.get(key, result.get(key)) != result.get(key):
            yield f"summary.{key}", summary[key], f"{result.get(key)!r}, as {key} says"
    good = sum(row.get("status") in COUNTED for row in frames)
    if summary.get("frames_ok", good) != good:
        yield "summary.frames_ok", summary["frames_ok"], f"{good}, the number of frames that are ok"
    if frames and not good <= (summary.get("frames") or good) <= len(frames):
        yield "summary.frames", summary["frames"], f"{good} to {len(frames)}, the number of frames"


def _of_other_kinds(where: str, row: Mapping[str, Any], kinds: Mapping[str, str]) -> Iterator[Wrong]:
    """What of a row is not of its kind; what is null says nothing, and other names are of other versions."""
    for name, kind in kinds.items():
        value = row.get(name)
        fits, expected = KINDS[kind]
        if value is not None and not fits(value):
            yield f"{where}{name}", value, expected


def _kinds_of(table: Table) -> dict[str, str]:
    """The kinds of the columns of a table, to which more may have been added since the start."""
    return {column.name: column.kind for column in table}
