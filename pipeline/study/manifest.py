"""The study description: TOML at the door, frozen dataclasses inside; every problem is listed at once."""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from pipeline.load.geometry import Source
from pipeline.study.schema import CaseModel, ManifestModel, Profile, WallModel, WireModel
from pipeline.study.suggest import did_you_mean

Vector = tuple[float, float, float]


class ManifestError(Exception):
    """The manifest cannot be used; ``problems`` lists everything that is wrong with it."""

    def __init__(self, problems: list[str]) -> None:
        super().__init__("\n".join(problems))
        self.problems = problems


@dataclass(frozen=True)
class Wire:
    """A guide wire as the manifest describes it; profiles run from the tip (mm) and are pairs or one number."""

    name: str
    radius_mm: float
    bending_stiffness_N_mm2: Profile
    rest_curvature_per_mm: Profile
    torsional_stiffness_N_mm2: float


@dataclass(frozen=True)
class Case:
    """One insertion: paths resolved, wire looked up, everything in LPS mm."""

    id: str
    role: str
    group: str
    entry_mm: Vector
    entry_direction: Vector
    material_axis: Vector | None
    wire: Wire
    wall: WallModel
    reference: Source | None
    frames: tuple[Source, ...]
    insertion_mm: tuple[float, ...] | None
    spacing_mm: Vector | None
    lumen: Source | None
    traces: tuple[Path, ...]
    parameters: Path | None
    roll_deg: float | tuple[float, ...] | str
    lumen_seed_mm: tuple[Vector, ...]
    truth: Path | None

    @property
    def frame_count(self) -> int:
        """Frames to report on: scans, or depths of a case without scans."""
        return len(self.frames) or len(self.insertion_mm or ())


@dataclass(frozen=True)
class Manifest:
    """A whole study."""

    path: Path
    cases: tuple[Case, ...]


def natural_key(text: str) -> list[Any]:
    """Sort key under which frame_2 comes before frame_10."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", text)]


def read_manifest(path: Path) -> Manifest:
    """Read and check a manifest (not the scans); raises ManifestError with every problem found."""
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ManifestError([f"{path}: no such manifest"]) from None
    except tomllib.TOMLDecodeError as error:
        raise ManifestError([f"{path}: not valid TOML: {error}"]) from None
    try:
        model = ManifestModel.model_validate(data)
    except ValidationError as error:
        raise ManifestError([_sentence(path, data, dict(item)) for item in error.errors()]) from None
    return _resolve(model, path)


def _sentence(path: Path, data: dict[str, Any], error: dict[str, Any]) -> str:
    """One pydantic error as: file, case, key, found, allowed."""
    place = list(error["loc"])
    if len(place) > 1 and place[0] == "case" and isinstance(place[1], int):
        cases = data.get("case", [])
        name = cases[place[1]].get("id", place[1]) if isinstance(cases, list) else place[1]
        place[:2] = [f"case {name!r}"]
    where = f"{path}: {' '.join(str(p) for p in place)}".rstrip()
    if error["type"] == "extra_forbidden":
        return f"{where}: unknown key; {did_you_mean(str(place[-1]), _siblings(error['loc']))}"
    if error["type"] == "missing":
        return f"{where}: missing; this key is required"
    found = f"; found {error['input']!r}" if not isinstance(error["input"], (dict, list)) else ""
    return f"{where}: {error['msg'].removeprefix('Value error, ')}{found}"


def _siblings(location: tuple[int | str, ...]) -> set[str]:
    models: dict[str, type] = {"case": CaseModel, "wires": WireModel, "wall": WallModel}
    for part in reversed(location[:-1]):
        if part in models:
            return set(models[str(part)].model_fields)  # type: ignore[attr-defined]
    return {"schema", "wires", "case"}


def _resolve(model: ManifestModel, path: Path) -> Manifest:
    problems: list[str] = []
    repeats = [name for name, count in Counter(c.id for c in model.case).items() if count > 1]
    problems += [
        f"{path}: case {name!r}: this id is used more than once; ids name output folders" for name in repeats
    ]
    cases = []
    for case in model.case:
        try:
            cases.append(_resolve_case(case, model.wires, path.parent))
        except ManifestError as error:
            problems += [f"{path}: case {case.id!r}: {text}" for text in error.problems]
    if problems:
        raise ManifestError(problems)
    return Manifest(path, tuple(cases))


def _resolve_case(case: CaseModel, wires: dict[str, WireModel], base: Path) -> Case:
    problems: list[str] = []
    if case.wire not in wires:
        problems.append(f"wire {case.wire!r} is not among [wires.*]; {did_you_mean(case.wire, wires)}")
    # part of the manifest's contract, but `wireval calibrate`, which makes sense of both, is not built yet
    if case.roll_deg == "fit":
        problems.append(
            'roll_deg = "fit" cannot be carried out in this version; give a number, or one per frame'
        )
    if case.parameters is not None:
        problems.append(
            "parameters cannot be read in this version; write the values into [wires] and [case.wall]"
        )
    frames = _sources(case.frames, base, "frames", problems)
    traces = tuple(s.path for s in _sources(case.traces, base, "traces", problems))
    roll = tuple(case.roll_deg) if isinstance(case.roll_deg, list) else case.roll_deg
    count = len(frames) or len(case.insertion_mm or ())
    for name, found in (("insertion_mm", case.insertion_mm), ("roll_deg", roll), ("traces", traces)):
        if isinstance(found, (list, tuple)) and found and len(found) != count and not _is_sequence(frames):
            problems.append(f"{name} has {len(found)} entries for {count} frames; give one per frame")
    if problems:
        raise ManifestError(problems)
    return Case(
        id=case.id,
        role=case.role,
        group=case.group or case.id,
        entry_mm=case.entry_mm,
        entry_direction=_unit(case.entry_direction),
        material_axis=case.material_axis,
        wire=Wire(case.wire, **dict(wires[case.wire])),
        wall=case.wall,
        reference=source_of(case.reference, base) if case.reference else None,
        frames=frames,
        insertion_mm=tuple(case.insertion_mm) if case.insertion_mm else None,
        spacing_mm=case.spacing_mm,
        lumen=source_of(case.lumen, base) if case.lumen else None,
        traces=traces,
        parameters=base / case.parameters if case.parameters else None,
        roll_deg=roll,
        lumen_seed_mm=tuple(case.lumen_seed_mm or (case.entry_mm,)),
        truth=base / case.truth if case.truth else None,
    )


def _unit(vector: Vector) -> Vector:
    x, y, z = np.array(vector) / np.linalg.norm(vector)
    return float(x), float(y), float(z)


def source_of(text: str, base: Path) -> Source:
    """``file``, ``folder`` or ``file.h5#/dataset``, relative to the manifest."""
    name, _, dataset = text.partition("#")
    return Source(base / name, dataset)


def _sources(value: str | list[str] | None, base: Path, key: str, problems: list[str]) -> tuple[Source, ...]:
    if value is None:
        return ()
    if isinstance(value, list):
        return tuple(source_of(item, base) for item in value)
    name, _, dataset = value.partition("#")
    if not any(mark in name for mark in "*?["):
        return (Source(base / name, dataset),)
    found = sorted(base.glob(name), key=lambda p: natural_key(p.name))
    if not found:
        problems.append(f"{key} = {value!r} matches no file below {base}")
    return tuple(Source(p, dataset) for p in found)


def _is_sequence(frames: tuple[Source, ...]) -> bool:
    """A single file that may hold many volumes; its count is known once its header is read."""
    return len(frames) == 1 and frames[0].path.is_file()
