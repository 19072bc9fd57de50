"""A diameter that is given for a radius: the traced wire is too thin for it. A rod that is traced: it is too thick."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.model import Curve, Lumen
from pipeline.run.stages.known import Frame
from pipeline.run.stages.thickness import not_too_thick, too_thin
from pipeline.segment import BLUR_UNSURE, segment
from pipeline.status import FrameStatus
from solver.grid import Grid
from tests.later import later
from tests.studies.seeing.scenes import Draft
from tests.studies.seeing.table import seen

BLUR_MM = 0.23


def lumen(blur_mm: float = BLUR_MM, spacing_mm: tuple[float, float, float] = (0.3, 0.3, 0.3)) -> Lumen:
    return Lumen(Grid(np.zeros((4, 4, 4)), spacing_mm), levels={"scanner_blur_mm": blur_mm})


def frames(radius_mm: float, fitted: float = 1.5) -> list[Frame]:
    """Of a wire of that radius; a fit takes it for 1.5 times as thick."""
    seen = {"blur_mm": float(np.hypot(BLUR_MM, 0.5 * fitted * radius_mm))}
    points = np.stack([np.zeros(9), np.zeros(9), np.linspace(0, 20, 9)], 1)
    return [Frame(n, curve=Curve(points, np.full(9, 0.02), 0.05, levels=seen)) for n in range(3)]


@pytest.mark.parametrize("radius_mm", [0.18, 0.25, 0.45])
def test_a_diameter_given_for_the_radius_is_told(radius_mm: float) -> None:
    """It was not: the simulated wire then lies a radius from the wall where the real one touches it."""
    assert too_thin(frames(radius_mm), lumen(), radius_mm) == []
    (said,) = too_thin(frames(radius_mm), lumen(), 2.0 * radius_mm)
    assert f"{3.0 * radius_mm:.2f} mm thick at most, and radius_mm = {2.0 * radius_mm:g}" in said
    assert "is it the diameter?" in said


def test_of_a_tenth_less_the_diameter_is_the_second_cause_that_is_named() -> None:
    """A right radius of 0.18 mm had it in a lumen that a membrane parts; but so have radii stated twice as large."""
    (said,) = too_thin(frames(0.18, fitted=0.88), lumen(), 0.18)
    assert "looks 0.32 mm thick at most, and radius_mm = 0.18 says 0.36 mm: 12 % less" in said
    assert 0 < said.index("check the lumen") < said.index("whether it is the diameter")


@pytest.mark.parametrize(
    "vessel",
    [lumen(float("nan")), lumen(spacing_mm=(0.3, 0.3, 0.6)), lumen(spacing_mm=(0.7, 0.7, 0.7))],
    ids=["a lumen that was given", "thick slices", "large voxels"],
)
def test_what_cannot_be_told_is_not_doubted(vessel: Lumen) -> None:
    assert too_thin(frames(0.18), vessel, 0.36) == []
    assert too_thin([Frame(0)], lumen(), 0.36) == []


def test_a_wall_that_tells_the_blur_badly_leaves_a_right_radius_alone() -> None:
    """Beside a wire, or in a few greys, walls look 12 to 14 % less sharp: a wire of 0.36 mm looked 0.23 mm thick."""
    vessel = lumen(0.265)
    wire = [Frame(0, curve=Curve(20.0 * np.eye(3), np.full(3, 0.02), levels={"blur_mm": 0.272}))]
    assert too_thin(wire, vessel, 0.18)
    vessel.levels["blur_unsure"] = BLUR_UNSURE
    assert too_thin(wire, vessel, 0.18) == []
    assert too_thin(wire, vessel, 0.36), "a diameter given for the radius is told"


@pytest.mark.quick(1)
@pytest.mark.parametrize("way", ["", "wire", "greys"])
def test_walls_beside_a_wire_or_in_few_greys_tell_the_blur_badly(way: str) -> None:
    scene = Draft(np.random.default_rng(0)).scan(16)
    scan = scene.frame if way == "wire" else scene.reference
    if way == "greys":
        scan = replace(scan, values=(scan.values / 80).astype(np.int16))
    found = segment(scan, scene.entry[None], wire_radius_mm=scene.wire_radius if way == "wire" else None)
    assert ("blur_unsure" in found.levels) is bool(way)


@pytest.mark.parametrize("seed", [0, *later(1)])
def test_a_rod_is_no_wire_of_a_third_of_its_radius(seed: int) -> None:
    """Rods of 1 to 1.2 mm were traced, ok, in studies of a 0.36 mm wire; its own radius is as right as before."""
    rng = np.random.default_rng([seed, 9])
    radius_mm = float(rng.uniform(0.48, 0.6))
    scene = Draft(rng, radius=rng.uniform(1.6, 2.2), wire_radius=radius_mm).scan((8, 16)[seed % 2])
    vessel, curve = seen(scene)
    assert curve.status is FrameStatus.OK
    assert not_too_thick(curve, vessel, radius_mm) is curve
    refused = not_too_thick(curve, vessel, 0.18)
    assert refused.status is FrameStatus.TRACE_AMBIGUOUS
    assert "mm thick; expected 0.90 mm at most of a wire of radius_mm = 0.18" in refused.note


def test_a_wall_that_looks_sharper_than_any_line_makes_no_rod_of_a_wire() -> None:
    """A head's scan with a background of 0, blur of its wall 0.25 mm: all 12 right traces of a wire were refused."""
    vessel = lumen(0.25, (0.5, 0.5, 0.5))
    wire, rod = (Curve(20.0 * np.eye(3), np.full(3, 0.02), levels={"blur_mm": b}) for b in (0.443, 0.55))
    assert not_too_thick(wire, vessel, 0.18) is wire
    assert not_too_thick(rod, vessel, 0.18) is not rod


def test_a_short_line_tells_no_width() -> None:
    """A right one of 10 voxels looked 1.58 mm thick, of 0.36 stated, and was refused."""
    short, long = (Curve(mm * np.eye(3)[:2], np.full(2, 0.02), levels={"blur_mm": 0.6}) for mm in (3.0, 6.0))
    assert not_too_thick(short, lumen(), 0.18) is short
    assert not_too_thick(long, lumen(), 0.18).status is FrameStatus.TRACE_AMBIGUOUS


@pytest.mark.parametrize("vessel", [lumen(float("nan")), lumen(spacing_mm=(0.3, 0.3, 0.6))])
def test_what_shows_no_width_is_no_rod(vessel: Lumen) -> None:
    thick = frames(0.55)[0].curve
    assert thick is not None
    assert not_too_thick(thick, lumen(), 0.18) is not thick
    assert not_too_thick(thick, vessel, 0.18) is thick
