"""A diameter that is given for a radius: the traced wire is too thin for it."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.model import Curve
from pipeline.run.stages.known import Frame
from pipeline.run.stages.thickness import too_thin

BLUR_MM = 0.23
VOXELS = np.full(3, 0.3)


def frames(radius_mm: float, fitted: float = 1.5) -> list[Frame]:
    """Of a wire of that radius; a fit takes it for 1.5 times as thick."""
    seen = {"blur_mm": float(np.hypot(BLUR_MM, 0.5 * fitted * radius_mm))}
    points = np.stack([np.zeros(9), np.zeros(9), np.linspace(0, 20, 9)], 1)
    return [Frame(n, curve=Curve(points, np.full(9, 0.02), 0.05, levels=seen)) for n in range(3)]


@pytest.mark.parametrize("radius_mm", [0.18, 0.25, 0.45])
def test_a_diameter_given_for_the_radius_is_told(radius_mm: float) -> None:
    """It was not: the simulated wire then lies a radius from the wall where the real one touches it."""
    assert too_thin(frames(radius_mm), BLUR_MM, radius_mm, VOXELS) == []
    (said,) = too_thin(frames(radius_mm), BLUR_MM, 2.0 * radius_mm, VOXELS)
    assert f"{3.0 * radius_mm:.2f} mm thick at most, and radius_mm = {2.0 * radius_mm:g}" in said


@pytest.mark.parametrize(
    ("blur_mm", "spacing_mm"),
    [(float("nan"), VOXELS), (BLUR_MM, np.array([0.3, 0.3, 0.6])), (BLUR_MM, np.full(3, 0.7))],
    ids=["a lumen that was given", "thick slices", "large voxels"],
)
def test_what_cannot_be_told_is_not_doubted(blur_mm: float, spacing_mm: np.ndarray) -> None:
    assert too_thin(frames(0.18), blur_mm, 0.36, spacing_mm) == []
    assert too_thin([Frame(0)], BLUR_MM, 0.36, VOXELS) == []
