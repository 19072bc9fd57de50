"""Gaps in traced wires: a second device that faces the wire's tip looks like 17 to 19 mm more of it, and was ok."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pipeline.model import Curve
from pipeline.run.stages.gaps import own_gaps
from pipeline.run.stages.known import Frame
from pipeline.run.stages.repeated import once
from pipeline.status import FrameStatus
from pipeline.trace import BEYOND_GAP, GAP, of_catheter
from pipeline.trace.whose_end import first_gap_mm
from tests.later import later
from tests.pipeline.doubts import frames, thick, with_gap
from tests.studies.seeing.render import arc_of
from tests.studies.seeing.scenes import Draft
from tests.studies.seeing.table import seen

NAN = float("nan")


def facing(gap_mm: float):
    """A wire of 17 mm, and over 15 mm of a device as bright on its way, from that far beyond its tip on."""
    draft = Draft(np.random.default_rng(3), length=60.0)
    whole, tip = draft.path, round(20.0 / 0.05)
    draft.path, draft.opacity = whole[:tip], np.ones(tip)
    draft.others = [(whole[tip + round(gap_mm / 0.05) :], draft.wire_radius, 1.0)]
    return draft.scan(16)


@pytest.mark.slow
@pytest.mark.parametrize("gap_mm", [1.2, *later(2.5)])
def test_a_device_that_faces_the_tip_is_not_taken_for_the_wire_unless_the_depth_says_so(gap_mm):
    scene = facing(gap_mm)
    _, curve = seen(scene)
    assert curve.status is FrameStatus.TRACE_AMBIGUOUS, f"{curve.length_mm:.1f} of {arc_of(scene.wire)[-1]:.1f} mm, ok"
    assert "second device faces the wire's tip" in curve.note
    _, whole = seen(scene, expected_mm=curve.length_mm)
    assert whole.status is FrameStatus.OK, "the same picture: the wire has a gap, says the stated depth"


def test_a_gap_is_darker_than_the_line_on_both_sides():
    arc = np.linspace(0.0, 30.0, 301)
    line = np.ones(301)
    dark = (arc > 18.0) & (arc < 20.0)
    assert first_gap_mm(np.where(dark, 0.3, line), arc, 0.05) == pytest.approx((18.0, 20.0), abs=0.2)
    none = np.inf, np.inf
    assert first_gap_mm(np.where(dark, 0.8, line), arc, 0.05) == none
    assert first_gap_mm(np.where(arc < 18.0, 5.0, line), arc, 0.05) == none, "where a coil of platinum ends"
    assert first_gap_mm(np.where(arc < 18.0, 1.0, 0.2), arc, 0.05) == none, "a dim end"
    noisy = line + 0.15 * np.random.default_rng(0).normal(size=301)
    assert first_gap_mm(noisy, arc, 0.15) == none


def gapped(lengths: list[float], beyond: list[float], then: Callable[[Curve], Curve] = lambda c: c) -> list[Frame]:
    """Frames whose wires have gaps, as tracing judges them, and what is asked of their curves then."""
    return [
        frame.traced_by(then(with_gap(frame.curve, far) if far else frame.curve))
        for frame, far in zip(frames(lengths, [NAN] * len(lengths)), beyond, strict=True)
        if frame.curve is not None
    ]


@pytest.mark.parametrize(
    ("beyond", "told"),
    [
        (
            [20.0, 20.3, 19.8],
            ["frames 0, 1, 2: the last 20.0 mm of the traced wire lie beyond a gap that goes with its"],
        ),
        ([20.0, 25.2, 30.0], []),
    ],
    ids=["the wire's", "a streak's"],
)
def test_a_gap_at_the_same_distance_from_tip_or_entry_is_no_second_device(beyond, told):
    """But for a device 4 mm ahead of the tip, pushed with it: three frames were ok 8 mm too far, and nothing said."""
    found, said = own_gaps(gapped([40.0, 45.0, 50.0], beyond), 0.3)
    assert [f.status for f in found] == ["ok"] * 3
    assert all(f.trusted_curve is not None and f.trusted_curve.status is FrameStatus.OK for f in found)
    assert [text[: len(told[0])] for text in said] == told
    assert all("pushed with the wire, its tip would lie 23.0 mm before" in text for text in said)


@pytest.mark.parametrize(
    ("lengths", "beyond"),
    [
        ([52.8, 52.6, 52.2], [38.0, 28.0, 18.0]),  # the wire comes nearer and the line's end stays
        ([50.0, 50.0, 50.2], [20.0, 20.0, 20.0]),  # nothing was pushed
        ([40.0, 50.0], [20.0, 20.0]),
    ],
)
def test_a_gap_that_may_be_before_another_device_stays_refused(lengths, beyond):
    found, _ = own_gaps(gapped(lengths, beyond), 0.3)
    assert not any(f.ok for f in found)


def test_a_refusal_is_no_doubt_that_frames_can_settle():
    """It has no level: the empty name stood for all of them."""
    with pytest.raises(ValueError, match="of: got an empty name"):
        Curve(np.eye(3), np.zeros(3)).doubted(FrameStatus.TRACE_AMBIGUOUS, "two wires").without("")


def test_a_copy_of_a_frame_is_no_third_with_the_same_gap():
    seen = gapped([40.0, 46.0, 40.0], [20.0] * 3)
    found = once([replace(f, voxels=v) for f, v in zip(seen, "aba", strict=True)])
    assert [f.status for f in own_gaps(found, 0.3)[0]] == ["trace_ambiguous", "trace_ambiguous", "repeated"]


@pytest.mark.parametrize("beyond", [8.0, 20.0], ids=["a gap that is ok", "a gap that is doubted"])
def test_frames_with_one_gap_are_refused_for_what_else_is_wrong_with_them(beyond: float):
    """A rod five times as thick as the stated wire was ok, for all frames showed the same gap in it."""
    lengths = [30.0, 36.0, 42.0, 48.0]
    assert not any(f.ok for f in own_gaps(gapped(lengths, [beyond] * 4, lambda curve: thick(curve, 0.9)), 0.3)[0])
    # with the catheter's end where the line ends, other depths tell nothing of it either
    ends = gapped(lengths, [beyond] * 4, lambda curve: of_catheter(curve, curve.length_mm))
    assert not any(f.ok for f in own_gaps(ends, 0.3)[0])


def test_what_lay_ahead_of_the_tip_in_another_frame_is_no_wire():
    """A device of 10 mm: bright line off the curve in frame 0, the wire's last 10 mm in frame 1, which was ok."""
    seen = gapped([15.0, 46.0], [0.0, 10.0])
    ahead = np.stack([np.zeros(20), np.zeros(20), np.linspace(36.5, 46.0, 20)], 1)
    first = seen[0].curve
    assert first is not None
    seen[0] = replace(seen[0], curve=replace(first, elsewhere_mm=ahead)).failed("trace", FrameStatus.TRACE_AMBIGUOUS)
    found, said = own_gaps(seen, 0.3)
    assert found[1].status == "trace_ambiguous"
    assert "lies there in frame 0, of 15.0 mm of wire" in found[1].message
    assert not said
    # a streak hides the same place in both: the first frame's wire ended there, and went on
    near = frames([32.5], [NAN])[0].curve
    assert near is not None
    assert own_gaps([replace(seen[0], curve=replace(near, elsewhere_mm=ahead)), seen[1]], 0.3)[0][1].ok
    # nor is what a deeper wire goes past
    deep = frames([60.0], [NAN])[0].curve
    assert deep is not None
    assert not own_gaps([replace(seen[0], curve=replace(deep, elsewhere_mm=ahead)), seen[1]], 0.3)[0][1].ok
    # and a wire's own part has moved with it
    moved = [replace(seen[0], curve=replace(first, elsewhere_mm=ahead - [0, 0, 20.0])), seen[1]]
    assert own_gaps(moved, 0.3)[0][1].ok


