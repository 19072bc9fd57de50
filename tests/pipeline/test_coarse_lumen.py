"""The lumen beside a scan in larger voxels: as coarse as the scan, and no coarser."""

import numpy as np
import pytest

from pipeline.model import Branches, Lumen
from pipeline.segment.config import SegmentConfig
from pipeline.segment.given import given_lumen
from pipeline.trace.coarse import coarse_lumen
from solver import Grid


def test_a_lumen_in_voxels_as_large_stays_as_it_is() -> None:
    """A centreline's has 0.3 mm: in three times that a vessel of 0.6 mm radius was none, and others 0.4 mm thinner."""
    ends = np.array([[0.0, 0.0, 0.0], [3.0, 1.0, 9.0], [2.0, 4.0, 18.0]])
    radius = np.full(2, 0.6)
    lumen = given_lumen(Branches(ends[:-1], ends[1:], radius, radius), SegmentConfig())
    assert coarse_lumen(lumen, 3 * 0.1) is lumen


@pytest.mark.parametrize("voxel", [0.1, 0.12, 0.15])
def test_a_lumen_in_the_scans_voxels_becomes_as_coarse_as_the_scan(voxel: float) -> None:
    plane = np.broadcast_to(voxel * np.arange(24.0, dtype=np.float32) - 1.0, (24, 24, 24))
    lumen = Lumen(Grid(plane, np.full(3, voxel), np.zeros(3)))
    found = coarse_lumen(lumen, 2 * voxel).distance
    assert found.shape == (12, 12, 12)
    np.testing.assert_allclose(found.spacing_mm, 2 * voxel)
    np.testing.assert_allclose(
        found.values[0, 0], found.to_mm([[0, 0, k] for k in range(12)])[:, 2] - 1.0, rtol=0.0, atol=1e-6
    )
