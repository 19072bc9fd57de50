"""The catalogue through the command line at small size: every scene ends as it should, as well as it used to.

Some of them with every commit, all of them by ``make study``.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pandas as pd
import pytest

from data_synthetic import catalogue
from pipeline.cli import main
from reports.diff import CLOSING, diff_folders
from reports.tolerance import load_tolerance
from tests.studies.catalogue import GOLDEN, Outcome, coverage, golden, run_all, times

SAMPLE = ("bend", "missing-wire", "moved-phantom")
"""Of the others bifurcation, bone-wall and anisotropic are in ``tests.numbers.imaging``, two-wires in test_seeing."""
EXTENTS = [pytest.param(SAMPLE, id="sample"), pytest.param(catalogue.names(), id="all", marks=pytest.mark.slow)]


@pytest.fixture(scope="module", params=EXTENTS)
def outcomes(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> list[Outcome]:
    return run_all(tmp_path_factory.mktemp("catalogue"), request.param)


@pytest.fixture
def kept(outcomes: list[Outcome], tmp_path: Path) -> Path:
    """The golden tables of the scenes that were run."""
    for o in outcomes:
        shutil.copytree(GOLDEN / "cases" / o.name, tmp_path / "kept" / "cases" / o.name)
    return tmp_path / "kept"


def test_every_frame_ends_in_its_expected_status(outcomes: list[Outcome], capsys: pytest.CaptureFixture[str]) -> None:
    with capsys.disabled():
        print("\n" + coverage(outcomes))
        print(times(outcomes))
    assert not [line for o in outcomes for line in o.unexpected()]


def test_every_stage_is_entered_by_every_scene(outcomes: list[Outcome]) -> None:
    rows = [line.split("   ")[0] for line in coverage(outcomes).splitlines()[1:]]
    assert len(rows) == len(outcomes)
    assert not [row for row in rows if row.split()[1:].count("-")]


def _closing(kept: Path, out: Path) -> pd.DataFrame:
    """The rows of a comparison with the kept results for which a gate must close."""
    rows = diff_folders(kept, out, load_tolerance(GOLDEN / "tolerance.toml")).rows
    return rows[rows["verdict"].isin(CLOSING)]


def test_no_error_grew_beyond_its_tolerance(outcomes: list[Outcome], kept: Path) -> None:
    out = outcomes[0].folder.parents[1]
    bad = _closing(kept, out)
    assert bad.empty, bad.to_string(index=False)
    assert main(["diff", str(kept), str(out), "--tolerance", str(GOLDEN / "tolerance.toml")]) == 0


def test_the_gate_closes_on_a_worse_run(outcomes: list[Outcome], kept: Path, tmp_path: Path) -> None:
    for o in outcomes:
        table = golden(o.errors)
        if o.name == "bend":
            table["truth_rms_mm"] += 0.1
        folder = tmp_path / "cases" / o.name
        folder.mkdir(parents=True)
        table.to_csv(folder / "errors.csv", index=False)
    bad = _closing(kept, tmp_path)
    assert set(bad["case"]) == {"bend"}
    assert set(bad["column"]) == {"truth_rms_mm"}


def test_a_moved_phantom_is_traced_as_well_as_one_at_rest(outcomes: list[Outcome]) -> None:
    moved, rest = (next(o for o in outcomes if o.name == name) for name in ("moved-phantom", "bend"))
    more = moved.errors["trace_mean_mm"].mean() - rest.errors["trace_mean_mm"].mean()
    assert more <= 0.1 * 0.5, "a tenth of a voxel"
