"""Rows of a study on disk as they come in: a study that was broken off goes on where it stopped."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

import solver

EMPTY = {name: ["", "nan"] for name in ("residual", "stretch")}
"""Numbers that not every scene has, however they are written; an empty text is a text."""


def version() -> str:
    """Ten hex digits of everything that decides how a scene ends: the solver's sources and the study's own."""
    here = Path(__file__).parent
    files = [*Path(solver.__file__).parent.rglob("*.py"), *here.glob("*.py"), here.parent / "statics.py"]
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()[:10]


def rows_at(path: Path | None, seed: int, indices: Collection[int]) -> list[dict[str, Any]]:
    """Rows of this seed and version in a table; others are left out, and so is a last line that was cut off."""
    if path is None or not path.exists():
        return []
    mine = {"seed": str(seed), "version": version()}
    with path.open(newline="", encoding="utf-8") as file:
        # the version is the last column: a line without it is no whole line
        found = [row for row in csv.DictReader(file) if all(row.get(name) == mine[name] for name in mine)]
    wanted = set(indices)
    whole = {int(row["index"]): row for row in found if int(row["index"]) in wanted}
    if not whole:
        return []
    text = io.StringIO(pd.DataFrame(whole.values()).to_csv(index=False))
    table = pd.read_csv(text, dtype={"version": str}, keep_default_na=False, na_values=EMPTY)
    return [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]


class Ledger:
    """A table that grows by a line a scene, each written at once; nothing where there is no path."""

    def __init__(self, path: Path | None, rows: Collection[Mapping[str, Any]]) -> None:
        self.rows = [dict(row) for row in rows]
        self.file = None if path is None else path.open("w", newline="", encoding="utf-8")
        self.writer: csv.DictWriter[str] | None = None
        for row in self.rows:
            self._write(row)

    def add(self, row: dict[str, Any]) -> None:
        """Keep a row and write it."""
        self.rows.append(row)
        self._write(row)

    def _write(self, row: Mapping[str, Any]) -> None:
        if self.file is None:
            return
        if self.writer is None:
            self.writer = csv.DictWriter(self.file, list(row))
            self.writer.writeheader()
        self.writer.writerow(row)
        self.file.flush()

    def close(self) -> None:
        """Close the file."""
        if self.file is not None:
            self.file.close()
