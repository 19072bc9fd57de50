"""trace: sub-voxel accuracy and honest uncertainty on phantoms, hard topology, statuses, conventions."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial import cKDTree
from scipy.special import ndtr

from pipeline.arrays.grids import in_memory_order
from pipeline.compare.metrics import point_to_curve
from pipeline.model import Curve, Lumen, Volume, arc_length
from pipeline.run.log import Log
from pipeline.run.stages.known import Frame
from pipeline.run.stages.trace import _in_plane
from pipeline.segment import segment
from pipeline.status import FrameStatus
from pipeline.trace import doubts, explain, of_catheter, of_length, trace
from pipeline.trace.attempt import Attempt, EntryPose, _fitted, dense, misfit, prolonged
from pipeline.trace.config import TraceConfig
from pipeline.trace.elsewhere import DARK, brightest_line, hint_of_lines, passed_by_dark
from pipeline.trace.knots import first_tube
from pipeline.trace.link import Path
from pipeline.trace.region import region_of, shows_lumen
from pipeline.trace.rotation_plane import near_rotation_plane
from pipeline.trace.subtraction import BLOCK, _smooth, levelled, subtracted, subtracting
from pipeline.trace.tube import fit_tube
from pipeline.trace.verdict import judge
from pipeline.trace.ways import SURE
from solver.grid import Grid
from tests.bench.imaging.topology import earlier, plain
from tests.later import later
from tests.pipeline import phantoms, tangles
from tests.pipeline.in_region import trace_region

VOXEL = 0.3
PEAK = phantoms.wire_peak(0.2 / VOXEL, 0.8)


@lru_cache(maxsize=1)
def vessel():
    """A helical vessel with a wire before blur: origin, empty, wired, wire, entry (off by half a voxel), direction."""
    curve = phantoms.helix(7.0, 10.0, 0.8)
    origin = curve.min(axis=0) - 4.5
    shape = tuple(np.ceil((curve.max(axis=0) + 4.5 - origin) / VOXEL).astype(int))
    distance = phantoms.distance_to(curve, shape, VOXEL, origin, 3.0)
    empty = phantoms.BACKGROUND + 900 * phantoms.partial_volume(distance - 2.0, VOXEL)
    wire = phantoms.inside_curve(curve, 1.2, 3)[60:-140]
    wired = phantoms.add_wire(empty.copy(), wire, 0.2, phantoms.WIRE, VOXEL, origin)
    direction = wire[45] - wire[35]
    return origin, empty, wired, phantoms.resample(wire, 0.01), wire[40] + [0.1, -0.1, 0.05], direction


@lru_cache(maxsize=4)
def scans(cnr, seed=0):
    """Frame, reference and lumen at a contrast over noise."""
    origin, empty, wired, *_ = vessel()
    frame, reference = (
        Volume(np.asfortranarray(phantoms.scan(v, 0.8, PEAK / cnr, 10 * seed + n)), [VOXEL] * 3, origin)
        for n, v in enumerate((wired, empty))
    )
    return frame, reference, segment(reference, vessel()[4][None])


def test_what_is_measured_is_never_summed():
    frame, reference, lumen = scans(8)
    curve = trace(frame, lumen, *vessel()[4:], reference=reference)
    keys = {"cnr", "blur_mm", "gain", "noise", "residual_rms", "inflation", "inflation_tip", "knot_mm"}
    assert keys == set(curve.levels)
    assert {"noise", "blur_mm", "scanner_blur_mm", "least_filling", "wall_noise_mm"} == set(lumen.levels)
    log = Log(lambda *_: None)
    for _ in range(3):
        log.count("trace", curve.counters, curve.levels)
    pooled = log.counters["trace"]
    assert pooled["voxels_read"] == 3 * curve.counters["voxels_read"]
    assert pooled["cnr"] == dict.fromkeys(("min", "median", "max"), pytest.approx(curve.levels["cnr"]))
    for stage in (curve, lumen):
        assert not set(stage.counters) & set(stage.levels)
        assert not [name for name in stage.counters if "cnr" in name or "blur" in name or "fraction" in name]


def test_a_scan_beside_the_lumen_shows_none_of_it():
    """The corner of the lumen's lattice stood for it: inside a lumen that goes on beyond its lattice."""
    lumen = Lumen(Grid(np.full((4, 4, 4), -1.0, np.float32)))
    assert shows_lumen(Volume(np.zeros((4, 4, 4), np.float32)), lumen)
    assert not shows_lumen(Volume(np.zeros((4, 4, 4), np.float32), origin_mm=[9.0, 0.0, 0.0]), lumen)


