"""What a manifest may write where a file is meant: paths, patterns in natural order, a lumen with its label."""

import itertools
import os
import stat
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, ValidationInfo, WithJsonSchema
from pydantic_core import PydanticCustomError

from pipeline.load import Source, hdf5
from pipeline.load.geometry import LoadError, Mask
from pipeline.load.guard import read_toml, status_of
from pipeline.load.order import in_order
from pipeline.ranges import Strict
from pipeline.status import InputError
from pipeline.wording import saying

MOST_MATCHES, LONGEST_PATTERN, LONGEST_NAME = 20_000, 4000, 255
State = tuple[int, int, int, int]
"""Size, times of the last change of content and of its entry, and number on its disk.

A file that replaces another one has a number of its own; whoever puts back the time of its content (`rsync --inplace
--times`, `cp -p`) cannot put back that of its entry. The time of a folder changes with the files that are put into
it."""


def state_of(path: Path) -> State | None:
    """The state of a file, which tells whether it is still the same; None where it is not there."""
    try:
        known = path.stat()
    except OSError:
        return None
    return known.st_size, known.st_mtime_ns, known.st_ctime_ns, known.st_ino


def _source(value: Any, info: ValidationInfo) -> Source:
    """``file``, ``folder`` or ``file.h5#/dataset``, relative to the manifest."""
    if not isinstance(value, str):
        raise PydanticCustomError("name", "no name")
    name, _, dataset = value.partition("#")
    _require_name(name, info)
    path = Path((info.context or {}).get("folder", "")) / name
    if "#" in value and os.path.lexists(f"{path}#{dataset}"):
        raise saying(f"{info.field_name} = {value!r}: a # parts a file's name from that of a dataset; rename the file")
    return Source(path, _dataset(path, dataset, info))


def _dataset(path: Path, name: str, info: ValidationInfo) -> str:
    """The name of a dataset or series; an error where a file holds none of such, which would be read as a whole."""
    held = status_of(path) if name and not hdf5.recognises(path) else None
    if held and stat.S_ISREG(held.st_mode):
        allowed = "study.h5#/frames, or FOLDER#SERIES_UID of DICOM slices"
        raise saying(f"{info.field_name} = '{path.name}#{name}': this file holds no datasets; allowed: {allowed}")
    return name


def _require_name(name: str, info: ValidationInfo) -> None:
    """An error for what is no path, or leads out of the study without being absolute."""
    if not name.strip() or "\0" in name:
        raise saying(f"{info.field_name} = {name!r}: an empty name; name a file, or leave the key out")
    longest = max(len(part.encode()) for part in name.split("/"))
    if len(name) > LONGEST_PATTERN or longest > LONGEST_NAME:
        allowed = f"allowed: {LONGEST_NAME}, and {LONGEST_PATTERN} for a whole path"
        raise saying(f"{info.field_name}: a name of {longest} bytes in a path of {len(name)}; {allowed}")
    if not Path(name).is_absolute() and Path(os.path.normpath(name)).parts[:1] == ("..",):
        meant = os.path.normpath((Path((info.context or {}).get("folder", "")) / name).absolute())
        where = f"leads out of the manifest's folder; if it is meant, write {meant!r}"
        raise saying(f"{info.field_name} = {name!r} {where}")


def _sources(value: Any, info: ValidationInfo) -> tuple[Source, ...]:
    """A list of sources, or a pattern whose matches come in natural order; one without any stays as it is."""
    if isinstance(value, list):
        if not value:
            raise saying(f"{info.field_name} = []: an empty list; name files, or leave the key out")
        return tuple(_source(item, info) for item in value)
    source = _source(value, info)
    pattern = value.partition("#")[0]
    if not is_pattern(pattern):
        return (source,)
    base, relative = _base(pattern, info)
    try:
        matches = list(itertools.islice(base.glob(relative), MOST_MATCHES + 1))
    except (ValueError, NotImplementedError, OSError, RecursionError):
        raise saying(f"{info.field_name} = {value!r} is no pattern; write names with *, ? and [...]") from None
    found = in_order(matches, lambda path: path.relative_to(base).as_posix())
    if not found:  # said beside what else is wrong with the case's files
        return (source,)
    if len(found) > MOST_MATCHES:
        raise saying(f"{info.field_name} = {value!r} matches more than {MOST_MATCHES} files; make it narrower")
    return tuple(Source(path, _dataset(path, source.dataset, info)) for path in found)


