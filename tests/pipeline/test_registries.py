"""A metric and a predictor from outside are one registration each: tables, pooling and pages have them at once."""

from __future__ import annotations

import json
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from pipeline.arrays.polyline import to_length
from pipeline.cli import main
from pipeline.compare import metrics, nulls
from pipeline.compare.metrics import Pair
from pipeline.compare.nulls import Clues, PredictorInputs
from pipeline.model import Array
from pipeline.run import ledger
from pipeline.run.case import Job, why_again
from pipeline.run.own import not_loaded, refuse_scripts, registered, with_own
from pipeline.status import UsageError
from pipeline.study.manifest import read_manifest
from pipeline.study.settings import resolve
from reports.schema import ERRORS, SUMMARY, Column
from tests.reports.fake_results import FakeCase, write_run
from tests.studies import metrics_page

MANIFEST = """
schema = 1
[wires.w]
radius_mm = 0.18
bending_stiffness_N_mm2 = 10.0
[[case]]
id = "tube"
lumen = "none.stl"
entry_mm = [0.0, 0.0, 0.0]
entry_direction = [0.0, 0.0, 1.0]
wire = "w"
insertion_mm = [6.0]
"""


def test_a_metric_that_raises_is_named() -> None:
    with pytest.raises(RuntimeError, match="metric 'near_share': ZeroDivisionError: division by zero"):
        metrics.measured("near_share", lambda _: 1 / 0, None)  # type: ignore[arg-type]


@pytest.mark.slow
def test_results_of_own_functions_are_not_kept(as_before: None, tmp_path: Path) -> None:
    """What they close over, a partial's values and the modules that they call may have changed unseen."""
    folder = write_run(tmp_path, (FakeCase("tube"),)) / "cases" / "tube"
    job = job_of(tmp_path)
    ledger.write(folder, job.key)
    assert why_again(job) is None
    metrics.register(Column("own_mm", "mm", "mine"), partial(metrics.distal_rms, length_mm=5.0))
    ledger.write(folder, job.key)
    assert "results of functions of your own (own_mm) are never kept" in (why_again(job) or "")


def test_workers_have_what_a_module_registers_or_it_is_refused(as_before: None) -> None:
    """Their column was empty, and the run ok without a word."""
    metrics.register(Column("own_mm", "mm", "mine"), float)  # type: ignore[arg-type]
    own = registered()
    assert own == {"own_mm": "builtins"}
    assert with_own(own, abs, -2) == 2
    with pytest.raises(RuntimeError, match="other_mm: not registered when math is imported"):
        with_own({"other_mm": "math"}, abs, -2)
    refuse_scripts(own)
    with pytest.raises(UsageError, match="own_mm: registered in a script or a notebook"):
        refuse_scripts({"own_mm": "__main__"})


@pytest.mark.parametrize(
    ("module", "do"),
    [("__main__", "call main([]) at the end of that script"), ("mine.errors", "in Python import it, then main([])")],
)
def test_what_a_script_has_registered_cannot_be_imported(tmp_path: Path, module: str, do: str) -> None:
    (tmp_path / "run.json").write_text(json.dumps({"own": {"own_mm": module}}), encoding="utf-8")
    (said,) = not_loaded(tmp_path, "main([])")
    assert said.endswith(f"which is not loaded here: its columns would be lost; {do}")


@pytest.mark.parametrize("told", ["its tip", ""])
def test_a_cell_of_a_notebook_may_be_run_again(as_before: None, told: str) -> None:
    """It was told to choose another name. What another module registered, and the product's own, are not replaced."""
    for limit, pooled in ((1.0, "median"), (2.0, "max")):
        metrics.register(Column("own_mm", "mm", "mine", pooled=pooled), lambda _, limit=limit: limit)  # type: ignore[misc]
        nulls.register("ray", "straight on", f"{limit}", straight_on, told if limit == 1.0 else "")
    assert metrics.METRICS["own_mm"](None) == 2.0  # type: ignore[arg-type]
    assert ERRORS.names.count("own_mm") == ERRORS.names.count("null_ray_rms_mm") == 1
    assert ("own_median_mm" in SUMMARY.names, "own_max_mm" in SUMMARY.names) == (False, True)
    assert "ray" in nulls.rivals()
    for name, other in (("own_mm", len), ("rms_mm", lambda _: 0.0)):
        with pytest.raises(ValueError, match=f"errors.csv has a column '{name}'"):
            metrics.register(Column(name, "mm", "another"), other)