@pytest.mark.quick(1)
@pytest.mark.parametrize("has_reference", [True, False])
def test_a_wrong_entry_is_told_where_the_brightest_line_is(has_reference):
    """It was told to check that the frame shows a wire, which it did: 6 mm beside the entry."""
    frame, reference, lumen = scans(8)
    *_, wire, entry, direction = vessel()
    beside = np.cross(direction, [0.0, 0.0, 1.0])
    wrong = entry + 6.0 * beside / np.linalg.norm(beside)
    curve = trace(frame, lumen, wrong, direction, reference=reference if has_reference else None)
    away = float(np.linalg.norm(wire - wrong, axis=1).min())
    assert curve.status in (FrameStatus.NO_WIRE, FrameStatus.TRACE_LOW_CONTRAST)
    said = float(re.search(r"the brightest line near it passes (\S+) mm from entry_mm, at \[", curve.note)[1])
    assert said == pytest.approx(away, abs=2 * VOXEL), "voxels of the line, a tenth of them"
    assert brightest_line(reference, None, wrong) is None, "a vessel without a wire has no such line"
    assert brightest_line(frame, reference, entry) is None, "a line that passes the entry is no news"


def test_a_wire_that_is_darker_than_the_medium_is_called_dark():
    """It was told to check that the frame shows a wire, which it did, at the entry."""
    frame, reference, lumen = scans(8)
    *_, entry, direction = vessel()
    darker = replace(frame, values=2.0 * reference.values - frame.values)
    curve = trace(darker, lumen, entry, direction, reference=reference)
    assert curve.status is FrameStatus.NO_WIRE
    assert curve.note.endswith(DARK)
    assert not passed_by_dark(frame, reference, entry)
    assert not passed_by_dark(reference, None, entry)


def vessel_with(radius: float, moved_mm: float = 0.0, lines: tuple[tuple[float, float], ...] = ()) -> Volume:
    """A vessel of 500 along z with lines in it, each by its x, mm, and grey; the entry is [0, 0, 5]."""
    spacing, x, y = 0.3, *(0.3 * (np.indices((60, 60)) - 30))
    grey = 500.0 * ndtr((radius - np.hypot(x - moved_mm, y)) / 0.3)
    for at, height in lines:
        grey = grey + height * np.exp(-0.5 * ((x - at) ** 2 + y**2) / spacing**2)
    noise = np.random.default_rng(0).normal(0.0, 15.0, (60, 60, 60))
    return Volume((grey[..., None] + noise).astype(np.float32), [spacing] * 3, [-9.0, -9.0, 0.0])


def test_a_dark_streak_at_the_entry_is_not_told_before_a_bright_wire_beside_it():
    """A wire of 800 grey 1.8 mm off: of a streak of 100 it was said that it is the wire, and to thin the medium."""
    frame = vessel_with(4.0, lines=((1.8, 800.0), (0.0, -100.0)))
    said = hint_of_lines(frame, vessel_with(4.0), np.array([0.0, 0.0, 5.0]))
    assert "the brightest line near it passes 1.8 mm from entry_mm" in said


def test_a_vessel_that_moved_is_not_called_a_dark_line():
    """By a voxel, without any wire: less the reference it is a bright and a dark line, alike."""
    assert DARK not in hint_of_lines(vessel_with(0.8, 0.3), vessel_with(0.8), np.array([0.0, 0.0, 5.0]))


@pytest.mark.quick(1)
@pytest.mark.parametrize(("cnr", "mean_bar", "tip_bar"), [(16, 0.05, 0.4), (8, 0.08, 0.7), (4, 0.15, 1.1)])
def test_the_curve_lies_on_the_wire_as_closely_as_noise_allows(cnr, mean_bar, tip_bar):
    frame, reference, lumen = scans(cnr)
    _, _, _, wire, entry, direction = vessel()
    curve = trace(frame, lumen, entry, direction, reference=reference)
    error, _ = point_to_curve(curve.points_mm, wire)
    start = int(np.argmin(np.abs((wire[:300] - entry) @ direction)))
    assert curve.status is FrameStatus.OK
    assert error.mean() / VOXEL < mean_bar
    assert np.linalg.norm(curve.points_mm[-1] - wire[-1]) / VOXEL < tip_bar
    assert abs(curve.length_mm - 0.01 * (len(wire) - 1 - start)) < 0.5
    assert cKDTree(curve.points_mm).query(wire[start:])[0].max() < 1.5 * VOXEL
    assert np.all(np.diff(arc_length(curve.points_mm)) > 0)
    assert not curve.flagged.any()


