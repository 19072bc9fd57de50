"""segment: the wall of analytic tubes, what is not visited, and what is refused."""

from __future__ import annotations

import itertools
import re
from functools import lru_cache

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from pipeline.model import Lumen, Volume
from pipeline.segment import segment
from pipeline.segment.config import SegmentConfig
from pipeline.segment.levels import seed_voxels
from pipeline.status import FrameStatus, StageError
from pipeline.trace import trace
from solver import Grid
from tests.later import later
from tests.pipeline import phantoms

VOXEL = 0.3


@lru_cache(maxsize=4)
def tube(radius: float):
    """A curved tube: curve, grid origin, distance to the axis, and grey values before blur."""
    curve = phantoms.helix(8.0, 14.0, 0.7)
    origin = curve.min(axis=0) - radius - 3.0
    shape = tuple(np.ceil((curve.max(axis=0) + radius + 3.0 - origin) / VOXEL).astype(int))
    distance = phantoms.distance_to(curve, shape, VOXEL, origin, radius + 3.0)
    clean = phantoms.BACKGROUND + 900.0 * phantoms.partial_volume(distance - radius, VOXEL)
    return curve, origin, clean


def wall_error(lumen, curve, radius, within=0.45):
    """Error (voxels) of the signed distance at nodes near the wall, away from the tube's ends."""
    index = np.argwhere(np.abs(lumen.distance.values) < within)
    distance, foot = cKDTree(phantoms.resample(curve, 0.01)).query(lumen.distance.to_mm(index))
    middle = (foot > 300) & (foot < foot.max() - 300)
    return (lumen.distance.values[tuple(index.T)] - (distance - radius))[middle] / VOXEL


@pytest.mark.quick(2)
@pytest.mark.parametrize("radius", [0.6, 2.0])
@pytest.mark.parametrize(("noise", "bar"), [(0.0, 0.05), (90.0, 0.1)])
def test_wall_of_a_blurred_tube_is_where_it_was_drawn(radius, noise, bar):
    curve, origin, clean = tube(radius)
    grey = phantoms.scan(clean, 0.8, noise, seed=1)
    lumen = segment(Volume(np.asfortranarray(grey), [VOXEL] * 3, origin), curve[[200]])
    error = wall_error(lumen, curve, radius)
    assert len(error) > 3000
    assert np.sqrt(np.mean(error**2)) < bar


@pytest.mark.quick(1)
@pytest.mark.parametrize(("scale", "noise", "told"), [(0, 60.0, False), (0, 150.0, True), (None, 150.0, False)])
def test_a_scale_that_leaves_too_much_noise_is_told(scale, noise, told):
    """The wall was off by 1.3 voxels (rms), 4 at places, and nothing said so in a vessel that nothing runs beside."""
    curve, origin, clean = tube(0.6)
    grey = phantoms.scan(clean, 0.8, noise, seed=1)
    lumen = segment(Volume(np.asfortranarray(grey), [VOXEL] * 3, origin), curve[[200]], SegmentConfig(scale=scale))
    assert any("with segment.scale = 0 noise is 0." in text for text in lumen.warnings) is told
    assert bool(np.sqrt(np.mean(wall_error(lumen, curve, 0.6) ** 2)) > 0.5) is told


@pytest.mark.parametrize("radius", [9.5, 12.5])
def test_the_wall_of_an_aorta_is_where_it_was_drawn(radius):
    """It fills the box in which levels are estimated: two voxels inside, the wall was noise, and nothing said so."""
    half, voxel = np.arange(-radius - 4.0, radius + 4.1, 0.6), 0.6
    off = np.hypot(*np.meshgrid(half, half, indexing="ij")) - radius
    clean = np.repeat(phantoms.BACKGROUND + 900.0 * phantoms.partial_volume(off, voxel)[:, :, None], 40, axis=2)
    scan = Volume(np.asfortranarray(phantoms.scan(clean, 0.8, 40.0, seed=1)), [voxel] * 3, [half[0], half[0], 0.0])
    lumen = segment(scan, [[0.6, -0.6, 12.0]])
    assert lumen.warnings == ()
    there = np.argwhere(np.abs(lumen.distance.values) < 0.6)
    at = lumen.distance.to_mm(there[(there[:, 2] > 10) & (there[:, 2] < 30)])
    error = lumen.distance.values[tuple(there[(there[:, 2] > 10) & (there[:, 2] < 30)].T)] + radius
    assert np.abs(np.mean(error - np.hypot(at[:, 0], at[:, 1]))) < 0.1 * voxel


