"""Fuzzy connectedness against the obvious oracle, morphological reconstruction, and its own invariants."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage
from skimage.morphology import reconstruction

from pipeline.segment._kernels.tiles import GREY_STEPS
from pipeline.segment.config import SegmentConfig
from pipeline.segment.connect import (
    Affinity,
    binomial_taps,
    connect,
    connect_relative,
    cut_level,
    estimate_affinity,
    neighbours,
    strength_list,
)
from pipeline.segment.levels import GreyLevels
from solver.grid import Grid
from tests.naive import connectedness as naive

LEVELS = GreyLevels(inside=800.0, outside=100.0, noise=60.0, noise_left=(60.0, 14.0))


def strength_map(grid, seeds, affinity, threshold, offsets):
    """Strength of connectedness 0..255 (0 below ``threshold``) and the flat indices of the voxels that have one."""
    order, strength, _ = strength_list(grid, seeds, affinity, threshold, offsets)
    out = np.zeros(grid.shape, np.uint8)
    out.reshape(-1)[order] = strength
    return out, order


def noisy(seed, shape=(9, 10, 11)):
    """Blobs of vessel and background grey with noise."""
    rng = np.random.default_rng(seed)
    blobs = ndimage.gaussian_filter(rng.normal(size=shape), 1.2)
    return (100 + 700 * (blobs > 0) + rng.normal(0, 120, shape)).astype(np.int16)


def first(where, most=1):
    """Indices (n, 3) in one layout, for which kernels are compiled: theirs goes by how many there are."""
    return np.ascontiguousarray(np.argwhere(where)[:most])


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10_000), adjacency=st.sampled_from([6, 26]), threshold=st.sampled_from([0.02, 0.3, 0.6]))
def test_strengths_equal_naive_dijkstra_on_every_voxel(seed, adjacency, threshold):
    values = noisy(seed)
    tables = estimate_affinity(LEVELS, SegmentConfig(homogeneity_sigma=150.0, feature_sigma=300.0, scale=0))
    seeds = first(values == values.max())
    offsets = neighbours(adjacency)
    got, order = strength_map(Grid(values), seeds, tables, threshold, offsets)
    expected = naive.strengths(values, seeds, tables, offsets, cut_level(threshold))
    np.testing.assert_array_equal(got, expected)
    assert len(order) == len(np.unique(order)) == np.count_nonzero(expected)


@pytest.mark.parametrize("adjacency", [6, 26])
def test_the_flood_is_the_alpha_cut_of_the_strengths(adjacency):
    values = noisy(3, (24, 25, 26))
    tables = estimate_affinity(LEVELS)
    seeds = first(values == values.max())
    strength, _ = strength_map(Grid(values), seeds, tables, 0.1, neighbours(adjacency))
    for threshold in (0.3, 0.5, 0.7):
        order, _ = connect(Grid(values), seeds, tables, threshold, neighbours(adjacency))
        reached = np.zeros(values.size, bool)
        reached[order] = True
        np.testing.assert_array_equal(reached.reshape(values.shape), strength >= cut_level(threshold))


@pytest.mark.parametrize("scale", [1, 2, 3])
@pytest.mark.parametrize("shape", [(9, 10, 11), (25, 16, 30), (3, 2, 40)])
def test_smoothing_tile_by_tile_is_smoothing_everything_first(scale, shape):
    values = noisy(scale, shape)
    tables = estimate_affinity(LEVELS, SegmentConfig(scale=scale))
    whole = naive.smoothed(values, tables.taps)
    seeds = first(whole == whole.max())
    offsets = neighbours(6)
    got, order = strength_map(Grid(values), seeds, tables, 0.2, offsets)
    expected = naive.strengths(whole, seeds, tables, offsets, cut_level(0.2))
    np.testing.assert_array_equal(got, expected)
    flooded, _ = connect(Grid(values), seeds, tables, 0.2, offsets)
    assert sorted(flooded) == sorted(order)
    assert len(order) > 20


def test_only_tiles_that_the_object_touches_are_read():
    values = np.zeros((64, 64, 64), np.int16)
    values[29:35, 29:35, :] = 800
    order, read = connect(Grid(values), np.array([[31, 31, 5]]), estimate_affinity(LEVELS), 0.5, neighbours(6))
    assert len(order) == 4 * 4 * 64
    assert read == 4 * 8 * 8**3  # a bar about the corner of four columns of eight tiles of 8^3


def test_per_voxel_affinity_is_morphological_reconstruction():
    """With homogeneity 1 and an affinity that is the smaller of two voxel values, FC is reconstruction by dilation."""
    rng = np.random.default_rng(5)
    values = ndimage.gaussian_filter(rng.normal(size=(14, 15, 16)), 1.0)
    values = np.rint(127 * (values - values.min()) / np.ptp(values)).astype(np.int16)
    # min(a, b) = (a + b - |a - b|) / 2: a sum of a function of the sum and one of the difference, so its
    # exponential is a product of one of each; strengths are compared through the same monotone map
    base = 1.02
    difference, total = np.arange(1024), np.arange(2047)
    homogeneity = (20 * base ** (-0.5 * difference)).astype(np.float32)
    feature = (base ** (0.5 * np.minimum(total, 254))).astype(np.float32)
    tables = Affinity(homogeneity, feature, 0.0, 1.0, binomial_taps(0))
    seed = np.argwhere(values == values.max())[:1]
    got, _ = strength_map(Grid(values), seed, tables, 0.01, neighbours(6))
    marker = np.zeros_like(values)
    marker[tuple(seed[0])] = values.max()
    cross = ndimage.generate_binary_structure(3, 1)
    expected = np.floor(20 * base ** reconstruction(marker, values, footprint=cross) + 0.5)
    away = np.ones(values.shape, bool)
    away[tuple(seed[0])] = False
    assert np.abs(got[away] - expected[away]).max() <= 1  # float32 product against float64 power, at a tie
    assert np.mean(got[away] == expected[away]) > 0.999


def test_relative_connectedness_cuts_bone_off_where_it_touches():
    shape = (40, 30, 30)
    x, y, z = np.indices(shape)
    vessel = (y - 15) ** 2 + (z - 15) ** 2 < 16
    bone = (y - 15) ** 2 + (z - 22) ** 2 + (x - 20) ** 2 < 20
    clean = 100.0 + 700 * vessel
    clean[bone] = 1200
    grey = ndimage.gaussian_filter(clean, 0.8) + np.random.default_rng(0).normal(0, 20, shape)
    grid, tables = Grid(grey.astype(np.int16)), estimate_affinity(LEVELS)
    seed, rival = np.array([[5, 15, 15]]), np.array([[20, 15, 23]])
    alone, _ = connect(grid, seed, tables, 0.5, neighbours(6))
    both, _ = connect_relative(grid, seed, rival, tables, 0.5, neighbours(6))
    core = (ndimage.binary_erosion(bone & ~vessel, iterations=1)).reshape(-1)
    assert core[alone].sum() > 0.9 * core.sum()
    assert core[both].sum() < 0.1 * core.sum()
    assert (
        np.isin(np.flatnonzero(ndimage.binary_erosion(vessel & (np.abs(x - 20) > 9)).reshape(-1)), both).mean() > 0.98
    )


def test_more_seeds_and_lower_thresholds_only_add():
    values = noisy(8, (20, 20, 20))
    tables = estimate_affinity(LEVELS)
    seeds = first(values > 900, 3)
    one, _ = connect(Grid(values), seeds[:1], tables, 0.5, neighbours(6))
    three, _ = connect(Grid(values), seeds, tables, 0.5, neighbours(6))
    lower, _ = connect(Grid(values), seeds[:1], tables, 0.4, neighbours(6))
    assert set(one) <= set(three)
    assert set(one) <= set(lower)


def test_cost_follows_the_object_and_not_the_volume():
    """The same object in 125 times the volume, in one run: at most three times the time (1.5 measured)."""
    tables, grids = estimate_affinity(LEVELS), {}
    for side in (60, 300):
        values, middle = np.zeros((side, side, side), np.int16), side // 2
        values[middle - 15 : middle + 15, middle - 15 : middle + 15, middle - 15 : middle + 15] = 800
        grids[side] = Grid(values), np.array([[middle] * 3])

    def seconds(side):
        start = time.process_time()
        connect(*grids[side], tables, 0.5, neighbours(6))
        return time.process_time() - start

    # in pairs, one beside the other: what else the machine does must not decide
    assert min(seconds(300) / seconds(60) for _ in range(12)) < 3


def test_every_pair_of_voxels_has_its_entry_in_the_tables():
    """Kernels look them up unchecked: by a difference of two quantised greys, and by a sum, of a wire's too."""
    tables = estimate_affinity(LEVELS)
    brightest = GREY_STEPS - 1
    assert tables.homogeneity.shape == (brightest + 1,)
    assert tables.feature.shape == (2 * brightest + 1,)
    assert tables.feature[-1] == 1.0, "brighter than the vessel belongs to it"
