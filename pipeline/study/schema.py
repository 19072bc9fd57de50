"""The manifest as it is written (TOML), checked field by field by pydantic; all errors come at once."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

Vector = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Profile = float | list[tuple[float, float]]
Role = Literal["validation", "calibration"]


class Strict(BaseModel):
    """Unknown keys are errors; values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def _check_profile(value: Profile, lowest: float, name: str) -> Profile:
    pairs = [(0.0, value)] if isinstance(value, (int, float)) else value
    if not pairs:
        msg = f"{name}: an empty profile; give a number or [[distance from tip mm, value], ...]"
        raise ValueError(msg)
    distances = [s for s, _ in pairs]
    if distances != sorted(distances) or distances[0] < 0:
        msg = f"{name}: distances from the tip {distances} must be >= 0 and must not decrease"
        raise ValueError(msg)
    if any(not math.isfinite(v) or v < lowest for _, v in pairs):
        msg = f"{name}: values {[v for _, v in pairs]} must be finite" + (
            "" if lowest < 0 else " and above 0"
        )
        raise ValueError(msg)
    return value


class WireModel(Strict):
    """One ``[wires.NAME]`` table."""

    radius_mm: Positive
    bending_stiffness_N_mm2: Profile
    rest_curvature_per_mm: Profile = 0.0
    torsional_stiffness_N_mm2: Annotated[float, Field(gt=0)] = math.inf

    @field_validator("bending_stiffness_N_mm2")
    @classmethod
    def _bending(cls, value: Profile) -> Profile:
        return _check_profile(value, 1e-12, "bending_stiffness_N_mm2")

    @field_validator("rest_curvature_per_mm")
    @classmethod
    def _curvature(cls, value: Profile) -> Profile:
        return _check_profile(value, -math.inf, "rest_curvature_per_mm")


class WallModel(Strict):
    """One ``[case.wall]`` table."""

    stiffness_N_mm2: Positive = 2.0
    friction: NonNegative = 0.0


class CaseModel(Strict):
    """One ``[[case]]`` table."""

    id: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")]
    role: Role = "validation"
    group: str = ""
    reference: str | None = None
    frames: str | list[str] | None = None
    entry_mm: Vector
    entry_direction: Vector
    material_axis: Vector | None = None
    wire: str
    insertion_mm: list[Positive] | None = None
    spacing_mm: tuple[Positive, Positive, Positive] | None = None
    lumen: str | None = None
    traces: str | list[str] | None = None
    parameters: str | None = None
    roll_deg: float | list[float] | Literal["fit"] = 0.0
    lumen_seed_mm: list[Vector] | None = None
    truth: str | None = None
    wall: WallModel = WallModel()

    @field_validator("entry_direction", "material_axis")
    @classmethod
    def _not_zero(cls, value: Vector | None) -> Vector | None:
        if value is not None and math.hypot(*value) < 1e-9:
            msg = "a direction of length zero; give three numbers that are not all 0"
            raise ValueError(msg)
        return value

    @model_validator(mode="after")
    def _something_to_do(self) -> CaseModel:
        if self.frames is None and self.insertion_mm is None:
            msg = "neither frames nor insertion_mm: give scans to compare with, or depths to simulate"
            raise ValueError(msg)
        if self.frames is None and self.reference is None and self.lumen is None:
            msg = "no frames, no reference and no lumen: there is no vessel to simulate in"
            raise ValueError(msg)
        return self


class ManifestModel(Strict):
    """The whole file."""

    schema_: Annotated[Literal[1], Field(alias="schema")]
    wires: dict[str, WireModel]
    case: Annotated[list[CaseModel], Field(min_length=1)]
