"""Cone-beam scanner: path lengths against geometry, and a reconstruction against what was put in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("itk", reason="needs the extra [conebeam]")

from data_synthetic.anatomy.tubes import Anatomy, sweep
from data_synthetic.geometry import ScanGrid
from data_synthetic.scanner import Greys, Phantom
from data_synthetic.scanner.conebeam import Arc, ConeBeamScanner
from tests.data_synthetic.grids import centred_grid

ARC = Arc(projections=60, pixels=96, photons=1e5)
VESSEL = Anatomy((sweep("v", [[5.0, -3.0, -20.0], [5.0, -3.0, 24.0]], 2.5),))
LINE = np.column_stack([np.full(41, 0.3), np.full(41, -0.4), np.linspace(-6, 6, 41)])


@pytest.fixture(scope="module")
def grid() -> ScanGrid:
    return centred_grid([5.0, -3.0, 2.0], (48, 48, 48), 0.5)


@pytest.fixture(scope="module")
def scanner(grid: ScanGrid) -> ConeBeamScanner:
    return ConeBeamScanner.of(Phantom(VESSEL), grid, ARC)


@pytest.fixture(scope="module")
def plain(scanner: ConeBeamScanner) -> np.ndarray:
    return scanner.scan([], (0,)).astype(float)


def test_central_ray_crosses_the_vessel_by_its_diameter(scanner: ConeBeamScanner) -> None:
    middle = scanner.contrast[:, 46:50, 46:50]
    np.testing.assert_allclose(middle, 5.0, rtol=0.0, atol=0.15)
    body = 2 * 0.625 * 24.0
    np.testing.assert_allclose(scanner.body[0, 47:49, 47:49], body, rtol=1e-3)


def test_tissue_and_contrast_come_back_near_their_greys(scanner: ConeBeamScanner, plain: np.ndarray) -> None:
    """Calibrated in water: truncation and beam hardening leave a few per cent, as they do in a clinic."""
    assert np.median(plain[scanner.share > 0.99]) == pytest.approx(1000, rel=0.1)
    middle = (slice(14, 34),) * 3
    assert np.median(plain[middle][scanner.share[middle] == 0]) == pytest.approx(100, abs=80)


def test_contrast_washes_out_and_drifts(scanner: ConeBeamScanner, plain: np.ndarray) -> None:
    steady = scanner.counts(np.float32(0.0), scanner.iodine())
    fading = replace(scanner, greys=Greys(washout=0.4))
    less = fading.counts(np.float32(0.0), fading.iodine())
    ray = (slice(None), 48, 48)  # through the vessel
    np.testing.assert_allclose(less[0], steady[0], rtol=1e-6)
    assert np.all(np.diff(less[ray] / steady[ray]) > 0)  # less iodine, more photons, from view to view
    vessel = scanner.share > 0.99
    faded = fading.scan([], (0,)).astype(float)
    assert np.median(faded[vessel]) - 100 == pytest.approx(0.8 * (np.median(plain[vessel]) - 100), rel=0.12)
    thin = replace(scanner, greys=Greys(contrast=550.0, drift=0.0)).scan([], (0,)).astype(float)
    assert np.median(thin[vessel]) - 100 == pytest.approx(0.5 * (np.median(plain[vessel]) - 100), rel=0.15)


def test_less_exposure_is_more_noise(scanner: ConeBeamScanner, grid: ScanGrid, plain: np.ndarray) -> None:
    dark = ConeBeamScanner.of(Phantom(VESSEL, greys=Greys(noise=300.0)), grid, ARC)
    assert dark.arm.arc.photons == pytest.approx(ARC.photons / 9)
    middle = (slice(14, 20), slice(14, 34), slice(14, 34))
    noise = [np.diff(scan[middle], axis=2).std() for scan in (plain, dark.scan([], (0,)).astype(float))]
    assert noise[1] == pytest.approx(3 * noise[0], rel=0.15)


def test_a_moved_phantom_is_seen_where_it_lies(grid: ScanGrid, plain: np.ndarray) -> None:
    """Moving the phantom by two voxels is moving the grid by two: greys move along, the calibration does not."""
    shift = np.array([1.0, 0.0, 0.0])
    moved = ConeBeamScanner.of(Phantom(VESSEL), replace(grid, origin_mm=grid.origin_mm - shift), ARC)
    there = moved.scan([], (0,)).astype(float)[:, :, 18:30].mean(axis=2)
    here = plain[:, :, 18:30].mean(axis=2)
    assert np.abs(there[14:36, 14:34] - here[12:34, 14:34]).mean() < 0.3 * np.abs(there - here)[14:36, 14:34].mean()


def test_only_the_filled_box_is_projected_and_nothing_is_lost(scanner: ConeBeamScanner, grid: ScanGrid) -> None:
    share = np.zeros(grid.shape, dtype=np.float32)
    share[9:14, 30:33, 20:41] = 1.0
    whole = scanner.arm.line_integrals(share, grid.spacing_mm, np.zeros(3))
    np.testing.assert_allclose(scanner.arm.paths(share), whole, rtol=0.0, atol=2e-3)
    assert whole.max() > 2.0


def test_the_wire_is_bright_where_it_is_and_casts_streaks(scanner: ConeBeamScanner, grid: ScanGrid) -> None:
    points = LINE + np.array([5.0, -3.0, 2.0])
    added = scanner.scan([(points, 0.18)], (1,)).astype(float) - scanner.scan([], (1,))
    slab = added[:, :, 20:28].mean(axis=2)
    peak = np.array(np.unravel_index(np.argmax(slab), slab.shape))
    assert np.all(np.abs(peak - grid.to_index(points[20])[:2]) < 1.0)
    assert slab.max() > 500
    # metal darkens or brightens voxels far outside the wire: that is what ideal scanners lack
    ring = np.hypot(*(np.indices(slab.shape) - peak[:, None, None]))
    assert np.abs(slab[(ring > 4) & (ring < 10)]).max() > 3 * np.abs(added[2:6, 2:6]).mean() / np.sqrt(8)
