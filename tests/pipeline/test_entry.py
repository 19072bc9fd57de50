"""The clamp measured in the traces: better than what it corrects, and never far from what the user said."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.model import Clamp, Curve
from pipeline.simulate import measured_clamp


def arc_wire(length: float, noise: float, seed: int, curvature: float = 0.03) -> Curve:
    """A circular wire that leaves the origin along z."""
    s = np.arange(0, length, 0.3)
    x = (1 - np.cos(curvature * s)) / curvature
    points = np.column_stack([x, 0 * s, np.sin(curvature * s) / curvature])
    points += np.random.default_rng(seed).normal(scale=noise, size=points.shape)
    return Curve(points, np.full(len(s), noise))


@pytest.mark.parametrize("seed", range(5))
def test_position_and_direction_are_found_better_than_the_manifest_has_them(seed: int) -> None:
    tilt = np.radians(2.0)
    curves = [arc_wire(12.0 + 2 * i, 0.02, 100 * seed + i) for i in range(20)]
    given = Clamp(np.array([0.1, 0.1, 0.0]), np.array([np.sin(tilt), 0.0, np.cos(tilt)]))
    entry = measured_clamp(curves, given)
    assert np.linalg.norm(entry.entry_mm) < 0.03
    assert np.degrees(np.arccos(entry.direction @ [0, 0, 1])) < 1.0  # half of what the manifest is off
    assert "degrees from the manifest" in entry.note


def test_wires_too_short_to_tell_leave_the_manifest_alone() -> None:
    entry = measured_clamp([arc_wire(4.0, 0.0, 0)], Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0])))
    assert entry.note == ""
    np.testing.assert_array_equal(entry.entry_mm, 0.0)


def test_an_entry_far_off_is_not_followed_but_said() -> None:
    curves = [arc_wire(20.0, 0.0, i) for i in range(3)]
    entry = measured_clamp(curves, Clamp(np.array([3.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])))
    np.testing.assert_array_equal(entry.entry_mm, [3.0, 0.0, 0.0])
    assert "check entry_mm" in entry.warning
