"""The manifest as it is written (TOML) and as it is used: one class for each table, checked by pydantic.

Everything that is wrong with it is listed at once.
"""

from collections import Counter
from collections.abc import Iterator, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    BeforeValidator,
    Field,
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    field_validator,
    model_validator,
)
from pydantic.config import JsonDict

from pipeline.model import OverWire, Uncertainty, Wall, Wire
from pipeline.ranges import (
    Axis,
    Depths,
    Direction,
    Name,
    Number,
    PerFrame,
    Point,
    Positive,
    Roll,
    Sentence,
    Sigma,
    Spread,
    Strict,
)
from pipeline.status import InputError, did_you_mean
from pipeline.study.case_rules import borrowing_problems, catheter_problems, not_one_per_frame
from pipeline.study.others import LONGEST_NAME, OthersText
from pipeline.study.sources import MaskText, PathText, Sources, SourceText, read_tables
from pipeline.wording import WRITTEN_HERE, Place, as_toml, said, saying, sentences, shortened


def _wire(value: Any, info: ValidationInfo) -> Wire:
    """The wire of that name among ``[wires.*]``, which are read first."""
    wires: dict[str, Wire] = (info.context or {}).get("wires", {})
    if not isinstance(value, str) or value not in wires:
        problem = f"wire {shortened(as_toml(value))} is not among [wires.*]; {did_you_mean(str(value), wires)}"
        raise saying(*[problem] * bool(wires))  # where the wires themselves are wrong, that is all there is to say
    return wires[value]


def _not_written(value: Any, info: ValidationInfo) -> None:
    """A key that is filled in here, never by the user."""
    known = {"entry_case": 'entry = "case:ID"'}
    raise ValueError(f"unknown key; write {known.get(str(info.field_name), 'parameters = FILE')}")


ONE_OF_THEM: JsonDict = {"type": "string", "$comment": "the name of one of [wires.*], in quotes"}
FILLED_IN = BeforeValidator(_not_written), WithJsonSchema(WRITTEN_HERE)
IDS: JsonDict = {"$comment": f"up to {LONGEST_NAME} of A-Z, a-z, 0-9 and . _ -, a letter or a digit first"}
ANOTHER: JsonDict = {"$comment": '"case:ID", with the id of another case'}
LEAST_ACROSS_DEG = 5.0
"""Between material_axis and entry_direction: more than a clamp's direction is found to be off by."""


