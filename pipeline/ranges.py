"""Types of the values that users may give, and the base of tables of them. Messages are ``pipeline.wording``'s."""

import math
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema
from pydantic_core import PydanticCustomError

from solver import wall, wire


class Strict(BaseModel):
    """A table: unknown keys are errors, values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def _number(value: Any) -> Any:
    """The value itself; an error for a text or a boolean, which pydantic would convert to a number."""
    if isinstance(value, (bool, str)):
        raise PydanticCustomError("number", "no number")
    return value


Number = BeforeValidator(_number)
LEAST = 1e-9
"""What is smaller is 0 in any unit that is used here; the square of 5e-324 is, and was divided by."""
Truth = Annotated[bool, Field(strict=True)]
"""true or false; pydantic takes '1', -0.0 and "off", too."""
Finite = Annotated[float, Field(ge=-1e9, le=1e9, allow_inf_nan=False), Number]
PerFrame = Annotated[tuple[Finite, ...], Field(min_length=1)]
Positive = Annotated[float, Field(ge=LEAST, le=1e9, allow_inf_nan=False), Number]
NonNegative = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False), Number]


def _not_tiny(value: float) -> float:
    if 0 < value < LEAST:
        raise ValueError(f"{value:g}; expected 0, which is exact, or {LEAST:g} at least")
    return value


def _or_none(largest: float) -> tuple[AfterValidator, WithJsonSchema]:
    """That a value from 0 to the largest is not between 0 and LEAST, for readers and for JSON schemas."""
    above: dict[str, Any] = {"type": "number", "minimum": LEAST, "maximum": largest}
    return AfterValidator(_not_tiny), WithJsonSchema({"anyOf": [{"const": 0}, above]})


Sigma = Annotated[NonNegative, *_or_none(1e9)]
"""A standard deviation."""
LogSigma = Annotated[float, Field(ge=0, le=3, allow_inf_nan=False), Number, *_or_none(3)]
"""Standard deviation of a logarithm: at 3 nothing but a factor of 20 either way is known."""
Share = Annotated[float, Field(ge=0, le=1), Number]
Count = Annotated[int, Field(ge=0, le=10**6), Number]
PositiveCount = Annotated[int, Field(ge=1, le=10**6), Number]
Millimetres = Annotated[float, Field(ge=0, le=50, allow_inf_nan=False), Number]
Reach = Annotated[float, Field(ge=0.1, le=50, allow_inf_nan=False), Number]
"""A distance beside a vessel or along it, mm."""
Depth = Annotated[float, Field(gt=0, le=5000, allow_inf_nan=False), Number]
"""Insertion depth, mm: no wire is longer than 5 m."""
Depths = Annotated[tuple[Depth, ...], Field(min_length=1)]
Offset = Annotated[float, Field(ge=-50, le=50, allow_inf_nan=False), Number]
"""What stated depths are off by, mm."""
Factor = Annotated[float, Field(ge=1e-6, le=1e6, allow_inf_nan=False), Number]
Friction = Annotated[float, Field(ge=0, le=10, allow_inf_nan=False), Number]
"""Coulomb's coefficient: a hydrophilic wire has 0.01 to 0.1."""
Turn = Annotated[float, Field(ge=-1e5, le=1e5, allow_inf_nan=False), Number]
"""An angle, degrees."""
Roll = Turn | Annotated[tuple[Turn, ...], Field(min_length=1)] | Literal["fit"]
Spread = Annotated[float, Field(ge=0, le=180, allow_inf_nan=False), Number, *_or_none(180)]
"""Standard deviation of an angle, degrees: beyond half a turn nothing is known of it."""
Step = Annotated[float, Field(ge=0.01, le=100, allow_inf_nan=False), Number]
"""Step along a curve, mm: below 10 µm a run would hang instead of getting more accurate."""
Radius = Annotated[float, Field(ge=1e-3, le=20, allow_inf_nan=False), Number]
Place = Annotated[float, Field(ge=-1e4, le=1e4, allow_inf_nan=False), Number]
Point = tuple[Place, Place, Place]
"""LPS mm."""
Vector = tuple[Finite, Finite, Finite]
_Plain = Annotated[float, Number]
Profile = _Plain | list[tuple[_Plain, _Plain]]
"""A number for the whole wire, or pairs (distance from the tip in mm, value), linear between, constant beyond."""