def test_every_metric_is_defined_in_one_place() -> None:
    """Name, unit, formula and pooling stand in columns.toml; the page is made of them."""
    assert not [name for name in metrics.METRICS if not ERRORS[name].formula]
    columns = [ERRORS[f"null_{name}_rms_mm"] for name in nulls.NULLS]
    assert not [column.name for column in columns if not (column.formula or column.module)]
    assert metrics_page.PAGE.read_text(encoding="utf-8") == metrics_page.text(), "python -m tests.studies.metrics_page"


class Scaled:
    """A metric that is no function."""

    def __call__(self, pair: Pair) -> float:
        return 2.0 * float(pair.error_mm.max())


@pytest.mark.parametrize("metric", [partial(lambda factor, _: factor, 2.0), Scaled(), len])
def test_whatever_can_be_called_may_be_a_metric(as_before: None, tmp_path: Path, metric: Any) -> None:
    before = job_of(tmp_path).key
    metrics.register(Column("own_mm", "mm", "mine"), metric)
    assert job_of(tmp_path).key not in ("", before)


def job_of(folder: Path) -> Job:
    """The job of a case without files."""
    manifest = folder / "manifest.toml"
    manifest.write_text(MANIFEST, encoding="utf-8")
    return Job(read_manifest(manifest).cases[0], resolve([]), folder)


@pytest.fixture
def as_before() -> Iterator[None]:
    """Take back what a test registers."""
    columns = ERRORS.columns, SUMMARY.columns
    registries: tuple[dict[str, Any], ...] = metrics.METRICS, nulls.NULLS, nulls.TOLD
    known = [dict(registry) for registry in registries]
    yield
    ERRORS.columns, SUMMARY.columns = columns
    for registry, entries in zip(registries, known, strict=True):
        registry.clear()
        registry.update(entries)


def straight_on(clues: Clues, depth_mm: float, _seen: PredictorInputs) -> Array:
    """A wire that ignores the vessel."""
    return to_length(np.array([clues.clamp.entry_mm, clues.clamp.entry_mm + clues.clamp.direction]), depth_mm)


def test_a_metric_and_a_predictor_from_outside(
    as_before: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    study, out = tmp_path / "study", tmp_path / "out"
    assert main(["synth", "bend", "-o", str(study), "--frames", "3", "--size", "64"]) == 0
    words = ["run", str(study / "manifest.toml"), "-o", str(out), "--no-cache"]
    assert main([*words, "--until", "compare"]) == 0  # what is kept must not stay
    meaning = "share of the points within 0.1 mm of the traced curve"
    shown = {"frames": ""}
    column = Column("near_share", "1", meaning, better="high", pooled="mean", shown=shown)
    metrics.register(column, lambda pair: float(np.mean(pair.error_mm < 0.1)))
    nulls.register("ray", "straight on", "a straight line along the entry's direction", straight_on)
    assert main(words) == 0
    frames, points = (pd.read_csv(out / "cases" / "bend" / name) for name in ("errors.csv", "points.csv.gz"))
    summary = pd.read_csv(out / "summary.csv")
    expected = (points["error_mm"] < 0.1).groupby(points["frame"]).mean()
    np.testing.assert_allclose(frames["near_share"], expected, rtol=1e-8)
    assert summary["near_share"][0] == pytest.approx(float(expected.mean()), rel=1e-8)
    assert (frames["null_ray_rms_mm"] > 0).all()
    assert summary["null_ray_rms_mm"][0] > 0
    page = (out / "cases" / "bend" / "report.html").read_text(encoding="utf-8")
    assert "near_<wbr>share" in page
    assert meaning in page
    tables = [(out / name).read_bytes() for name in ("summary.csv", "overall.csv")]
    ERRORS._drop(ERRORS["near_share"])
    assert main(["report", str(out)]) == 2
    said = f"near_share was registered by {__name__}, which is not loaded here"
    assert said in capsys.readouterr().err
    assert main([*words, "--only", "bend"]) == 2
    assert said in capsys.readouterr().err
    assert tables == [(out / name).read_bytes() for name in ("summary.csv", "overall.csv")], "its column was dropped"
