"""A .csv file in rows: those of its table, and its comments, which say what its numbers mean."""

import csv
import io
from pathlib import Path

from pipeline.load.geometry import refused
from pipeline.load.guard import read_text

CURVE_BYTES = 16 * 2**20
"""Longest table of a curve: 200,000 points."""


def rows_of(path: Path) -> tuple[list[list[str]], list[str]]:
    """The rows of a table, its names among them, and its comments, one line each, wherever in the file they stand.

    A comment is a row that begins with #, in quotes or not. Where a spreadsheet parts cells by semicolons, as it does
    in countries that write decimals with a comma, those decimals are given with a point.
    """
    text = read_text(path, CURVE_BYTES)
    first = next((line for line in text.splitlines() if line.strip() and not _is_comment([line.lstrip('"')])), "")
    mark = ";" if ";" in first else ","
    try:
        rows = [row for row in csv.reader(io.StringIO(text, newline=""), delimiter=mark) if row]
    except csv.Error:
        raise refused(path, "a line that is no CSV", "columns x_mm, y_mm, z_mm of numbers", "save it again") from None
    comments = [line for row in rows if _is_comment(row) for line in mark.join(row).splitlines()]
    table = [row for row in rows if not _is_comment(row)]
    return [[cell.replace(",", ".") for cell in row] for row in table] if mark == ";" else table, comments


def _is_comment(row: list[str]) -> bool:
    return row[0].lstrip().startswith("#")
