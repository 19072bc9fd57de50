"""Calibration of a small study, what its design predicts, and the parameters that both know."""

from __future__ import annotations

import json
import tempfile
from dataclasses import astuple
from pathlib import Path
from typing import Any

from pipeline.calibrate.unknowns import unknowns
from pipeline.cli import main
from tests.numbers.drawn import printed
from tests.numbers.kept import Numbers, Scene, digest
from tests.numbers.runs import values_of


def parameters() -> Numbers:
    """What each parameter may be before anything is fitted."""
    found = unknowns([2.0, 1.0, 2.0], 0.1, weighed=True)
    return {u.name.replace(":", "_"): [v for v in astuple(u) if isinstance(v, float)] for u in found}


def calibrated() -> Numbers:
    """The fit to one insertion of three frames."""
    return _found("calibration.json", ("estimates", "correlation", "profiles", "frames", "insertions", "scale"))


def designed() -> Numbers:
    """What the same insertion is predicted to tell."""
    return _found("design.json", ("predicted",), "--design")


def _found(record: str, kept: tuple[str, ...], *words: str) -> Numbers:
    with tempfile.TemporaryDirectory() as folder:
        manifest, out = Path(folder) / "study/manifest.toml", Path(folder) / "out"
        made = ["synth", "bend", "-o", str(manifest.parent), "--frames", "3", "--size", "56", "--seed", "4", "-q"]
        assert main(made) == 0
        text = manifest.read_text(encoding="utf-8")
        manifest.write_text(text.replace('role = "validation"', 'role = "calibration"'), encoding="utf-8")
        with printed() as shown:
            assert main(["calibrate", str(manifest), "-o", str(out), "--no-cache", *words]) == 0
        found: dict[str, Any] = json.loads((out / record).read_text(encoding="utf-8"))
    return {name: digest(list(values_of(found[name]))) for name in kept} | shown


SCENES: dict[str, Scene] = {"parameters": parameters, "calibrated": calibrated, "designed": designed}
