"""What a page says, as text: values with three significant digits, trees, cards, tables."""

import math
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import pandas as pd

from reports.case_files import GOOD, WORST
from reports.schema import ERRORS, SUMMARY, Column
from reports.tables import first_row

Grid = dict[str, Any]
NOTHING = "–"
_LEVEL = {"min", "median", "max"}
_WITH_INTERVAL = ("rms_mm", "skill_strongest")
"""Numbers at the head of a page that say so where they have no interval."""
_FEWER = "It is over the frames for which every predictor has a guess; the two rms beside it are over other frames."
MOST_TILES = 6
"""Of the numbers at the head of a page so many are tiles, which a reader decides by; the others stand in a table."""


def number(value: Any, digits: int = 3) -> str:
    """A number with ``digits`` significant digits, no exponent between 0.0001 and a million; – for none."""
    if value is None or value is pd.NA or (isinstance(value, float) and math.isnan(value)):
        return NOTHING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, float):
        return str(value)
    if value == 0 or math.isinf(value):
        return f"{value + 0.0:g}"  # of -0.0, too
    exponent = math.floor(math.log10(abs(value)))
    if not -4 <= exponent < 6:
        return f"{value:.{digits}g}"
    return f"{value:.{max(digits - 1 - exponent, 0)}f}"


def length(value: Any) -> str:
    """A number of mm; one below a nanometre is rounding, and was 2.35e-16 mm."""
    return "0" if isinstance(value, float) and abs(value) < 1e-6 else number(value)


SKILLS = "skill", "skill_strongest"
LEAST_TOLD = -10.0
"""Skill below which no number is given: 3.3 times the rival's error."""


def skill_told(skill: float, text: str = "") -> str:
    """A skill in words: how far below LEAST_TOLD it is says no more, since a rival's error may be next to nothing."""
    return (text or number(skill)) if skill >= LEAST_TOLD else f"below {LEAST_TOLD:g}"


def _shown(value: Any, column: Column) -> str:
    """A value of a column in words."""
    return length(value) if column.unit == "mm" else number(value)


_IF = re.compile(r"\{([^|{}]+)\|([^{}]*)\}")


def caption(text: str, table: pd.DataFrame) -> str:
    """A caption, each ``{name|words}`` of it kept where the figure shows ``name``.

    table : the figure's numbers: it shows the columns that have a value, and the words that stand in columns of texts.
    """
    shown = {str(name) for name in table if table[name].notna().any()}
    for name in table.select_dtypes(include=["object", "string"]):
        shown |= {value for value in table[name].unique() if isinstance(value, str)}
    said = " ".join(_IF.sub(lambda found: found[2] if found[1] in shown else "", text).split())
    return said.removesuffix(";") + "." * said.endswith(";")  # the last of several that are parted so


def interval(low: Any, high: Any) -> str:
    """``low to high``; empty where either is missing."""
    ends = (number(low), number(high))
    return "" if NOTHING in ends else f"{ends[0]} to {ends[1]}"