def pulls(curve, wire):
    """Errors across the wire, in its plane, over what is stated of them; without the ends."""
    near = cKDTree(wire).query(curve.points_mm)[1]
    side = np.cross(np.gradient(wire, axis=0)[near], [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1)[:, None]
    return (np.sum((curve.points_mm - wire[near]) * side, axis=1) / curve.sigma_mm)[2:-6]


def test_stated_uncertainty_is_the_spread_of_errors():
    _, _, _, wire, entry, direction = vessel()
    found = []
    for seed in range(3):
        frame, reference, lumen = scans(8, seed)
        found.append(pulls(trace(frame, lumen, entry, direction, reference=reference), wire))
    assert 0.6 < np.concatenate(found).std() < 1.5


def test_the_curve_turns_with_the_volume():
    """Half-voxel and axis slips show: the same voxels under another direction matrix give the same curve, turned."""
    frame, reference, lumen = scans(8)
    _, _, _, _, entry, direction = vessel()
    turn = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])

    def turned(volume):
        return Volume(volume.values, volume.spacing_mm, turn @ volume.origin_mm, turn)

    plain = trace(frame, lumen, entry, direction, reference=reference)
    moved_lumen = segment(turned(reference), (turn @ entry)[None])
    moved = trace(turned(frame), moved_lumen, turn @ entry, turn @ direction, reference=turned(reference))
    np.testing.assert_allclose(moved.points_mm, plain.points_mm @ turn.T, rtol=0.0, atol=1e-3)
    c_order = Volume(np.ascontiguousarray(frame.values), frame.spacing_mm, frame.origin_mm)
    c_reference = Volume(np.ascontiguousarray(reference.values), frame.spacing_mm, frame.origin_mm)
    other = trace(c_order, lumen, entry, direction, reference=c_reference)
    assert point_to_curve(other.points_mm, plain.points_mm)[0].max() < 0.1 * VOXEL


@pytest.mark.quick(1)
@pytest.mark.parametrize("has_reference", [True, False])
def test_greys_in_another_unit_make_no_other_curve(has_reference):
    """Attenuation per mm, say, in which all noise lies far below 1."""
    curves = []
    for scale, level in ((1.0, 0.0), (1e-3, -1.0)):
        frame, reference = (
            replace(scan, values=np.float32(scale * scan.values.astype(float) + level), made_of=None)
            for scan in scans(8)[:2]
        )
        lumen = segment(reference, vessel()[4][None])
        curves.append(trace(frame, lumen, *vessel()[4:6], reference=reference if has_reference else None))
    here, there = curves
    assert here.status is there.status is FrameStatus.OK
    np.testing.assert_allclose(here.points_mm, there.points_mm, rtol=0.0, atol=1e-5)  # float32 holds 1 to 6e-8
    np.testing.assert_allclose(here.sigma_mm, there.sigma_mm, rtol=1e-4, atol=0.0)


def fading(shape, origin, wire):
    """Share of the contrast at every voxel: it falls by a third along z and is lowest at the tip."""
    z = origin[2] + VOXEL * np.arange(shape[2])
    share = np.clip((z - wire[0, 2]) / (wire[-1, 2] - wire[0, 2]), 0, 1)
    return np.broadcast_to(1 - 0.33 * share, shape)


def test_without_a_reference_uneven_contrast_neither_moves_the_tip_nor_goes_unstated():
    origin, empty, wired, wire, entry, direction = vessel()
    faded = phantoms.BACKGROUND + (empty - phantoms.BACKGROUND) * fading(empty.shape, origin, wire)
    spread = {}
    for name, clean in (("even", wired), ("fading", faded + wired - empty)):
        frame = Volume(np.asfortranarray(phantoms.scan(clean, 0.8, PEAK / 16, 5)), [VOXEL] * 3, origin)
        curve = trace(frame, segment(frame, entry[None], wire_radius_mm=0.2), entry, direction)
        assert curve.status is FrameStatus.OK
        assert point_to_curve(curve.points_mm, wire)[0].mean() < 0.06 * VOXEL
        assert np.linalg.norm(curve.points_mm[-1] - wire[-1]) < 0.35 * VOXEL
        assert 0.5 < pulls(curve, wire).std() < 1.5
        spread[name] = curve.sigma_mm.mean()
    assert spread["fading"] > spread["even"]


def test_the_lumens_level_is_found_under_the_wire_and_leaves_an_even_lumen_alone():
    origin, empty, _, wire, *_ = vessel()
    lumen = scans(16)[2]
    faded = phantoms.BACKGROUND + (empty - phantoms.BACKGROUND) * fading(empty.shape, origin, wire)
    left = []
    for clean in (empty, faded):
        frame = Volume(ndimage.gaussian_filter(clean.astype(np.float32), 0.8), [VOXEL] * 3, origin)
        image = subtracted(frame, lumen, None)
        even = levelled(image, image.local(wire[::50]), 0.27)
        deep = (image.region.box.values < -0.6) & (image.region.box.values > -1.5)
        left.append([float(np.sqrt(np.mean(s.grey[deep] ** 2))) for s in (image, even)])
    (_, untouched), (before, after) = left
    assert untouched < 6.0
    assert after < 25.0
    assert before > 3 * after


