"""Pooling and intervals: points are pooled, merging changes nothing, blocks keep neighbours together."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.compare.metrics import rms
from pipeline.compare.pooled import Row, blocks, intervals, is_pooled, pooled, skill_of
from pipeline.run.stages.known import Frame
from pipeline.status import FrameStatus


def frame(errors: np.ndarray, null: float = 1.0, tip: float = 0.2) -> tuple[Row, np.ndarray]:
    row = {"status": "ok", "rms_mm": rms(errors), "arc_rms_mm": rms(errors), "tip_mm": tip, "branch_ok": True}
    return row | {"null_centreline_rms_mm": null}, errors


def frames(seed: int, count: int = 9) -> list[tuple[Row, np.ndarray]]:
    draw = np.random.default_rng(seed)
    return [frame(np.abs(draw.normal(size=10 + 7 * i)), tip=float(draw.random())) for i in range(count)]


def test_points_are_pooled_not_averaged() -> None:
    short, long = np.full(10, 3.0), np.full(90, 1.0)
    result = pooled([frame(short), frame(long)], 0)
    assert result["rms_mm"] == pytest.approx(np.sqrt((10 * 9 + 90) / 100))
    assert result["mean_mm"] == pytest.approx(1.2)
    assert result["skill"] == pytest.approx(1 - result["rms_mm"] ** 2)


def test_a_run_merged_with_itself_changes_nothing_but_the_intervals() -> None:
    once, twice = pooled(frames(1), 0), pooled(frames(1) + frames(1), 0)
    for name in ("rms_mm", "mean_mm", "max_mm", "tip_median_mm", "skill", "arc_rms_mm", "null_centreline_rms_mm"):
        assert once[name] == pytest.approx(twice[name]), name


def test_the_order_of_frames_does_not_matter_to_the_statistics() -> None:
    assert pooled(frames(2), 0)["rms_mm"] == pytest.approx(pooled(frames(2)[::-1], 0)["rms_mm"])


def test_failed_frames_are_not_pooled_and_nothing_gives_nothing() -> None:
    row, errors = frame(np.full(5, 100.0))
    assert is_pooled(row, errors)
    assert not is_pooled({**row, "status": FrameStatus.LENGTH_MISMATCH.identifier}, errors)
    assert not is_pooled({**row, "status": FrameStatus.SIMULATED.identifier}, None)
    assert pooled([], 0) == {}


def test_the_first_failure_is_kept() -> None:
    record = Frame(0).failed("trace", FrameStatus.NO_WIRE, "first")
    record = record.failed("simulate", FrameStatus.SIMULATE_FAILED, "second")
    assert (record.status, record.stage, record.message) == ("no_wire", "trace", "first")


@pytest.mark.parametrize(("count", "length"), [(9, 3), (10, 3), (2, 5), (1, 1), (30, 5)])
def test_blocks_hold_every_frame_once_and_keep_neighbours(count: int, length: int) -> None:
    parts = blocks(count, length)
    np.testing.assert_array_equal(np.concatenate(parts), np.arange(count))
    assert all(len(p) >= min(length, count) for p in parts)


def test_the_interval_covers_the_true_value_about_as_often_as_it_says() -> None:
    """Independent blocks of a known spread: 95 % intervals must cover in 85 to 99 % of 200 repetitions (12 blocks)."""
    draw = np.random.default_rng(5)
    covered = 0
    for _ in range(200):
        squares = draw.chisquare(4, size=12)
        rows = np.column_stack([np.full(12, 4.0), squares])
        units = [np.array([i]) for i in range(12)]
        (low, high), *_ = intervals(rows, units, (lambda r: float(np.sqrt(r[:, 1].sum() / r[:, 0].sum())),), 300)
        covered += low <= 1.0 <= high
    assert 170 <= covered <= 198


def test_two_blocks_give_no_interval() -> None:
    result = pooled([frame(np.ones(4)), frame(np.ones(4))], 100)
    assert np.isnan(result["rms_low_mm"])


def test_skill() -> None:
    assert skill_of(0.0, 2.0) == 1.0
    assert skill_of(2.0, 2.0) == 0.0
    assert skill_of(4.0, 2.0) == -3.0
    assert np.isnan(skill_of(1.0, float("nan")))
