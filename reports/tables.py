"""Read and write the result tables with the columns of ``schema``; not applicable is an empty field.

Rows are mappings from column name to value: None, NaN and a missing key are all written as an empty field.
Readers give a DataFrame with every column of the schema, in its order, with missing values as NA.
"""

from __future__ import annotations

import gzip
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from reports.atomic import write_bytes
from reports.schema import (
    ERRORS_COLUMNS,
    FAILURES_COLUMNS,
    POINTS_COLUMNS,
    SUMMARY_COLUMNS,
    SWEEP_COLUMNS,
    Column,
    check_names,
    names,
)

Row = Mapping[str, object]
_DTYPES = {"float": "float64", "integer": "Int64", "boolean": "boolean", "text": "string"}
_FLOAT_DIGITS = "%.9g"  # a nanometre in a metre: more than any scan, few enough to read


def write_errors(path: Path, rows: Iterable[Row]) -> None:
    """Write errors.csv of one case, one row per frame."""
    _write_rows(path, rows, ERRORS_COLUMNS)


def write_summary(path: Path, rows: Iterable[Row]) -> None:
    """Write summary.csv of a run, one row per case."""
    _write_rows(path, rows, SUMMARY_COLUMNS)


def write_failures(path: Path, rows: Iterable[Row]) -> None:
    """Write failures.csv of a run, one row per failed frame or case; only the header when all is well."""
    _write_rows(path, rows, FAILURES_COLUMNS)


def write_sweep(path: Path, rows: Iterable[Row]) -> None:
    """Write sweep.csv of a run, one row per parameter value and case."""
    _write_rows(path, rows, SWEEP_COLUMNS)


def write_points(path: Path, columns: Mapping[str, Any]) -> None:
    """Write points.csv.gz of one case; ``columns`` maps names to arrays (n,), all of one length.

    Raises ValueError for an unknown name or unequal lengths. A column left out is empty.
    """
    check_names(columns, POINTS_COLUMNS, path.name)
    lengths = {len(values) for values in columns.values()}
    if len(lengths) > 1:
        sizes = {name: len(values) for name, values in columns.items()}
        msg = f"columns of {path.name} differ in length: {sizes}; give one value per point in each"
        raise ValueError(msg)
    write_table(path, pd.DataFrame(dict(columns)), POINTS_COLUMNS)


def read_errors(path: Path) -> pd.DataFrame:
    """Read errors.csv of one case."""
    return read_table(path, ERRORS_COLUMNS)


def read_points(path: Path) -> pd.DataFrame:
    """Read points.csv.gz of one case."""
    return read_table(path, POINTS_COLUMNS)


def read_summary(path: Path) -> pd.DataFrame:
    """Read summary.csv of a run."""
    return read_table(path, SUMMARY_COLUMNS)


def read_failures(path: Path) -> pd.DataFrame:
    """Read failures.csv of a run."""
    return read_table(path, FAILURES_COLUMNS)


def read_sweep(path: Path) -> pd.DataFrame:
    """Read sweep.csv of a run."""
    return read_table(path, SWEEP_COLUMNS)


def write_table(path: Path, table: pd.DataFrame, columns: Sequence[Column] | None = None) -> None:
    """Write a DataFrame as CSV, gzipped where the name ends in .gz; ``columns`` gives order and kinds."""
    dressed = table if columns is None else _conform(table, columns)
    text = dressed.to_csv(index=False, float_format=_FLOAT_DIGITS, lineterminator="\n")
    content = text.encode("utf-8")
    # mtime 0: the same result gives the same bytes
    write_bytes(path, gzip.compress(content, mtime=0) if path.suffix == ".gz" else content)


def read_table(path: Path, columns: Sequence[Column]) -> pd.DataFrame:
    """Read a CSV with the columns of a schema; a missing column is NA, one in excess is kept at the end."""
    raw = pd.read_csv(path, dtype="string", keep_default_na=False, na_values=[""])
    try:
        return _conform(raw, columns)
    except (ValueError, TypeError) as error:
        msg = f"{path}: a field is not what its column says ({error}); write it again with `wireval run`"
        raise ValueError(msg) from error


def empty_table(columns: Sequence[Column]) -> pd.DataFrame:
    """No rows, every column of the schema in its kind."""
    return _conform(pd.DataFrame(), columns)


def _write_rows(path: Path, rows: Iterable[Row], columns: Sequence[Column]) -> None:
    kept = [dict(row) for row in rows]
    for row in kept:
        check_names(row, columns, path.name)
    values = {c.name: [_field(row.get(c.name)) for row in kept] for c in columns}
    write_table(path, pd.DataFrame(values, columns=list(names(columns)), dtype=object), columns)


def _field(value: object) -> object:
    """Return a value, or None where it does not apply."""
    return None if isinstance(value, float) and math.isnan(value) else value


def _conform(table: pd.DataFrame, columns: Sequence[Column]) -> pd.DataFrame:
    extra = [name for name in table.columns if name not in names(columns)]
    parts = {c.name: _column(table, c) for c in columns}
    return pd.DataFrame({**parts, **{name: table[name] for name in extra}})


def _column(table: pd.DataFrame, column: Column) -> pd.Series[Any]:
    dtype: Any = _DTYPES[column.kind]
    if column.name not in table:
        return pd.Series(pd.NA if dtype != "float64" else math.nan, index=table.index, dtype=dtype)
    values: Any = table[column.name]
    if column.kind in ("float", "integer"):
        values = pd.to_numeric(values)
    if column.kind == "boolean":
        values = values.map(_boolean)
    typed: pd.Series[Any] = values.astype(dtype)
    # -0.0 + 0.0 is 0.0: a force of "-0" is no news to a reader and would not survive a spreadsheet
    return typed + 0.0 if column.kind == "float" else typed


def _boolean(value: object) -> bool | None:
    if value is None or value is pd.NA or value == "" or (isinstance(value, float) and math.isnan(value)):
        return None
    if str(value) not in ("True", "False", "true", "false", "1", "0"):
        msg = f"got {value!r} where True or False is expected"
        raise ValueError(msg)
    return str(value) in ("True", "true", "1")
