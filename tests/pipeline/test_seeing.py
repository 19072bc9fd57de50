"""Temptations to be wrong, one scene each of the stress table (``make seeing``): right, or refused in so many words."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import ndimage
from scipy.special import expit, ndtr

from pipeline.arrays.polyline import across, carried
from pipeline.arrays.spare import Spare
from pipeline.model import Volume
from pipeline.segment import segment
from pipeline.status import FrameStatus
from pipeline.trace import FAINT_BEYOND, explain, trace
from pipeline.trace.attempt import EntryPose
from pipeline.trace.config import TraceConfig
from pipeline.trace.ends import sharpest_turn_deg
from pipeline.trace.outside import seen_outside
from pipeline.trace.reach import end_range
from pipeline.trace.section import MEDIAN, places_around, read_around, section_along
from pipeline.trace.steps import Steps
from pipeline.trace.subtraction import CREST_VOXELS, subtracted
from pipeline.trace.tube import Tube, spline_through, tint_nodes
from pipeline.trace.verdict import judge
from pipeline.trace.ways import SURE, highest, ways_on
from pipeline.trace.whose_end import dim_from_tip_mm
from tests.later import later
from tests.numbers.kept import different
from tests.numbers.traces import RELATIVE, numbers_of, word
from tests.studies.seeing.known import FIRST, LARGE, REFUSED, TRACED
from tests.studies.seeing.render import Lattice, arc_of, even
from tests.studies.seeing.scenes import Draft, less_sharp
from tests.studies.seeing.table import found, look, row_of, scene_of, seen


def further_ones_slow(rows):
    """The first scene of each case for every commit, further ones, which were wrong once, by ``make study``."""
    cases = [case for case, *_ in rows]
    again = [case in LARGE or case in cases[:n] for n, case in enumerate(cases)]
    return [pytest.param(*row, marks=[pytest.mark.slow] * slow) for row, slow in zip(rows, again, strict=True)]


def looked_at(case, seed):
    """The row of a scene; the numbers of one whose numbers are kept are what they were, too."""
    made = found(case, seed)
    if FIRST.get(case) == seed:
        moved = different("traces", word(case), numbers_of(*made[1:]), RELATIVE)
        assert not moved, moved
    return row_of(case, seed, *made)


@pytest.mark.quick(6)
@pytest.mark.parametrize(("case", "seed"), further_ones_slow(TRACED))
def test_what_can_be_seen_is_traced(case, seed):
    row = looked_at(case, seed)
    assert row.verdict == "right", row.text


@pytest.mark.quick(6)
@pytest.mark.parametrize(("case", "seed", "status"), further_ones_slow(REFUSED))
def test_what_cannot_be_told_is_refused(case, seed, status):
    row = looked_at(case, seed)
    assert row.status == status, row.text
    if case.startswith("no wire"):
        assert "the frame shows none" in FrameStatus[status].value, "in noise something thin is always found"
        assert "that the frame shows a wire" in row.text


@pytest.mark.parametrize(("seed", "cnr"), [(0, 10), (1, 16), *later((0, 16), (1, 10))])
def test_a_marker_at_the_tip_is_seen_in_noise_beyond_what_is_not(seed: int, cnr: float):
    """In voxels of 0.4 mm too few of a marker's were bright enough: 7 mm of wire were missing, and ok."""
    draft = Draft(np.random.default_rng(seed), spacing=0.4, radius=2.0)
    draft.opacity = np.where((draft.from_tip > 1.0) & (draft.from_tip < 8.0), 0.03, 1.0)
    scene = draft.scan(cnr)
    _, curve = seen(scene)
    assert curve.status is FrameStatus.TRACE_AMBIGUOUS
    right = abs(curve.length_mm - arc_of(scene.wire)[-1]) < 1.0
    assert ("beyond a gap" if right else "beyond") in curve.note


