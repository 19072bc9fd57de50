"""Kernels on lists of voxels against what NumPy and SciPy find in whole boxes; calls side by side on several cores."""

from __future__ import annotations

import threading

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial import cKDTree

from pipeline.arrays.cores import in_parts, on_cores, side_by_side
from pipeline.segment._kernels.voxels import components, eroded, extent, gaps, largest, rebased, shell
from pipeline.segment.contact import inside_of, numbered

SHAPE = (24, 31, 27)


@pytest.fixture
def inside() -> np.ndarray:
    """Blobs, some of which meet the box's border."""
    return ndimage.gaussian_filter(np.random.default_rng(5).normal(size=SHAPE), 1.5) > 0.04


def test_parts_cores_and_shells_are_those_of_whole_boxes(inside: np.ndarray) -> None:
    flat, voxels = inside_of(np.where(inside, -1.0, 1.0).astype(np.float32))
    np.testing.assert_array_equal(flat, np.flatnonzero(inside))
    np.testing.assert_array_equal(components(voxels) + 1, ndimage.label(inside)[0].reshape(-1)[flat])
    np.testing.assert_array_equal(flat[shell(voxels)], np.flatnonzero(inside & ~ndimage.binary_erosion(inside)))
    wider = tuple(n + 2 for n in SHAPE)
    left = rebased(eroded(voxels, 2), wider, -np.ones(3, np.int64), SHAPE)
    np.testing.assert_array_equal(left, np.flatnonzero(ndimage.binary_erosion(inside, iterations=2)))


def test_extents_and_indices_in_another_box(inside: np.ndarray) -> None:
    flat = np.random.default_rng(6).permutation(np.flatnonzero(inside))
    index = np.array(np.unravel_index(flat, SHAPE)).T
    np.testing.assert_array_equal(extent(flat, SHAPE), [index.min(axis=0), index.max(axis=0)])
    moved = rebased(flat, SHAPE, np.array([3, 0, 5]), (30, 31, 40))
    np.testing.assert_array_equal(np.array(np.unravel_index(moved, (30, 31, 40))).T, index + [3, 0, 5])
    with pytest.raises(ValueError, match="outside"):
        rebased(flat, SHAPE, np.array([0, 0, 1]), SHAPE)


@pytest.mark.parametrize("reach", [3.0, 9.0, 14.0])
def test_gaps_are_exact_and_infinite_from_the_reach_on(reach: float) -> None:
    rng = np.random.default_rng(7)
    shape = (40, 50, 60)
    here, there = (np.unique(rng.integers(0, np.prod(shape), n)) for n in (500, 30))
    points = [np.array(np.unravel_index(flat, shape)).T for flat in (here, there)]
    expected = cKDTree(points[1]).query(points[0], distance_upper_bound=reach)[0]
    np.testing.assert_array_equal(gaps(here, there, shape, reach), expected)
    assert np.all(np.isinf(gaps(here, there[:0], shape, reach)))


def test_the_largest_of_each_part() -> None:
    np.testing.assert_array_equal(largest(np.array([1, 0, 1]), np.array([2.0, -1.0, 5.0]), 3), [0.0, 5.0, 0.0])
    assert numbered((3, 3, 3), np.array([13])).ids[1, 1, 1] == 1


@pytest.mark.parametrize("cores", [1, 2, 3])
def test_calls_side_by_side_give_their_results_in_order(cores: int) -> None:
    with on_cores(cores):
        assert side_by_side(lambda: 1, lambda: 2, lambda: 3, lambda: 4) == [1, 2, 3, 4]
        parts = in_parts(lambda part: 2 * part, np.arange(7))
        assert len(parts) == cores
        np.testing.assert_array_equal(np.concatenate(parts), 2 * np.arange(7))
    assert len(in_parts(len, np.arange(7))) == 1


def test_two_cores_are_used_at_the_same_time_and_an_error_is_raised_here() -> None:
    both = threading.Barrier(2, timeout=20)
    with on_cores(2):
        assert sorted(side_by_side(both.wait, both.wait)) == [0, 1]
        with pytest.raises(ZeroDivisionError):
            side_by_side(lambda: 1, lambda: 1 // 0)
