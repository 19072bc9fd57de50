"""Branches one to three voxels across: kept, with the radius that was drawn, and nothing else is added."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import label, map_coordinates

from pipeline.model import Volume
from pipeline.segment import segment
from pipeline.segment.config import SegmentConfig
from tests.later import later
from tests.pipeline import phantoms

VOXEL, LOW = 0.3, np.array([-4.93, -7.43, -8.93])
AXIS = np.array([0.95, 0.2, 0.25]) / np.linalg.norm([0.95, 0.2, 0.25])
POINTS = np.stack(np.indices((70, 50, 60)), axis=-1) * VOXEL + LOW


def lumen_of(radius, cnr, seed=100, zero=0.0):
    """A tube of 2 mm with a branch of ``radius`` mm, contrast 900, PSF 0.8 voxel. zero : added to the grey."""
    along = np.clip(POINTS @ AXIS, 0.0, 15.0)
    branch = np.linalg.norm(POINTS - along[..., None] * AXIS, axis=-1) - radius
    clean = 100.0 + 900.0 * phantoms.partial_volume(
        np.minimum(np.hypot(POINTS[..., 0], POINTS[..., 1]) - 2.0, branch), VOXEL
    )
    grey = phantoms.scan(clean, 0.8, 900.0 / cnr, seed)
    return segment(Volume(np.asfortranarray(grey + np.float32(zero)), [VOXEL] * 3, LOW), [[0.0, 0.0, 0.0]])


def wall_along(lumen):
    """Where the wall lies (mm from the axis, at four sides) along the branch outside its parent, and gaps in it."""
    place = np.arange(3.5, 13.5, 0.3)[:, None] * AXIS
    u = np.cross(AXIS, [0.0, 0.0, 1.0])
    u /= np.linalg.norm(u)
    v = np.cross(AXIS, u)
    index = lumen.distance.to_index(place)
    assert np.all(index > 0)
    assert np.all(index < np.array(lumen.distance.shape) - 1)
    inside = map_coordinates(lumen.distance.values, index.T, order=1) < 0
    sides = [s * w for w in (u, v) for s in (1, -1)]
    away = np.array(
        [map_coordinates(lumen.distance.values, lumen.distance.to_index(place + 0.9 * w).T, order=1) for w in sides]
    )
    return 0.9 - away.mean(), inside.mean()


@pytest.mark.quick(1)
@pytest.mark.parametrize(
    ("radius_voxels", "least"), [(0.67, 0.9), (1.0, 0.99), (1.67, 0.99), *later((0.83, 0.95), (1.33, 0.99))]
)
@pytest.mark.parametrize("zero", [0.0, *later(-3000.0)])
def test_thin_branches_are_kept_with_their_radius(radius_voxels, least, zero):
    """``least``: share of the axis where the distance is negative between the nodes; and all is one piece."""
    lumen = lumen_of(radius_voxels * VOXEL, 9.0, zero=zero)
    radius, kept = wall_along(lumen)
    assert label(lumen.distance.values < 0, np.ones((3, 3, 3)))[1] == 1
    assert kept > least
    assert radius == pytest.approx(radius_voxels * VOXEL, abs=0.25 * VOXEL)


def test_no_branch_is_made_of_noise_or_of_the_skirt_of_a_vessel():
    for seed in range(100, 104):
        lumen = lumen_of(0.0, 9, seed)
        assert lumen.counters["voxels_thin"] == 0


def test_no_branch_is_made_of_a_vessel_that_connectedness_reaches_in_part():
    """At a threshold of 0.95 noise keeps its voxels off the wall: balls, 2.6 voxels high, were put on outer bends."""
    z = np.linspace(-16.0, 16.0, 640)
    axis = np.stack([1.5 * np.sin(z / 5), 0.8 * np.cos(z / 6), z], 1)
    low = np.array([-5.0, -4.4, -14.9])
    away = phantoms.distance_to(axis, (34, 30, 100), VOXEL, low, 4.0)
    grey = phantoms.scan(100.0 + 900.0 * phantoms.partial_volume(np.minimum(away, 4.0) - 1.5, VOXEL), 0.8, 60.0, 0)
    usual, strict = (
        segment(Volume(grey, [VOXEL] * 3, low), [[0.0, 0.8, 0.0]], SegmentConfig(threshold=threshold))
        for threshold in (0.6, 0.95)
    )
    assert strict.counters["voxels_visited"] < 0.7 * usual.counters["voxels_visited"]
    assert strict.counters["voxels_thin"] == 0
    at = np.argwhere(np.abs(usual.distance.values) < VOXEL)
    there = strict.distance.to_index(usual.distance.to_mm(at)).T
    off = map_coordinates(strict.distance.values, there, order=1) - usual.distance.values[tuple(at.T)]
    assert np.abs(off).max() < 0.1 * VOXEL


def test_a_threshold_that_finds_more_than_the_faintest_grey_keeps_the_vessel():
    """At 0.05 all of the scan is connected, the faintest grey ends in the tube's skirt: voxels lay outside its box."""
    off = np.hypot(POINTS[..., 0], POINTS[..., 1])[:, :, :30] - 2.0
    grey = phantoms.scan(100.0 + 900.0 * phantoms.partial_volume(off, VOXEL), 0.8, 20.0, 0)
    usual, loose = (
        segment(Volume(grey, [VOXEL] * 3, LOW), [[0.0, 0.0, -5.0]], SegmentConfig(threshold=threshold))
        for threshold in (0.6, 0.05)
    )
    assert loose.counters["voxels_visited"] > 10 * usual.counters["voxels_visited"]
    inside = loose.distance.to_index(usual.distance.to_mm(np.argwhere(usual.distance.values < -0.5 * VOXEL))).T
    assert np.mean(map_coordinates(loose.distance.values, inside, order=1) < 0) > 0.99