def scaled(profile: Profile, factor: float) -> Profile:
    """A profile with its values, not its distances, times a factor."""
    if isinstance(profile, (int, float)):
        return float(profile * factor)
    return [(distance, float(value * factor)) for distance, value in profile]


_PROFILE = WithJsonSchema(
    {
        "anyOf": [
            {"type": "number"},
            {
                "type": "array",
                "items": {"type": "array", "prefixItems": [{"type": "number"}] * 2, "minItems": 2, "maxItems": 2},
                "$comment": "pairs [[distance from the tip in mm, number], ...]",
            },
        ]
    }
)


def _not_zero(value: Vector) -> Vector:
    if math.hypot(*value) < 1e-9:
        raise ValueError("a direction of length zero; give three numbers that are not all 0")
    return value


def _unit(value: Vector) -> Vector:
    size = math.hypot(*_not_zero(value))
    return value[0] / size, value[1] / size, value[2] / size


def _checked(value: Profile, *, lowest: float, highest: float) -> Profile:
    pairs = [(0.0, value)] if isinstance(value, (int, float)) else value
    if not pairs:
        raise ValueError("an empty profile; give a number or [[distance from tip mm, value], ...]")
    distances = [s for s, _ in pairs]
    if distances != sorted(distances) or not 0 <= distances[0] <= distances[-1] < math.inf:
        raise ValueError(f"distances from the tip {distances!s:.200} must be >= 0 and must not decrease")
    if any(not lowest <= v <= highest for _, v in pairs):
        above = "" if lowest < 0 else " and above 0"
        raise ValueError(f"values {[v for _, v in pairs]!s:.200} must be finite{above}, at most {highest:g}")
    return value


def _torsional(value: float) -> float:
    most = wire.STIFFNESS_N_MM2.largest
    if most < value < math.inf:
        raise ValueError(f"{value:g}; expected {most:g} at most, or inf: the tip turns as the hand does")
    return value


Torsional = Annotated[float, Field(ge=wire.STIFFNESS_N_MM2.least), Number, AfterValidator(_torsional)]
WallStiffness = Annotated[float, Field(ge=wall.STIFFNESS_N_MM2.least, le=wall.STIFFNESS_N_MM2.largest), Number]
Axis = Annotated[Vector, AfterValidator(_not_zero)]
Direction = Annotated[Vector, AfterValidator(_unit)]
"""A vector, normalised to length 1."""
PositiveProfile = Annotated[Profile, AfterValidator(partial(_checked, lowest=1e-12, highest=1e9)), _PROFILE]
OpacityProfile = Annotated[Profile, AfterValidator(partial(_checked, lowest=1e-3, highest=1e6)), _PROFILE]
FiniteProfile = Annotated[Profile, AfterValidator(partial(_checked, lowest=-100.0, highest=100.0)), _PROFILE]


def _visible(value: Any) -> Any:
    """A name without blanks around it; ValueError for one with characters that nobody sees, as two would differ by."""
    if not isinstance(value, str):
        return value
    name = value.strip()
    if value and not name:
        raise ValueError("blanks alone; write it in letters and digits, or leave the key out")
    if not name.isprintable():
        raise ValueError(f"{value!r:.200} has characters that are not seen; write it in letters and digits")
    return name


Name = Annotated[str, BeforeValidator(_visible)]
"""What people call a group, or a phantom."""


def _on_one_line(value: Any) -> Any:
    """A sentence, its lines joined; ValueError for what a terminal obeys, or nobody sees."""
    joined = " ".join(value.split()) if isinstance(value, str) else ""
    if not joined.isprintable():
        raise ValueError(f"{joined!r:.200} has characters that are not seen; write it without them")
    return joined if isinstance(value, str) else value


Sentence = Annotated[str, BeforeValidator(_on_one_line)]
"""What a user says of a case, for the pages and the terminal."""
