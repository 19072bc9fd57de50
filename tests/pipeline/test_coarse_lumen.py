"""The lumen beside a scan in larger voxels: as coarse as the scan, and no coarser."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.model import Branches, Lumen, Volume
from pipeline.segment.config import SegmentConfig
from pipeline.segment.given import given_lumen
from pipeline.trace.coarse import ALL_OF_THEM, coarse_lumen, coarse_scan, matching, times
from solver import Grid

AS_LPS = np.eye(3)


def scan_of(
    *spacing_mm: float, shape: tuple[int, int, int] = (12, 12, 12), direction: NDArray[np.float64] = AS_LPS
) -> Volume:
    """Its greys are the indices along the first axis."""
    values = np.broadcast_to(np.arange(float(shape[0]))[:, None, None], shape)
    return Volume(values.astype(np.float32), np.broadcast_to(spacing_mm, 3), np.zeros(3), direction)


def test_voxels_are_made_of_about_the_largest_edge_along_each_axis() -> None:
    """One factor, by the smallest edge, made 0.3 x 0.3 x 0.75 mm of 0.1 x 0.1 x 0.25: a fifth of frames was lost.

    Rounded down, 0.15 x 0.15 x 0.1503 mm became 0.3 x 0.3 x 0.1503: 2 of 16 frames were.
    """
    for spacing, shape, wanted in (
        ((0.1, 0.1, 0.25), (60, 60, 30), (3, 3, 1)), ((0.05, 0.14, 0.1), (60, 60, 60), (6, 2, 3)),
        ((0.1, 0.1, 0.1), (60, 60, 10), (3, 3, 1)), ((0.4, 0.3, 0.5), (60, 60, 60), ALL_OF_THEM),
        ((0.15, 0.15, 0.75), (60, 60, 60), ALL_OF_THEM),
        ((0.15, 0.15, 0.1503), (60, 60, 60), (2, 2, 2)), ((0.1, 0.1, 0.16), (60, 60, 60), (3, 3, 2)),
    ):  # fmt: skip
        assert times(scan_of(*spacing, shape=shape)) == wanted
    scan = scan_of(0.1, 0.1, 0.25, shape=(60, 60, 30))
    found = coarse_scan(scan, times(scan))
    assert found.shape == (20, 20, 30)
    np.testing.assert_allclose(found.spacing_mm, [0.3, 0.3, 0.25])
    np.testing.assert_allclose(found.origin_mm, [0.1, 0.1, 0.0], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.values[:, 0, 0], 3.0 * np.arange(20) + 1.0)


def test_a_lumen_whose_axes_are_others_is_as_coarse_as_the_scan_along_each() -> None:
    turned = np.eye(3)[[2, 0, 1]]
    lumen = Lumen(Grid(np.full((24, 24, 24), -1.0, np.float32), np.full(3, 0.1)))
    found = coarse_lumen(lumen, scan_of(0.1, 0.2, 0.3, direction=turned)).distance
    np.testing.assert_allclose(np.abs(turned.T @ found.spacing_mm), [0.1, 0.2, 0.3])


def test_a_reference_whose_axes_are_others_is_as_coarse_as_its_frame_along_each() -> None:
    """It took the frame's numbers along its own axes: 0.3 x 0.1 x 0.75 mm beside 0.3 x 0.3 x 0.25."""
    seen = coarse_scan(scan := scan_of(0.1, 0.1, 0.25, shape=(60, 60, 30)), times(scan))
    sagittal = scan_of(0.1, 0.25, 0.1, shape=(60, 30, 60), direction=np.eye(3)[[0, 2, 1]])
    found = coarse_scan(sagittal, matching(sagittal, seen))
    np.testing.assert_allclose(found.spacing_mm, [0.3, 0.25, 0.3])


def test_a_lumen_in_voxels_as_large_stays_as_it_is() -> None:
    """A centreline's has 0.3 mm: in three times that a vessel of 0.6 mm radius was none, and others 0.4 mm thinner."""
    ends = np.array([[0.0, 0.0, 0.0], [3.0, 1.0, 9.0], [2.0, 4.0, 18.0]])
    radius = np.full(2, 0.6)
    lumen = given_lumen(Branches(ends[:-1], ends[1:], radius, radius), SegmentConfig())
    assert coarse_lumen(lumen, scan_of(0.3)) is lumen


@pytest.mark.parametrize("voxel", [0.1, 0.12, 0.15])
def test_a_lumen_in_the_scans_voxels_becomes_as_coarse_as_the_scan(voxel: float) -> None:
    plane = np.broadcast_to(voxel * np.arange(24.0, dtype=np.float32) - 1.0, (24, 24, 24))
    lumen = Lumen(Grid(plane, np.full(3, voxel), np.zeros(3)))
    found = coarse_lumen(lumen, scan_of(2 * voxel)).distance
    assert found.shape == (12, 12, 12)
    np.testing.assert_allclose(found.spacing_mm, 2 * voxel)
    np.testing.assert_allclose(
        found.values[0, 0], found.to_mm([[0, 0, k] for k in range(12)])[:, 2] - 1.0, rtol=0.0, atol=1e-6
    )