class Case(Strict):
    """One ``[[case]]`` table, an insertion: paths are resolved, the wire is looked up, everything is in LPS mm."""

    id: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$", max_length=LONGEST_NAME, json_schema_extra=IDS)]
    role: Literal["validation", "calibration"] = "validation"
    assumed: tuple[Annotated[Sentence, Field(min_length=1, max_length=1000)], ...] = ()
    group: Name = Field(default_factory=lambda data: data.get("id", ""), min_length=1, max_length=200)
    phantom: Name = Field("", max_length=200)
    reference: SourceText | None = None
    frames: Sources = ()
    entry_mm: Point
    entry_direction: Direction
    entry: Annotated[str, Field(pattern=r"^(case:.+)?$", json_schema_extra=ANOTHER)] = ""
    entry_case: Annotated["Case | None", *FILLED_IN] = None
    entry_sigma_mm: Sigma | None = None
    entry_direction_sigma_deg: Spread = 2.0
    material_axis: Axis | None = None
    wire: Annotated[Wire, BeforeValidator(_wire), WithJsonSchema(ONE_OF_THEM)]
    insertion_mm: Depths | None = None
    insertion_sigma_mm: Sigma | None = None
    spacing_mm: tuple[Positive, Positive, Positive] | None = None
    lumen: MaskText | None = None
    traces: Sources = ()
    parameters: PathText | None = None
    calibrated: Annotated[str, *FILLED_IN] = ""
    calibrated_sigma: Annotated[dict[str, float], *FILLED_IN] = Field(default_factory=dict)
    as_stated: Annotated[str, *FILLED_IN] = ""
    own_parameters: Annotated[str, *FILLED_IN] = ""
    calibrated_kin: Annotated[str, *FILLED_IN] = ""
    calibrated_scans: Annotated[tuple[str, ...], *FILLED_IN] = ()
    calibrated_traces: Annotated[tuple[tuple[Point, ...], ...], *FILLED_IN] = ()
    roll_deg: Roll = 0.0
    roll_sigma_deg: Spread | None = None
    push_force_N: PerFrame | None = None
    push_force_sigma_N: Positive = 0.001
    lumen_seed_mm: Annotated[tuple[Point, ...], Field(min_length=1)] = Field(
        default_factory=lambda data: (data.get("entry_mm"),)
    )
    truth: PathText | None = None
    projections: PathText | None = None
    simulated: OthersText = None
    wall: Wall = Wall()
    uncertainty: Uncertainty = Uncertainty()
    down: Axis | None = None
    catheter: OverWire | None = None

    @property
    def frame_count(self) -> int:
        """Frames to report on: scans, or own curves or depths of a case without scans."""
        return len(self.frames) or len(self.traces) or len(self.insertion_mm or ())

    @property
    def compared(self) -> bool:
        """Whether the real wire is known: in scans, as own curves or from projections."""
        return bool(self.frames or self.traces or self.projections)

    @property
    def frames_to_score(self) -> int:
        """Frames that count as planned in numbers over a run, as far as the manifest tells: a file may hold several."""
        if self.role == "calibration" or not self.compared:
            return 0
        return max(len(self.insertion_mm or ()), self.frame_count) - (self.roll_deg == "fit")

    @property
    def unconfirmed(self) -> tuple[str, ...]:
        """What is assumed, less what another key has made void."""
        void = {
            "roll_deg:": self.roll_deg == "fit",
            "material_axis:": self.material_axis is not None,
            "lumen_seed_mm:": self.lumen_seed_mm != (self.entry_mm,) or self.lumen is not None,
            "insertion_mm:": self.insertion_mm is not None,
        }
        return tuple(text for text in self.assumed if not void.get(text.partition(" ")[0]))

    @property
    def stated_roll_deg(self) -> float | tuple[float, ...]:
        """The roll, one for all frames or one per frame; 0 where it is to be fitted."""
        return 0.0 if self.roll_deg == "fit" else self.roll_deg

    @property
    def lists(self) -> dict[str, Any]:
        """What must have one entry per frame."""
        catheter = self.catheter and self.catheter.insertion_mm
        named = {"insertion_mm": self.insertion_mm, "catheter insertion_mm": catheter}
        return {**named, "roll_deg": self.stated_roll_deg, "traces": self.traces, "push_force_N": self.push_force_N}

    @model_validator(mode="after")
    def _something_to_do(self) -> "Case":
        if not (self.frames or self.traces) and self.insertion_mm is None:
            raise ValueError("neither frames nor insertion_mm: give scans (or traces) to compare with, or depths")
        if self.projections and (self.frames or self.traces):
            raise ValueError("projections beside frames or traces: one tells of the real wire; make two cases")
        if self.projections and self.roll_deg == "fit":
            raise ValueError('roll_deg = "fit" with projections: they cannot fit a roll, scans or traces can; state it')
        if not self.frames and self.reference is None and self.lumen is None:
            raise ValueError("no frames, no reference and no lumen: there is no vessel to simulate in")
        return self

    @model_validator(mode="after")
    def _fits_together(self) -> "Case":
        problems = []
        if self.wire.weight_N_per_mm > 0 and self.down is None:
            problems.append(
                f"down is missing: wire {self.wire.name!r} has a weight; [0, 1, 0] for a patient on the back"
            )
        problems += self._axis_along_the_wire()
        # files of scans may hold several volumes each: how many is known once their headers are read
        problems += () if self.frames else not_one_per_frame(self.lists, self.frame_count)
        if self.catheter is not None:
            problems += catheter_problems(self.catheter, self.wire.radius_mm, self.insertion_mm or ())
        if problems:
            raise saying(*problems)
        return self

    def _axis_along_the_wire(self) -> list[str]:
        """That material_axis, which shows where roll 0 points across the wire, points along it."""
        if self.material_axis is None:
            return []
        along = abs(float(np.dot(self.material_axis, self.entry_direction)))
        if along < np.cos(np.radians(LEAST_ACROSS_DEG)):
            return []
        found = f"material_axis = {list(self.material_axis)} is within {LEAST_ACROSS_DEG:g} degrees of entry_direction"
        return [f"{found}; give a direction across the wire, where its curved tip points at roll 0, or leave it out"]


