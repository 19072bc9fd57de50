"""Grey that differs along the wall, inside or outside it: the wall lies half way between its own two sides."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.special import ndtr

from pipeline.model import Volume
from pipeline.segment import segment
from pipeline.segment.levels import GreyLevels
from pipeline.segment.sides import Sides, _around
from tests.pipeline import phantoms
from tests.studies.seeing.table import look


def sides(inside: float, outside: float, low: float, high: float) -> Sides:
    """One place on a wall, and the extremes along it."""
    return Sides(
        cKDTree(np.zeros((1, 3))), np.array([inside]), np.array([outside]), low, low, (min(outside, 0.0), high)
    )


@pytest.mark.parametrize("inside", [0.6, 0.8, 1.0, 1.6])
@pytest.mark.parametrize("outside", [-1.0, -0.5, 0.0, 0.2])
def test_the_level_lies_where_a_blurred_wall_passes_it(inside: float, outside: float) -> None:
    levels = GreyLevels(inside=1000.0, outside=100.0, noise=1.0, noise_left=(1.0,))
    both = sides(inside, outside, 0.6, 0.2)
    (blurs,), (steepness,) = both.at(np.zeros((1, 3)))
    grey = 100.0 + 900.0 * (outside + (inside - outside) * ndtr(blurs))
    assert grey == pytest.approx(both.level(levels), rel=1e-12), "a flat wall, blurred"
    step = 1e-4
    fall = (inside - outside) * (ndtr(blurs + step) - ndtr(blurs - step)) / (ndtr(step) - ndtr(-step))
    assert steepness == pytest.approx(fall, rel=1e-6)


@pytest.mark.parametrize(("inside", "outside"), [(0.1, 0.0), (1.0, -50.0), (0.6, 0.49)])
def test_what_hardly_tells_moves_the_wall_by_a_bounded_way(inside: float, outside: float) -> None:
    (blurs,), (steepness,) = sides(inside, outside, 0.6, 0.4).at(np.zeros((1, 3)))
    assert abs(float(blurs)) < 1.5, "blurs; without end where the level is hardly passed"
    assert steepness > 0.0


def found_in(outside, vessel, noise, size, seed):
    """The lumen of a straight vessel, what is around it by z (mm); and how far (voxels) its wall is off, with the z."""
    voxel, radius = 0.3, 1.5
    x, y, z = (np.arange(n) * voxel + low for n, low in zip(size, (-0.15 * size[0] + 0.15,) * 2 + (0.0,), strict=True))
    share = phantoms.partial_volume(np.hypot(x[:, None], y) - radius, voxel)[:, :, None]
    grey = phantoms.scan(outside(z) + (vessel - outside(z)) * share, 0.8, noise, seed=seed)
    lumen = segment(Volume(np.asfortranarray(grey), [voxel] * 3, [x[0], y[0], 0.0]), [[0.0, 0.0, 4.0]])
    near = np.argwhere(np.abs(lumen.distance.values) < 0.3)
    at = lumen.distance.to_mm(near)
    return lumen, (lumen.distance.values[tuple(near.T)] - (np.hypot(at[:, 0], at[:, 1]) - radius)) / voxel, at[:, 2]


@pytest.mark.parametrize("tissue", [-260.0, 400.0])
def test_the_wall_lies_half_way_to_what_lies_next_to_it(tissue: float) -> None:
    """From z = 9 mm on other tissue lies around a vessel of 900 in 100: its wall was 0.8 voxels off, unsaid."""
    lumen, error, z = found_in(lambda z: np.where(z < 9.0, 100.0, tissue), 1000.0, 40.0, (40, 40, 70), seed=1)
    for begin, stop in ((2.0, 7.5), (10.5, 18.0)):
        assert abs(np.median(error[(z > begin) & (z < stop)])) < 0.15
    assert any("what lies around the vessel differs" in text for text in lumen.warnings)


def test_of_two_tissues_the_brighter_one_surrounds_a_vessel():
    """Its entry in gel of 60, beside plastic of 180: a lumen of 330 was nine tenths plastic, two of three frames ok."""
    lumen, error, z = found_in(lambda z: np.where(z < 12.0, 60.0, 180.0), 330.0, 12.0, (64, 64, 80), seed=2)
    for begin, stop in ((2.0, 10.5), (13.5, 20.0)):
        assert abs(np.median(error[(z > begin) & (z < stop)])) < 0.15
    assert any("or is far thicker, hangs together" in text for text in lumen.warnings)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "most"), [(0, 0.35), pytest.param(12, 0.2, marks=pytest.mark.slow)])
def test_medium_that_has_settled_is_said_and_the_wall_found(seed: int, most: float) -> None:
    row = look("contrast that has settled", seed)
    assert row.verdict == "right"
    assert "the vessel's contrast falls to" in row.text
    assert row.wall < most, "voxel; 0.64 and 0.25 with one level for both sides"


def test_of_fewer_places_than_are_averaged_all_are() -> None:
    """Where hardly any wall has room beside it, scipy's places that are missing were looked up: an IndexError."""
    places = cKDTree(np.random.default_rng(0).normal(size=(5, 3)))
    assert _around(places, np.arange(5.0), 400) == pytest.approx(np.full(5, 2.0))
