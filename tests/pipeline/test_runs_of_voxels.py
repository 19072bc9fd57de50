"""Runs of voxels near the lumen, and the scan without wire smoothed on them, against what is slow and plain."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from pipeline.trace._kernels.runs import WallModel, denoised, runs_below
from solver.grid import read_only

TAPS = np.exp(-0.5 * np.arange(-2.0, 3.0) ** 2)


def lumen(seed: int, shape: tuple[int, int, int]) -> np.ndarray:
    """Distances that are below 0 in blobs, some of them at the edges of the box."""
    return np.random.default_rng(seed).normal(size=shape).astype(np.float32)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("limit", [-0.8, 0.0, 1.5, 9.0, -9.0])
def test_runs_are_every_voxel_below_the_limit_once(seed: int, limit: float) -> None:
    values = read_only(lumen(seed, (7, 40, 19)))  # more runs than the list begins with
    runs = runs_below(values, limit)
    found = [(i, j, k) for i, j, first, stop in runs for k in range(first, stop)]
    assert found == [tuple(index) for index in np.argwhere(values < limit)]
    joined = {(i, j, stop) for i, j, _, stop in runs.tolist()} & {(i, j, first) for i, j, first, _ in runs.tolist()}
    assert not joined, "a run ends where it must"


def test_a_list_of_runs_grows() -> None:
    values = np.zeros((40, 40, 9), np.float32)
    values[..., ::2] = -1.0
    assert len(runs_below(read_only(values), 0.0)) == 40 * 40 * 5


def smoothed(rough: np.ndarray, near: np.ndarray, variance: float) -> np.ndarray:
    """The residual's weighted mean over the 125 voxels around, of those near the lumen; itself where it varies."""
    out = np.zeros(rough.shape)
    for index in np.argwhere(near):
        weight = total = square = 0.0
        for step in itertools.product(range(-2, 3), repeat=3):
            at = tuple(index + step)
            if all(0 <= a < n for a, n in zip(at, rough.shape, strict=True)) and near[at]:
                w = float(np.prod([TAPS[s + 2] for s in step]))
                weight, total, square = weight + w, total + w * rough[at], square + w * rough[at] ** 2
        mean = total / weight
        out[tuple(index)] = mean if square / weight - mean**2 < 2.0 * variance else rough[tuple(index)]
    return out


@pytest.mark.quick(1)
@pytest.mark.parametrize("variance", [0.01, 0.5, 5.0])
def test_the_residual_is_smoothed_near_the_lumen_alone(variance: float) -> None:
    rng = np.random.default_rng(8)
    distance = lumen(5, (8, 9, 11))
    rough = rng.normal(size=distance.shape) * rng.choice([0.3, 2.0], size=(8, 1, 1))
    flat = WallModel(distance, runs_below(read_only(distance), 0.5), np.full(3, 100.0), 1.0)
    out = np.zeros(distance.shape)
    denoised(rough, flat, TAPS, 0.5, variance, out)
    near = distance < 0.5
    np.testing.assert_allclose(out[near] - 100.0, smoothed(rough, near, variance)[near], rtol=0.0, atol=1e-12)
    assert not out[~near].any()