def test_a_frame_sees_nothing_of_the_one_whose_memory_it_takes_over():
    frame, reference, lumen = scans(16)
    fresh = subtracted(reference, lumen, reference).grey
    with subtracting(frame, lumen, reference) as first, subtracting(reference, lumen, reference) as second:
        assert not np.shares_memory(first.grey, second.grey)
        taken = [first.grey, second.grey]
    with subtracting(reference, lumen, reference) as image:
        assert any(image.grey is one for one in taken)
        assert np.array_equal(image.grey, fresh)


def traced():
    """The image of a frame, its entry and what was found of it; the depth is stated."""
    frame, reference, lumen = scans(16)
    image = subtracted(frame, lumen, reference)
    entry = EntryPose(image.local(vessel()[4][None])[0], image.turned(vessel()[5] / np.linalg.norm(vessel()[5])))
    best = explain.best_of(image, entry, None, TraceConfig())
    return image, entry, replace(best, attempt=replace(best.attempt, missing_mm=0.0))


def test_wire_outside_the_entry_does_not_choose_between_two_explanations():
    """A wrong fit had slid 1.7 mm out of the entry, and what it explained there won: it was folded, and ok."""
    image, entry, best = traced()
    later = _fitted(image, best.attempt.path.points[8:], True, entry)
    assert later.length_mm < best.attempt.tube.length_mm - 1.0
    own, other = misfit(image, [best.attempt, replace(best.attempt, tube=later)])
    assert own == pytest.approx(other, rel=0.05), "a millimetre of this wire left out is as much again"


def test_a_curve_that_doubles_back_on_itself_is_neither_chosen_nor_ok():
    """It turned by 168 and back by 166 degrees within 0.4 mm, was 0.3 mm too long, and ok."""
    image, entry, best = traced()
    tube, none = best.attempt.tube, np.zeros(len(best.points), bool)
    controls = tube.controls.copy()
    controls[[6, 7]] = controls[[7, 6]]
    folded = replace(best.attempt, tube=replace(tube, controls=controls))
    verdict = judge(image, folded, best.points, none, best.length_mm)
    assert verdict.status is FrameStatus.TRACE_AMBIGUOUS
    assert "degrees within a voxel" in verdict.note
    assert judge(image, best.attempt, best.points, none, best.length_mm).status is FrameStatus.OK
    tempting = replace(best, attempt=folded, length_mm=best.length_mm)
    assert explain._best(image, [tempting, best], entry, TraceConfig()) is best


def test_a_faint_line_beyond_a_tip_of_the_stated_depth_refuses_nothing(monkeypatch):
    """The wall beside a label map's stairs was 10 standard deviations of noise: a right frame of 7 was refused."""
    image, entry, best = traced()
    assert not best.attempt.agrees
    stated = explain._read_off(image, best.attempt, replace(entry, expected_mm=best.length_mm + 0.8))[0]
    longer = explain._read_off(image, best.attempt, replace(entry, expected_mm=best.length_mm + 0.96))[0]
    assert stated.attempt.agrees
    assert not longer.attempt.agrees, "it lacks more than three voxels"
    monkeypatch.setattr(doubts, "_beyond", lambda image, tube, *_: np.array([[0.1 * tube.peak, SURE + 1.0]]))
    curve = trace(*scans(16)[::2], *vessel()[4:], reference=scans(16)[1])
    found = doubts.ends_in_nothing(image, best.attempt, replace(curve, doubts=()))
    assert found.status is FrameStatus.TRACE_AMBIGUOUS
    place = [float(x) for x in re.search(r"followed, from (\S+), (\S+), (\S+) mm on", found.note).groups()]
    assert np.linalg.norm(place - curve.points_mm[-1]) < 0.1
    kept = doubts.ends_in_nothing(image, stated.attempt, replace(curve, doubts=()))
    assert kept.status is FrameStatus.OK
    lacking = doubts.ends_in_nothing(image, longer.attempt, replace(curve, doubts=()))
    assert "mm on, where 1.0 mm of the stated depth are missing; expected" in lacking.note


def test_the_last_voxels_of_a_wire_are_no_line_beyond_its_tip():
    """A fit stopped 1.5 voxels short; fitted again it was right, and refused for not being 3 voxels longer."""
    image, entry, best = traced()
    line = dense(best.attempt.tube, 0.5 * image.voxel)
    short = replace(best.attempt, tube=fit_tube(image, first_tube(image, line[:-4]), iterations=0))
    more = prolonged(image, short, entry)
    assert not more.goes_on
    assert more.tube.length_mm == pytest.approx(best.attempt.tube.length_mm, abs=0.3 * VOXEL)