class ManifestTables(Strict):
    """The whole file."""

    schema_: Annotated[Literal[1], Number, Field(alias="schema")]
    wires: dict[str, Wire]
    case: Annotated[list[Case], Field(min_length=1)]

    @field_validator("wires", mode="before")
    @classmethod
    def _named(cls, value: Any) -> Any:
        """A wire carries the name of its table."""
        if not isinstance(value, dict):
            return value
        return {k: {"name": k} | table if isinstance(table, dict) else table for k, table in value.items()}

    @field_validator("wires")
    @classmethod
    def _known_to_cases(cls, value: dict[str, Wire], info: ValidationInfo) -> dict[str, Wire]:
        for name, wire in value.items():
            if wire.name != name:
                raise saying(f"wires {name} name: unknown key; a wire has the name of its table")
        if info.context is not None:
            info.context["wires"] = value
        return value

    @model_validator(mode="after")
    def _entries_known(self) -> "ManifestTables":
        if problems := borrowing_problems({c.id: (c.entry, bool(c.frames or c.traces)) for c in self.case}):
            raise saying(*problems)
        return self

    @model_validator(mode="after")
    def _unique(self) -> "ManifestTables":
        counts = Counter(case.id for case in self.case)
        what = "this id is used more than once; ids name output folders"
        problems, taken = [f"case {name!r}: {what}" for name, count in counts.items() if count > 1], dict[str, str]()
        for name in counts:
            first = taken.setdefault(name.lower(), name)
            if name != first:
                what = f"this id differs from {first!r} by capital letters alone; rename one"
                problems.append(f"case {name!r}: {what}: ids name output folders, which some disks do not tell apart")
        if problems:
            raise saying(*problems)
        return self


class ManifestError(InputError):
    """The manifest cannot be used. sound : those of its cases with which nothing is wrong in themselves."""

    def __init__(self, problems: Sequence[str], sound: Sequence[Case] = ()) -> None:
        super().__init__(problems)
        self.sound = sound


@dataclass(frozen=True)
class Manifest:
    """A whole study."""

    path: Path
    cases: tuple[Case, ...]

    def without(self, ids: Set[str]) -> "Manifest":
        """The same study less some of its cases."""
        return Manifest(self.path, tuple(case for case in self.cases if case.id not in ids))


def read_manifest(path: Path) -> Manifest:
    """Read and check a manifest (not the scans); raises ManifestError with every problem found."""
    data = read_tables(path, ManifestError, "no such manifest")
    context: dict[str, Any] = {"folder": path.parent}
    try:
        tables = ManifestTables.model_validate(data, context=context)
    except ValidationError as error:
        raise ManifestError([f"{path}: {text}" for text in _problems(data, error)], [*_sound(data, context)]) from None
    held = {f"case:{case.id}": case for case in tables.case}
    return Manifest(path, tuple(case.model_copy(update={"entry_case": held.get(case.entry)}) for case in tables.case))


def _sound(data: dict[str, Any], context: dict[str, Any]) -> Iterator[Case]:
    """Those cases of a refused manifest that are right in themselves. context : with its wires, where these are."""
    cases = data.get("case")
    for table in cases if isinstance(cases, list) else ():
        with suppress(ValidationError):
            yield Case.model_validate(table, context=context)


_schema = cache(ManifestTables.model_json_schema)


def _problems(data: dict[str, Any], error: ValidationError) -> Iterator[str]:
    """Everything that is wrong with a manifest, a sentence each: case, key, what was found, what is allowed."""
    for place, sentence in sentences(error, data, _schema()):
        yield said(_named(data, place), sentence)


def _named(data: dict[str, Any], place: Place) -> Place:
    """A place with a case called by its id instead of its number."""
    match place:
        case ("case", int(number), *rest):
            case = data["case"][number]
            name = case.get("id", number) if isinstance(case, dict) else number
            called = repr(name) if isinstance(name, str) else as_toml(name)
            return (f"case {shortened(called, 2 * LONGEST_NAME)}", *rest)
    return place
