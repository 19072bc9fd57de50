"""parameters.toml: what ``wireval calibrate`` found, and the cases of a study as they are with it.

A case is known again by the content of its frames and traces, whatever it is called: one that was calibrated with says
nothing about the model, and is not scored unless that is asked for.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import isclose
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, StrictBool, ValidationError

from pipeline.ranges import (
    Finite,
    FiniteProfile,
    Friction,
    NonNegative,
    Offset,
    Point,
    Positive,
    PositiveProfile,
    Strict,
    Turn,
)
from pipeline.status import InputError
from pipeline.study.sources import read_tables
from pipeline.wording import said, sentences

if TYPE_CHECKING:
    from pipeline.model import Wire
    from pipeline.study.manifest import Case

SAME = 1e-4
"""Relative difference up to which two stated numbers are one: a file may leave out digits."""


def same_wall(one_N_mm2: float, other_N_mm2: float) -> bool:
    """Whether two stated stiffnesses are those of one wall."""
    return isclose(one_N_mm2, other_N_mm2, rel_tol=SAME)


class WallFound(Strict):
    """A wall as calibrated, known by the stiffness that the manifest states."""

    stated_N_mm2: Positive
    stiffness_N_mm2: Positive


class Found(Strict):
    """An estimate: a value with its standard deviation (of its logarithm where it is a factor), and what is used."""

    name: str
    value: Finite
    sd: NonNegative
    logarithmic: StrictBool
    seen: StrictBool
    used: Finite
    why: str = ""


class Stated(Strict):
    """The wire as the manifest stated it when it was calibrated."""

    bending_stiffness_N_mm2: PositiveProfile
    rest_curvature_per_mm: FiniteProfile

    def is_of(self, wire: "Wire") -> bool:
        """Whether a manifest still states it so, but for digits that the file leaves out."""
        pairs = ((getattr(self, name), getattr(wire, name)) for name in type(self).model_fields)
        arrays = ((np.asarray(a, float), np.asarray(b, float)) for a, b in pairs)
        return all(a.shape == b.shape and np.allclose(a, b, rtol=SAME, atol=1e-9) for a, b in arrays)


class Used(Strict):
    """A case that was calibrated with.

    data : hashes of each of its frames and traces, and of its frames' voxels.     traced_mm : points (n, 3) on its
    frames' traces, by which a scan is known that was written again.
    """

    case: str
    group: str
    data: tuple[str, ...]
    traced_mm: tuple[Annotated[tuple[Point, ...], Field(min_length=1)], ...] = ()


class Parameters(Strict):
    """The whole file. bending_... and rest_... : of the wire, as profiles of the manifest."""

    schema_: Annotated[Literal[1], Field(alias="schema")]
    wire: str
    bending_stiffness_N_mm2: PositiveProfile
    rest_curvature_per_mm: FiniteProfile
    friction: Friction
    roll_offset_deg: Turn
    depth_offset_mm: Offset
    absolute_stiffness: StrictBool
    wall: tuple[WallFound, ...]
    stated: Stated | None = None
    estimate: tuple[Found, ...] = ()
    used: tuple[Used, ...] = ()

    def wall_of(self, stated_N_mm2: float) -> WallFound | None:
        """The wall that a manifest states so; None where none was calibrated."""
        return next((one for one in self.wall if same_wall(one.stated_N_mm2, stated_N_mm2)), None)

    @property
    def unseen(self) -> list[str]:
        """Names of what the calibration could not see: as stated there."""
        return [found.name for found in self.estimate if not found.seen]

    @property
    def seen(self) -> list[str]:
        """Names of what the calibration could see."""
        return [found.name for found in self.estimate if found.seen]


class ParametersError(InputError):
    """Parameters that cannot be used."""

    place = "the parameters"


def read_parameters(path: Path) -> Parameters:
    """Read parameters.toml; raises ParametersError."""
    missing = "no such file; wireval calibrate MANIFEST -o OUT writes OUT/parameters.toml"
    data = read_tables(path, ParametersError, missing)
    try:
        return Parameters.model_validate(data)
    except ValidationError as error:
        found = sentences(error, data, Parameters.model_json_schema())
        raise ParametersError([f"{path}: {said(*one)}; wireval calibrate writes this file" for one in found]) from None


def with_parameters(case: "Case", found: Parameters, data: Sequence[str], *, score_used: bool = False) -> "Case":
    """A case with calibrated wire, wall, roll and depths; ParametersError where they are another wire's.

    data : SHA-256 of its frames and traces. A case that was calibrated with is one for calibration from here on.
    score_used : scans that were calibrated with are scored, too: those in other files are not looked for.
    """
    if case.wire.name != found.wire:
        what = f"case {case.id!r}: its wire is {case.wire.name!r}, the parameters are those of {found.wire!r}"
        raise ParametersError([f"{what}; calibrate this wire, or take the parameters off this case"])
    if found.stated is not None and not found.stated.is_of(case.wire):
        what = f"case {case.id!r}: wire {found.wire!r} is stated otherwise than when it was calibrated (table stated)"
        raise ParametersError([f"{what}; state it as then, give it another name, or calibrate it again"])
    profiles = {name: getattr(found, name) for name in ("bending_stiffness_N_mm2", "rest_curvature_per_mm")}
    wall = found.wall_of(case.wall.stiffness_N_mm2)
    stiffness = case.wall.stiffness_N_mm2 if wall is None else wall.stiffness_N_mm2
    friction = case.wall.friction if "friction" in found.unseen else found.friction
    changes: dict[str, Any] = {
        "wire": replace(case.wire, **profiles),
        "wall": replace(case.wall, stiffness_N_mm2=stiffness, friction=friction),
        "calibrated": _told(case, found, wall),
        "calibrated_sigma": _sigmas(case, found),
        "calibrated_scans": () if score_used else tuple(scan for used in found.used for scan in used.data),
        "calibrated_traces": () if score_used else tuple(trace for used in found.used for trace in used.traced_mm),
    }
    if case.roll_deg != "fit":
        rolls = case.roll_deg if isinstance(case.roll_deg, tuple) else (case.roll_deg,)
        turned = tuple(roll + found.roll_offset_deg for roll in rolls)
        changes["roll_deg"] = turned if isinstance(case.roll_deg, tuple) else turned[0]
    if case.insertion_mm is not None:
        changes["insertion_mm"] = tuple(max(mm + found.depth_offset_mm, 1e-3) for mm in case.insertion_mm)
    own = sharing(found, data)
    if own:
        warning = f"its scans or traces were calibrated with (as case {own!r}): its errors say nothing about the model"
        changes |= {"role": "calibration", "own_parameters": warning, "calibrated_scans": (), "calibrated_traces": ()}
    elif any(case.group == used.group for used in found.used):
        changes["calibrated_kin"] = (
            f"its group, {case.group!r}, is that of a case that was calibrated with: as a part of one insertion it is "
            "no test of the parameters; if it is another insertion, give it a group of its own"
        )
    return case.model_copy(update=changes)


def sharing(found: Parameters, data: Sequence[str]) -> str:
    """Which calibrated case has a frame or a trace with these in common; empty where none has."""
    return next((one.case for one in found.used if set(one.data) & set(data)), "")


def _sigmas(case: "Case", found: Parameters) -> dict[str, float]:
    """Standard deviations of what the calibration saw, for the budget, by its keys.

    The taper is not among them: it is a factor on the shaft's stiffness there, on lengths in the budget.
    """
    keys = {name: name for name in ("rest_curvature", "friction")} | {"depth_offset_mm": "insertion_mm"}
    wall = found.wall_of(case.wall.stiffness_N_mm2)
    keys |= {} if wall is None else {f"wall:{wall.stated_N_mm2:g}": "wall_stiffness"}
    keys |= {"roll_offset_deg": "roll_deg"} if case.roll_deg != "fit" else {}
    return {keys[one.name]: one.sd for one in found.estimate if one.seen and one.name in keys}


def _told(case: "Case", found: Parameters, wall: WallFound | None) -> str:
    """For the report: what is calibrated, and what stays as stated. wall : the calibrated one of the case."""
    own = "" if wall is None else f"wall:{wall.stated_N_mm2:g}"
    seen, unseen = (
        [name for name in names if not name.startswith("wall:") or name == own] for names in (found.seen, found.unseen)
    )
    parts = [f"calibrated with {', '.join(u.case for u in found.used)}: {', '.join(seen) or 'nothing'}"]
    if unseen:
        parts.append(f"not seen there, as stated: {', '.join(unseen)}")
    if wall is None:
        parts.append(f"no wall stated at {case.wall.stiffness_N_mm2:g} N/mm2 was calibrated: as stated")
    if not found.absolute_stiffness:
        parts.append("stiffness is known in its ratios alone: forces are in units of the stated one")
    return "; ".join(parts)