def test_a_gap_that_nothing_explains_is_a_warning_and_a_stated_depth_ends_all_doubt():
    found, said = own_gaps(gapped([40.0], [10.0]), 0.3)
    assert found[0].ok
    assert said[0].startswith("frame 0 (10.0 mm): so much")
    assert "state insertion_mm" in said[0]
    stated = [replace(f, expected_mm=40.0) for f in found]
    assert own_gaps(stated, 0.3) == (stated, [])


def test_frames_that_end_at_one_point_beyond_gaps_that_grow_are_refused():
    """A fragment that stayed at 22 to 26 mm while the rest was pulled back: four frames were ok."""
    seen = [replace(f) for f in frames([12.0, 26.1, 26.0, 26.2, 26.1], [NAN] * 5)]
    for n, gap_mm in ((2, 1.5), (3, 3.4), (4, 5.3)):
        curve = seen[n].curve
        assert curve is not None
        seen[n] = replace(seen[n], curve=replace(curve, levels={BEYOND_GAP: 4.0, GAP: gap_mm}))
    found, said = own_gaps(seen, 0.35)
    assert [f.status for f in found] == ["ok", "ok", *["trace_ambiguous"] * 3]
    assert "in 4 frames (1, 2, 3, 4), in 4.0 mm of line that stay where they are while" in found[2].message
    assert len(said) == 1, "the wire may touch the fragment in frame 1, which was ok without a word"
    assert said[0].startswith("frame 1: the traced wire ends where a line stays where it is in frames 2, 3, 4; how")
    # a wire that is held, beside a clot that hides more of it or a streak that moves, has another line beyond the gap
    for beyond_mm in ((6.5, 4.6, 2.7), (10.0, 7.0, 4.0)):
        held = [
            replace(f, curve=replace(f.curve, levels={BEYOND_GAP: beyond, GAP: gap_mm}))
            for f, beyond, gap_mm in zip(seen[2:], beyond_mm, (1.5, 3.4, 5.3), strict=True)
            if f.curve is not None
        ]
        assert all(f.ok for f in own_gaps(held, 0.35)[0])
    stated = [replace(f, expected_mm=26.0) for f in seen]
    assert all(f.ok for f in own_gaps(stated, 0.35)[0])
    assert all(f.ok for f in own_gaps(gapped([40.0, 44.0, 48.0], [10.0, 14.0, 3.0]), 0.35)[0])


