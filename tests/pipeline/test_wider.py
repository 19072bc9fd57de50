"""A wall that lies all around outside, or inside, the reference's: tubes with a wire, drawn by formula."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from pipeline.model import Curve, Lumen, Volume
from pipeline.register import Anchor, anchor, register
from pipeline.register.frames import alignment_of, record, sentences_of, widened
from tests.pipeline.test_bent import LATTICE, RADIUS, SKIP, VOXEL, distance, line, turned, wire

NOISE = 25.0


def tube(more_mm: float, vessel: float, number: int, voxels: float = 0.0, gain: float = 1.0) -> Volume:
    """A frame of a tube wider than the reference's, of grey ``vessel``; the reference is number 0, without a wire."""
    move = turned(voxels, voxels, 0).moved
    grey = vessel * ndtr((RADIUS + more_mm - distance(move(line(0)))) / 0.25)
    if number:
        grey += 900.0 * np.exp(-0.5 * (distance(move(wire(0))) / 0.25) ** 2)
    grey = gain * (grey + np.random.default_rng(number).normal(0.0, NOISE, LATTICE.shape))
    return Volume(grey.astype(np.int16), LATTICE.spacing_mm, LATTICE.origin_mm)


def held(vessel: float) -> tuple[Lumen, Anchor]:
    lumen = Lumen(LATTICE.with_values((distance(line(0)) - RADIUS).astype(np.float32)))
    return lumen, anchor(tube(0.0, vessel, 0), lumen)


@pytest.mark.quick(2)
@pytest.mark.parametrize(
    ("more_mm", "vessel", "voxels", "gain"),
    [(0.1, 400.0, 0.0, 1.3), (-0.15, 400.0, 0.0, 1.0), (0.2, -400.0, 0.0, 1.0), (-0.2, 400.0, 3.0, 0.8)],
)
def test_a_wider_or_narrower_vessel_than_the_references_is_told(
    more_mm: float, vessel: float, voxels: float, gain: float
) -> None:
    """Once ok: traces half of that off, at a tenth of it as their standard deviation."""
    lumen, to = held(vessel)
    found = register(tube(more_mm, vessel, 1, voxels, gain), to, SKIP)
    assert np.linalg.norm(found.motion.moved(line(0)) - turned(voxels, voxels, 0).moved(line(0)), axis=1).max() < VOXEL
    assert found.wider.voxels == pytest.approx(more_mm / VOXEL, rel=0.15)
    alignment = alignment_of(lumen, to.reference, SKIP, switched_on=True, own_curves=False)
    (told,) = sentences_of(alignment, {1: found})[1]
    side = "outside" if more_mm > 0.0 else "inside"
    assert f"frame 1: the vessel's wall lies {abs(found.wider.voxels) * VOXEL:.2f} mm {side}" in told
    curve = widened(Curve(wire(0), np.full(len(wire(0)), 0.006), 0.05), found)
    assert curve.sigma_mm == pytest.approx(np.hypot(0.006, 0.5 * abs(found.wider.voxels) * VOXEL))
    written = record(found)
    assert written is not None
    assert written["wider_voxels"] == found.wider.voxels


@pytest.mark.quick(1)
@pytest.mark.parametrize(("vessel", "voxels", "gain"), [(400.0, 0.0, 1.3), (-400.0, 0.0, 1.0), (100.0, 2.0, 1.0)])
def test_a_vessel_as_wide_as_the_references_is_silent(vessel: float, voxels: float, gain: float) -> None:
    _, to = held(vessel)
    found = register(tube(0.0, vessel, 1, voxels, gain), to, SKIP)
    assert abs(found.wider.voxels) < 0.1
    assert not found.wider.told
    assert found.wider.off_mm == 0.0


@pytest.mark.quick(1)
@pytest.mark.parametrize(("radius", "metal", "beside"), [(1.0, 1500.0, 0.0), (1.2, 4000.0, 0.9), (0.8, 900.0, 0.0)])
def test_the_skirts_of_a_wire_that_fills_its_vessel_are_no_wall(radius: float, metal: float, beside: float) -> None:
    """Once 0.3 to 0.8 voxel, told: what lay next to metal all along was taken for wall."""
    away = distance(line(0))
    clean = 400.0 * ndtr((radius - away) / 0.25)
    wired = clean + metal * np.exp(-0.5 * (distance(line(0) + [beside, 0.0, 0.0]) / 0.25) ** 2)
    noise = np.random.default_rng(5).normal(0.0, NOISE, (2, *LATTICE.shape))
    reference, frame = (
        Volume((grey + rest).astype(np.int16), LATTICE.spacing_mm, LATTICE.origin_mm)
        for grey, rest in zip((clean, wired), noise, strict=True)
    )
    to = anchor(reference, Lumen(LATTICE.with_values((away - radius).astype(np.float32))))
    assert not register(frame, to, SKIP).wider.told
