"""Contrast medium that has settled: the wall lies half way to the level of its own side of the vessel."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.special import ndtr

from pipeline.segment.levels import GreyLevels
from pipeline.segment.settled import Filled
from tests.studies.seeing.table import look


@pytest.mark.parametrize("share", [0.6, 0.8, 1.0, 1.6])
def test_the_level_lies_where_a_blurred_wall_passes_it(share: float) -> None:
    low, levels = 0.6, GreyLevels(inside=1000.0, outside=100.0, noise=1.0, noise_left=(1.0,))
    filled = Filled(cKDTree(np.zeros((1, 3))), np.array([share]), low, low)
    (blurs,), (steepness,) = filled.at(np.zeros((1, 3)))
    grey = 100.0 + 900.0 * share * ndtr(blurs)
    assert grey == pytest.approx(filled.level(levels), rel=1e-12), "a flat wall, blurred"
    step = 1e-4
    fall = share * (ndtr(blurs + step) - ndtr(blurs - step)) / (ndtr(step) - ndtr(-step))
    assert steepness == pytest.approx(fall, rel=1e-6)


def test_what_is_hardly_filled_moves_the_wall_by_a_bounded_way() -> None:
    filled = Filled(cKDTree(np.zeros((1, 3))), np.array([0.1]), 0.6, 0.6)
    assert 0 < float(filled.at(np.zeros((1, 3)))[0][0]) < 1.5, "blurs; without end at half of the lowest and less"


@pytest.mark.parametrize(("seed", "most"), [(0, 0.35), pytest.param(12, 0.2, marks=pytest.mark.slow)])
def test_medium_that_has_settled_is_said_and_the_wall_found(seed: int, most: float) -> None:
    row = look("contrast that has settled", seed)
    assert row.verdict == "right"
    assert "the vessel's contrast falls to" in row.text
    assert row.wall < most, "voxel; 0.64 and 0.25 with one level for both sides"