def marked(lengths: list[float], expected: float = NAN) -> list[Frame]:
    """Frames in which a marker stands 36 mm deep, seen where the wire ends well before it."""
    at = np.array([[0.0, 0.3, 36.0]])
    return [
        replace(f, curve=replace(f.curve, marks_mm=at if f.curve.length_mm < 32.0 else at[:0]))
        for f in frames(lengths, [expected] * len(lengths))
        if f.curve is not None
    ]


@pytest.mark.parametrize("expected", [NAN, 35.0], ids=["no depth", "a depth"])
def test_a_curve_does_not_end_at_a_marker_that_stood_there_before(expected: float):
    """The marker of a catheter that stays where it is was 1.6 mm of wire, and ok, with a stated depth, too."""
    seen = marked([20.0, 25.0, 36.6, 40.0], expected)
    found, _ = own_gaps(seen, 0.4)
    assert [f.status for f in found] == ["ok", "ok", "trace_ambiguous", "ok"], "the last goes past it"
    assert "lies in frames 0 and 1, beyond 20.0 and 25.0 mm of wire" in found[2].message
    assert all(f.ok for f in own_gaps(marked([33.0, 34.0, 36.6], expected), 0.4)[0]), "seen by none"
    assert all(f.ok for f in own_gaps([replace(f, catheter_mm=36.5) for f in seen], 0.4)[0]), "a stated catheter's"


@pytest.mark.parametrize("lengths", [[20.0, 36.6], [20.0, 20.4, 36.6]])
def test_a_marker_seen_from_one_depth_may_be_the_wires_own_tip(lengths: list[float]):
    """Its own tip beyond 13 mm that nobody saw, in a frame of the same depth, made a right frame ambiguous."""
    assert all(f.ok for f in own_gaps(marked(lengths), 0.4)[0])
