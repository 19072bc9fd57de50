"""An own lumen is held against the scan: larger, smaller or elsewhere than the vessel there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.special import ndtr

from pipeline.model import Lumen, Volume
from pipeline.run.stages.known import Frame
from pipeline.run.stages.trace import _first_said
from pipeline.segment.shown import LumenDoubt, beside_the_wall
from pipeline.status import FrameStatus
from reports.doubts import Caveats
from solver import Grid
from tests.pipeline.phantoms import helix

VOXEL, RADIUS, NOISE = 0.4, 1.6, 200.0


@pytest.fixture(scope="module")
def tube() -> Grid:
    """Signed distance to a helical tube, on an oblique lattice."""
    axis = helix(radius=5.0, pitch=9.0, turns=0.8)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    local = axis @ turn
    low, high = local.min(axis=0) - 4.0, local.max(axis=0) + 4.0
    shape = tuple(int(n) for n in np.ceil((high - low) / VOXEL))
    grid = Grid(np.zeros(shape, np.float32), np.full(3, VOXEL), turn @ low, turn)
    points = grid.to_mm(np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 3))
    return grid.with_values((cKDTree(axis).query(points)[0] - RADIUS).reshape(shape).astype(np.float32))


def scan_of(tube: Grid, contrast: float = 1000.0) -> Volume:
    rng = np.random.default_rng(5)
    grey = 100.0 + contrast * ndtr(-tube.values / (0.8 * VOXEL)) + NOISE * rng.normal(size=tube.shape)
    return Volume(grey.astype(np.int16), tube.spacing_mm, tube.origin_mm, tube.direction)


def larger(tube: Grid, by_mm: float) -> Lumen:
    return Lumen(tube.with_values(np.clip(tube.values - by_mm, -9, 3).astype(np.float32)))


@pytest.mark.parametrize("by_mm", [-0.1, 0.0, 0.1])
def test_a_lumen_that_fits_is_nothing_to_speak_of(tube: Grid, by_mm: float) -> None:
    assert beside_the_wall(larger(tube, by_mm), scan_of(tube)) == LumenDoubt()


@pytest.mark.parametrize("by_mm", [0.4, 1.0, 1.1, -0.4, -0.8])
def test_a_lumen_of_another_size_is_told_by_how_much(tube: Grid, by_mm: float) -> None:
    """A mask dilated by one voxel multiplied the error by 3.5, and nothing was said."""
    told, far = beside_the_wall(larger(tube, by_mm), scan_of(tube))
    assert Caveats(warnings=[told]).against, "pages name it first"
    assert far is (abs(by_mm) > 2.0 * VOXEL)
    assert ("outside the wall" if by_mm > 0 else "inside the wall") in told
    found = float(told.partition("lies ")[2].partition(" mm")[0])
    assert found == pytest.approx(abs(by_mm), abs=0.15 * VOXEL)


@pytest.mark.parametrize(("thick_mm", "by_mm"), [(1.2, 0.0), (1.5, 0.0), (2.5, 0.0), (2.5, 0.8), (2.5, -0.8)])
def test_water_in_resin_in_air_has_its_wall_where_grey_rises(tube: Grid, thick_mm: float, by_mm: float) -> None:
    """It falls by more where the resin ends: a right label map was told to lie 0.9 mm inside the wall."""
    wet, dry = (ndtr((tube.values - at) / (0.8 * VOXEL)) for at in (0.0, thick_mm))
    grey = 300.0 * wet - 1300.0 * dry + 60.0 * np.random.default_rng(5).normal(size=tube.shape)
    told, _ = beside_the_wall(larger(tube, by_mm), Volume(grey, tube.spacing_mm, tube.origin_mm, tube.direction))
    assert bool(told) is (by_mm != 0.0)
    if told:
        assert ("outside the wall" if by_mm > 0 else "inside the wall") in told
        assert float(told.partition("lies ")[2].partition(" mm")[0]) == pytest.approx(abs(by_mm), abs=0.15 * VOXEL)


def test_a_lumen_elsewhere_is_told_where(tube: Grid) -> None:
    lumen = Lumen(replace(tube, origin_mm=tube.origin_mm + [0.0, 0.6, -0.3]))
    told, _ = beside_the_wall(lumen, scan_of(tube))
    found = np.array([float(x) for x in told.partition("(")[2].partition(")")[0].split(",")])
    np.testing.assert_allclose(found, [0.0, 0.6, -0.3], rtol=0.0, atol=0.04)  # a tenth of a voxel


def test_a_frame_that_failed_in_a_lumen_far_off_says_that_first() -> None:
    """Diameters given for radii: "look at the reference; name another one, or none" stood above what was wrong."""
    bad = Frame(0).failed("trace", FrameStatus.TRACE_AMBIGUOUS, "trace: wire: got two")
    assert (
        _first_said(bad, "the lumen lies off").message == "the lumen lies off; look at that first. trace: wire: got two"
    )
    assert _first_said(bad, "").message == "trace: wire: got two"
    unread = Frame(0).failed("load", FrameStatus.LOAD_FAILED, "w.mha: cut off")
    for other in (Frame(0), unread):
        assert _first_said(other, "the lumen lies off") is other, "an unreadable file has nothing to do with the lumen"


def test_a_scan_without_the_vessel_says_nothing(tube: Grid) -> None:
    """Taken without contrast medium: the user's lumen is all there is."""
    assert beside_the_wall(larger(tube, 1.0), scan_of(tube, contrast=100.0)) == LumenDoubt()
    away = scan_of(tube)
    assert beside_the_wall(larger(tube, 1.0), replace(away, origin_mm=away.origin_mm + 500.0)) == LumenDoubt()
