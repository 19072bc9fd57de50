"""Scans that do not lie on one grid: the odd one is named, and each is not told anew."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline.load import Header, Source
from pipeline.study.same_grid import apart


def scan(name: str, origin_mm: float = 0.0) -> Header:
    return Header(Source(Path(name)), (9, 9, 9), np.full(3, 0.5), np.full(3, origin_mm), np.eye(3), "int16")


@pytest.mark.parametrize("count", [1, 3])
def test_scans_on_one_grid_are_no_problem(count: int) -> None:
    assert apart([scan(str(n)) for n in range(count)]) == []


def test_a_first_scan_that_differs_from_all_others_is_the_odd_one() -> None:
    """A reference on another grid, or a label map in a folder of scans, was told once for each of thirty frames."""
    (said,) = apart([scan("reference.mha", 7.0), *(scan(f"{n}.mha") for n in range(5))])
    assert said.startswith("reference.mha is the odd one of 6 scans, the others lie on one grid; is it one of them?")
    assert said.count("geometry differs") == 1


def test_one_frame_on_another_grid_is_told_by_itself() -> None:
    (said,) = apart([scan("reference.mha"), scan("0.mha"), scan("1.mha", 7.0)])
    assert said.startswith("geometry differs between scans of one case")
    assert "1.mha" in said


def test_many_grids_are_one_problem() -> None:
    other = replace(scan("2.mha"), shape=(8, 9, 9))
    (said,) = apart([scan("reference.mha"), scan("0.mha"), scan("1.mha", 7.0), other])
    assert said.endswith("Of 4 scans 1 more differ from the first.")