def flatten(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Dotted keys and texts of a nested mapping, in its order; empty values are left out.

    A level (a mapping of min, median and max, such as the contrast over all frames) is one text.
    """
    for key, value in tree.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping) and value.keys() == _LEVEL:
            if value["median"] is not None:
                ends = f" ({interval(value['min'], value['max'])})" if value["min"] != value["max"] else ""
                yield name, number(value["median"]) + ends
        elif isinstance(value, Mapping):
            yield from flatten(value, f"{name}.")
        elif value not in (None, "", [], ()):
            yield name, _text(value)


def settings(config: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Rows (table.key, value, source) of a resolved configuration."""
    rows = []
    for table, keys in config.items():
        for key, entry in keys.items() if isinstance(keys, Mapping) else ():
            known = isinstance(entry, Mapping) and "value" in entry
            value, source = (entry["value"], str(entry.get("source", ""))) if known else (entry, "")
            rows.append((f"{table}.{key}", _text(value) or NOTHING, source))
    return rows


def size(n_bytes: int) -> str:
    """A file's size in kB or MB."""
    return f"{n_bytes / 1e6:.1f} MB" if n_bytes >= 1e6 else f"{max(n_bytes / 1e3, 0.1):.1f} kB"


def cards(entries: Iterable[Mapping[str, str]], statistics: Mapping[str, Any]) -> list[dict[str, str]]:
    """The numbers at the head of a page; those that do not apply are left out.

    entries : ``column`` and ``label`` of each, as in sections.toml; ``{name}`` within a column's name is the value of
    that column; ``of`` names the column of a total, ``name`` that of a word that follows the label, ``why`` explains.
    A skill that is over fewer frames than the rms beside it says so in its label: 0.378 and 0.433 mm give 0.24, and
    it was 0.067.
    """
    shown = []
    for entry in entries:
        name = entry["column"].format_map(defaultdict(str, statistics))
        value = _shown(statistics.get(name), SUMMARY[name]) if name in SUMMARY.names else NOTHING
        if value != NOTHING:
            column = SUMMARY[name]
            value = skill_told(float(statistics[name])) if name in SKILLS else value  # as the sentences above have it
            total = f"of {statistics[entry['of']]} " if entry.get("of") in statistics else ""
            ends = _interval(statistics, column)
            interval_95 = f" (95 %: {ends})" if ends else _withheld(statistics, name) if name in _WITH_INTERVAL else ""
            named = f" {predictor_label(statistics[entry['name']])}" if entry.get("name") else ""
            part = fewer_frames(statistics) if name == "skill_strongest" else ""
            fewer = f" {part}, the rms over more" * bool(part)
            why = " ".join(filter(None, (entry.get("why"), _FEWER * bool(part))))
            fitted = _used_for_roll(statistics) if name == "frames_ok" else ""
            card = {"value": value, "label": f"{total}{entry['label']}{named}{fewer}{interval_95}{fitted}"}
            shown.append(card | ({"why": why} if why else {}))
    return shown


def _used_for_roll(statistics: Mapping[str, Any]) -> str:
    """`` (1 more used for the roll)`` beside a number of frames; empty without such a one."""
    fitted = number(statistics.get("frames_fitted"))
    return "" if fitted in (NOTHING, "0") else f" ({fitted} more used for the roll)"


def _withheld(statistics: Mapping[str, Any], name: str) -> str:
    """`` (no interval: 1 insertion)`` where the note on intervals says so of all or of this one; empty where not."""
    for part in str(statistics.get("interval")).split("; "):
        whose, told, rest = part.partition("interval withheld: ")
        if told and whose in ("", f"{name} "):
            return f" (no interval: {rest.partition(',')[0]})"
    return ""


def value_of(value: Any) -> float:
    """A field as a number, NaN where it is empty."""
    return math.nan if number(value) == NOTHING else float(value)


def predictor_label(name: str) -> str:
    """A trivial predictor as figures call it; its name where they show none of it."""
    column = f"null_{name}_rms_mm"
    shown = next((table[column].shown for table in (ERRORS, SUMMARY) if column in table.names), {})
    return shown.get("predictors") or shown.get("rivals") or name.replace("_", " ")


def fewer_frames(statistics: Mapping[str, Any]) -> str:
    """``over 5 of 6 frames``: of those with a result, the ones that the skill is over; empty where it is all.

    The skill against the strongest predictor, or against the centreline where none is the strongest.
    """
    over = "strongest_frames" if number(statistics.get("skill_strongest")) != NOTHING else "skill_frames"
    judged, good = (number(statistics.get(key)) for key in (over, "frames_ok"))
    return "" if NOTHING in (judged, good) or float(judged) >= float(good) else f"over {judged} of {good} frames"


def overall(entries: Iterable[Mapping[str, str]], table: pd.DataFrame) -> list[dict[str, str]]:
    """The numbers over all validation cases, and what their intervals rest on. table : overall.csv, a row or none."""
    if table.empty:
        return []
    row = first_row(table)
    stand = "insertion stands" if row["insertions"] == 1 else "insertions stand"
    rests = {"value": number(row["insertions"]), "label": f"{stand} behind the intervals ({number(row['interval'])})"}
    return [*cards(entries, row), rests]


def in_tiles(numbers: Sequence[Mapping[str, str]]) -> dict[str, Sequence[Mapping[str, str]]]:
    """The numbers at the head of a page, as ``tiles`` and ``others``."""
    return {"tiles": numbers[:MOST_TILES], "others": numbers[MOST_TILES:]}


def worst_first(summary: pd.DataFrame) -> pd.DataFrame:
    """The rows of summary.csv, cases with failed frames first, of these the ones without any result, then by WORST.

    Equal ones stand as the manifest has them.
    """
    failed = _failed(summary)
    keys = summary.assign(failed=failed, nothing=failed & summary[WORST].isna())
    return summary.loc[keys.sort_values(["failed", "nothing", WORST], ascending=False, kind="stable").index]


def _failed(summary: pd.DataFrame) -> "pd.Series[bool]":
    return ((summary["frames_failed"] > 0) | ~summary["status"].isin(GOOD)).fillna(value=True)


def cases(summary: pd.DataFrame, links: Mapping[str, str], worse: Iterable[str] = ()) -> Grid:
    """One row per case, linked to its page; those that failed are marked, and those that are worse than a guess."""
    table = grid(
        summary, quoted_first(SUMMARY.shown("cases")), bad=_failed(summary) | summary["case"].isin(list(worse))
    )
    for row, name in zip(table["rows"], summary["case"], strict=True):
        row["cells"][0]["link"] = links.get(name, "")
    return table


QUOTED, BEFORE = ("skill_strongest", "strongest_null"), "distal10_rms_mm"


def quoted_first(columns: Sequence[Column]) -> list[Column]:
    """Columns of a table on a page, the number to quote before those that a narrow window cuts off."""
    names = [column.name for column in columns]
    at = names.index(BEFORE) if BEFORE in names else len(names)
    moved = [column for column in columns[at:] if column.name in QUOTED]
    return [*columns[:at], *moved, *(column for column in columns[at:] if column not in moved)]


def grid(table: pd.DataFrame, columns: Sequence[Column], bad: Iterable[Any] | None = None, nothing: str = "") -> Grid:
    """Headings and rows for a template; columns without any value are left out, and ends of intervals, told below what
    they are of.

    bad : for each row, whether it is marked.     nothing : what stands in an empty cell. What else the rows
    name is to be explained in ``about``, (name, meaning).
    """
    told = {end for column in columns for end in _ends(column)}
    kept = [c for c in columns if c.name not in told and table[c.name].notna().any()]
    marks = [False] * len(table) if bad is None else map(bool, bad)
    rows = [
        {"cells": [_cell(record, column, nothing) for column in kept], "bad": mark}
        for record, mark in zip(table.to_dict("records"), marks, strict=True)
    ]
    return {"columns": [_head(column) for column in kept], "rows": rows, "about": []}


def _head(column: Column) -> dict[str, Any]:
    """The unit stands in the heading, too, where the name does not carry it, as a simulator's."""
    unit = "" if column.unit in ("-", "1") else column.unit
    told = {"name": column.name, "meaning": column.meaning + f" [{unit}]" * bool(unit), "text": column.kind == "text"}
    return told | {"unit": "" if column.name.endswith(f"_{unit}") else unit}


def _cell(record: Mapping[Any, Any], column: Column, nothing: str) -> dict[str, Any]:
    value = _shown(record[column.name], column).replace(NOTHING, nothing)
    return {"value": value, "detail": _interval(record, column), "text": column.kind == "text", "link": ""}


def _interval(record: Mapping[Any, Any], column: Column) -> str:
    """The 95 % interval of rms_mm, tip_median_mm, ...: what rms_low_mm, tip_low_mm, ... hold; empty without."""
    low, high = _ends(column)
    return interval(record.get(low), record.get(high))


def _ends(column: Column) -> tuple[str, str]:
    """The columns that hold the ends of a column's interval, where there are any."""
    low, high = (column.with_word(end).replace("_median_", "_") for end in ("low", "high"))
    return low, high


def _text(value: Any) -> str:
    if isinstance(value, (list, tuple)):
        parts = [_text(v) for v in value]
        return " ".join(parts) if all(isinstance(v, str) for v in value) else f"[{', '.join(parts)}]"
    if value is None or isinstance(value, bool):
        return NOTHING if value is None else str(value).lower()  # as TOML has it
    # counts arrive as floats (16777216.0 voxels), directions with sixteen digits
    return f"{value:.9g}" if isinstance(value, float) else str(value)