@pytest.mark.quick(1)
@pytest.mark.parametrize(("noise", "spot"), [(0.0, -1000.0), (0.0, -1024.0), (40.0, -1000.0)])
def test_nothing_beyond_a_round_field_of_view_is_what_surrounds_a_vessel(noise, spot):
    """Set to -1000 there, or air, a vessel at the rim was told from it: the lumen was the body, frames were refused."""
    voxel, x, z = 0.3, np.arange(60) * 0.3 - 9.0, np.arange(50) * 0.3
    off = np.hypot(x[:, None, None], x[None, :, None] - 6.5 + 0.15 * z) - 1.5
    grey = phantoms.scan(phantoms.BACKGROUND + 900.0 * phantoms.partial_volume(off, voxel), 0.8, 40.0, seed=1)
    beyond = np.hypot(x[:, None], x) > 8.2
    grey[beyond] = -1000.0 + np.random.default_rng(2).normal(0.0, noise, (np.count_nonzero(beyond), len(z)))
    grey[0, 0, 0] = spot
    lumen = segment(Volume(np.asfortranarray(grey), [voxel] * 3, [x[0], x[0], 0.0]), [[0.0, 5.6, 6.0]])
    index = np.argwhere(lumen.distance.values < 0)
    at = lumen.distance.to_mm(index)
    assert np.hypot(at[:, 0], at[:, 1] - 6.5 + 0.15 * at[:, 2]).max() < 1.5 + voxel
    assert len(index) > 3000


@pytest.mark.quick(1)
@pytest.mark.parametrize("noise", [0.0, 90.0])
def test_bone_that_touches_is_not_what_the_vessel_is_as_bright_as(noise):
    """It is deeper than the vessel: its grey was taken for the plateau, and the wall lay 0.2 voxels too far in."""
    curve, origin, clean = tube(2.0)
    at = np.argwhere(np.ones(clean.shape, bool)) * VOXEL + origin
    outwards = curve[200] * [1.0, 1.0, 0.0] / 8.0
    bone = np.linalg.norm(at - (curve[200] + 6.7 * outwards), axis=1).reshape(clean.shape) - 5.0
    beside = np.maximum(clean, phantoms.BACKGROUND + 1200.0 * phantoms.partial_volume(bone, VOXEL))
    seen = [Volume(phantoms.scan(grey, 0.8, noise, seed=1), [VOXEL] * 3, origin) for grey in (clean, beside)]
    alone, touched = (segment(volume, curve[[500]]) for volume in seen)
    assert not any("bone" in warning for warning in alone.warnings)
    assert any("bone or metal hangs together" in warning for warning in touched.warnings)
    assert touched.wall_level == pytest.approx(alone.wall_level, abs=0.03 * 900.0)


@pytest.mark.quick(1)
@pytest.mark.parametrize(("noise", "darkest", "spot"), [(0.0, 0.0, False), (60.0, 0.0, False), (60.0, 150.0, True)])
def test_a_vessel_whose_grey_is_cut_off_is_told(noise, darkest, spot):
    """A window narrower than the vessel is bright: its wall lay 0.4 voxel too far out, without a word."""
    curve, origin, clean = tube(2.0)
    grey = phantoms.scan(clean, 0.8, noise, seed=1)
    window = np.clip(grey, darkest, phantoms.BACKGROUND + 540.0).astype(np.float32)
    window[0, 0, 0] += 1000.0 * spot  # a single voxel is brighter, as of metal far away
    whole, cut = (segment(Volume(g, [VOXEL] * 3, origin), curve[[200]]) for g in (grey, window))
    off = {name: float(np.median(wall_error(lumen, curve, 2.0))) for name, lumen in (("whole", whole), ("cut", cut))}
    assert abs(off["whole"]) < 0.1
    assert off["cut"] < -0.3
    assert not whole.warnings
    # without noise a vessel is as flat as one that is cut off
    assert any("one and the same grey" in text for text in cut.warnings) is (noise > 0)


DAILY = [(0.6, 150.0, 0.0), (2.0, 60.0, 0.5), (0.6, 60.0, 0.8), (2.0, 150.0, 1.5)]
NOISES = itertools.product((0.6, 2.0), (60.0, 150.0), (0.0, 0.5, 0.8, 1.5))


@pytest.mark.quick(2)
@pytest.mark.parametrize(
    ("radius", "noise", "correlation"), [*DAILY, *later(*(row for row in NOISES if row not in DAILY))]
)
def test_how_far_noise_moves_the_wall_is_said(radius, noise, correlation):
    """The wider noise is correlated, the more of it smoothing leaves: 0.07 voxel were said of 0.3, 0.01 of 0.17.

    It is no vessel either: of noise that is correlated over 0.8 voxel and more a fifth of the lumen were branches.
    """
    curve, origin, clean = tube(radius)
    rough = np.random.default_rng(1).standard_normal(clean.shape)
    rough = gaussian_filter(rough, correlation) if correlation else rough
    grey = phantoms.scan(clean, 0.8, 0.0, seed=1) + noise * rough / rough.std()
    lumen = segment(Volume(grey.astype(np.float32), [VOXEL] * 3, origin), curve[[200]])
    error = wall_error(lumen, curve, radius)
    low, high = np.percentile(error, [16, 84])
    assert 0.5 < lumen.levels["wall_noise_mm"] / VOXEL / (0.5 * (high - low)) < 1.4
    assert np.mean(error < -2.0) < 2e-3


