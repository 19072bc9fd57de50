"""The bench's scenes: a helical vessel with a wire in it, scanned with noise, and how far a curve is from the wire."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from pipeline.compare.metrics import point_to_curve
from pipeline.model import Volume
from tests.pipeline import phantoms

VOXEL, PSF, RADIUS = 0.3, 0.8, 0.2
PEAK = phantoms.wire_peak(RADIUS / VOXEL, PSF)


@dataclass(frozen=True, eq=False)
class Scene:
    """A vessel without and with a wire before blur, and both blurred; ``entry`` is off by half a voxel."""

    seed: int
    origin: np.ndarray
    empty: np.ndarray
    wired: np.ndarray
    blurred: tuple[np.ndarray, np.ndarray]
    wire: np.ndarray
    entry: np.ndarray
    direction: np.ndarray


FADE, MOTTLE, MOTTLE_VOXELS = 0.25, 0.04, 5.0
"""Uneven contrast: what is lost of it from end to end of the vessel, and its mottle (share of it, correlation)."""


def _faded(vessel, shape, origin, seed):
    """Share of the contrast at every voxel: it fades along the vessel and is mottled, as flow leaves it."""
    axis = vessel[-1] - vessel[0]
    along = sum(
        (np.arange(n) * VOXEL + o).reshape([-1 if b == a else 1 for b in range(3)]) * axis[a]
        for a, (n, o) in enumerate(zip(shape, origin, strict=True))
    )
    share = np.clip((along - vessel[0] @ axis) / (axis @ axis), 0, 1).astype(np.float32)
    noise = np.random.default_rng(seed + 70).standard_normal(shape, dtype=np.float32)
    mottle = ndimage.gaussian_filter(noise, MOTTLE_VOXELS)
    return 1 - FADE * share + MOTTLE * mottle / mottle.std()


def scene(seed, side, uneven=False):
    """A 4 mm helical vessel and a wire that wanders in it, in side^3 voxels; its contrast even, or fading."""
    vessel = phantoms.helix(0.36 * VOXEL * (side - 30), 0.5 * VOXEL * (side - 60), 1.25 if side > 150 else 0.9)
    centre = 0.5 * (vessel.min(axis=0) + vessel.max(axis=0))
    origin = centre - 0.5 * VOXEL * side
    shape = (side, side, side)
    wire = phantoms.inside_curve(vessel, 1.2, seed)[60:-140]
    distance = phantoms.distance_to(vessel, shape, VOXEL, origin, 2.6)
    contrast = 900 * phantoms.partial_volume(distance - 2.0, VOXEL)
    contrast *= _faded(vessel, shape, origin, seed) if uneven else 1.0
    empty = (phantoms.BACKGROUND + contrast).astype(np.float32)
    wired = phantoms.add_wire(empty.copy(), wire, RADIUS, phantoms.WIRE, VOXEL, origin)
    direction = wire[45] - wire[35]
    rng = np.random.default_rng(seed + 7)
    shift = rng.normal(size=3)
    shift *= 0.5 * VOXEL / np.linalg.norm(shift)
    blurred = (ndimage.gaussian_filter(empty, PSF), ndimage.gaussian_filter(wired, PSF))
    return Scene(seed, origin, empty, wired, blurred, phantoms.resample(wire, 0.005), wire[40] + shift, direction)


def volumes(s, cnr, correlation=0.0):
    """Frame and reference of the same noise."""
    noise = PEAK / cnr
    return tuple(
        Volume(np.asfortranarray(phantoms.scan(v, 0, noise, 1000 * s.seed + n, correlation)), [VOXEL] * 3, s.origin)
        for n, v in enumerate(s.blurred[::-1])
    )


def errors(points, s):
    """Mean, p95, tip (voxel) and coverage of the true curve from the entry plane on."""
    off, _ = point_to_curve(points, s.wire)
    first = int(np.argmin(np.linalg.norm(s.wire - points[0], axis=1)))
    seen = cKDTree(phantoms.resample(points, 0.05)).query(s.wire[first:])[0] < 2 * VOXEL
    tip = np.linalg.norm(points[-1] - s.wire[-1]) / VOXEL
    return off.mean() / VOXEL, np.percentile(off, 95) / VOXEL, tip, seen.mean()


def pulls(curve, s):
    """Errors across the wire over their stated standard deviations, and the tip's along it."""
    _, near = cKDTree(s.wire).query(curve.points_mm)
    t = np.gradient(s.wire, axis=0)[near]
    t /= np.linalg.norm(t, axis=1)[:, None]
    off = curve.points_mm - s.wire[near]
    side = np.cross(t, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1)[:, None]
    other = np.cross(t, side)
    keep = slice(2, -6)
    across = np.concatenate([np.sum(off * side, axis=1)[keep], np.sum(off * other, axis=1)[keep]])
    sigma = np.concatenate([curve.sigma_mm[keep]] * 2)
    return across / sigma, float((curve.points_mm[-1] - s.wire[-1]) @ t[-1] / curve.tip_sigma_mm)