@pytest.mark.parametrize("has_reference", [True, False])
def test_memory_for_the_numbers_of_voxels_is_left_as_it_was(has_reference):
    """What one fit left in it would be voxels of the next one's wire."""
    frame, reference, lumen = scans(16)
    trace(frame, lumen, *vessel()[4:], reference=reference if has_reference else None)
    grid, axes = in_memory_order(frame)
    region = region_of(grid, lumen, axes)
    assert region.numbers._free, "a fit works on one box at least"
    assert not any(array.any() for array in region.numbers._free)


@pytest.mark.slow
def test_correlated_noise_that_hides_the_wire_is_a_named_status():
    for seed in range(3):
        curve, _ = tangles.run(seed, cnr=4.0, kind=0, correlation=0.8)
        assert curve.status is FrameStatus.NO_WIRE


def test_noise_of_a_grey_is_as_correlated_in_whole_greys():
    """Of an 8 bit export with a noise of one grey the sigma was half of what it is: greys of 0 passed for not read."""
    origin, empty, wired, _, *entry = vessel()
    rng = np.random.default_rng(0)
    fields = [ndimage.gaussian_filter(rng.normal(size=wired.shape), 1.0) for _ in range(2)]
    greys = [
        ndimage.gaussian_filter(v, 0.8) * 12.0 / PEAK + n / n.std() for v, n in zip((wired, empty), fields, strict=True)
    ]
    lumen = segment(scans(8)[1], entry[0][None])
    found = []
    for kind in (np.asarray, lambda v: np.rint(v).astype(np.int16)):
        frame, reference = (Volume(np.asfortranarray(kind(v)), [VOXEL] * 3, origin) for v in greys)
        found.append(trace(frame, lumen, *entry, reference=reference))
    real, whole = found
    assert real.levels["inflation"] > 2.0
    assert 0.9 < np.median(whole.sigma_mm) / np.median(real.sigma_mm) < 1.3, "rounding adds a twelfth to the variance"


def test_points_nearly_parallel_to_the_rotation_plane_are_marked():
    frame, reference, lumen = scans(8)
    _, _, _, wire, entry, direction = vessel()
    plain = trace(frame, lumen, entry, direction, reference=reference)
    near = cKDTree(wire).query(plain.points_mm)[1]
    t = np.gradient(wire, axis=0)[near]
    t /= np.linalg.norm(t, axis=1)[:, None]
    for axis, config in ((2, TraceConfig()), (0, TraceConfig(rotation_axis=(1.0, 0.0, 0.0)))):
        curve = trace(frame, lumen, entry, direction, reference=reference, config=config)
        climb = np.degrees(np.arcsin(np.abs(t[:, axis])))
        assert curve.in_plane[climb < 7].all()
        assert not curve.in_plane[climb > 13].any()
        np.testing.assert_array_equal(curve.points_mm, plain.points_mm)
        assert curve.counters["in_plane_mm"] == pytest.approx(curve.in_plane.mean() * curve.length_mm)
    assert 0 < curve.in_plane.sum() < len(t)


def test_a_bend_that_passes_through_the_rotation_plane_is_no_warning():
    """5 % of a bend is so near to it, and half of the catalogue's scenes warned of that."""

    def told(share):
        marks = np.arange(100) < 100 * share
        curve = Curve(np.zeros((100, 3)), np.zeros(100), in_plane=marks)
        return _in_plane([Frame(0, curve=curve)], TraceConfig(in_plane_deg=10.0))

    assert told(0.0) == told(0.05) == told(0.17) == []
    assert told(0.5)[0].startswith("50 % of the traced points run within 10 degrees of the plane of rotation")


def test_the_rotation_plane_of_a_ring_and_of_a_line():
    a = np.linspace(0, 2 * np.pi, 200)
    ring = np.stack([10 * np.cos(a), 10 * np.sin(a), 0 * a], axis=1)
    assert near_rotation_plane(ring, [0, 0, 2], 10).all()
    # a ring about x lies in the x-y plane only where it runs along y: within 10 degrees of it, a ninth of it
    assert near_rotation_plane(ring[:, [2, 0, 1]], [0, 0, 1], 10).mean() == pytest.approx(1 / 9, abs=0.03)
    line = np.linspace(0, 5, 30)[:, None] * [np.cos(0.2), 0, np.sin(0.2)]
    assert near_rotation_plane(line, [0, 0, 1], 11.6).all()
    assert not near_rotation_plane(line, [0, 0, 1], 11.3).any()
    assert near_rotation_plane(line[:1], [0, 0, 1], 10).tolist() == [False]


