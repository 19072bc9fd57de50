"""Kinds of values that users may give; pydantic refuses any other at the door, naming the place and what was found."""

import math
from functools import partial
from typing import Annotated

from pydantic import AfterValidator, Field, ValidationInfo

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1)]
Count = Annotated[int, Field(ge=0)]
PositiveCount = Annotated[int, Field(ge=1)]
Vector = tuple[Finite, Finite, Finite]
Profile = float | list[tuple[float, float]]
"""A number for the whole wire, or pairs (distance from the tip in mm, value), linear between, constant beyond."""


def _not_zero(value: Vector) -> Vector:
    if math.hypot(*value) < 1e-9:
        raise ValueError("a direction of length zero; give three numbers that are not all 0")
    return value


def _unit(value: Vector) -> Vector:
    size = math.hypot(*_not_zero(value))
    return value[0] / size, value[1] / size, value[2] / size


def _checked(value: Profile, info: ValidationInfo, *, lowest: float) -> Profile:
    name = info.field_name
    pairs = [(0.0, value)] if isinstance(value, (int, float)) else value
    if not pairs:
        raise ValueError(f"{name}: an empty profile; give a number or [[distance from tip mm, value], ...]")
    distances = [s for s, _ in pairs]
    if distances != sorted(distances) or not 0 <= distances[0] <= distances[-1] < math.inf:
        raise ValueError(f"{name}: distances from the tip {distances} must be >= 0 and must not decrease")
    if any(not math.isfinite(v) or v < lowest for _, v in pairs):
        above = "" if lowest < 0 else " and above 0"
        raise ValueError(f"{name}: values {[v for _, v in pairs]} must be finite{above}")
    return value


Axis = Annotated[Vector, AfterValidator(_not_zero)]
Direction = Annotated[Vector, AfterValidator(_unit)]
"""A vector that is made to have length 1."""
PositiveProfile = Annotated[Profile, AfterValidator(partial(_checked, lowest=1e-12))]
FiniteProfile = Annotated[Profile, AfterValidator(partial(_checked, lowest=-math.inf))]
