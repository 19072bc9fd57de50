"""Traced lengths of a sequence against each other: a frame cut short shows, a scale that is off does not matter."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pipeline.run.log import Log
from pipeline.run.stages.depths import (
    drawn_back,
    in_step,
    perhaps_turned,
    shrinking,
    standing,
    stated_elsewhere,
    to_depth,
    traced_depths,
    turned_round,
)
from pipeline.run.stages.dim_ends import barely_seen, faint_ends, own_dim_ends
from pipeline.run.stages.gaps import own_gaps
from pipeline.run.stages.known import Frame
from pipeline.run.stages.misstated import as_steps, in_another_order
from pipeline.run.stages.repeated import kept, once
from pipeline.run.stages.scales import on_another_scale
from pipeline.run.stages.trace import _in_step, _last_curve, _Part
from pipeline.run.stages.way import with_depths
from pipeline.simulate.clamp import Clamp
from pipeline.status import FrameStatus
from pipeline.study.settings import Config
from pipeline.trace import FAINT_BEYOND, GOES_ON, of_catheter, of_length
from pipeline.trace.config import TraceConfig
from reports.doubts import Caveats
from tests.pipeline.doubts import dim, frames, thick, with_gap

DEPTHS = [10.0, 14.0, 18.0, 22.0, 26.0, 30.0]
COMMON_MM = 0.17
"""Half a voxel of 0.3 mm that an entry is known to, and a quarter that traced tips are."""


def from_entry(seen: list[Frame], z_mm: float = 0.0) -> dict[int, float]:
    """Their depths from an entry at this height, where their curves begin at 0."""
    return traced_depths(seen, [0.0, 0.0, z_mm], [0.0, 0.0, 1.0])


def elsewhere(lengths: list[float], expected: list[float], z_mm: float = 0.0) -> list[str]:
    seen = frames(lengths, expected)
    return stated_elsewhere(seen, from_entry(seen, z_mm), COMMON_MM, None)


@pytest.mark.parametrize("cut", [0, 3, 5])
def test_a_wire_cut_short_by_less_than_the_tolerance_is_out_of_step(cut: int) -> None:
    lengths = [d - 0.4 for d in DEPTHS]
    lengths[cut] -= 1.5
    status = [f.status for f in in_step(frames(lengths, DEPTHS), 0.3)]
    assert status == ["length_mismatch" if n == cut else "ok" for n in range(len(DEPTHS))]


def test_a_scale_that_is_off_or_read_by_hand_is_no_fault() -> None:
    rng = np.random.default_rng(0)
    drift = [1.03 * d + 0.5 for d in DEPTHS]
    by_hand = [d + rng.normal(scale=0.4) for d in DEPTHS]
    for lengths in (drift, by_hand):
        assert all(f.ok for f in in_step(frames(lengths, DEPTHS), 0.3))


def test_depths_counted_from_elsewhere_are_a_warning() -> None:
    """1.5 mm in every frame, within the tolerance of each: 16 of 18 ok, and nothing was said."""
    (said,) = elsewhere([d - 1.5 for d in DEPTHS], DEPTHS)
    assert said.startswith("the traced wires are 1.5 mm shorter than insertion_mm states (median of 6 stated depths; ")
    assert Caveats(warnings=[said]).against, "pages name it first"
    assert elsewhere([d - 0.4 for d in DEPTHS], DEPTHS) == []
    assert elsewhere([d - 1.5 for d in DEPTHS[:2]], DEPTHS[:2]) == []
    assert elsewhere(DEPTHS, [float("nan")] * 6) == []


def test_a_wrong_zero_of_the_ruler_is_told_of_three_frames() -> None:
    """Of stated depths that were 1.5 mm too deep alike, and of 0.8 mm in six frames, nothing was said."""
    read = np.array([-0.02, 0.0, 0.03])
    (said,) = elsewhere([*(DEPTHS[:3] + read - 1.5)], DEPTHS[:3])
    assert "1.5 mm shorter than insertion_mm states (median of 3 stated depths" in said
    assert said.endswith("unless simulate.depth is manifest: then they end as much too deep")
    assert elsewhere([d + 0.8 for d in DEPTHS], DEPTHS)[0].endswith("too shallow")
    assert not elsewhere([*(DEPTHS[:3] + 20.0 * read - 1.2)], DEPTHS[:3]), "read to 0.5 mm, three are so by chance"


def test_lengths_that_are_left_outside_are_told_as_such() -> None:
    """100 mm less what is in: "grow -1.000 times as fast: is the scans' voxel size right", or a reversed direction."""
    outside = [110.0 - d for d in DEPTHS]
    seen = [f.failed("trace", FrameStatus.LENGTH_MISMATCH, "too short") for f in frames(DEPTHS, outside)]
    assert perhaps_turned(seen)[0].message.startswith("too short; are these the lengths left outside (ins")
    seen = frames(DEPTHS, outside)
    (said,) = on_another_scale(seen, from_entry(seen))
    assert said.startswith("the traced wires get longer where insertion_mm states less: are these the lengths left")


def test_noise_over_depths_that_hardly_differ_is_no_length_left_outside() -> None:
    """Of three depths within 0.5 mm it was told in 9 % of draws, and that the direction may be turned was not."""
    rng = np.random.default_rng(0)
    for _ in range(500):
        seen = frames(rng.normal(1.0, 0.5, size=3).tolist(), [30.0, 30.25, 30.5])
        seen = [f.failed("trace", FrameStatus.LENGTH_MISMATCH, "too short") for f in seen]
        assert "or entry_direction points back" in perhaps_turned(seen)[0].message


def test_a_zero_is_as_well_known_as_the_entry_and_the_ruler_are() -> None:
    seen = frames([d - 0.9 for d in DEPTHS], DEPTHS)
    for common_mm, read_mm, told in ((0.17, None, 1), (0.17, 0.1, 1), (0.3, None, 0), (0.17, 1.0, 0)):
        assert len(stated_elsewhere(seen, from_entry(seen), common_mm, read_mm)) == told


def test_right_depths_are_hardly_ever_told() -> None:
    """Each read to 0.5 mm, of an entry that is off within its standard deviation."""
    rng = np.random.default_rng(0)
    lengths = [
        n * [0.0] + d + rng.normal(scale=COMMON_MM) + rng.normal(scale=0.5, size=n)
        for n in (3, 6)
        for d in [np.array(DEPTHS[:n])] * 500
    ]
    assert sum(len(elsewhere([*each], DEPTHS[: len(each)])) for each in lengths) <= 2


@pytest.mark.parametrize("count", [3, 5])
def test_scans_of_one_depth_are_one_reading_of_it(count: int) -> None:
    """Of depths scanned six times each and read to 0.5 mm, a scale was told in 183 (three) or 137 (five) of 400."""
    rng, told = np.random.default_rng(0), [0, 0]
    stated = np.repeat(np.linspace(10.0, 30.0, count), 6)
    for _ in range(100):
        read = np.repeat(rng.normal(scale=0.5, size=count), 6) + rng.normal(scale=0.02, size=6 * count)
        seen = frames([*(stated + read)], [*stated])
        told[0] += len(on_another_scale(seen, from_entry(seen)))
        told[1] += len(stated_elsewhere(seen, from_entry(seen), COMMON_MM, None))
    assert max(told) <= 1
    assert len(elsewhere([*(stated - 1.5)], [*stated])) == 1


@pytest.mark.parametrize("apart", [4e-15, 3e-8, 1e-7, 1e-3])
@pytest.mark.parametrize("depth", [20.0, 20.125])
def test_depths_that_rounding_tells_apart_are_one(depth: float, apart: float) -> None:
    """A parabola through them ended the case with a singular matrix, or grew 27,000 times as fast."""
    stated = [depth, depth + apart, 2.0 * depth, 2.0 * depth + apart]
    seen = frames([1.06 * depth, 1.06 * depth + 0.01, 2.12 * depth, 2.12 * depth + 0.03], stated)
    assert not on_another_scale(seen, from_entry(seen))


def test_a_wrong_scale_is_no_wrong_zero_too() -> None:
    """Of depths from 60 to 150 mm and 1.01 for 1 both were told: one error, and two causes."""
    stated = np.linspace(60.0, 150.0, 10)
    seen = frames([*(1.01 * stated)], [*stated])
    assert elsewhere([*(1.01 * stated)], [*stated])
    case = SimpleNamespace(
        entry_mm=[0.0] * 3, entry_direction=[0.0, 0.0, 1.0], entry_sigma_mm=None, insertion_sigma_mm=None, traces=None
    )
    run: Any = SimpleNamespace(case=case, config=Config(), log=Log(lambda *_: None))
    _in_step(run, seen, 0.3)
    said = [text for text in run.log.warnings if "insertion_mm states" in text]
    assert len(said) == 1
    assert "1.010 times as fast" in said[0]


def test_a_scale_that_is_off_is_told_where_depths_were_read_well() -> None:
    """Voxels stated 3 % too long: 0.7 to 1.3 mm in six frames, all within the tolerance, and nothing was said."""

    def said(lengths: list[float], stated: list[float] = DEPTHS) -> list[str]:
        seen = frames(lengths, stated)
        return on_another_scale(seen, from_entry(seen))

    rng = np.random.default_rng(0)
    for scale in (1.03, 0.985):
        (text,) = said([scale * d + 0.3 + rng.normal(scale=0.02) for d in DEPTHS])
        assert text.startswith(f"the traced wires grow {scale:.2f}"[:-1]), text
        assert Caveats(warnings=[text]).against
    assert not said([1.03 * d for d in DEPTHS[:3]], DEPTHS[:3]), "too few"
    assert not said([1.005 * d for d in DEPTHS])
    assert not said([20.0] * 6, [20.0] * 6)
    by_hand = [said([1.02 * d + rng.normal(scale=0.5) for d in DEPTHS]) for _ in range(200)]
    assert sum(map(len, by_hand)) <= 4


@pytest.mark.parametrize("scale", [0.9, 0.95, 1.05, 1.1])
def test_a_wrong_voxel_size_of_a_few_depths_is_no_wrong_zero(scale: float) -> None:
    """By 10 % five depths were told to be counted from elsewhere, by 5 % nothing was said: a line was not sure."""
    stated, read = np.array([8.2, 15.8, 22.8, 30.4, 37.7]), np.array([0.2, -0.15, -0.15, -0.05, 0.2])
    seen = frames([*(scale * stated + read)], [*stated])
    (said,) = on_another_scale(seen, from_entry(seen))
    assert float(said.partition("grow ")[2].partition(" times")[0]) == pytest.approx(scale, abs=0.01)
    for lengths in (stated - 1.5, stated - 1.5 + read, stated + 2.0 * read):
        other = frames([*lengths], [*stated])
        assert not on_another_scale(other, from_entry(other))


@pytest.mark.parametrize("count", [6, 10])
def test_slack_that_grows_as_the_square_of_the_depth_is_no_voxel_size(count: int) -> None:
    """Of slack up to 2 mm the scans' voxel size was asked for: a straight line explained most of it, and no scale.

    Of six such depths it is told in 95 % of draws, of ten in all.
    """
    rng, stated = np.random.default_rng(4), np.linspace(10.0, 40.0, count)
    off = rng.normal(scale=0.02, size=count)
    seen = frames([*(stated - 2.0 * (stated / 40.0) ** 2 + off)], [*stated])
    (said,) = on_another_scale(seen, from_entry(seen))
    assert "no one scale explains that" in said
    assert float(said.partition("grow ")[2].partition(" times")[0]) == pytest.approx(0.975, abs=0.005)
    assert Caveats(warnings=[said]).against
    seen = frames([*(0.97 * stated - 2e-4 * stated**2 + off)], [*stated])
    (said,) = on_another_scale(seen, from_entry(seen))
    assert "is the scans' voxel size right" in said, "a little bend beside a wrong scale"


def test_a_depth_that_is_misread_at_an_end_bends_no_scale() -> None:
    """Of 30 depths one end was off by 1 mm, and the voxel size that was wrong "no voxel size does" in 9 of 200."""
    rng, stated, told = np.random.default_rng(7), np.linspace(5.0, 60.0, 30), 0
    for _ in range(200):
        read = 1.05 * stated + rng.normal(scale=0.1, size=30)
        read[rng.choice([0, -1])] += rng.choice([-1.0, 1.0])
        seen = frames([*read], [*stated])
        (said,) = on_another_scale(seen, from_entry(seen))
        told += "no one scale" in said
    assert told <= 5


def test_right_depths_are_hardly_ever_told_to_be_on_another_scale() -> None:
    """Read to 0.5 mm, from an entry that is off by 0.17 mm as a rule, or from a wrong zero."""
    rng = np.random.default_rng(0)
    told = 0
    for off in [0.0, 1.5] * 500:
        lengths = np.array(DEPTHS[:5]) + off + rng.normal(scale=COMMON_MM) + rng.normal(scale=0.5, size=5)
        seen = frames([*lengths], DEPTHS[:5])
        told += len(on_another_scale(seen, from_entry(seen)))
    assert told <= 5


def test_a_wrong_zero_of_four_depths_is_no_wrong_scale() -> None:
    """Read to 0.5 mm from a zero that was 1.5 mm off, a scale was told in 21 of 1000."""
    rng, stated = np.random.default_rng(1), [10.0, 14.0, 18.0, 22.0]
    told = 0
    for _ in range(500):
        seen = frames([*(np.array(stated) - 1.5 + rng.normal(scale=0.5, size=4))], stated)
        told += len(on_another_scale(seen, from_entry(seen)))
    assert told <= 2


@pytest.mark.parametrize(("deviations", "told"), [(8.0, False), (9.0, True), (-8.0, False), (-9.0, True)])
def test_a_scale_may_be_wrong_either_way(deviations: float, told: bool) -> None:
    """Of four degrees of freedom a slope is 8.6 standard deviations off by chance once in 1000, to one side 7.2."""
    stated = np.array(DEPTHS)
    left = 0.05 * np.array([-5.0, 7.0, 4.0, -4.0, -7.0, 5.0])  # no slope and no bend fit any of it
    slope = deviations * np.sqrt(left @ left / 4 / np.sum((stated - stated.mean()) ** 2))
    seen = frames([*(stated + slope * (stated - stated.mean()) + left)], DEPTHS)
    assert bool(on_another_scale(seen, from_entry(seen))) is told


def test_depths_that_are_refused_count_among_those_counted_from_elsewhere() -> None:
    """2 mm in each of five frames: two were refused, alone, and three were too few to be told of."""
    seen = frames([d - 1.9 for d in DEPTHS[:5]], DEPTHS[:5])
    seen = [f.failed("trace", FrameStatus.LENGTH_MISMATCH, "by itself") if f.index < 2 else f for f in seen]
    (said,) = stated_elsewhere(seen, from_entry(seen), COMMON_MM, None)
    assert said.startswith("the traced wires are 1.9 mm shorter than insertion_mm states (median of 5 stated depths; ")


def test_an_entry_before_the_wire_begins_counts_as_depth() -> None:
    """1.5 mm back the wires were as long as stated, and 1.0 to 1.6 mm deeper, without a word; 3 mm back one was ok."""
    (said,) = elsewhere(DEPTHS, DEPTHS, -1.5)
    assert said.startswith(
        "the traced wires are 1.5 mm longer than insertion_mm states and begin 1.5 mm beyond entry_mm"
    )
    assert Caveats(warnings=[said]).against
    assert elsewhere([d - 1.5 for d in DEPTHS], DEPTHS, -1.5) == []
    seen = frames(DEPTHS, DEPTHS)
    assert all(f.ok for f in to_depth(seen, from_entry(seen, -1.5), 2.0))
    first, *_ = to_depth(seen, from_entry(seen, -2.6), 2.0)
    assert first.status == "length_mismatch"
    assert "got 12.60 mm from entry_mm to the tip, as the traced wire begins 2.60 mm beyond it" in first.message


def test_frames_in_another_order_are_named_as_such() -> None:
    """Four of five failed by their lengths, with advice to turn entry_direction round."""
    seen = frames(DEPTHS[:5][::-1], DEPTHS[:5])
    (said,) = in_another_order(seen, from_entry(seen), 2.0)
    assert said.startswith(
        "the traced wires have the depths that insertion_mm states, of other frames (4 of 5): that of"
    )
    assert Caveats(warnings=[said]).against
    assert "frame 0, 26.0 mm, is of frame 4; are frames and insertion_mm in one order?" in said
    for lengths in (DEPTHS[:5], [10.0, 14.0, 12.0, 22.0, 26.0], [d + 3.0 for d in DEPTHS[:5]]):
        other = frames(lengths, DEPTHS[:5])
        assert not in_another_order(other, from_entry(other), 2.0)
    unknown = frames(DEPTHS[:2], [float("nan")] * 2)
    assert not in_another_order(unknown, from_entry(unknown), 2.0)


def test_depths_given_as_increments_are_asked_about() -> None:
    """ "The wire is replayed as drawn back there" was all that was said of four frames that failed by their lengths."""
    steps = list(np.diff(DEPTHS, prepend=0.0))
    seen = frames(DEPTHS, steps)
    (said,) = as_steps(seen, from_entry(seen), 2.0)
    assert said.endswith(
        "(frame 5: 30.0 mm, stated 4, sum 30.0): are these increments? State the depth of each frame, counted from "
        "entry_mm"
    )
    assert Caveats(warnings=[said]).against
    assert not as_steps(seen[:2], from_entry(seen[:2]), 2.0)
    for lengths, stated in ((DEPTHS, DEPTHS), (DEPTHS[::-1], DEPTHS), (steps, steps), (DEPTHS, [np.nan] * 6)):
        other = frames(lengths, stated)
        assert not as_steps(other, from_entry(other), 2.0)


def test_too_few_frames_or_no_depths_say_nothing() -> None:
    assert all(f.ok for f in in_step(frames([10.0, 12.0, 18.0], DEPTHS[:3]), 0.3))
    assert all(f.ok for f in in_step(frames([10.0, 12.0, 11.0, 12.0], [float("nan")] * 4), 0.3))


def test_a_wire_that_does_not_advance_is_a_warning() -> None:
    """From an entry inside the wire, backwards, two of four traces of 5 mm were ok, and nobody asked."""
    nan = [float("nan")] * 3
    assert "the traced wire is 5.0 mm long in all 3 frames" in standing(frames([5.0, 5.2, 4.9], nan), 0.3)[0]
    assert standing(frames([5.0, 5.2, 6.9], nan), 0.3) == []
    assert standing(frames([5.0, 5.2, 4.9], [5.0] * 3), 0.3) == []
    rolled = [replace(f, roll_deg=30.0 * f.index) for f in frames([5.0, 5.2, 4.9], nan)]
    assert standing(rolled, 0.3) == []


def test_a_wire_that_gets_shorter_unsaid_is_a_warning() -> None:
    nan = [float("nan")] * 3
    assert "frame 2 (-3.0 mm): the traced wire is shorter" in shrinking(frames([10.0, 14.0, 11.0], nan), 0.3)[0]
    assert shrinking(frames([10.0, 14.0, 13.9], nan), 0.3) == []
    assert shrinking(frames([10.0, 14.0, 11.0], [10.0, 14.0, 11.0]), 0.3) == []


def test_frames_that_are_exchanged_by_less_than_any_tolerance_are_a_warning() -> None:
    """Half a millimetre apart and exchanged in pairs, as d25, d25.5 once were read, all was ok without a word."""
    stated = [25.0 + 0.5 * n for n in range(8)]
    traced = [stated[n ^ 1] + 0.3 for n in range(8)]
    assert [f.status for f in in_step(frames(traced, stated), 0.5)] == ["ok"] * 8
    (said,) = drawn_back(frames(traced, stated), 0.7)
    assert said.startswith("frames 1 (-0.50 mm, stated +0.50 mm), 3 (")
    assert "are frames and insertion_mm in one order?" in said
    assert drawn_back(frames(stated, stated), 0.5) == []
    assert drawn_back(frames([*stated[:3], 25.9, *stated[4:]], stated), 0.5) == [], "one of seven, by chance"
    assert drawn_back(frames([20.0, 10.0], [20.0, 10.0]), 0.5) == [], "pulled back as stated"
    many = [20.0 + 0.8 * i for i in range(36)]
    (one,) = drawn_back(frames([*many[:14], many[15], many[14], *many[16:]], many), 0.3)
    assert one.startswith("frame 15 (-0.80 mm, stated +0.80 mm): "), "one pair of thirty-six, 9 standard deviations"
    assert drawn_back(frames([20.0, 10.0], [float("nan")] * 2), 0.5) == []


def test_a_dim_end_that_goes_with_the_tip_is_the_wires_own() -> None:
    found, said = own_dim_ends(dim([20.0, 25.0, 30.0, 35.0], [8.0, 8.3, 7.9, 3.0]), 0.3)
    assert [f.status for f in found] == ["ok", "ok", "ok", "trace_ambiguous"], "the last one has another end"
    assert found[0].trusted_curve is not None
    assert found[0].trusted_curve.status is FrameStatus.OK
    assert "the last 8.0 mm" in said[0]


@pytest.mark.parametrize(
    ("lengths", "from_tip"),
    [
        ([35.0, 35.0, 35.0, 35.0], [15.0, 10.0, 5.0, 2.0]),  # a catheter that stays while the wire is pushed
        ([35.0, 35.2, 35.1], [8.0, 8.0, 8.0]),  # nothing was pushed
        ([20.0, 30.0], [8.0, 8.0]),
        ([20.0, 24.0, 28.0, 32.0, 36.0], [8.0, 8.1, 4.0, 2.0, 12.0]),
    ],
)
def test_a_dim_end_that_may_be_a_catheters_stays_refused(lengths: list[float], from_tip: list[float]) -> None:
    found, said = own_dim_ends(dim(lengths, from_tip), 0.3)
    assert not said
    assert not any(f.ok for f in found)


def test_a_wire_is_dimmer_beyond_a_stated_catheter() -> None:
    (frame,) = dim([30.0], [12.0])
    assert frame.curve is not None
    assert of_catheter(frame.curve, 18.3).status is FrameStatus.OK
    assert of_catheter(frame.curve, 25.0) is frame.curve


def test_what_ends_with_a_stated_catheter_is_not_cleared_by_other_depths() -> None:
    """A catheter pushed with the wire, its end stated: 15 of 15 frames were ok, 4 to 5 mm too deep."""
    seen = dim([20.0, 25.0, 30.0], [8.0, 8.0, 8.0])
    ends = [replace(f, curve=of_catheter(f.curve, f.curve.length_mm)) for f in seen if f.curve is not None]
    found, said = own_dim_ends(ends, 0.3)
    assert not said
    assert not any(f.ok for f in found)


def test_a_faint_end_that_some_frames_show_is_doubted_in_the_others() -> None:
    """Of a tip of 5 mm that is faint three frames were refused, two ended 5 mm short, ok, without a word."""
    lengths = [10.0, 15.0, 20.0, 25.0, 30.0]
    found = frames(lengths, lengths)
    unstated = [replace(f, expected_mm=np.nan) for f in found]
    note = f"trace: end: got a line {GOES_ON}"

    def refused(of: list[Frame], count: int) -> list[Frame]:
        doubted = [f.curve.doubted(FrameStatus.TRACE_AMBIGUOUS, note) for f in of[:count] if f.curve]
        return [f.traced_by(curve) for f, curve in zip(of, doubted, strict=False)] + of[count:]

    (said,) = faint_ends(refused(unstated, 3))
    assert said.startswith(f"in frames 0, 1, 2 a line goes on {GOES_ON}: the wire's end may be too faint in 3, 4, too")
    assert not faint_ends(refused(unstated, 1)), "one frame of five"
    assert not faint_ends(refused(found, 3)), "depths are stated, and tell"
    assert not faint_ends(unstated)


def test_an_end_as_faint_as_a_streak_is_told_of_where_nobody_states_a_depth() -> None:
    lengths = [10.0, 15.0, 20.0]
    found = frames(lengths, lengths)
    with_more = [replace(f, curve=replace(f.curve, levels={FAINT_BEYOND: 0.03})) for f in found[1:] if f.curve]
    (said,) = barely_seen([found[0], *(replace(f, expected_mm=np.nan) for f in with_more)])
    assert said.startswith("beyond the traced tip of frames 1, 2 something goes on, 0.03 times as bright as the wire")
    assert not barely_seen(found)
    assert not barely_seen(with_more), "depths are stated, and tell"


def test_a_copy_of_a_frame_is_no_third_that_agrees() -> None:
    read = [replace(f, voxels=v) for f, v in zip(dim([20.0, 30.0, 20.0], [8.0, 8.0, 8.0]), "aba", strict=True)]
    seen = once(read)
    assert once(read, ("b",))[1].status == FrameStatus.REPEATED.identifier
    assert seen[2].status == FrameStatus.REPEATED.identifier
    assert not any(f.ok for f in own_dim_ends(seen, 0.3)[0])


LENGTHS = [20.0, 26.0, 32.0, 38.0]


def test_a_rod_with_a_dim_end_of_its_own_is_a_rod() -> None:
    """A rod of 1.1 mm, of 0.36 mm stated, was ok in 4 of 4 frames: its dim end was asked about alone."""
    found, said = own_dim_ends(dim(LENGTHS, [6.0] * 4, lambda curve: thick(curve, 0.6)), 0.3)
    assert not said
    assert not any(f.ok for f in found)
    assert "mm thick; expected" in found[0].message, "and no word of other depths, which settle nothing here"


def test_a_dim_end_beyond_a_gap_is_asked_about_both() -> None:
    """Once the dim end was found the wire's own nobody asked whether a second device faced its tip."""
    seen = dim(LENGTHS, [6.0] * 4, lambda curve: with_gap(curve, 15.5))
    found, said = own_dim_ends(seen, 0.3)
    assert "the last 6.0 mm" in said[0]
    assert [f.status for f in found] == ["trace_ambiguous"] * 4
    assert all("15.5 mm of it beyond a gap" in f.message for f in found)
    assert all(f.ok for f in own_gaps(found, 0.3)[0]), "which the frames agree on, too"


