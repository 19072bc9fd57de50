"""Curves of cases that are finished, read back from their folders."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from pipeline.compare.config import CompareConfig
from pipeline.model import Array
from pipeline.run import ledger
from pipeline.run.overall import Found
from reports.frames_file import read_arrays
from reports.records import read_json

Traces = Mapping[int, tuple[float, Array]]
"""By frame, the depth in mm and the traced wire (n, 3)."""


def compare_of(out: Path, case: Found) -> CompareConfig:
    """How a run samples curves, which is the same for all cases that are pooled: its step, and what no score counts."""
    known = read_json(out / "cases" / case.result.case / ledger.RESULT).get("config", {}).get("compare", {})
    plain = CompareConfig()
    sample, skip = (float(known.get(name, {}).get("value", getattr(plain, name))) for name in ("sample_mm", "skip_mm"))
    return CompareConfig(sample, skip)


def arrays_of(out: Path, case: Found, name: str) -> dict[int, Array]:
    """Curves of a case by frame, those of at least two points."""
    kept: Mapping[int, Mapping[str, Array]] = {}
    with suppress(OSError, KeyError, ValueError):  # a finished case whose ledger does not fit it counts as damaged
        kept = read_arrays(out / "cases" / case.result.case / ledger.FRAMES, name)
    return {number: arrays[name] for number, arrays in kept.items() if len(arrays.get(name, ())) > 1}


def traces_of(out: Path, case: Found) -> Traces:
    """The traces of a case that are to be trusted, whatever became of the simulated wire."""
    curves = arrays_of(out, case, "traced_mm")
    return {number: (depth, curves[number]) for number, depth in case.traced_mm.items() if number in curves}
