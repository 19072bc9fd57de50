"""Cone-beam scanner: path lengths against geometry, and a reconstruction against what was put in."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("itk", reason="needs the extra [conebeam]")

from data_synthetic.scan_grid import ScanGrid, centred_grid
from data_synthetic.scanner.conebeam import Arc, ConeBeamScanner
from data_synthetic.tubes import Anatomy, sweep

ARC = Arc(projections=60, pixels=96, photons=1e5)
LINE = np.column_stack([np.full(41, 0.3), np.full(41, -0.4), np.linspace(-6, 6, 41)])


@pytest.fixture(scope="module")
def grid() -> ScanGrid:
    return centred_grid([5.0, -3.0, 2.0], (48, 48, 48), 0.5)


@pytest.fixture(scope="module")
def scanner(grid: ScanGrid) -> ConeBeamScanner:
    vessel = Anatomy((sweep("v", [[5.0, -3.0, -20.0], [5.0, -3.0, 24.0]], 2.5),))
    return ConeBeamScanner.of(vessel, None, 1.0, grid, ARC)


def test_central_ray_crosses_the_vessel_by_its_diameter(scanner: ConeBeamScanner) -> None:
    middle = scanner.contrast[:, 46:50, 46:50]
    np.testing.assert_allclose(middle, 5.0, atol=0.15)
    body = 2 * 0.625 * 24.0
    np.testing.assert_allclose(scanner.body[:, 47:49, 47:49], body, rtol=1e-3)


def test_tissue_and_contrast_come_back_at_their_greys(scanner: ConeBeamScanner, grid: ScanGrid) -> None:
    scan = scanner.scan([], (0,)).astype(float)
    assert np.median(scan[scanner.share > 0.99]) == pytest.approx(1000, abs=60)
    assert np.median(scan[14:34, 14:34, 14:34][scanner.share[14:34, 14:34, 14:34] == 0]) == pytest.approx(
        100, abs=80
    )


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