def is_pattern(name: str) -> bool:
    """Whether a name holds one of the marks of a pattern."""
    return any(mark in name for mark in "*?[")


def _base(pattern: str, info: ValidationInfo) -> tuple[Path, str]:
    """The folder from which a pattern looks, and the pattern from there on."""
    path = Path(pattern)
    if not path.is_absolute():
        return Path((info.context or {}).get("folder", "")), pattern
    fixed = list(itertools.takewhile(lambda part: not is_pattern(part), path.parts))
    if len(fixed) < 2:
        raise saying(f"{info.field_name} = {pattern!r} looks through the whole machine; name a folder")
    return Path(*fixed), str(Path(*path.parts[len(fixed) :]))


def _mask(value: Any, info: ValidationInfo) -> Mask:
    """A file, or ``{file = ..., label = 2}``, ``{file = ..., label = "artery"}``, ``{file = ..., level = 0.5}``."""
    if not isinstance(value, dict):
        return _masked(_source(value, info), None, None)
    label, level = value.get("label"), value.get("level")
    unknown = set(value) - {"file", "label", "level"}
    if unknown or "file" not in value or (label is not None and level is not None):
        allowed = "file, and label (a number or a name) or level (above 0, below 1)"
        raise saying(f"lumen holds {', '.join(sorted(map(str, value)))}; allowed: {allowed}")
    if label is not None and (isinstance(label, bool) or not isinstance(label, (int, str)) or label in ("", 0)):
        raise saying(f"lumen: label = {label!r}; allowed: a number that is not 0, or a name")
    if level is not None and not (isinstance(level, (int, float)) and not isinstance(level, bool) and 0 < level < 1):
        raise saying(f"lumen: level = {level!r}; allowed: a number above 0 and below 1")
    return _masked(_source(value["file"], info), label, level)


def _masked(source: Source, label: int | str | None, level: float | None) -> Mask:
    return Mask(source.path, source.dataset, source.item, label, level)


NAME: dict[str, Any] = {"type": "string", "$comment": "the name of a file or a folder, in quotes"}
NAMES: dict[str, Any] = {
    "anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}],
    "$comment": 'a name or a pattern in quotes ("frames/*.mha"), or a list of names',
}
MASK: dict[str, Any] = {
    "anyOf": [
        {"type": "string"},
        {
            "type": "object",
            "properties": {
                "file": {"type": "string"},
                "label": {"anyOf": [{"type": "integer"}, {"type": "string"}]},
                "level": {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1},
            },
            "required": ["file"],
            "additionalProperties": False,
        },
    ],
    "$comment": "the name of a file in quotes, or {file = ..., label = ...}, or {file = ..., level = ...}",
}
SourceText = Annotated[Source, BeforeValidator(_source), WithJsonSchema(NAME)]
MaskText = Annotated[Mask, BeforeValidator(_mask), WithJsonSchema(MASK)]
Sources = Annotated[tuple[Source, ...], BeforeValidator(_sources), WithJsonSchema(NAMES)]
PathText = Annotated[Path, BeforeValidator(lambda value, info: _source(value, info).path), WithJsonSchema(NAME)]


def read_tables(path: Path, error: type[InputError], missing: str) -> dict[str, Any]:
    """What a TOML file holds; raises ``error`` where it cannot be read, with ``missing`` where there is none."""
    try:
        if status_of(path) is None:
            raise error([f"{path}: {missing}"])
        return read_toml(path)
    except LoadError as found:
        raise error([str(found)]) from None


def files_of(table: Strict, within: str = "") -> dict[str, Path]:
    """Every file or folder that a table names, by its key, with its place where that is a list: ``frames[3]``."""
    found = {}
    for key, value in table:
        named = {f"{key}[{n}]": item for n, item in enumerate(value)} if isinstance(value, tuple) else {key: value}
        for name, item in named.items():
            path = item.path if isinstance(item, Source) else item
            if isinstance(path, Path):
                found[within + name] = path
    return found