def test_a_scan_that_was_calibrated_with_is_known_by_its_trace_whatever_its_end() -> None:
    """Written again and doubted for its dim end, it was scored once other frames had cleared that."""
    seen = dim(LENGTHS, [6.0] * 4)
    assert seen[1].curve is not None
    single = once(seen, traced_mm=[kept(seen[1].curve)])
    assert [f.status for f in own_dim_ends(single, 0.3)[0]] == ["ok", "repeated", "ok", "ok"]


def test_a_frame_is_told_strands_apart_by_one_that_stands_alone() -> None:
    """A longer device beside the wire: refused in frame 0, and ok in frame 1 for frame 0 had a curve like that."""
    right, wrong, own_end = frames([10.0], [10.0])[0], frames([14.0], [14.0])[0], dim([18.0], [8.0])[0]
    assert wrong.curve is not None
    wrong = replace(wrong, curve=wrong.curve.doubted(FrameStatus.TRACE_AMBIGUOUS, ""))
    lengths = [
        round(_last_curve(len(seen), [_Part(f, None, Log(lambda *_: None)) for f in seen].__getitem__).length_mm)
        for seen in ([wrong], [right, wrong], [right, wrong, own_end])
    ]
    assert lengths == [0, 10, 18]


def test_the_length_of_a_trace_that_is_not_trusted_is_no_depth_where_one_is_stated() -> None:
    """Pages showed the failed frame at 7 mm where 18 were stated, and the wire was drawn back to 7 mm in between."""
    clamp = Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    lengths = [10.0, 14.0, 7.0, 22.0]
    seen = frames(lengths, DEPTHS[:4])
    seen[2] = seen[2].failed("trace", FrameStatus.LENGTH_MISMATCH, "")
    assert [f.depth_mm for f in with_depths(seen, "traced", clamp)] == [10.0, 14.0, 18.0, 22.0]
    unstated = [replace(f, expected_mm=float("nan")) for f in seen]
    assert [f.depth_mm for f in with_depths(unstated, "traced", clamp)] == lengths
    assert [f.depth_mm for f in with_depths(seen, "manifest", clamp)] == DEPTHS[:4]


