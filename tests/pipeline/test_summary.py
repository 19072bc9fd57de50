"""Pooling: points are pooled, merging changes nothing, frames that failed have no say."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pipeline.compare.metrics import rms
from pipeline.compare.pooled import Scored, is_pooled, pooled, skill_of
from pipeline.model import OtherWire
from pipeline.run.outputs import error_row, summary_row
from pipeline.run.stages.known import Frame, Known
from pipeline.status import FrameStatus
from reports._content import fewer_frames


def frame(errors: np.ndarray, null: float = 1.0, tip: float = 0.2) -> Scored:
    row = {"status": "ok", "rms_mm": rms(errors), "arc_rms_mm": rms(errors), "tip_mm": tip, "branch_ok": True}
    return Scored(row | {"null_centreline_rms_mm": null}, errors, np.arange(len(errors)) / 2, "one")


def frames(seed: int, count: int = 9) -> list[Scored]:
    draw = np.random.default_rng(seed)
    return [frame(np.abs(draw.normal(size=10 + 7 * i)), tip=float(draw.random())) for i in range(count)]


def test_points_are_pooled_not_averaged() -> None:
    short, long = np.full(10, 3.0), np.full(90, 1.0)
    result = pooled([frame(short), frame(long)])
    assert result["rms_mm"] == pytest.approx(np.sqrt((10 * 9 + 90) / 100))
    assert result["mean_mm"] == pytest.approx(1.2)
    assert result["skill"] == pytest.approx(1 - result["rms_mm"] ** 2)


def test_a_run_merged_with_itself_changes_nothing_but_the_intervals() -> None:
    once, twice = pooled(frames(1)), pooled(frames(1) + frames(1))
    for name in ("rms_mm", "mean_mm", "max_mm", "tip_median_mm", "skill", "arc_rms_mm", "null_centreline_rms_mm"):
        assert once[name] == pytest.approx(twice[name]), name


def test_the_order_of_frames_does_not_matter_to_the_statistics() -> None:
    assert pooled(frames(2))["rms_mm"] == pytest.approx(pooled(frames(2)[::-1])["rms_mm"])


def test_failed_frames_are_not_pooled_and_nothing_gives_nothing() -> None:
    row, errors, *_ = frame(np.full(5, 100.0))
    assert is_pooled(row, errors)
    assert not is_pooled({**row, "status": FrameStatus.LENGTH_MISMATCH.identifier}, errors)
    assert not is_pooled({**row, "status": FrameStatus.SIMULATED.identifier}, None)
    assert pooled([]) == {}


def test_the_first_failure_is_kept() -> None:
    record = Frame(0).failed("trace", FrameStatus.NO_WIRE, "first")
    record = record.failed("simulate", FrameStatus.SIMULATE_FAILED, "second")
    assert (record.status, record.stage, record.message) == ("no_wire", "trace", "first")


def test_skill() -> None:
    assert skill_of(0.0, 2.0) == 1.0
    assert skill_of(2.0, 2.0) == 0.0
    assert skill_of(4.0, 2.0) == -3.0
    assert np.isnan(skill_of(1.0, float("nan")))


@pytest.mark.parametrize(("without", "skill"), [(0, True), (1, True), (2, False)])
def test_no_skill_is_claimed_of_frames_most_of_which_have_no_predictor(without: int, skill: bool) -> None:
    """Six of nine frames lay 8 mm off and had no centreline: skill 0.987, gate open, by the three that had one."""
    good, far = frame(np.full(10, 0.1)), frame(np.full(12, 8.0), null=float("nan"))
    found = pooled([good] * 2 + [far] * without)
    assert ("skill" in found) == skill
    assert found.get("skill_frames") == (2 if skill else None)
    if skill:
        assert fewer_frames({**found, "frames_ok": 2 + without}) == ("over 2 of 3 frames" if without else "")


@pytest.mark.parametrize("joints", [1, 3])
def test_a_wire_of_one_point_has_neither_overlap_nor_force(joints: int) -> None:
    """Nothing of it is beyond the entry: a depth of 0 mm would read as a wall that was never touched."""
    wire = OtherWire(np.outer(np.arange(float(joints)), [0.0, 0.0, 1.0]), 0.0)
    one = Frame(0, simulated=wire)
    case: Any = SimpleNamespace(id="c", group="", role="validation", compared=False)
    for row in (error_row(one), summary_row(case, Known(frames=(one,)), [error_row(one)])):
        assert ("max_penetration_mm" in row) == (joints > 1)
        assert "push_force_N" not in row
    assert error_row(one)["joints"] == joints
