"""Read and write the tables of ``schema`` as CSV; what does not apply is an empty field.

Reading gives a DataFrame with every column of the table, in its order and kind, with NA for empty fields.
"""

import csv
import gzip
import io
import math
import zlib
from collections import defaultdict
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from reports.atomic import write_bytes
from reports.schema import Column, Table
from reports.texts import opened, unreadable

Row = Mapping[str, object]
# not their names, which pandas looks up once a column and table: half the time of reading small ones
_DTYPES: dict[str, Any] = {
    "float": np.dtype("float64"),
    "integer": pd.Int64Dtype(),
    "boolean": pd.BooleanDtype(),
    "text": pd.StringDtype(),
}
_FLOAT_DIGITS = "%.9g"  # a nanometre in a metre: more than any scan, few enough to read
_WHOLE, _TRUTH = (int, np.integer), (bool, np.bool_)
_KINDS: dict[str, tuple[type[Any], ...]] = {
    "float": (*_WHOLE, float, np.floating), "integer": _WHOLE, "boolean": _TRUTH, "text": (str,),
}  # fmt: skip
_POINTER = b"version https://git-lfs"
_BOOLEANS = {"True": True, "true": True, "1": True, "False": False, "false": False, "0": False}


def write(path: Path, table: Table, content: pd.DataFrame | Mapping[str, Any] | Iterable[Row]) -> None:
    """Write a DataFrame, columns (name -> array (n,), all of one length) or rows (name -> value).

    A column or value left out, None and NaN are empty fields. Raises ValueError for a name that the table does not
    have (a DataFrame may bring more columns: they follow at the end), columns of unequal lengths, or a value in a row
    that is not of its column's kind.
    """
    if isinstance(content, Mapping):
        table.check(content, path.name)
        sizes = {name: len(values) for name, values in content.items()}
        if len(set(sizes.values())) > 1:
            raise ValueError(f"columns of {path.name} differ in length: {sizes}; give one value per point in each")
        content = pd.DataFrame(dict(content))
    elif not isinstance(content, pd.DataFrame):
        rows = [dict(row) for row in content]
        for row in rows:
            table.check(row, path.name)
        _write(path, _text_of(rows, table, path.name))
        return
    whole = _columns(content, table)
    # 0.0 for -0.0, as in _field
    whole |= {column.name: whole[column.name] + 0.0 for column in table if column.kind == "float"}
    write_csv(path, pd.DataFrame(whole, index=content.index))


def write_csv(path: Path, content: pd.DataFrame) -> None:
    """Write any DataFrame as CSV, gzipped where the name ends in .gz."""
    texts = content.select_dtypes(include=["object", "string"]).columns
    content = content.assign(**{name: content[name].map(_plain_text) for name in texts})
    _write(path, content.to_csv(index=False, float_format=_FLOAT_DIGITS, lineterminator="\n"))


def _write(path: Path, text: str) -> None:
    whole = text.encode("utf-8")
    # mtime 0: the same result gives the same bytes
    write_bytes(path, gzip.compress(whole, mtime=0) if path.suffix == ".gz" else whole)


def _text_of(rows: Iterable[Row], table: Table, name: str) -> str:
    """The text of a table of rows. Without pandas, to which one row of 69 columns is 69 Series: 20 ms.

    name : of the file, for the ValueError about a value that is not of its column's kind.
    """
    file = io.StringIO()
    line = csv.writer(file, lineterminator="\n")
    line.writerow(table.names)
    for row in rows:
        line.writerow([_field(row.get(column.name), column, name) for column in table])
    return file.getvalue()


def _field(value: Any, column: Column, name: str) -> str:
    """A value as it is written."""
    if value is None or value is pd.NA or (isinstance(value, float) and math.isnan(value)):
        return ""
    if not isinstance(value, _KINDS[column.kind]) or isinstance(value, _TRUTH) is not (column.kind == "boolean"):
        raise ValueError(f"{name}: {column.name}: got {value!r}; allowed: {column.kind}, or nothing")
    if column.kind == "float":
        # -0.0 + 0.0 is 0.0: a force of "-0" is no news to a reader and would not survive a spreadsheet
        return _FLOAT_DIGITS % (float(value) + 0.0)
    return str(_plain_text(value)) if column.kind == "text" else str(value)


FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""A text that begins so, and is no number, is a formula to a spreadsheet: it is written after an apostrophe."""


def _plain_text(value: Any) -> Any:
    formula = isinstance(value, str) and value.startswith(FORMULA)
    return f"'{value}" if formula and not _is_number(value) else value


def _is_number(text: str) -> bool:
    with suppress(ValueError):
        float(text)
        return True
    return False


def _own_text(value: Any) -> Any:
    """What ``_plain_text`` was given."""
    return value[1:] if isinstance(value, str) and value[:1] == "'" and value[1:].startswith(FORMULA) else value


def read(path: Path, table: Table) -> pd.DataFrame:
    """Read a table; a column that the file lacks is NA, one that it has in excess is kept at the end.

    Raises ValueError, naming the file, where it is no table, cannot be unpacked, or a field is not of its kind.
    """
    # numbers are parsed as such: to take them from text, column after column, was half the time of a page of 500 cases
    kinds = {c.name: _DTYPES[c.kind] for c in table if c.kind in ("float", "integer")}
    kept: Any = {"keep_default_na": False, "na_values": [""]}
    with opened(path) as file:
        if file.read(len(_POINTER)) == _POINTER:
            raise unreadable(path, "a pointer of Git LFS, not the table; fetch the table with `git lfs pull`")
    try:
        raw = pd.read_csv(path, dtype=defaultdict(lambda: _DTYPES["text"], kinds), **kept)
        texts = [c.name for c in table if c.kind == "text" and c.name in raw]
        if texts and (path.suffix == ".gz" or b"'" in path.read_bytes()):  # few tables have any
            raw = raw.assign(**{name: raw[name].map(_own_text) for name in texts})
        if set(table.names).isdisjoint(raw):
            raise ValueError("it has none of the columns")
        return _conform(raw, table)
    except (OSError, EOFError, zlib.error) as error:
        raise unreadable(path, f"cut short or altered ({error}); copy it again") from error
    except (ValueError, TypeError) as error:
        raise ValueError(
            f"{path}: a field is not what its column says ({error}); write it again with `wireval run`"
        ) from error


_EMPTY: dict[tuple[str, ...], pd.DataFrame] = {}


def read_if_there(path: Path | None, table: Table) -> pd.DataFrame:
    """Read a table; without a file it has no rows, and every column in its kind."""
    if path is not None and path.exists():
        return read(path, table)
    if table.names not in _EMPTY:  # kept: the page of 500 cases asks for thousands
        _EMPTY[table.names] = _conform(pd.DataFrame(), table)
    return _EMPTY[table.names].copy()


def first_row(content: pd.DataFrame) -> dict[str, Any]:
    """The first row by the names of its columns; empty where there is none."""
    return {str(name): value for name, value in content.iloc[0].items()} if len(content) else {}


def in_texts(content: pd.DataFrame) -> list[dict[str, Any]]:
    """The rows by the names of their columns, an empty text where a field is empty."""
    blank = content.astype(object).where(content.notna(), "")
    return [{str(name): value for name, value in row.items()} for row in blank.to_dict("records")]


def has(content: pd.DataFrame, *columns: str) -> bool:
    """Say whether any of the columns has a value."""
    return any(content[column].notna().any() for column in columns if column in content)


def _conform(content: pd.DataFrame, table: Table) -> pd.DataFrame:
    """The columns of the table in their kinds, then those in excess."""
    extra = [name for name in content.columns if name not in table.names]
    whole = content.reindex(columns=[*table.names, *extra])
    kinds = whole.dtypes.to_dict()
    wrong = [column for column in table if kinds[column.name] != _DTYPES[column.kind]]
    return whole.assign(**{column.name: _typed(content, column) for column in wrong})


def _columns(content: pd.DataFrame, table: Table) -> "dict[str, pd.Series[Any]]":
    """The same by name: where few columns are in their kinds, a frame made of all at once takes half the time."""
    kinds = content.dtypes.to_dict()
    right = {c.name for c in table if c.name in kinds and kinds[c.name] == _DTYPES[c.kind]}
    whole = {c.name: content[c.name] if c.name in right else _typed(content, c) for c in table}
    return whole | {name: content[name] for name in content.columns if name not in whole}


def _typed(content: pd.DataFrame, column: Column) -> "pd.Series[Any]":
    dtype = _DTYPES[column.kind]
    if column.name not in content:
        return pd.Series(math.nan if column.kind == "float" else pd.NA, index=content.index, dtype=dtype)
    values: Any = content[column.name]
    if column.kind in ("float", "integer"):
        values = pd.to_numeric(values)
    if column.kind == "boolean":
        values = values.map(_boolean)
    typed: pd.Series[Any] = values.astype(dtype)
    return typed


def _boolean(value: Any) -> bool | None:
    if pd.isna(value) or value == "":
        return None
    if str(value) not in _BOOLEANS:
        raise ValueError(f"got {value!r} where True or False is expected")
    return _BOOLEANS[str(value)]
