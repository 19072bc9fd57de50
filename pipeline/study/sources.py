"""How files are named in a manifest: one, a list, a pattern, or a part of an HDF5 file; relative to the manifest."""

import re
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationInfo
from pydantic_core import PydanticCustomError

from pipeline.load import Source

WHOLE_CASE = "whole_case"
"""Kind of an error whose message says all, beyond the case that it belongs to; its context lists the problems."""


def natural_key(text: str) -> list[Any]:
    """Sort key under which frame_2 comes before frame_10."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", text)]


def problem_of(*problems: str) -> PydanticCustomError:
    """An error whose sentences say all."""
    return PydanticCustomError(WHOLE_CASE, "{problems}", {"problems": problems})


def _source(value: Any, info: ValidationInfo) -> Source:
    """``file``, ``folder`` or ``file.h5#/dataset``, relative to the manifest."""
    if not isinstance(value, str):
        raise ValueError("Input should be a valid string")
    name, _, dataset = value.partition("#")
    return Source(Path((info.context or {}).get("folder", "")) / name, dataset)


def _sources(value: Any, info: ValidationInfo) -> tuple[Source, ...]:
    """A list of sources, or a pattern whose matches come in natural order."""
    if isinstance(value, list):
        return tuple(_source(item, info) for item in value)
    source, base = _source(value, info), Path((info.context or {}).get("folder", ""))
    pattern = value.partition("#")[0]
    if not any(mark in pattern for mark in "*?["):
        return (source,)
    root = Path(Path(pattern).anchor or base)
    found = sorted(root.glob(str(Path(pattern).relative_to(Path(pattern).anchor))), key=lambda p: natural_key(p.name))
    if not found:
        problem = f"{info.field_name} = {value!r} matches no file below {base}"
        raise problem_of(problem)
    return tuple(Source(path, source.dataset) for path in found)


SourceText = Annotated[Source, BeforeValidator(_source)]
Sources = Annotated[tuple[Source, ...], BeforeValidator(_sources)]
PathText = Annotated[Path, BeforeValidator(lambda value, info: _source(value, info).path)]


class Strict(BaseModel):
    """Unknown keys are errors; values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True)
