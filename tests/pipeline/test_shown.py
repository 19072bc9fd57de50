"""An own lumen is held against the scan: larger, smaller or elsewhere than the vessel there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import SimpleITK as sitk
from scipy.spatial import cKDTree
from scipy.special import ndtr

from pipeline.arrays.grids import corners_mm
from pipeline.load import Crop, read_header
from pipeline.model import Lumen, Volume
from pipeline.run.log import Log
from pipeline.run.stages.known import Frame
from pipeline.run.stages.segment import _held_against
from pipeline.run.stages.trace import _first_said
from pipeline.segment.astray import astray
from pipeline.segment.shown import LumenDoubt, beside_the_wall
from pipeline.status import FrameStatus, StageError
from pipeline.study.settings import Config
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


PATH = helix(radius=5.0, pitch=9.0, turns=0.8)
ENTRY, AHEAD = PATH[0], (PATH[1] - PATH[0]) / np.linalg.norm(PATH[1] - PATH[0])


def turned_about_entry(tube: Grid, turn: object) -> Lumen:
    """The tube flipped or turned: it shares the entry, and what lies around it, with the right one."""
    matrix = np.asarray(turn, float)
    origin = matrix @ (tube.origin_mm - ENTRY) + ENTRY
    return Lumen(replace(tube, origin_mm=origin, direction=matrix @ tube.direction))


def told_astray(lumen: Lumen, scan: Volume) -> str:
    return astray(lumen, scan, ENTRY, AHEAD, lambda _: scan)


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


@pytest.mark.parametrize(
    ("turn", "fits"),
    [
        (np.diag([-1.0, -1.0, 1.0]), "(-x, -y, z) about the entry"),
        (np.diag([-1.0, 1.0, 1.0]), "(-x, y, z) about the entry"),
        (np.eye(3)[[1, 0, 2]], "(y, x, z) about the entry"),
        (np.array([[0.866, 0.5, 0.0], [-0.5, 0.866, 0.0], [0.0, 0.0, 1.0]]), ""),
    ],
)
@pytest.mark.parametrize("contrast", [1000.0, -1000.0, 600.0])
def test_a_lumen_that_leaves_the_vessel_beyond_the_entry_is_told(
    tube: Grid, turn: object, fits: str, contrast: float
) -> None:
    """RAS for LPS: its wall is right by the entry, nothing was said, and the phantom was told to be soft."""
    told = told_astray(turned_about_entry(tube, turn), scan_of(tube, contrast))
    assert told.startswith("the given lumen lies beside the vessel: ")
    assert Caveats(warnings=[told]).against, "pages name it first"
    assert told.endswith(f"with its coordinates as {fits} it lies in the vessel" if fits else "whether it is turned")


def test_what_cannot_be_read_beyond_the_lumen_hides_no_doubt_of_it(tube: Grid, tmp_path: Path) -> None:
    """A scan of real numbers with NaN in its padding: other axes of the lumen lead there, what is told does not."""
    path, lumen = tmp_path / "scan.mha", turned_about_entry(tube, np.diag([-1.0, -1.0, 1.0]))
    noise = 100.0 + NOISE * np.random.default_rng(6).normal(size=np.array(tube.shape) + 40)
    noise[20:-20, 20:-20, 20:-20] = scan_of(tube).values
    image = sitk.GetImageFromArray(noise.astype(np.float32).transpose(2, 1, 0))
    image.SetSpacing(tube.spacing_mm.tolist())
    image.SetOrigin(tube.to_mm([-20.0] * 3).tolist())
    image.SetDirection(tube.direction.ravel().tolist())
    sitk.WriteImage(image, str(path))
    box = tuple(map(slice, *read_header(path).box_of(corners_mm(lumen.distance))))
    padded = np.full(noise.shape, np.nan, np.float32)
    padded[box] = noise[box]
    padding = sitk.GetImageFromArray(padded.transpose(2, 1, 0))
    padding.CopyInformation(image)
    sitk.WriteImage(padding, str(path))
    scan = read_header(path)
    with pytest.raises(StageError, match="NaN"):
        Crop(scan, scan.box).load()
    case = SimpleNamespace(entry_mm=ENTRY, entry_direction=AHEAD)
    run: Any = SimpleNamespace(case=case, config=Config(), log=Log(lambda *_: None), load=lambda crop: crop.load())
    known: Any = SimpleNamespace(scans=SimpleNamespace(first=scan))
    assert _held_against(run, known, lumen).told.startswith("the given lumen lies beside the vessel: ")


def test_a_lumen_that_goes_with_the_vessel_is_not_told(tube: Grid) -> None:
    """Filled in part, washed out, of another size, one branch of two, with metal in it, or hardly seen."""
    right, scan = Lumen(tube), scan_of(tube)
    grey = scan.values.astype(float)
    along = (scan.to_mm(np.indices(scan.shape).reshape(3, -1).T)[:, 2] - ENTRY[2]).reshape(scan.shape)
    half = np.where(along < 2.5, grey, 100.0 + NOISE * np.random.default_rng(6).normal(size=grey.shape))
    decaying = 100.0 + (grey - 100.0) * np.exp(-np.clip(along, 0.0, None) / 4.0)
    metal = np.where(tube.values < -1.2, 6000.0, grey)
    places = scan.to_mm(np.indices(scan.shape).reshape(3, -1).T)
    back = (places - ENTRY) @ AHEAD
    aside = np.linalg.norm(places - ENTRY - back[:, None] * AHEAD, axis=1)
    inlet = np.where(((back < 0.0) & (aside < 1.5)).reshape(scan.shape), 1100.0, half)
    for shown in (half, decaying, metal, inlet):
        assert not told_astray(right, replace(scan, values=shown))
    for other in (larger(tube, 1.0), larger(tube, -0.6), Lumen(replace(tube, origin_mm=tube.origin_mm + [0.6, 0, 0]))):
        assert not told_astray(other, scan)
    stump = tube.with_values(np.where(along < 3.0, tube.values, 3.0).astype(np.float32))
    assert not told_astray(Lumen(stump), scan)
    assert not told_astray(turned_about_entry(tube, np.diag([-1.0, -1.0, 1.0])), scan_of(tube, 100.0))
