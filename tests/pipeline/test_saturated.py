"""A wire that is brighter than the scan's greys go: its tip seemed a voxel too deep, with a sigma of 0.05 mm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr

from pipeline.model import Curve, Volume
from pipeline.trace.saturated import LEVEL, TIP_VOXELS, cut_off, saturated

VOXEL, TIP_MM = 0.4, 16.3
LINE = np.stack([np.full(33, 5.05), np.full(33, 5.1), np.linspace(0.0, TIP_MM, 33)], axis=1)
CURVE = Curve(LINE, np.full(33, 0.02), 0.05)


def scan(bright: float, noise: float = 10.0) -> Volume:
    """A straight wire along z, blurred by 0.35 mm, in a vessel of grey 200."""
    at = np.stack(np.meshgrid(*[VOXEL * np.arange(n) for n in (26, 26, 60)], indexing="ij"), -1)
    across = np.exp(-((at[..., 0] - 5.05) ** 2 + (at[..., 1] - 5.1) ** 2) / (2 * 0.35**2))
    greys = 200.0 + bright * across * ndtr((TIP_MM - at[..., 2]) / 0.35)
    noisy = greys + np.random.default_rng(0).normal(0.0, noise, greys.shape)
    return Volume(noisy.astype(np.float32), spacing_mm=np.full(3, VOXEL))


def clipped(volume: Volume, top: float) -> Volume:
    return replace(volume, values=np.minimum(volume.values, np.float32(top)))


@pytest.mark.parametrize("top", [300.0, 500.0, 700.0])
def test_a_crest_that_is_cut_off_is_said(top: float) -> None:
    seen = saturated(CURVE, clipped(scan(1000.0), top))
    assert seen.levels[LEVEL] > 0.8
    assert seen.tip_sigma_mm == pytest.approx(np.hypot(0.05, TIP_VOXELS * VOXEL))
    (said,) = cut_off({3: seen, 4: CURVE})
    assert said.startswith("frame 3: up to")
    assert "export the scans with a wider window" in said


def test_the_same_in_whole_numbers_of_eight_bits() -> None:
    volume = scan(1000.0)
    greys = np.clip(volume.values / 2.0, 0, 255).astype(np.uint8)
    assert LEVEL in saturated(CURVE, replace(volume, values=greys)).levels


@pytest.mark.parametrize("noise", [0.0, 10.0, 60.0])
def test_a_crest_that_is_not_is_left_as_it_is(noise: float) -> None:
    """Noise makes one voxel the greatest; without any, the crest differs from voxel to voxel near the tip alone."""
    volume = scan(1000.0, noise)
    whole = replace(volume, values=np.round(volume.values))
    kept = [saturated(CURVE, v) for v in ((volume, whole) if noise else (volume,))]
    assert all(curve is CURVE for curve in kept)
    bright = clipped(volume, 1e4)
    bright.values.flags.writeable = True
    bright.values[:3, :3, :3] = 1e4  # a marker, cut off, elsewhere
    assert saturated(CURVE, bright) is CURVE


def test_a_curve_without_points_has_no_crest() -> None:
    nothing = Curve(np.zeros((0, 3)), np.zeros(0))
    assert saturated(nothing, scan(1000.0)) is nothing
    assert cut_off({0: CURVE}) == []