@pytest.mark.quick(1)
@pytest.mark.parametrize(("share", "expected"), [(0.35, True), (0.45, True), (1.0, False)])
def test_a_branch_that_is_filled_too_little_is_said(share, expected):
    """Of 1 mm radius, filled to 35 to 50 %, two thirds of it and more were missing without a word."""
    branch = np.linalg.norm(POINTS - np.clip(POINTS @ AXIS, 0.0, 30.0)[..., None] * AXIS, axis=-1) - 1.0
    trunk = phantoms.partial_volume(np.hypot(POINTS[..., 0], POINTS[..., 1]) - 1.5, VOXEL)
    clean = 100.0 + 900.0 * np.maximum(trunk, share * phantoms.partial_volume(branch, VOXEL))
    lumen = segment(Volume(np.asfortranarray(phantoms.scan(clean, 0.8, 60.0, 3)), [VOXEL] * 3, LOW), [[0.0, 0.0, 0.0]])
    assert any("something like a branch" in text for text in lumen.warnings) is expected


@pytest.mark.quick(2)
@pytest.mark.parametrize(("gap_mm", "tilt_deg"), [(0.6, 0.0), (0.8, 0.0), (0.6, 40.0), (0.8, 70.0)])
def test_a_thin_vessel_that_passes_by_is_no_branch(gap_mm, tilt_deg):
    """Of 0.5 mm radius, two voxels beside the vessel: it was its branch, all along, in silence."""
    y = POINTS[..., 1] * np.cos(np.radians(tilt_deg)) - POINTS[..., 2] * np.sin(np.radians(tilt_deg))
    other = np.hypot(POINTS[..., 0] - (2.0 + gap_mm + 0.5), y) - 0.5
    distance = np.minimum(np.hypot(POINTS[..., 0], POINTS[..., 1]) - 2.0, other)
    clean = 100.0 + 900.0 * phantoms.partial_volume(distance, VOXEL)
    grey = phantoms.scan(clean, 0.8, 900.0 / 12.0, 101)
    lumen = segment(Volume(np.asfortranarray(grey), [VOXEL] * 3, LOW), [[0.0, 0.0, 0.0]])
    inside = lumen.distance.to_mm(np.argwhere(lumen.distance.values < 0).astype(float))
    assert inside[:, 0].max() < 2.0 + 0.5 * gap_mm
    # at 40 degrees it is not even connected
    assert tilt_deg == 40.0 or any("beside the lumen" in text for text in lumen.warnings)
