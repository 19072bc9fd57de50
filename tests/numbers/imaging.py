"""Small studies through the whole pipeline, from scan to metrics, budget and the numbers behind the figures."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pandas as pd

from data_synthetic import catalogue
from pipeline.cli import main
from pipeline.model import Volume
from pipeline.segment import segment
from pipeline.trace import trace
from tests.numbers.kept import Numbers, Scene, digest
from tests.unseen import undrawn

TIMES = re.compile(r"(_s|_ms)$|time")
"""Columns that the machine's speed is in."""


def columns(path: Path) -> Iterator[tuple[str, list[float]]]:
    """Each column of numbers of a table, as it is where it is short."""
    table = pd.read_csv(path)
    for name in (name for name in table if not TIMES.search(str(name))):
        if pd.api.types.is_numeric_dtype(table[name]) and table[name].notna().any():
            values = table[name].to_numpy(float)
            yield f"{path.stem}.{name}", list(values) if len(values) < 5 else digest(values)


def arrays(path: Path) -> Iterator[tuple[str, list[float]]]:
    """Each array of a file of curves and pictures."""
    found: list[tuple[str, list[float]]] = []
    with h5py.File(path) as file:
        file.visititems(lambda name, item: found.append((name, digest(item[...]))) if hasattr(item, "shape") else None)
    yield from ((name.replace("/", "_"), values) for name, values in found)


def results(out: Path) -> Numbers:
    """What a run left: its tables, its curves and the data of its figures."""
    case = next((out / "cases").iterdir())
    tables = [case / "errors.csv", case / "entries.csv", out / "summary.csv", *sorted((case / "figures").glob("*.csv"))]
    found = dict(pair for path in tables if path.stem != "run_time" and path.exists() for pair in columns(path))
    return found | dict(arrays(case / "frames.h5"))


def run(scene: str, *settings: str, size: int = 60, frames: int = 2) -> Numbers:
    """A scene of the catalogue written, run and read."""
    with tempfile.TemporaryDirectory() as folder:
        study = [f"{folder}/study", "--frames", str(frames), "--size", str(size), "--seed", "3", "-q"]
        assert main(["synth", scene, "-o", *study]) == 0
        with undrawn():  # the numbers behind figures are looked at, not a pixel
            assert main(["run", f"{folder}/study/manifest.toml", "-o", f"{folder}/out", "--no-cache", *settings]) == 0
        return results(Path(folder) / "out")


def segmented(scene: str, size: int = 64) -> Numbers:
    """The vessel of a scene's reference scan; and the wire of its frame where no reference is given."""
    study = catalogue.build(scene, frames=1, size=size, truth_step_mm=0.8, seed=6)
    setup, grid = study.setup, study.grid
    place = grid.spacing_mm, grid.origin_mm, grid.direction
    reference, frame = (Volume(np.asfortranarray(scan), *place) for scan in (study.reference, study.frame(0)))
    lumen = segment(reference, [setup.entry_mm + 3.0 * setup.direction])
    curve = trace(frame, lumen, setup.entry_mm, setup.direction, expected_mm=setup.depths_mm[0])
    return {
        "distance": digest(lumen.distance.values),
        "box": [*lumen.distance.origin_mm, *np.shape(lumen.distance.values), len(lumen.warnings)],
        "levels": [lumen.wall_level, *(lumen.levels[name] for name in sorted(lumen.levels))],
        "counters": [lumen.counters[name] for name in sorted(lumen.counters)],
        "curve": [*digest(curve.points_mm), curve.length_mm, *digest(curve.sigma_mm)],
        "traced": [curve.levels[name] for name in sorted(curve.levels)],
    }


SCENES: dict[str, Scene] = {
    "bifurcation": lambda: run("bifurcation", "--set", "budget.members=12", frames=3),
    "kissing": lambda: segmented("kissing-vessels"),
    "bone": lambda: segmented("bone-wall", 72),
    "aneurysm": lambda: segmented("aneurysm-neck"),
    "anisotropic": lambda: segmented("anisotropic", 72),
    "moved": lambda: run("moved-phantom", "--until", "trace"),
}
