"""Settings at the ends of their ranges: what a wire or the solver cannot take is told before anything is computed."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from pipeline.benchmark.cost import costs
from pipeline.benchmark.insert import SolverSetting
from pipeline.benchmark.scenes import bend
from pipeline.cli import main
from pipeline.simulate import guide_wire
from pipeline.study.coarse import too_coarse
from pipeline.study.manifest import read_manifest
from pipeline.study.settings import parse_assignment, resolve
from solver import GuideWire


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wire whose tip has a rest curvature of 0.12 per mm: segments of 13.09 mm turn by a right angle."""
    folder = tmp_path_factory.mktemp("coarse") / "study"
    assert main(["synth", "straight", "-o", str(folder), "--size", "72", "--frames", "2"]) == 0
    return folder


def refused(study: Path, *settings: str, calibrates: bool = False) -> str:
    """What is said of a study before it is run."""
    config = resolve([parse_assignment(text) for text in settings]).config
    return "\n".join(too_coarse(read_manifest(study / "manifest.toml").cases, config, calibrates=calibrates))


def test_segments_are_refused_exactly_where_the_solver_would(study: Path) -> None:
    wire = read_manifest(study / "manifest.toml").cases[0].wire
    for length in (math.pi / 2 / 0.12 - 1e-6, math.pi / 2 / 0.12 + 1e-6):
        fits = not refused(study, f"solver.segment_mm={length}")
        try:
            guide_wire(wire, length)
        except ValueError:
            assert not fits
        else:
            assert fits
    said = refused(study, "solver.segment_mm=20")
    assert "case 'straight': solver.segment_mm = 20: segments of 20 mm cannot follow a rest curvature of 0.12" in said
    assert "allowed: up to 13.08 mm for this wire, or auto" in said


def test_what_is_drawn_or_tried_has_to_fit_too(study: Path) -> None:
    assert not refused(study, "solver.segment_mm=12")
    assert "up to 1.2 times that in a budget" in refused(study, "solver.segment_mm=12", "budget.members=20")
    assert "up to 4 times that in a calibration" in refused(study, "solver.segment_mm=4", calibrates=True)
    assert not refused(study, "solver.segment_mm=3", calibrates=True)
    assert "lower simulate.rest_curvature_scale" in refused(study, "simulate.rest_curvature_scale=1000")
    assert not refused(study)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--set", "solver.segment_mm=20"), "segments of 20 mm cannot follow"),
        (("--sweep", "solver.segment_mm=1,19"), "segments of 19 mm cannot follow"),
        (("--set", "solver.segment_mm=50"), "expected a number from 0.01 to 20"),
        (("--set", "solver.hull=samples:257"), "N from 1 to 256"),
        (("--set", "simulate.friction=11"), "expected a number from 0 to 10"),
        (("--set", "segment.scale=1000"), "expected a whole number from 0 to 2"),
        (("--set", "segment.least_voxels=0"), "expected a whole number from 1"),
        (("--set", "simulate.roll_offset_deg=1e9"), "expected a number from -100000 to 100000"),
    ],
)
def test_nothing_is_computed(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], said: str
) -> None:
    """Each was "crashed", with a traceback in the log."""
    assert main(["run", str(study), "-o", str(tmp_path / "out"), *words]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_what_the_solver_alone_refuses_is_a_status(study: Path, tmp_path: Path) -> None:
    """Profiles have no farther end than 10 km; while the clamp was fitted that crashed."""
    words = ["-q", "--until", "simulate", "--set", "simulate.taper_scale=1e6"]
    assert main(["run", str(study), "-o", str(tmp_path), *words]) == 1
    failures = pd.read_csv(tmp_path / "failures.csv")
    assert set(failures["status"]) == {"simulate_failed"}
    assert failures["message"].str.contains("distances from the tip").all()


def test_a_bench_leaves_out_segments_that_a_wire_cannot_follow() -> None:
    """A tip of 3 mm radius ended the study of one's own case with a traceback."""
    scene = replace(bend(4.0), guide_wire=GuideWire(0.5, 0.18, 5.0, rest_curvature_per_mm=1 / 3.0))
    rows = list(costs([scene], [SolverSetting(5.0), SolverSetting(2.0)], repeats=1, fine_mm=0.5))
    assert [row["segment_mm"] for row in rows] == [2.0]
