"""Partial volume, blur and noise: sums and standard deviations that are known beforehand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from data_synthetic.anatomy.tubes import Anatomy, ball, sweep
from data_synthetic.anatomy.willis import WillisPlan, circle_of_willis
from data_synthetic.geometry import ScanGrid
from data_synthetic.scanner import Greys, Phantom, PsfScanner
from data_synthetic.scanner.coverage import SUBSAMPLES, bone_coverage, lumen_coverage, splat, wire_particles
from tests.data_synthetic.grids import centred_grid
from tests.naive.tubes import inside_share

QUIET = Greys(noise=0.0, drift=0.0)
LINE = np.column_stack([np.full(41, 0.13), np.full(41, -0.07), np.linspace(-5.98, 6.02, 41)])


@pytest.fixture(scope="module")
def grid() -> ScanGrid:
    return centred_grid([0, 0, 0], (48, 48, 60), 0.3)


@pytest.fixture(scope="module")
def vessel() -> Anatomy:
    return Anatomy((sweep("v", [[-0.4, 0.3, -20.0], [0.2, -0.3, 0.0], [0.0, 0.6, 20.0]], 2.0),))


def test_coverage_of_a_ball_adds_up_to_its_volume(grid: ScanGrid) -> None:
    share = lumen_coverage(Anatomy((ball("b", [0.2, 0.1, 0.3], 2.5),)), grid)
    assert share.sum() * 0.3**3 == pytest.approx(4 / 3 * np.pi * 2.5**3, rel=2e-3)


def test_coverage_of_each_voxel_is_the_share_inside(grid: ScanGrid, vessel: Anatomy) -> None:
    share = lumen_coverage(vessel, grid)
    partial = np.argwhere((share > 0) & (share < 1))
    for index in np.random.default_rng(0).choice(partial, 40):
        centre = grid.to_mm(index)
        exact = inside_share(vessel.distance, centre - 0.15, centre + 0.15)
        assert abs(share[tuple(index)] - exact) < 0.05


def test_coverage_looks_at_every_tube_that_counts() -> None:
    """What the distance to all tubes gives, to the last digit of a float32, in a tree whose branches blend."""
    tree = circle_of_willis(np.random.default_rng(3), WillisPlan())
    middle = 0.5 * (tree.tables.points.min(axis=0) + tree.tables.points.max(axis=0))
    grid = centred_grid(middle, (96, 96, 96), 0.9)
    share = lumen_coverage(tree, grid)
    index = np.argwhere((share > 0) & (share < 1))
    assert len(index) > 2000
    index = index[::3]
    inside, steps = np.zeros(len(index)), 0.9 * ((np.arange(SUBSAMPLES) + 0.5) / SUBSAMPLES - 0.5)
    for offset in np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3):
        distance = tree.distance(grid.to_mm(index) + offset)
        inside += np.clip(0.5 - distance / (0.9 / SUBSAMPLES), 0.0, 1.0) / SUBSAMPLES**3
    np.testing.assert_allclose(share[tuple(index.T)], inside, rtol=0.0, atol=2e-7)


def test_wire_keeps_its_volume(grid: ScanGrid) -> None:
    particles, volume = wire_particles(LINE, 0.18, 0.03)
    share = np.zeros(grid.shape, dtype=np.float32)
    weights = np.full(len(particles), volume / 0.3**3)
    splat(grid.to_index(particles), weights, np.full(3, 0.8), share)
    assert share.sum() * 0.3**3 == pytest.approx(np.pi * 0.18**2 * 12.0, rel=1e-3)


def test_painted_wire_has_its_centre_on_its_curve(grid: ScanGrid, vessel: Anatomy) -> None:
    scanner = PsfScanner.of(Phantom(vessel, greys=QUIET), grid)
    added = scanner.scan([(LINE, 0.18)], (0,)).astype(float) - scanner.scan([], (0,))
    k = 30
    weights = added[:, :, k]
    place = np.array([(weights.sum(axis=1) @ np.arange(48)), (weights.sum(axis=0) @ np.arange(48))]) / weights.sum()
    np.testing.assert_allclose(grid.to_mm(np.array([*place, k]))[:2], LINE[0, :2], rtol=0.0, atol=1e-3)
    # a disc of 0.6 voxel radius blurred by 0.8 voxel and integrated over a voxel (variance 1/12 more), off centre
    peak = 5000 * (1 - np.exp(-0.5 * 0.6**2 / (0.8**2 + 1 / 12)))
    assert 0.75 * peak < added[:, :, k].max() < 1.02 * peak


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.8])
def test_noise_has_the_sd_asked_for_and_its_correlation(grid: ScanGrid, vessel: Anatomy, correlation: float) -> None:
    greys = Greys(noise=100.0, drift=0.0, correlation_voxels=correlation)
    scanner = PsfScanner.of(Phantom(vessel, greys=greys), grid)
    noise = scanner.scan([], (1,)) - scanner.blurred
    assert noise.std() == pytest.approx(100.0, rel=0.02)
    neighbour = float(np.corrcoef(noise[1:].ravel(), noise[:-1].ravel())[0, 1])
    impulse = np.eye(1, 41, 20)[0]
    kernel = gaussian_filter1d(impulse, correlation) if correlation else impulse
    assert neighbour == pytest.approx(float(kernel[1:] @ kernel[:-1] / (kernel @ kernel)), abs=0.02)


def test_bone_keeps_its_gap(grid: ScanGrid, vessel: Anatomy) -> None:
    bone = Anatomy((ball("bone", [4.0, 0.0, 0.0], 3.5),))
    share = bone_coverage(Phantom(vessel, bone=bone), grid)
    assert share.max() == 1.0
    index = np.argwhere(share > 0.5)
    assert vessel.distance(grid.to_mm(index)).min() > 1.15


def test_a_frame_is_the_same_every_time_and_frames_differ(grid: ScanGrid, vessel: Anatomy) -> None:
    scanner = PsfScanner.of(Phantom(vessel), grid)
    first, again, other = scanner.scan([], (5, 0)), scanner.scan([], (5, 0)), scanner.scan([], (5, 1))
    assert first.dtype == np.int16
    np.testing.assert_array_equal(first, again)
    assert np.mean(first == other) < 0.1


def test_noise_keeps_pace_with_the_peak_of_a_thin_wire(grid: ScanGrid, vessel: Anatomy) -> None:
    coarse = replace(grid, spacing_mm=2 * grid.spacing_mm)
    noise = [
        (s.scan([], (2,)) - s.blurred).std()
        for s in (PsfScanner.of(Phantom(vessel, greys=Greys(drift=0.0)), g) for g in (grid, coarse))
    ]
    assert noise[0] / noise[1] == pytest.approx(2**2, rel=0.05)