def test_a_stated_depth_is_taken_as_the_traced_ones_show_that_it_was_read() -> None:
    """All wires 1.2 mm longer than stated: in the frame without a trace the wire was drawn back by that."""
    clamp = Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    seen = frames([depth + 1.2 for depth in DEPTHS[:5]], DEPTHS[:5])
    seen[2] = replace(seen[2], curve=None)
    assert [f.depth_mm for f in with_depths(seen, "traced", clamp)] == pytest.approx([d + 1.2 for d in DEPTHS[:5]])
    assert [f.depth_mm for f in with_depths(seen, "manifest", clamp)] == DEPTHS[:5]
    assert with_depths(seen[1:], "traced", clamp)[1].depth_mm == DEPTHS[2], "three traces do not tell"


def test_a_tip_behind_the_entry_names_entry_direction() -> None:
    """It was "depths_mm: got -0.0317; allowed: a number from 0", of the solver, and the whole case was lost."""
    clamp = Clamp(np.array([0.0, 0.0, 10.5]), np.array([0.0, 0.0, 1.0]))
    (frame,) = with_depths(frames([10.0], [float("nan")]), "traced", clamp)
    assert (frame.status, np.isnan(frame.depth_mm)) == ("simulate_failed", True)
    assert "ends 0.50 mm behind the entry" in frame.message
    assert "entry_direction" in frame.message


