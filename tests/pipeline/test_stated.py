"""A wire's stated brightness: checked at the door, and what it says of where the wire ends."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.study.manifest import read_manifest
from pipeline.trace.stated import Opacity, _end
from tests.later import later
from tests.pipeline.test_manifest import GOOD, problems, written
from tests.studies.seeing.scenes import CASES
from tests.studies.seeing.table import look

COIL = [(0.0, 3.0), (20.0, 3.0), (20.0, 1.0)]


def with_opacity(text: str) -> str:
    return GOOD.replace("radius_mm = 0.18", f"radius_mm = 0.18\nopacity = {text}")


def test_opacity_is_read_and_may_be_left_out(tmp_path: Path) -> None:
    stated = read_manifest(written(tmp_path, with_opacity("[[0, 3.0], [20, 3.0], [20, 1.0]]"))).cases[0]
    assert stated.wire.opacity == COIL
    assert read_manifest(written(tmp_path, GOOD)).cases[0].wire.opacity is None


@pytest.mark.parametrize("text", ["0.0", "-1", "[]", "[[20, 1.0], [0, 3.0]]", "[[0, 3.0], [20, nan]]", '"bright"'])
def test_an_opacity_that_cannot_be_is_refused_by_name(tmp_path: Path, text: str) -> None:
    assert "opacity" in problems(tmp_path, with_opacity(text))


def test_a_profile_in_pieces_is_the_profile() -> None:
    """Pieces of a coil, a ramp and a body, of a line that ends 5 mm before its tip."""
    opacity = Opacity.of([(0.0, 3.0), (20.0, 3.0), (20.0, 2.0), (30.0, 1.0)])
    assert opacity is not None
    steps = opacity.steps(45.0, 5.0)
    share = np.linspace(0.0, 1.0, 2000)
    expected = opacity.at(5.0 + 45.0 * (1.0 - share))
    np.testing.assert_allclose(steps.at(share) * np.median(expected), expected, rtol=0.08)
    assert steps.stated
    assert steps.missing_mm == 5.0
    assert len(Opacity.of(2.0).steps(45.0, 0.0).edges) == 0


@pytest.mark.parametrize(("seen", "end"), [(60.0, 40.0), (36.0, 40.0), (25.0, 40.0)])
def test_the_end_of_a_coil_tells_where_the_tip_is_even_where_that_is_not_seen(seen: float, end: float) -> None:
    opacity, blur = Opacity.of(COIL), 0.35
    assert opacity is not None
    arc = np.arange(0.0, seen, 0.075)
    grey = 100.0 * opacity.crests(end - arc, blur) + np.random.default_rng(1).normal(scale=10.0, size=len(arc))
    assert abs(_end(opacity, grey, arc, np.arange(1.0, seen + 20.0, 0.5 * blur), blur) - end) < blur


@pytest.mark.quick(1)
@pytest.mark.parametrize(
    ("case", "seed"),
    [
        ("platinum coil tip, opacity stated", 0),
        # its end alone may lie 2.4 mm off: the stated step tells
        ("dim distal part, opacity stated", 574),
        *later(*(("dim distal part, opacity stated", seed) for seed in (2, 568))),
        *later(("platinum coil tip, opacity stated", 2)),
    ],
)
def test_a_stated_profile_is_traced_to_its_tip(case: str, seed: int) -> None:
    assert case in CASES
    row = look(case, seed)
    assert row.verdict == "right", row.text


def test_a_line_that_ends_before_the_stated_profile_does_is_refused() -> None:
    """A wire of even brightness, said to end in 12 mm that are an eighth as bright: none are seen."""
    row = look(
        "platinum coil tip, opacity stated", 2, opacity=[(0.0, 1.0), (12.0, 1.0), (12.0, 8.0), (32.0, 8.0), (32.0, 1.0)]
    )
    assert row.status == "TRACE_AMBIGUOUS", row.text
