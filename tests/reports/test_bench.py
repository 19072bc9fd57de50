"""The benchmark page: the front is what nothing beats, the recommendation is a row of the table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reports import bench
from reports.figures._drawing import Drawing
from reports.figures.benchmark import convergence, orders, pareto, stress_outcomes


def fake_bench(folder: Path) -> tuple[Path, Path]:
    """Two tidy files with second-order methods of different cost, and a stress table."""
    rng = np.random.default_rng(0)
    rows: list[dict[str, object]] = []
    for scene, scale in (("bend", 1.0), ("siphon", 3.0), ("circle-of-willis", 5.0)):
        for method, cost, order in (("newton", 0.05, 2), ("closed_form", 3.0, 2), ("exudyn", 9.0, 1.5)):
            rows += [_bench_row(scene, scale, method, cost, order, s, rng) for s in (5.0, 2.0, 1.0, 0.5, 0.2, 0.1)]
    rows.append({"scene": "bend", "method": "mujoco", "segment_mm": 0.2})  # did not finish: no numbers
    outcomes = [
        {"axis": axis, "outcome": o, "count": n}
        for axis in ("stiff wire", "soft wall", "one-voxel lumen")
        for o, n in (("converged", 90), ("max_iterations", 10))
    ]
    pd.DataFrame(rows).to_csv(folder / "bench.csv", index=False)
    pd.DataFrame(outcomes).to_csv(folder / "stress.csv", index=False)
    return folder / "bench.csv", folder / "stress.csv"


def _bench_row(
    scene: str, scale: float, method: str, cost: float, order: float, segment: float, rng: np.random.Generator
) -> dict[str, object]:
    return {
        "scene": scene,
        "method": method,
        "segment_mm": segment,
        "hull": "offset",
        "tolerance": 1e-9,
        "ms_per_mm": cost / segment * rng.uniform(0.8, 1.2),
        "shape_error_mm": 0.02 * scale * segment**order * rng.uniform(0.8, 1.2),
        "tip_error_mm": 0.05 * scale * segment**order,
        "iterations": 12.0,
        "cells_skipped": 7,
    }


@given(st.lists(st.tuples(st.integers(1, 6), st.integers(1, 6)), min_size=1, max_size=25))
def test_the_front_is_what_no_other_point_beats(points: list[tuple[int, int]]) -> None:
    error, cost = np.array(points, float).T
    front = bench.pareto_front(error, cost)
    for i in range(len(points)):
        beaten = any(
            error[j] <= error[i] and cost[j] <= cost[i] and (error[j], cost[j]) != (error[i], cost[i])
            for j in range(len(points))
        )
        twin = any((error[j], cost[j]) == (error[i], cost[i]) and front[j] for j in range(len(points)) if j != i)
        assert front[i] == (not beaten and not twin)


def test_nan_is_never_on_the_front() -> None:
    assert bench.pareto_front(np.array([np.nan, 1.0]), np.array([0.1, np.nan])).tolist() == [False, False]


def test_recommendations_are_the_fastest_rows_within_the_target(tmp_path: Path) -> None:
    rows = bench.read_bench(*fake_bench(tmp_path)).rows
    best = bench.recommended(rows)
    assert set(best["target_mm"]) == {0.1, 0.01}
    for record in best.to_dict("records"):
        rivals = rows[(rows["scene"] == record["scene"]) & (rows["shape_error_mm"] <= record["target_mm"])]
        assert record["shape_error_mm"] <= record["target_mm"]
        assert record["ms_per_mm"] == rivals["ms_per_mm"].min()
    assert bench.recommended(rows.assign(shape_error_mm=9.0)).empty


def test_a_long_segment_that_is_right_by_luck_is_not_recommended() -> None:
    rows = pd.DataFrame(
        {
            "scene": "siphon",
            "method": "newton",
            "tolerance": 1e-9,
            "segment_mm": [2.0, 1.0, 0.5, 0.25],
            "shape_error_mm": [0.05, 0.9, 0.02, 0.005],
            "ms_per_mm": [0.1, 0.2, 0.3, 0.6],
        }
    )
    best = bench.recommended(rows).set_index("target_mm")["segment_mm"]
    assert best.to_dict() == {0.1: 0.5, 0.01: 0.25}
    assert bench.recommended(rows.assign(shape_error_mm=[0.05, 0.05, 0.05, np.nan])).empty


def test_the_page_has_everything_and_keeps_extra_columns(tmp_path: Path) -> None:
    page = bench.render_bench(*_swap(fake_bench(tmp_path), tmp_path), note="one core of <some> machine")
    text = page.read_text(encoding="utf-8")
    for part in ('id="pareto"', 'id="convergence"', 'id="stress_outcomes"', 'id="recommended"', 'id="stress"'):
        assert part in text
    assert "one core of &lt;some&gt; machine" in text
    assert "cells_<wbr>skipped" in text
    assert "the largest shape error that is asked for" in text
    assert ">nan<" not in text
    for name in ("pareto", "convergence", "stress_outcomes"):
        assert (tmp_path / "out" / "figures" / f"{name}.png").exists()
        assert (tmp_path / "out" / "figures" / f"{name}.csv").exists()


def _swap(files: tuple[Path, Path], folder: Path) -> tuple[Path, Path, Path]:
    return files[0], folder / "out", files[1]


@pytest.mark.parametrize("draw", [pareto, convergence, orders, stress_outcomes])
def test_nothing_to_show_is_no_figure(draw: object, tmp_path: Path) -> None:
    pd.DataFrame({"scene": ["bend"], "method": ["newton"]}).to_csv(tmp_path / "b.csv", index=False)
    result: Drawing | None = draw(bench.read_bench(tmp_path / "b.csv"))  # type: ignore[operator]
    assert result is None


def test_a_stress_study_alone_shows_how_well_its_scenes_ended(tmp_path: Path) -> None:
    pd.DataFrame(columns=["scene", "method"]).to_csv(tmp_path / "b.csv", index=False)
    row = {"outcome": "converged", "count": 3, "iterations_max": 71, "worst_residual": 2.5e-5, "slowest": 1099}
    pd.DataFrame([{"axis": a, **row} for a in ("all", "roll")]).to_csv(tmp_path / "s.csv", index=False)
    text = bench.render_bench(tmp_path / "b.csv", tmp_path / "out", tmp_path / "s.csv").read_text("utf-8")
    assert "Over all scenes, by outcome" in text
    assert "1099" in text
    assert "All rows" not in text


def test_broken_promises_come_first_and_are_counted_among_those_with_an_aim(tmp_path: Path) -> None:
    rows, stress = fake_bench(tmp_path)
    told = [("kept", "at most 2", True), ("reported", "", None), ("broken", "at most 1", False)]
    claims = pd.DataFrame([{"claim": c, "value": 1.5, "unit": "1", "aim": aim, "met": met} for c, aim, met in told])
    claims.to_csv(tmp_path / "claims.csv", index=False)
    page = bench.render_bench(rows, tmp_path / "out", stress, tmp_path / "claims.csv").read_text(encoding="utf-8")
    assert "1 of 2 promises" in page
    assert '<td class="text">1</td>' not in page, "a plain number's unit"
    assert page.index(">broken<") < page.index(">kept<") < page.index(">reported<")
