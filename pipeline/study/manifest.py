"""The study's description, read from TOML; everything that is wrong with it is listed at once."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from pipeline.model import Wall, Wire
from pipeline.status import InputError, did_you_mean
from pipeline.study.schema import WHOLE_CASE, Case, ManifestTables


class ManifestError(InputError):
    """The manifest cannot be used."""


@dataclass(frozen=True)
class Manifest:
    """A whole study."""

    path: Path
    cases: tuple[Case, ...]


def read_manifest(path: Path) -> Manifest:
    """Read and check a manifest (not the scans); raises ManifestError with every problem found."""
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ManifestError([f"{path}: no such manifest"]) from None
    except tomllib.TOMLDecodeError as error:
        raise ManifestError([f"{path}: not valid TOML: {error}"]) from None
    try:
        tables = ManifestTables.model_validate(data, context={"folder": path.parent})
    except ValidationError as error:
        problems = [text for item in error.errors() for text in _sentences(data, dict(item))]
        raise ManifestError([f"{path}: {text}".replace(": : ", ": ") for text in problems]) from None
    return Manifest(path, tuple(tables.case))


def _sentences(data: dict[str, Any], error: dict[str, Any]) -> Iterator[str]:
    """One error of pydantic as sentences: case, key, what was found, what is allowed."""
    place = [str(part) for part in _place(data, error["loc"])]
    if error["type"] == WHOLE_CASE:
        yield from (": ".join([*place[:1], problem]) for problem in error["ctx"]["problems"])
        return
    where = " ".join(place)
    if error["type"] == "default_factory_not_called":
        return  # a default that hangs on another key, which is named already
    if error["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        yield f"{where}: unknown key; {did_you_mean(place[-1], _siblings(error['loc']))}"
    elif error["type"] == "missing":
        yield f"{where}: missing; this key is required"
    else:
        found = f"; found {error['input']!r}" if not isinstance(error["input"], (dict, list)) else ""
        yield f"{where}: {error['msg'].removeprefix('Value error, ')}{found}"


def _place(data: dict[str, Any], location: tuple[int | str, ...]) -> list[int | str]:
    """The place of an error, a case by its id instead of its number."""
    if len(location) < 2 or location[0] != "case" or not isinstance(location[1], int):
        return list(location)
    cases = data.get("case", [])
    case = cases[location[1]] if isinstance(cases, list) else None
    name = case.get("id", location[1]) if isinstance(case, dict) else location[1]
    return [f"case {name!r}", *location[2:]]


def _siblings(location: tuple[int | str, ...]) -> set[str]:
    """The keys that stand beside the one at a location."""
    tables = {
        "case": set(Case.model_fields),
        "wires": {item.name for item in fields(Wire)} - {"name"},
        "wall": {item.name for item in fields(Wall)},
    }
    nearest = next((part for part in reversed(location[:-1]) if part in tables), None)
    return tables[str(nearest)] if nearest else {"schema", "wires", "case"}