def test_memory_order_and_pose_do_not_change_the_lumen():
    curve, origin, clean = tube(2.0)
    grey = phantoms.scan(clean, 0.8, 50.0, seed=2)
    turn = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
    plain = segment(Volume(np.ascontiguousarray(grey), [VOXEL] * 3, origin), curve[[200]])
    fortran = segment(Volume(np.asfortranarray(grey), [VOXEL] * 3, origin), curve[[200]])
    turned = segment(Volume(grey, [VOXEL] * 3, turn @ origin, turn), curve[[200]] @ turn.T)
    assert plain.distance.shape == fortran.distance.shape
    near = np.abs(plain.distance.values) < 0.6
    np.testing.assert_allclose(plain.distance.values[near], fortran.distance.values[near], rtol=0.0, atol=2e-2)
    np.testing.assert_allclose(plain.distance.values, turned.distance.values, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(turned.distance.origin_mm, turn @ plain.distance.origin_mm, rtol=0.0, atol=1e-9)


def test_background_is_not_visited():
    curve, origin, clean = tube(0.75)
    grey = phantoms.scan(clean, 0.8, 50.0, seed=3)
    lumen = segment(Volume(grey, [VOXEL] * 3, origin), curve[[200]])
    assert lumen.counters["voxels_read"] < 0.1 * lumen.counters["voxels_total"]


def test_a_seed_in_the_background_or_outside_is_refused_by_name():
    _, origin, clean = tube(0.75)
    volume = Volume(phantoms.scan(clean, 0.8, 90.0, seed=4), [VOXEL] * 3, origin)
    for seed in (origin + 1.0, origin - 50.0):
        with pytest.raises(StageError, match="expected") as error:
            segment(volume, seed[None])
        assert error.value.status is FrameStatus.SEGMENT_FAILED
        if np.all(seed > origin):
            place = re.search(r"the seed is at \[(.*?)\] mm \(LPS\), grey \d", str(error.value))
            assert place is not None
            assert np.linalg.norm(np.array(place[1].split(","), float) - seed) < 3 * VOXEL
            assert "move entry_mm (or lumen_seed_mm" in str(error.value), "most cases give no other seed"


def test_seeds_outside_the_scan_are_told_where_it_lies() -> None:
    grid = Grid(np.zeros((4, 5, 6)), [0.5, 0.5, 0.5], [1.0, 2.0, 3.0])
    with pytest.raises(StageError, match=re.escape("a point inside the scan, [1.0, 2.0, 3.0] to [2.5, 4.0, 5.5] mm")):
        seed_voxels(grid, [[90.0, 0.0, 0.0]])
    np.testing.assert_array_equal(seed_voxels(grid, [[90.0, 0.0, 0.0], [1.6, 2.0, 5.4]]), [[1, 0, 5]])


def test_a_dark_vessel_is_told_as_one_that_is_not_filled_or_as_an_inverted_scan():
    """The advice was to move the entry; then to turn the grey round: a bright wire is dark then, and not traced."""
    curve, origin, clean = tube(1.5)
    rng = np.random.default_rng(0)
    dark = Volume(np.float32(2000.0 - clean + rng.normal(0.0, 20.0, clean.shape)), [VOXEL] * 3, origin)
    with pytest.raises(StageError, match="or the scan is inverted, and the wire is dark, too") as error:
        segment(dark, curve[len(curve) // 2][None])
    assert "the vessel is not filled" in str(error.value)
    assert "manifest key lumen) and leave the scans as they are" in str(error.value)


@pytest.mark.parametrize("with_reference", [True, False])
def test_a_wire_in_air_is_traced_where_the_lumen_was_given(with_reference: bool) -> None:
    """What the refusal of an unfilled phantom advises."""
    curve, origin, clean = tube(1.5)
    shape, rng = clean.shape, np.random.default_rng(1)
    air = phantoms.BACKGROUND - 1.2 * (clean - phantoms.BACKGROUND)
    wire = curve[: round(18.0 / 0.05)]
    held = phantoms.add_wire(air.copy(), wire, 0.2, 3000.0, VOXEL, origin)
    still, frame = (
        Volume(np.float32(gaussian_filter(grey, 0.8) + rng.normal(0.0, 30.0, shape)), [VOXEL] * 3, origin)
        for grey in (air, held)
    )
    depth = np.float32(np.minimum(phantoms.distance_to(curve, shape, VOXEL, origin, 4.5), 4.5) - 1.5)
    start = 60  # 3 mm of wire before the entry
    found = trace(
        frame, Lumen(Grid(depth, [VOXEL] * 3, origin)), curve[start], curve[start + 1] - curve[start],
        reference=still if with_reference else None,
    )  # fmt: skip
    assert found.status is FrameStatus.OK, found.note
    assert np.max(cKDTree(wire).query(found.points_mm)[0]) < VOXEL
    assert np.linalg.norm(found.points_mm[-1] - wire[-1]) < VOXEL
