"""The log of a case: counts add up over frames, levels have a median."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from pipeline.run.log import CaseProgress, Log, last_stage


def test_counts_add_up_and_levels_do_not() -> None:
    log = Log(lambda *_: None)
    for cnr in (4.0, 12.0, 8.0, float("nan")):
        log.count("trace", {"voxels": 10.0}, {"cnr": cnr})
    assert log.counters["trace"] == {"voxels": 40.0, "cnr": {"min": 4.0, "median": 8.0, "max": 12.0}}


def test_times_of_frames_add_up_to_the_stage() -> None:
    log = Log(lambda *_: None)
    for frame in (0, 1, 0):
        log.spent("trace", 1.0, frame)
    assert log.frame_seconds == {(0, "trace"): 2.0, (1, "trace"): 1.0}
    with log.timed("trace"):
        pass
    assert log.seconds["trace"] == pytest.approx(3.0, abs=0.1)


def test_a_stage_that_has_no_steps_yet_counts_none(tmp_path: Path) -> None:
    """The bar read ``compare 0/0  begins``."""
    progress = CaseProgress("a", tmp_path / "log.txt", io.StringIO())
    Log(progress).begins("compare")
    assert "[a] compare  begins" in (tmp_path / "log.txt").read_text(encoding="utf-8")


def test_the_last_stage_is_that_of_the_last_line_that_names_one(tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    assert last_stage(log) == ""
    log.write_text("[a] load 1/2\n[a] trace 2/2  frame 1 [x] compare\n[a] warning: simulate is no stage here\n")
    assert last_stage(log) == "trace"