@pytest.mark.quick(1)
@pytest.mark.parametrize("other", [True, False])
def test_a_reference_of_another_phantom_is_named(other: bool):
    """It was 500 grey of noise, where there were 60, and the advice to look at the entry."""
    scene = Draft(np.random.default_rng(5)).scan(40)
    lumen, values = segment(scene.reference, scene.entry[None]), scene.reference.values
    reference = replace(scene.reference, values=np.ascontiguousarray(values[::-1]) if other else values)
    frame = scene.frame if other else scene.reference
    curve = trace(frame, lumen, scene.entry, scene.direction, reference=reference)
    assert curve.status is FrameStatus.NO_WIRE
    assert ("check that the reference is of this phantom" in curve.note) is other


def test_a_stated_depth_does_not_hide_that_the_direction_is_turned_round():
    """It was a length that disagrees, to be corrected in the manifest."""
    row = look("entry_direction the wrong way round", 0, expected_mm=30.0)
    assert row.status == "TRACE_WRONG_WAY", row.text
    assert "state insertion_mm" not in row.text


@pytest.mark.slow
def test_a_dim_end_may_be_a_catheters_unless_the_depth_is_stated():
    case, seed = "dim distal part, x 0.15 to 0.2", 518
    assert "state the wire's opacity if its end is so" in look(case, seed).text
    wire = scene_of(case, seed).wire
    row = look(case, seed, expected_mm=float(arc_of(wire)[-1]))
    assert row.verdict == "right", row.text


@pytest.mark.parametrize(
    ("levels", "edges", "from_tip"),
    [
        ([1.0, 0.3], [20.0], 10.0),
        ([1.0, 0.3, 1.5], [20.0, 29.0], 10.0),  # with a marker at its end
        ([0.2, 1.0, 0.15], [10.0, 20.0], 10.0),  # beyond a coil of platinum
        ([1.0, 2.5, 1.0], [26.0, 27.0], 0.0),  # a marker band
        ([1.6, 1.0], [10.0], 0.0),  # a wire that comes out of a catheter
        ([1.0, 0.2, 1.0], [12.0, 14.0], 0.0),  # a stenosis that no reference shows
        ([1.0, 0.05, 1.0], [20.0, 29.0], 0.0),  # a gap
        ([0.2, 1.0], [10.0], 0.0),
    ],
)
def test_only_what_is_dimmer_than_the_body_up_to_the_end_may_be_a_catheters(levels, edges, from_tip):
    steps = Steps(np.array(edges) / 30.0, np.array(levels))
    assert dim_from_tip_mm(steps, 30.0, 0.3) == pytest.approx(from_tip)
    assert dim_from_tip_mm(replace(steps, stated=True), 30.0, 0.3) == 0.0


def test_a_dim_end_is_not_drawn_outwards_by_an_offset_common_to_bright_and_dim():
    row = look("dim distal part, x 0.15 to 0.2", 343)
    assert row.text.startswith("though right"), "2.4 voxels too long with an offset"


@pytest.mark.parametrize("seed", [0, *later(5)])
def test_a_marker_band_does_not_draw_the_tip_to_itself(seed):
    row = look("marker band before the tip", seed)
    assert abs(row.tip) < 3.0, "stated standard deviations; 4.6 and 6.9 where the band is taken for noise"


def test_a_piece_of_wire_in_the_reference_that_bends_away_is_told():
    assert look("a piece of wire in the reference, where the wire ends", 2740).verdict == "refused", (
        "6 mm short, and ok"
    )


def test_without_its_reference_a_frame_is_not_believed_alone():
    """Once ok and 7.6 voxels wrong: in correlated noise the wall's model leaves lines of its own."""
    assert look("correlated noise, CNR 4 to 6", 305).verdict == "refused"


@pytest.mark.quick(1)
@pytest.mark.parametrize("case", ["layered filling", "contrast that decays by 60 %"])
def test_the_wall_lies_half_way_to_the_local_level(case):
    row = look(case, 0)
    assert row.wall < 0.2, "voxel; 0.9 to 1.9 with one level for the whole vessel"