def test_a_crop_of_the_frame_and_a_lumen_on_another_lattice_do():
    frame, reference, lumen = scans(8)
    _, _, _, wire, entry, direction = vessel()
    a, b = (2, 1, 0), tuple(n - 2 for n in frame.shape)
    crop, still = (v.crop(a, b) for v in (frame, reference))
    coarse = Grid(lumen.distance.values[::2, ::2, ::2], lumen.distance.spacing_mm * 2, lumen.distance.origin_mm)
    other = Lumen(coarse)
    curve = trace(Volume(crop.values, crop.spacing_mm, crop.origin_mm), other, entry, direction,
                  reference=Volume(still.values, still.spacing_mm, still.origin_mm))  # fmt: skip
    assert point_to_curve(curve.points_mm, wire)[0].mean() < 0.15 * VOXEL


def test_a_reference_between_whose_voxels_the_frame_s_lie_leaves_no_lines_at_the_wall():
    """Half a voxel off each way: trilinear grey left 5 % of the contrast there, marks as bright as a thin wire."""
    index, noise = np.indices((30, 24, 40), np.float32), np.random.default_rng(0).normal(size=(2, 30, 24, 40))
    distance, other = (np.hypot(index[0] + by - 14.0, index[1] + by - 11.0) - 5.0 for by in (0.0, 0.5))
    reference = Volume(1000.0 * ndtr(-distance / 0.7) + noise[0])
    frame = Volume(1000.0 * ndtr(-other / 0.7) + noise[1], origin_mm=np.full(3, 0.5))
    lumen = Lumen(Grid(distance.astype(np.float32)), levels={"scanner_blur_mm": 0.7})
    image = subtracted(frame, lumen, reference)
    left = image.grey[image.region.box.values < 1.0]
    assert np.abs(left - np.median(left)).max() < 30.0


def test_a_frame_without_wire_is_a_named_status():
    _, reference, lumen = scans(8)
    origin, empty, _, _, entry, direction = vessel()
    frame = Volume(np.asfortranarray(phantoms.scan(empty, 0.8, PEAK / 8, 77)), [VOXEL] * 3, origin)
    curve = trace(frame, lumen, entry, direction, reference=reference)
    assert curve.status is FrameStatus.NO_WIRE
    assert len(curve.points_mm) == 0
    assert "expected" in curve.note


@pytest.mark.parametrize("radius", [8.0, 17.0], ids=["8,000 voxels", "43,000"])
def test_a_frame_of_another_phantom_is_told_in_lumens_of_any_size(radius):
    """From 40,000 voxels on no two of those that were looked at were neighbours, and the hint was never given."""
    x, y, z = np.indices((40, 40, 46), np.float32)
    distance, noise = np.hypot(x - 19.5, y - 19.5) - radius, np.random.default_rng(0).normal(0.0, 2.0, (2, *x.shape))
    empty = 300.0 * ndtr(-distance) + noise[0]
    frame = Volume(300.0 * ndtr(-distance) + 60.0 * np.sin(x / 6.0) * np.sin(y / 5.0 + z / 9.0) + noise[1])
    curve = trace(frame, Lumen(Grid(distance)), [19.5, 19.5, 0.5], [0.0, 0.0, 1.0], reference=Volume(empty))
    assert curve.status is FrameStatus.NO_WIRE
    assert "check that the reference is of this phantom" in curve.note


def test_too_little_contrast_is_a_named_status_and_never_a_silent_error():
    for seed in range(3):
        curve, _ = tangles.run(seed, cnr=1.8, kind=0)
        assert curve.status is FrameStatus.TRACE_LOW_CONTRAST


@pytest.mark.quick(2)
@pytest.mark.parametrize("seed", [0, 1, 2, 3, 5])
def test_gaps_crossings_and_parallel_turns(seed):
    """Seeds 0, 3: two gaps of up to 12 voxels; 1: strands crossing in contact; 2, 5: turns 3 voxels apart or more."""
    curve, outcome = tangles.run(seed)
    assert outcome.right, outcome
    if seed in (0, 3):
        assert curve.flagged.any()
        assert curve.sigma_mm[curve.flagged].min() > 3 * np.median(curve.sigma_mm)


@pytest.mark.slow
def test_turns_in_contact_from_the_frame_before():
    rng = np.random.default_rng(4)
    wire = tangles.coil(rng, 1.4 * tangles.VOXEL)
    previous = wire.points[20:-60:6] + rng.normal(scale=0.03, size=wire.points[20:-60:6].shape)
    curve, outcome = tangles.run(4, wire=wire, previous=previous)
    assert outcome.right, outcome
    assert curve.counters["from_previous"] == 1.0
    _, outcome = tangles.run(4, wire=wire)
    assert outcome.status == "TRACE_AMBIGUOUS", outcome