def test_a_stated_depth_behind_the_entry_is_told_as_such() -> None:
    """Of a frame without a trace it was said that the traced wire ends there."""
    clamp = Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    seen = frames([depth - 1.2 for depth in DEPTHS[:5]], [1.0, *DEPTHS[1:5]])
    found = with_depths([replace(seen[0], curve=None), *seen[1:]], "traced", clamp)[0]
    assert "its insertion_mm, counted as the traces show that the others' were, ends 0.20 mm behind" in found.message
    assert "traced wire" not in found.message


def test_a_trace_that_hardly_begins_may_run_the_wrong_way() -> None:
    seen = [replace(f, expected_mm=14.0) for f in frames([0.1, 9.0, 14.0], DEPTHS[:3])]
    seen = [f.traced_by(of_length(f.curve, 14.0, TraceConfig())) for f in seen if f.curve]
    short, long, right = perhaps_turned(seen)
    assert short.message.endswith("or entry_direction points back along the wire: turn it round")
    assert long.status == short.status == "length_mismatch"
    assert "entry_direction" not in long.message
    assert right == seen[2]


def test_a_direction_turned_round_is_said_once_for_all_frames() -> None:
    """Two of six frames had advice of their own: to look for a second device, or for a fainter end."""
    back, odd = FrameStatus.TRACE_WRONG_WAY, FrameStatus.TRACE_AMBIGUOUS
    seen = [f.failed("trace", odd if f.index < 2 else back, "its own") for f in frames([0.1] * 6, DEPTHS)]
    turned = turned_round(seen)
    assert {(f.status, f.stage) for f in turned} == {("trace_wrong_way", "trace")}
    (said,) = {f.message for f in turned}
    assert "in 4 of 6 frames; expected more beyond it; entry_direction seems to be reversed" in said
    trusted = frames([9.9], DEPTHS[:1])
    assert turned_round([*seen, *trusted]) == [*seen, *trusted], "one that goes on beyond the entry speaks against it"
    few = [f.failed("trace", odd) for f in frames([0.1] * 5, DEPTHS[:5])] + seen[-1:]
    assert turned_round(few) == few
