"""A frame of another wire: at equal distances from the tip one wire is equally bright in all frames."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from pipeline.model import Curve
from pipeline.run.stages.brightness import FACTOR, of_another_brightness
from pipeline.run.stages.known import Frame
from pipeline.segment import segment
from pipeline.status import FrameStatus
from pipeline.trace import trace
from tests.studies.seeing.scenes import Draft

RADIUS_MM = 0.2
SECTION_MM2 = np.pi * RADIUS_MM**2
BODY, COIL, CONTRAST = 3000.0 * SECTION_MM2, 9000.0 * SECTION_MM2, 900.0


def frame(number: int, length_mm: float, times: float = 1.0, contrast: float = CONTRAST, coil_mm: float = 0.0) -> Frame:
    """Of a straight wire, its last ``coil_mm`` of platinum; all of it ``times`` as bright."""
    z = np.linspace(0.0, length_mm, round(length_mm / 0.3) + 1)
    bright = times * np.where(length_mm - z < coil_mm, COIL, BODY)
    points = np.stack([np.zeros_like(z), np.zeros_like(z), z], axis=1)
    return Frame(number, curve=Curve(points, np.full(len(z), 0.02), 0.05, brightness=bright, contrast=contrast))


@pytest.mark.parametrize("times", [3.8, 0.25, 1.05 * FACTOR, 0.95 / FACTOR])
def test_the_frame_of_another_wire_is_named(times: float) -> None:
    """It was ok without a word, at 3.8 times the brightness of the others and at a quarter of it."""
    seen = [frame(n, length, times if n == 2 else 1.0) for n, length in enumerate((12.0, 18.0, 24.0, 30.0))]
    (said,) = of_another_brightness(seen, RADIUS_MM)
    assert f"in frame 2 {times:.2g} times as bright as in most" in said
    assert "frame 0" not in said
    both = of_another_brightness(seen[1:3], RADIUS_MM)
    assert "frame 1" in both[0], "of two frames nobody knows which is the odd one"
    assert "frame 2" in both[0]


def test_what_scans_of_one_wire_differ_by_is_not_told() -> None:
    lengths = (12.0, 18.0, 24.0, 30.0)
    tipped = [frame(n, length, coil_mm=20.0) for n, length in enumerate(lengths)]
    assert of_another_brightness(tipped, RADIUS_MM) == [], "a coil of three times the brightness, which is pushed in"
    scales = (1.0, 0.4, 2.5, 0.1)
    scaled = [frame(n, x, s, CONTRAST * s) for n, (x, s) in enumerate(zip(lengths, scales, strict=True))]
    assert of_another_brightness(scaled, RADIUS_MM) == [], "scans on other scales"
    faint = 500.0 * SECTION_MM2 / BODY  # as bright above medium of 900 as (900 - 100) more above medium of 100
    washed = [frame(0, 20.0, faint), frame(1, 25.0, faint), frame(2, 30.0, 1300.0 / 500.0 * faint, 100.0)]
    assert of_another_brightness(washed, RADIUS_MM) == [], "the medium is washed out about a wire hardly brighter"
    hidden = [frame(0, 20.0, faint), frame(1, 25.0, faint), frame(2, 30.0, 100.0 / 500.0 * faint, 1300.0)]
    assert of_another_brightness(hidden, RADIUS_MM) == [], "thicker medium hides most of a wire hardly brighter"
    still = [washed[0], washed[1], frame(2, 30.0, 1300.0 / 500.0 * faint)]
    assert "frame 2 2.6 times" in of_another_brightness(still, RADIUS_MM)[0]


def test_what_cannot_be_compared_is_not_judged() -> None:
    assert of_another_brightness([frame(0, 20.0)], RADIUS_MM) == []
    assert of_another_brightness([frame(0, 20.0), frame(1, 3.0, 4.0)], RADIUS_MM) == [], "a stub"
    given = frame(1, 20.0, 4.0)
    assert given.curve is not None
    own = replace(given, curve=replace(given.curve, brightness=np.zeros(0)))
    assert of_another_brightness([frame(0, 20.0), own], RADIUS_MM) == []
    refused = given.failed("trace", FrameStatus.TRACE_AMBIGUOUS, "?")
    assert of_another_brightness([frame(0, 20.0), refused], RADIUS_MM) == []
    inside = [replace(frame(n, 20.0, 4.0 if n == 2 else 1.0), catheter_mm=18.0) for n in range(3)]
    assert of_another_brightness(inside, RADIUS_MM) == [], "a catheter lies over all but its last 2 mm"


def test_traces_say_how_bright_a_wire_is_whatever_the_blur() -> None:
    """A wire of 0.35 mm among ones of 0.18: 3.8 times the cross-section."""
    draft = Draft(np.random.default_rng(5), wire_radius=0.18)
    whole, lumen, seen = draft.path, None, []
    for number, (length_mm, radius_mm) in enumerate([(14.0, 0.18), (17.0, 0.35), (20.0, 0.18)]):
        draft.path, draft.wire_radius = whole[: round((3.0 + length_mm) / 0.05)], radius_mm
        draft.opacity = np.ones(len(draft.path))
        scene = draft.scan(12 if radius_mm < 0.2 else 30)
        lumen = lumen or segment(scene.reference, scene.entry[None])
        curve = trace(scene.frame, lumen, scene.entry, scene.direction, reference=scene.reference)
        assert curve.status is FrameStatus.OK
        assert len(curve.brightness) == len(curve.points_mm)
        assert np.median(curve.brightness) == pytest.approx(3000.0 * np.pi * radius_mm**2, rel=0.15)
        assert curve.contrast == pytest.approx(900.0, rel=0.1)
        seen.append(Frame(number, curve=curve))
    (said,) = of_another_brightness(seen, 0.18)
    told = re.search(r"in frame 1 (\S+) times as bright", said)
    assert told is not None
    assert float(told[1]) == pytest.approx((0.35 / 0.18) ** 2, rel=0.1)
    assert of_another_brightness(seen[::2], 0.18) == []