def test_a_straight_wire_in_thick_slices():
    """As in a clinical CT: pixels of 0.5 mm, slices of 2 mm, a wire at 23 degrees to them."""
    angle, size = np.radians(23.0), np.array([0.5, 0.5, 2.0])
    shape = (100, 30, 14)
    fine = np.zeros((100, 30, 56), np.float32)
    line = np.array([5.0, 7.3, 3.0]) + np.linspace(0, 44, 900)[:, None] * [np.cos(angle), 0.05, np.sin(angle)]
    index = line / 0.5
    for offset in np.stack(np.meshgrid(*[(0, 1)] * 3, indexing="ij"), -1).reshape(-1, 3):
        cell = np.floor(index).astype(int) + offset
        weight = np.prod(1 - np.abs(index - cell), axis=1)
        keep = np.all((cell >= 0) & (cell < fine.shape), axis=1)
        np.add.at(fine, tuple(cell[keep].T), weight[keep])
    blurred = ndimage.gaussian_filter(fine, 0.8).reshape(100, 30, 14, 4).mean(axis=3)
    grey = 400 * blurred / blurred.max() + np.random.default_rng(0).normal(0, 12, shape)
    volume = Volume(grey.astype(np.float32), size, [0.25, 0.25, 0.25 + 0.75])
    inside = line[(line[:, 0] > 8) & (line[:, 0] < 40)] + 0.25
    curve = trace_region(volume, [1, 3, 0], [49, 12, 27], inside[0], inside[-1] - inside[0])
    off, _ = point_to_curve(curve.points_mm, line + 0.25)
    spread, axes = np.linalg.svd(curve.points_mm - curve.points_mm.mean(axis=0), full_matrices=False)[1:]
    t = axes[0]
    assert spread[1] < 0.011 * np.sqrt(len(curve.points_mm))  # 0.015 mm with a knot for every slice
    assert abs(np.degrees(np.arcsin(abs(t[2]))) - np.degrees(np.arcsin(np.sin(angle) / np.hypot(1, 0.05)))) < 1.0
    assert np.median(off) < 0.2


def test_another_wire_in_the_lumen_is_not_passed_over_in_silence():
    shape, origin = (70, 70, 70), np.zeros(3)
    z = np.linspace(0.5, 20.5, 400)
    one, two = (np.stack([x + 0 * z, 10 + 0 * z, z], axis=1) for x in (6.0, 14.0))
    clean = np.full(shape, 1000.0, np.float32)
    for wire in (one, two):
        phantoms.add_wire(clean, wire, 0.2, 4000.0, VOXEL, origin)
    frame, reference = (
        Volume(phantoms.scan(v, 0.8, PEAK / 8, n), [VOXEL] * 3) for n, v in enumerate((clean, np.full(shape, 1000.0)))
    )
    lumen = tangles.tank(np.array([[3.0, 3, 3], [18, 18, 18]]))[2]
    curve = trace(frame, lumen, one[40], [0, 0, 1], reference=reference)
    assert curve.status is FrameStatus.TRACE_AMBIGUOUS


def test_empty_previous_curve_and_config_are_accepted():
    frame, reference, lumen = scans(8)
    _, _, _, _, entry, direction = vessel()
    nothing = Curve(np.zeros((0, 3)), np.zeros(0)).doubted(FrameStatus.NO_WIRE, "")
    curve = trace(frame, lumen, entry, direction, reference=reference, previous=nothing, expected_mm=5.0,
                  config=TraceConfig(ridge_voxels=0.8))  # fmt: skip
    assert curve.length_mm > 20


def straight(seed, length, bulge=0.0):
    """A nearly straight wire in a tank, turned anyhow, whose middle bulges sideways; frame, reference, lumen, wire."""
    rng = np.random.default_rng(seed)
    z = np.linspace(0, length, 400)
    side = rng.uniform(-0.05, 0.05) * z**2 + bulge * np.exp(-(((z - 0.5 * length) / 1.5) ** 2))
    wire = np.stack([side, 0 * z, z], axis=1)
    turn = tangles._rotation(rng) if bulge == 0 else np.eye(3)
    origin, shape, lumen = tangles.tank(wire @ turn.T)
    clean = tangles.clean_frame(tangles.Tangle("straight", wire @ turn.T), origin, shape)
    frame, reference = (
        Volume(phantoms.scan(v, 0.8, PEAK / 12, 2 * seed + n), [VOXEL] * 3, origin)
        for n, v in enumerate((clean, np.full(shape, 1000.0, np.float32)))
    )
    return frame, reference, lumen, wire @ turn.T


