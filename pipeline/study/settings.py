"""Every setting of a run, one TOML table for each stage's frozen dataclass, and where each setting comes from.

Command line > config file > default; unknown or ill-typed ones are all listed.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from pipeline.budget.config import BudgetConfig
from pipeline.compare.config import CompareConfig
from pipeline.load.config import LoadConfig
from pipeline.segment.config import SegmentConfig
from pipeline.simulate.config import SimulateConfig, SolverConfig
from pipeline.status import InputError, did_you_mean
from pipeline.study.sources import read_tables
from pipeline.trace.config import TraceConfig
from pipeline.wording import as_toml, said, sentences, shortened
from reports.texts import MalformedError, UnreadableError, toml_of


@dataclass(frozen=True)
class Config:
    """All settings of a run."""

    load: LoadConfig = field(default_factory=LoadConfig)
    segment: SegmentConfig = field(default_factory=SegmentConfig)
    trace: TraceConfig = field(default_factory=TraceConfig)
    solver: SolverConfig = field(default_factory=SolverConfig)
    simulate: SimulateConfig = field(default_factory=SimulateConfig)
    compare: CompareConfig = field(default_factory=CompareConfig)
    budget: BudgetConfig = field(default_factory=BudgetConfig)


PARAMETERS = "calibrate.parameters"
"""What config.resolved.toml calls the file that was given as --parameters."""


TYPED = "command line"
"""Where settings come from that stand beside --set."""


class SettingsError(InputError):
    """Settings that cannot be used."""

    place = "the settings"


@dataclass(frozen=True)
class Resolved:
    """The settings in force and, by ``table.key``, where each one that is not the default came from.

    calibrated : hash and name of a file of parameters that was given for all cases.
    """

    config: Config
    origin: dict[str, str]
    calibrated: tuple[str, str] | None = None

    def as_dict(self) -> dict[str, dict[str, dict[str, Any]]]:
        """{table: {key: {"value", "source"}}}, as result.json holds it."""
        value, source = self.calibrated or ("", "")
        given = {"calibrate": {"parameters": {"value": value, "source": source}}} if self.calibrated else {}
        return given | {
            table: {
                key: {"value": value, "source": self.origin.get(f"{table}.{key}", "default")}
                for key, value in values.items()
            }
            for table, values in asdict(self.config).items()
        }


@dataclass(frozen=True)
class Setting:
    """One ``table.key = value`` and who said it."""

    name: str
    value: Any
    source: str


def parse_assignment(text: str, source: str = TYPED) -> Setting:
    """``table.key=value`` as typed after --set; the value is TOML, a bare word is a string."""
    name, equals, raw = text.partition("=")
    if not equals or "." not in name:
        raise SettingsError([f"{source}: {text!r} is no setting; write table.key=value, as in solver.segment_mm=0.5"])
    try:
        found = toml_of(f"value = {raw.strip()}", f"{source}: {name.strip()}")
    except MalformedError:
        found = {"value": raw.strip()} | dict.fromkeys(raw.strip().splitlines()[1:])
    except UnreadableError as error:
        raise SettingsError([str(error)]) from None
    if len(found) > 1:
        why = "more than one value, and what follows would be lost; write one, and further settings with --set each"
        raise SettingsError([f"{source}: {name.strip()} = {shortened(as_toml(raw.strip()))}: {why}"])
    return Setting(name.strip(), found["value"], source)


def read_settings(path: Path) -> list[Setting]:
    """All settings of a TOML file of tables."""
    found: list[Setting] = []
    for table, values in read_tables(path, SettingsError, "no such file; wireval settings prints one").items():
        if not isinstance(values, dict):
            raise SettingsError([f"{path}: {table!r} stands outside a table; write [solver] and the like above it"])
        found += [Setting(f"{table}.{key}", value, path.name) for key, value in values.items()]
    return found


def without_parameters(settings: Sequence[Setting], *, given: bool) -> list[Setting]:
    """The settings of files alone; raises SettingsError where they were used with parameters and none are ``given``.

    Without them the same settings make other wires: rms 0.22 for 0.026 mm.
    """
    used = [one for one in settings if one.name == PARAMETERS]
    if used and not given:
        file, path = used[0].source, used[0].value
        raise SettingsError(
            [
                f"{file}: these settings were used with the parameters of {path}; say --parameters {path}, too, or "
                f"take {PARAMETERS} out of the file to run with what the manifest states"
            ]
        )
    return [one for one in settings if one.name != PARAMETERS]


def resolve(settings: Sequence[Setting]) -> Resolved:
    """Apply settings in order (later ones win); raises SettingsError listing every problem."""
    config, origin = Config(), {}
    problems: list[str] = []
    for setting in settings:
        try:
            config = _applied(config, setting)
            origin[setting.name] = setting.source
        except SettingsError as error:
            problems += error.problems
    if problems:
        raise SettingsError(problems)
    return Resolved(config, origin)


def _applied(config: Config, setting: Setting) -> Config:
    table, _, key = setting.name.partition(".")
    tables = {item.name for item in fields(config)}
    if table not in tables:
        raise SettingsError([f"{setting.source}: no table {table!r}; {did_you_mean(table, tables)}"])
    current = getattr(config, table)
    kinds = {item.name for item in fields(current)}
    if key not in kinds:
        raise SettingsError([f"{setting.source}: no setting {setting.name!r}; {did_you_mean(key, kinds)}"])
    adapter, written = TypeAdapter(type(current)), {key: setting.value}
    try:
        value = getattr(adapter.validate_python(written), key)
    except ValidationError as error:
        found = sentences(error, written, adapter.json_schema())
        raise SettingsError([f"{setting.source}: {table}.{said(*one)}" for one in found]) from None
    return replace(config, **{table: replace(current, **{key: value})})


def to_toml(resolved: Resolved) -> str:
    """config.resolved.toml: every setting with a comment saying where it came from; reads back through -c.

    Parameters are no setting: their file is named, and -c asks for it.
    """
    lines = []
    if resolved.calibrated:
        digest, path = resolved.calibrated
        table, _, key = PARAMETERS.partition(".")
        lines = [f"[{table}]", f"{key} = {json.dumps(path, ensure_ascii=False)}  # {digest}", ""]
    for table, items in replace(resolved, calibrated=None).as_dict().items():
        lines += [f"[{table}]", *(_line(key, item) for key, item in items.items()), ""]
    return "\n".join(lines)


def _line(key: str, item: dict[str, Any]) -> str:
    """One setting. TOML takes a value as JSON writes it, but has no null: what is left to the data is a comment."""
    if item["value"] is None:
        return f"# {key}: estimated from the data"
    return f"{key} = {json.dumps(item['value'], ensure_ascii=False)}  # {item['source']}"