@pytest.mark.quick(1)
@pytest.mark.parametrize(("voxels", "pitch_mm"), [(1.25, 8.0), (2.0, 12.0), (1.3, 3.0), *later((1.5, 6.0), (1.3, 4.0))])
def test_two_wires_turned_about_each_other_are_not_one(voxels, pitch_mm):
    """Traced midway, ok, 0.6 to 1.1 voxel off at a claimed 0.06 to 0.2: which way they lie apart was averaged away."""
    draft = Draft(np.random.default_rng(3), radius=2.2, wire_radius=0.18, room=0.9)
    tangents = np.gradient(draft.path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    one = carried(tangents, across(tangents[0])[0])
    two = np.cross(tangents, one)
    phase = 2.0 * np.pi * arc_of(draft.path)[:, None] / pitch_mm
    other = draft.path + 0.3 * voxels * (np.cos(phase) * one + np.sin(phase) * two)
    draft.others = [(other, 0.18, 1.0)]
    _, curve = seen(draft.scan(10))
    assert curve.status is FrameStatus.TRACE_AMBIGUOUS
    assert "out of round over" in curve.note or "one strand" in curve.note


@pytest.mark.parametrize("seed", [101, *later(1)])
def test_a_second_wire_that_is_a_copy_moved_aside_is_seen_in_part(seed):
    """Traced midway, ok, 0.4 to 0.5 voxel off: where the vessel turns the two lie behind each other, round as one."""
    rng = np.random.default_rng([seed, 7])
    radius, bend, wire_radius = rng.uniform(1.7, 2.4), rng.uniform(0.04, 0.1), rng.uniform(0.15, 0.22)
    draft = Draft(rng, radius=radius, bend=bend, wire_radius=wire_radius)
    aside = rng.normal(size=3)
    aside *= rng.uniform(1.0, 2.6) * 0.3 / np.linalg.norm(aside)
    draft.others.append((draft.path + aside, wire_radius, 1.0))
    _, curve = seen(draft.scan((8, 16)[seed % 2]))
    assert curve.status is FrameStatus.TRACE_AMBIGUOUS
    assert "out of round over 10 mm" in curve.note


@pytest.mark.parametrize("ratio", [1.2, *later(1.1)])
def test_a_scanner_that_is_sharper_across_its_axis_makes_no_pair_of_one_wire(ratio):
    """Blur that is a fifth larger along one axis refused every second wire as two in contact."""
    for seed in range(2):
        _, curve = seen(less_sharp(Draft(np.random.default_rng([seed, 13])).scan(16), ratio, 2))
        assert "out of round" not in curve.note


@pytest.mark.quick(1)
@pytest.mark.parametrize(("seed", "ratio"), [(500, 1.3), (505, 1.3), *later((502, 1.3), (507, 1.4), (506, 1.4))])
def test_how_sharp_a_scanner_is_along_each_axis_is_read_off_the_wall(seed, ratio):
    """11 of 12 frames of a cone-beam scanner, as much sharper along one axis, were refused as two wires in contact."""
    draft = Draft(np.random.default_rng([seed, 13]))
    _, curve = seen(less_sharp(draft.scan((16, 8)[seed // 3 % 2], reference=True), ratio, seed % 3))
    assert curve.status is FrameStatus.OK, curve.note


@pytest.mark.quick(1)
@pytest.mark.parametrize(("seed", "ratio"), [(500, 1.4), (504, 1.3), *later((508, 1.3), (501, 1.4), (513, 1.35))])
def test_what_the_scanner_makes_of_a_wire_hides_no_second_one(seed, ratio):
    scene = scene_of("two wires that touch all along", seed)
    _, curve = seen(less_sharp(scene, ratio, seed % 3))
    assert "out of round" in curve.note


def leaving(seed, leaves_mm, angle_deg):
    """A wire whose last part leads out of the vessel through its wall."""
    rng = np.random.default_rng([seed, 9])
    draft = Draft(rng, wire_radius=0.2)
    last = len(draft.path) - round(leaves_mm / 0.05)
    along = draft.path[last] - draft.path[last - 10]
    along /= np.linalg.norm(along)
    across = np.cross(along, rng.normal(size=3))
    across /= np.linalg.norm(across)
    out = np.cos(np.radians(angle_deg)) * along + np.sin(np.radians(angle_deg)) * across
    way = draft.path[last] + np.linspace(0.0, leaves_mm + 2.0, 60)[6:, None] * out
    draft.path = even(np.concatenate([draft.path[20 : last - 10 : 10], way]), 0.05)
    draft.opacity = np.ones(len(draft.path))
    return draft


@pytest.mark.parametrize(("leaves_mm", "angle_deg"), [(2.0, 80.0), *later((5.0, 80.0))])
def test_a_wire_that_leaves_the_lumen_through_its_wall_is_not_cut_there(leaves_mm, angle_deg):
    """Cut where grey is no longer read, four voxels outside: ok, 2 to 27 voxels short, a tip known to 0.04 mm."""
    for seed in (20, 21):
        _, curve = seen(leaving(seed, leaves_mm, angle_deg).scan(16))
        assert curve.status is FrameStatus.TRACE_LEFT_LUMEN


@pytest.mark.parametrize("seed", [0, *later(1)])
def test_a_wire_that_leaves_the_lumen_is_no_thin_vessel_of_a_frame_without_reference(seed):
    """In tissue it is as bright as contrast medium, and counted as lumen: cut where it leaves, 4 mm short, and ok."""
    _, curve = seen(leaving(seed, 3.0, 80.0).scan(16, reference=False))
    assert curve.status is FrameStatus.TRACE_LEFT_LUMEN
    assert "leads on through tissue" in curve.note


@pytest.mark.quick(1)
@pytest.mark.parametrize(("seed", "thinner", "about_mm"), [(4, 0.9, 2.0), (1, 0.6, 2.0), (0, 0.0, 2.0)])
def test_a_tip_in_medium_that_is_washed_out_is_not_seen(seed, thinner, about_mm):
    """As dark as the reference's medium, it was cut off: 3 to 5 voxels short, ok, at a sigma of 0.2 voxel."""
    draft = Draft(np.random.default_rng([seed, 77]))
    scene = draft.scan(16)
    away = np.linalg.norm(scene.frame.to_mm(np.argwhere(np.ones(scene.frame.shape))) - scene.wire[-1], axis=1)
    medium = (scene.reference.values - 100.0) * expit((about_mm - away) / 0.3).reshape(scene.frame.shape)
    frame = replace(scene.frame, values=(scene.frame.values - thinner * medium).astype(np.float32))
    _, curve = seen(replace(scene, frame=frame))
    assert (curve.status is FrameStatus.OK) == (thinner == 0.0), curve.note
    if thinner == 0.6:
        assert "contrast medium about the curve's end that is darker than the reference's" in curve.note


@pytest.mark.parametrize("step", [1.3, *later(1.0)])
def test_scans_in_coarse_steps_of_grey_are_no_copies(step):
    """Half of their voxels are alike by chance; no eight in a row are."""
    scene = Draft(np.random.default_rng(5)).scan(16)
    size = step * float(np.std(scene.reference.values[:15, :15, :15]))
    frame, reference = (
        replace(v, values=(np.rint(v.values / size) * size).astype(np.int16)) for v in (scene.frame, scene.reference)
    )
    _, curve = seen(replace(scene, frame=frame, reference=reference))
    assert "to the last bit" not in curve.note


@pytest.mark.quick(1)
@pytest.mark.parametrize(("seed", "lower"), [(0, 100), (1, 200)])
def test_scans_whose_negative_grey_is_cut_off_at_0_are_no_copies(seed, lower):
    """Half of tissue about 0 is 0 in both: all were refused as copies, and the medium's level was off by a sixth."""
    scene = Draft(np.random.default_rng([seed, 77])).scan(16)
    frame, reference = (
        replace(v, values=np.maximum(v.values - np.int16(lower), 0)) for v in (scene.frame, scene.reference)
    )
    _, curve = seen(replace(scene, frame=frame, reference=reference))
    assert curve.status is FrameStatus.OK, curve.note
    assert curve.levels["gain"] == 1.0


@pytest.mark.quick(1)
@pytest.mark.parametrize("seed", [1, 4, 2])
def test_a_frame_of_which_a_part_is_the_reference_is_no_scan_of_the_wire(seed):
    """The wire was cut where the copy began, by half of it, ok; a whole frame is as before."""
    rng = np.random.default_rng([seed, 12])
    scene = Draft(rng).scan((8, 16)[seed % 2])
    values = np.array(scene.frame.values)
    middle, towards = scene.wire[len(scene.wire) // 2], scene.wire[-1] - scene.wire[len(scene.wire) // 2]
    axis = int(np.argmax(np.abs(towards)))
    first = int(scene.frame.to_index(middle[None])[0][axis])
    part = [slice(None)] * 3
    part[axis] = slice(first, None) if towards[axis] > 0 else slice(None, first)
    if seed != 2:
        values[tuple(part)] = scene.reference.values[tuple(part)]
    _, curve = seen(replace(scene, frame=replace(scene.frame, values=values)))
    assert (curve.status is FrameStatus.OK) == (seed == 2)
    assert ("of the lumen's voxels as the reference has them, to the last bit" in curve.note) == (seed != 2)


@pytest.mark.quick(1)
@pytest.mark.parametrize("noises", [-10.0, 0.5, *later(-0.5)])
def test_grey_that_is_counted_from_elsewhere_costs_no_wire(noises):
    """A reference without its intercept, or of a scanner that is not calibrated: half a noise lost every second."""
    scene = Draft(np.random.default_rng(1)).scan(8)
    lumen = segment(scene.reference, scene.entry[None])
    noise = float(np.std(scene.reference.values[:20, :20, :20]))
    moved = replace(scene.reference, values=scene.reference.values + np.float32(noises * noise))
    plain, other = (
        trace(scene.frame, lumen, scene.entry, scene.direction, reference=still) for still in (scene.reference, moved)
    )
    assert plain.status is other.status is FrameStatus.OK, other.note
    assert np.linalg.norm(plain.points_mm[-1] - other.points_mm[-1]) < 0.1 * scene.voxel
    assert other.levels["gain"] == pytest.approx(plain.levels["gain"], abs=0.02)


def narrow(seed, gain):
    """A wire through most of a vessel that is so narrow that the blurred wire reaches all of it."""
    draft = Draft(np.random.default_rng(seed), radius=0.8, wire_radius=0.18, room=0.1)
    draft.gain = gain
    return draft.scan(8)


def fitted_in(scene):
    """A scene as tracing sees it, and what explains it best."""
    image = subtracted(scene.frame, segment(scene.reference, scene.entry[None]), scene.reference)
    entry = EntryPose(image.local(scene.entry[None])[0], image.turned(scene.direction))
    return image, explain.best_of(image, entry, None, TraceConfig())


@pytest.mark.quick(1)
@pytest.mark.parametrize("seed", [30, 32])
def test_a_wire_in_a_narrow_vessel_is_no_more_contrast(seed):
    """It was 2 and 4 % more, of a vessel that it nearly fills, and a faint end of 8 mm was taken off with that."""
    draft = Draft(np.random.default_rng([seed, 77]), length=60.0, radius=0.6, wire_radius=0.2, room=0.05)
    draft.opacity = np.where(draft.from_tip < 8.0, 0.1, 1.0)
    _, curve = seen(draft.scan(30))
    assert curve.levels["gain"] == 1.0
    assert curve.status is FrameStatus.TRACE_AMBIGUOUS


@pytest.mark.quick(1)
@pytest.mark.parametrize("gain", [0.75, 1.0, 1.3])
@pytest.mark.parametrize("seed", [4, *later(6)])
def test_the_wire_is_not_taken_for_contrast_medium(seed, gain):
    """0.11 to 0.14 off by the median of a lumen of which the wire brightens more than half."""
    _, curve = seen(narrow(seed, gain))
    assert abs(curve.levels["gain"] - gain) < 0.09
    assert curve.status.name == "OK", curve.note


def test_a_wire_of_no_brightness_is_refused_and_not_divided_by():
    image, best = fitted_in(narrow(4, 1.0))
    dark = replace(best.attempt, tube=replace(best.attempt.tube, tint=0.0 * best.attempt.tube.tint))
    verdict = judge(image, dark, best.points, np.zeros(len(best.points), bool), best.length_mm)
    assert verdict.status.name == "TRACE_LOW_CONTRAST"


def test_a_sharp_line_in_a_halo_is_a_wire_that_moved():
    """Half of the scan 1.6 voxels aside: the line lay at neither place, 0.2 mm off one at a sigma of 0.015, and ok."""
    image, best = fitted_in(narrow(4, 1.0))

    def judged(blur, halo):
        tube = best.attempt.tube
        tube = replace(tube, sigma=blur * image.wall_blur_mm, offset=halo * tube.peak)
        none = np.zeros(len(best.points), bool)
        return judge(image, replace(best.attempt, tube=tube), best.points, none, best.length_mm)

    assert "moved during the scan" in judged(1.0, 0.13).note
    assert judged(1.0, 0.13).status is FrameStatus.TRACE_AMBIGUOUS
    assert "halo" not in judged(1.2, 0.13).note, "a faint catheter of 2 mm over the wire"
    assert judged(1.0, 0.06).status is FrameStatus.OK


@pytest.mark.parametrize(("level", "status"), [(0.15, "TRACE_AMBIGUOUS"), (1.0, "OK")])
def test_a_faint_end_in_a_sharp_scan_is_not_dropped_in_silence(level, status):
    """6 mm of 2.4 noises: 8 of 23 such ends were dropped, and ok; the blur in which grey is read takes most of them."""
    rng = np.random.default_rng(3)
    draft = Draft(rng, radius=2.0, wire_radius=0.18, spacing=0.5)
    draft.lattice = Lattice.around(draft.axis, 4.5, 0.5, rng, 0.5)
    draft.opacity = np.where(draft.from_tip < 6.0, level, 1.0)
    scene = draft.scan(16)
    _, curve = seen(scene)
    assert curve.status.name == status, f"{curve.length_mm:.1f} of {arc_of(scene.wire)[-1]:.1f} mm; {curve.note}"


@pytest.mark.parametrize(
    ("beyond", "thread", "seen"),
    [(1000.0, 0.0, True), (1350.0, 0.0, False), (100.0, 0.0, False), (100.0, 4000.0, True), (1000.0, 4000.0, True)],
    ids=["vessel", "bone", "tissue", "wire in tissue", "wire in vessel"],
)
def test_a_lumen_ends_too_early_before_a_vessel_or_a_wire_but_not_before_bone(beyond, thread, seen):
    """Bone 1.35 times as bright as the vessel, behind the wall that a tip points at, was taken for more vessel."""
    h, wall = 0.3, 6.0
    x, y, z = (np.arange(48) * h - c for c in (7.0, 7.0, 0.0))
    grey = np.broadcast_to(np.where(z > wall, beyond, 1000.0), (48, 48, 48)).copy()
    grey[np.hypot(*np.meshgrid(x, y, indexing="ij")) < 0.25] += thread
    scan = Volume(grey.astype(np.float32), [h] * 3, [0.0] * 3)
    image = SimpleNamespace(
        voxel=h, spacing=np.full(3, h), in_scan=lambda points: points / h, scan=scan,
        wall_greys=(1000.0, 100.0), depth_at=lambda points: points[:, 2] - wall,
    )  # fmt: skip
    line = np.stack([np.full(20, 7.0), np.full(20, 7.0), np.linspace(0.0, 5.5, 20)], axis=1)
    assert seen_outside(image, line) is seen


def line_in_noise(seed, height, last_mm, size=(40, 40, 90), h=0.3, blur=0.95):
    """White noise of 1 with a straight wire along z up to ``last_mm``, ``height`` noises bright, as tracing sees it."""
    grey = np.random.default_rng(seed).normal(size=size).astype(np.float32)
    x, y, z = (np.arange(n) * h for n in size)
    across = np.exp(-((x[:, None] - 6.0) ** 2 + (y[None] - 6.0) ** 2) / (2 * (blur * h) ** 2))
    grey += height * across[:, :, None] * ndtr((last_mm - z) / (blur * h))
    smooth = ndimage.gaussian_filter(grey, CREST_VOXELS)
    sd = float(np.std(ndimage.gaussian_filter(np.random.default_rng(0).normal(size=size), CREST_VOXELS)))
    box, within = SimpleNamespace(shape=size, values=0 * smooth - 1.0), np.arange(grey.size)
    return SimpleNamespace(
        voxel=h, spacing=np.full(3, h), grey=grey, noise=1.0, correlation=1.0, noise_in=lambda blur: sd,
        along=lambda points: ndimage.map_coordinates(smooth, np.asarray(points).T / h, order=1),
        region=SimpleNamespace(within=within, box=box, numbers=Spare(size, np.int32)),
        deep=lambda _: within,
    )  # fmt: skip


def test_the_range_of_an_end_holds_the_true_one_and_is_as_narrow_as_noise_allows():
    """Wires that were fitted up to 0.3 mm too far. All voxels tell 2 voxels where the profile along the wire told 3."""
    h, line = 0.3, np.stack([np.full(140, 6.0), np.full(140, 6.0), np.linspace(3.0, 18.3, 140)], axis=1)
    controls = spline_through(line, 2.4)
    tube = Tube(controls, np.full(tint_nodes(len(controls) - 3), 3.0), 0.95 * h, 0.0)
    ranges = np.array([end_range(line_in_noise(seed, 3.0, 18.0), tube) for seed in range(60)])
    assert np.mean(ranges[:, 0] > 0.26) > 0.97, "three standard deviations, in steps of a quarter of a voxel"
    assert np.median(ranges.sum(axis=1)) < 2 * 1.3 * h, "1.06 / CNR voxel is the least standard deviation of an end"


def test_how_far_noise_makes_a_round_line_out_of_round_is_known():
    """It was taken for a half more: two wires in contact had to be so much further out of round to be seen."""
    line, found = np.stack([np.full(90, 6.0), np.full(90, 6.0), np.linspace(3.0, 24.0, 90)], axis=1), []
    for seed in range(12):
        image = line_in_noise(seed, 30.0, 30.0)
        section = section_along(image, line, read_around(image, places_around(line, 0.3)))
        found.append(np.median(section.oblong) / section.noise)
    assert np.mean(found) == pytest.approx(MEDIAN, rel=0.15), "7 independent values each; a ring has 12 that are not"


def test_faint_wire_beyond_a_tip_stands_out_over_its_length_and_noise_does_not():
    tip, heading = np.array([6.0, 6.0, 6.0]), np.array([0.0, 0.0, 1.0])
    for seed in range(10):
        assert highest(ways_on(line_in_noise(seed, 0.0, 0.0), tip, heading), 0.0) < SURE
        wire = ways_on(line_in_noise(seed, 1.7, 12.0), tip, heading)
        assert highest(wire, 0.0) > SURE, "6 mm of 1.7 noises lie ahead"
        assert highest(wire, 3.0) == 0.0, "none is as bright as that"


@pytest.mark.quick(1)
@pytest.mark.parametrize(("share", "cnr"), [(0.03, 120), (0.07, 40), (0.0, 120)])
def test_an_end_as_faint_as_a_streak_is_told_of(share, cnr):
    """The last 6 mm had 3 to 7 % of the brightness: cut off in 18 of 18 frames, ok, without a word."""
    draft = Draft(np.random.default_rng([0, 5]))
    draft.opacity = np.where(draft.from_tip < 6.0, share, 1.0)
    curve = seen(draft.scan(cnr))[1]
    assert curve.status is FrameStatus.OK
    assert curve.levels.get(FAINT_BEYOND, 0.0) == pytest.approx(share, rel=0.15)


def test_bends_are_followed_by_knots_that_noise_sets_far_apart():
    """Contrast 4 times the noise, knots 13 voxels apart; the sharpest bends have radii of 11 and 15 voxels."""
    row = look("plain", 2)
    assert row.levels["knot_mm"] > 11.0 * 0.3
    assert row.mean < 0.115, "voxel; 0.13 where a Gaussian prior straightened bends"


def test_a_turn_is_as_sharp_as_its_arc():
    angle = np.linspace(0.0, np.pi, 200)
    for radius in (0.5, 5.0):
        arc = radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
        step = radius * np.pi / 199
        reach = 0.5 * radius
        assert sharpest_turn_deg(arc, step, reach) == pytest.approx(np.degrees(0.5), rel=0.02), "to a sample"
    assert sharpest_turn_deg(arc[:2], step, reach) == 0.0