@pytest.mark.parametrize("length", [1.2, *later(1.8, 2.4)])
def test_a_wire_of_a_few_voxels_does_not_turn_back(length):
    for seed in range(6):
        frame, reference, lumen, wire = straight(seed, length)
        heading = wire[1] - wire[0]
        curve = trace(frame, lumen, wire[0], heading, reference=reference)
        assert curve.status is FrameStatus.OK
        assert np.all(np.diff(curve.points_mm, axis=0) @ heading > 0)
        assert curve.length_mm == pytest.approx(length, abs=0.2)


def test_a_length_that_disagrees_with_the_insertion_is_a_named_status():
    frame, reference, lumen, wire = straight(0, 12.0)
    for expected, status in ((11.0, FrameStatus.OK), (16.0, FrameStatus.LENGTH_MISMATCH)):
        curve = trace(frame, lumen, wire[0], wire[1] - wire[0], reference=reference, expected_mm=expected)
        assert curve.status is status
    assert "insertion_mm" in curve.note
    assert "16.00" in curve.note
    given = Curve(wire, np.full(len(wire), np.nan))
    assert of_length(given, 11.0, TraceConfig()) is of_length(given, None, TraceConfig()) is given
    assert of_length(given, 16.0, TraceConfig()).status is FrameStatus.LENGTH_MISMATCH
    for expected, said in ((1.2, "would do in cm"), (0.012, "would do in m:"), (16.0, ""), (1.7, "")):
        assert ("would do" in of_length(given, expected, TraceConfig()).note) == bool(said)
        assert said in of_length(given, expected, TraceConfig()).note


def test_a_trace_that_ends_with_the_catheter_may_be_the_catheter_s():
    """A catheter pushed past the wire's tip is a line as thin and as bright, and its end is as sharp."""
    wire = np.column_stack([np.zeros((39, 2)), np.arange(39.0)])
    curve = Curve(wire, np.full(39, np.nan))
    found = of_catheter(curve, 38.4)
    assert found.status is FrameStatus.TRACE_AMBIGUOUS
    assert "38.40" in found.note
    assert "insertion_mm" in found.note
    assert of_catheter(curve, 30.0) is curve
    missing = curve.doubted(FrameStatus.NO_WIRE, "")
    assert of_catheter(missing, 38.4) is missing


def test_a_curve_that_leaves_the_lumen_is_a_named_status():
    frame, reference, lumen, wire = straight(0, 14.0, bulge=2.0)
    inside = trace(frame, lumen, wire[0], wire[1] - wire[0], reference=reference)
    assert inside.status is FrameStatus.OK
    x = lumen.distance.origin_mm[0] + VOXEL * np.arange(lumen.distance.shape[0])
    depth = np.maximum(lumen.distance.values, (x - 1.0)[:, None, None]).astype(np.float32)
    narrow = Lumen(lumen.distance.with_values(depth))
    outside = trace(frame, narrow, wire[0], wire[1] - wire[0], reference=reference)
    assert outside.status is FrameStatus.TRACE_LEFT_LUMEN
    assert outside.flagged.any()


@pytest.mark.slow
def test_below_the_least_contrast_a_previous_curve_counts_only_where_the_frame_confirms_it_up_to_the_tip():
    """Seed 11: not nearly everywhere. Seed 15: the crest pauses before the tip, found behind that. 18: it does not."""
    for seed, status in ((11, FrameStatus.TRACE_LOW_CONTRAST), (15, FrameStatus.OK), (18, FrameStatus.OK)):
        wire = plain(seed)
        alone, _ = tangles.run(seed, 2.0, wire=wire)
        assert alone.status is FrameStatus.TRACE_LOW_CONTRAST
        curve, outcome = tangles.run(seed, 2.0, wire=wire, previous=earlier(seed, wire))
        assert curve.status is status
        assert outcome.right


def test_blocks_that_hold_nothing_are_level() -> None:
    sums, counts = np.zeros((9, 9, 9)), np.zeros((9, 9, 9))
    counts[:2, :2, :2] = BLOCK**3
    sums[:2, :2, :2] = 5.0 * BLOCK**3
    smooth = _smooth(sums, counts)
    assert smooth[0, 0, 0] == pytest.approx(5.0)
    assert np.all(smooth[6:, 6:, 6:] == 0.0)


@pytest.mark.parametrize(("peak", "told"), [(30.0, "3.0 noises bright"), (-5e25, "no brighter than what is around it")])
def test_how_bright_a_line_is_makes_sense(peak: float, told: str) -> None:
    """A fit gone wrong was "-5347310214188968479555584.0 noises bright"."""
    none = np.zeros((0, 3))
    attempt = Attempt(SimpleNamespace(peak=peak), Path(none, np.zeros(0, bool), 0), [], [], none)
    assert attempt.brightness(SimpleNamespace(noise=10.0)) == told
