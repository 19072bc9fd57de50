"""A lumen that a traced wire runs out of is opened there, and says where; one that holds it is left as it is."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.model import Curve, Lumen
from pipeline.segment.hollows import hollows
from pipeline.segment.opened import opened
from pipeline.segment.pieces import between_pieces, in_pieces
from solver.grid import Grid

H = 0.3


def tube(order: str) -> Lumen:
    """A tube of 1.5 mm along z that is closed between 8 and 10 mm, 3 mm exact outside."""
    x, y, z = np.meshgrid(*(H * np.arange(n) for n in (40, 40, 60)), indexing="ij")
    radial = np.hypot(x - 6.0, y - 6.0) - 1.5
    gap = 1.0 - np.abs(z - 9.0)
    values = np.minimum(np.maximum(radial, gap), 3.0).astype(np.float32)
    return Lumen(Grid(np.asarray(values, order=order), np.full(3, H), np.array([1.0, -2.0, 3.0])), warnings=("before",))


def wire(x: float, low: float, high: float) -> np.ndarray:
    z = np.arange(low, high, 0.3)
    return np.stack([np.full(len(z), x), np.full(len(z), 6.0), z], axis=1) + [1.0, -2.0, 3.0]


def traced(points: np.ndarray, sigma: float = 0.03) -> Curve:
    return Curve(points, np.full(len(points), sigma))


@pytest.mark.parametrize("order", ["C", "F"])
def test_a_wire_through_a_closed_place_opens_it(order: str) -> None:
    lumen, curve = tube(order), wire(6.4, 2.0, 16.0)
    found = opened(lumen, [traced(wire(6.0, 2.0, 7.0)), traced(curve)], 0.2)
    index = np.rint(found.distance.to_index(curve)).astype(int)
    assert np.all(found.distance.values[tuple(index.T)] < -0.1)
    assert found.warnings[0] == "before"
    assert "opened" in found.warnings[1]
    assert "[7.4, 4.0, 12.2]" in found.warnings[1] or "[7.4, 4.0, 11.9]" in found.warnings[1]
    far = np.abs(H * np.arange(60) - 9.0) > 4.5
    np.testing.assert_array_equal(found.distance.values[:, :, far], lumen.distance.values[:, :, far])


def test_a_wire_within_the_lumen_or_pressed_into_its_wall_changes_nothing() -> None:
    lumen = tube("C")
    assert opened(lumen, [traced(wire(6.0, 2.0, 7.5)), traced(wire(7.6, 2.0, 7.0))], 0.2) is lumen
    # 0.4 mm outside, more than a voxel: told apart from the wall by a trace that is known to 0.03, not to 0.06 mm
    assert opened(lumen, [traced(wire(7.9, 2.0, 7.0), 0.06)], 0.2) is lumen
    assert opened(lumen, [traced(wire(7.9, 2.0, 7.0))], 0.2) is not lumen
    assert opened(lumen, [], 0.2) is lumen


@pytest.mark.parametrize("order", ["C", "F"])
def test_a_wire_enters_through_the_end_of_the_scan(order: str) -> None:
    """A scan reaches half a voxel beyond the middle of its last slice; further on the vessel may end."""
    lumen = tube(order)
    entering, leaving = wire(6.0, -0.49 * H, 7.0), wire(6.0, 11.0, 59.45 * H)
    assert opened(lumen, [traced(entering), traced(leaving)], 0.2) is lumen
    for outside in (wire(7.9, -0.49 * H, 7.0), wire(6.0, -9.0, 7.0)):
        assert "opened" in opened(lumen, [traced(outside)], 0.2).warnings[1]


def test_who_gave_the_lumen_is_not_told_to_give_it() -> None:
    lumen, curve = tube("C"), traced(wire(6.4, 2.0, 16.0))
    assert "give the lumen as a file" in opened(lumen, [curve], 0.2).warnings[1]
    assert opened(lumen, [curve], 0.2, given=True).warnings[1].endswith("or correct the file of the lumen")


def test_a_soft_wall_that_a_wire_presses_into_is_not_opened() -> None:
    """It was: the simulated wire went where the tube's wall had been, 2 mm off, and a calibration blamed all else."""
    lumen, pressed = tube("C"), traced(wire(8.5, 2.0, 7.0))  # 1 mm outside
    found = opened(lumen, [pressed], 0.2, 0.03, given=True)
    assert found.distance is lumen.distance
    assert "no further than a wall of 0.03 N/mm² yields, and it was not opened" in found.warnings[1]
    assert "allowed 0.33" in opened(lumen, [pressed], 0.2, 2.0, given=True).warnings[1]


def cut(gap_mm: float) -> Lumen:
    """A tube of 1.5 mm along z with a slice missing about 9 mm."""
    x, y, z = np.meshgrid(*(H * np.arange(n) for n in (40, 40, 60)), indexing="ij")
    values = np.maximum(np.hypot(x - 6.0, y - 6.0) - 1.5, 0.5 * gap_mm - np.abs(z - 9.0))
    return Lumen(Grid(np.minimum(values, 3.0).astype(np.float32), np.full(3, H), np.array([1.0, -2.0, 3.0])))


@pytest.mark.parametrize("gap_mm", [0.65, 1.3])
def test_a_given_lumen_with_a_slice_missing_is_joined_where_wires_cross(gap_mm: float) -> None:
    """Two voxels were less than a trace may lie outside: all was ok, and the simulated wire turned back there."""
    lumen, crossing = cut(gap_mm), traced(wire(6.6, 2.0, 16.0))
    found = opened(lumen, [traced(wire(6.0, 2.0, 7.0)), crossing], 0.2, given=True)
    assert "from one piece of the given lumen to another, 1 time" in found.warnings[0]
    assert "[7.6, 4.0, 1" in found.warnings[0]
    across = found.distance.values[:, :, 30]
    # as wide as the vessel on both sides, about its own middle and not about the trace
    np.testing.assert_allclose(across[20, 20], -1.5, rtol=0.0, atol=0.15)
    assert np.all(across[20 - 4 : 20 + 5, 20] < 0.0)
    assert opened(lumen, [traced(wire(6.0, 2.0, 7.0))], 0.2, given=True) is lumen, "nothing crosses"


def test_a_curve_of_few_points_may_go_from_one_piece_to_beyond_the_end_of_another() -> None:
    """Its next point lay outside the grid, where numpy was asked for the deepest voxel of none."""
    lumen = tube("C")
    (gap,) = between_pieces(lumen.distance, [traced(wire(6.0, 4.0, 30.0)[[0, -1]])])
    assert gap.radii_mm == pytest.approx((1.5, 1.5), abs=0.2)
    assert lumen.distance.to_mm(gap.ends)[1, 2] > 17.0, "in the last millimetres of the piece"


def test_a_hollow_in_a_given_lumen_is_told() -> None:
    """A ball within a surface, or a wire that a segmentation leaves out, was a wall: 0.51 mm rms, nothing said."""
    grid = cut(-1.0).distance
    assert hollows(grid) == [], "closed at its ends, or open there"
    values = np.array(grid.values)
    values[18:21, 18:21, 40:45] = 0.3
    (said,) = hollows(grid.with_values(values))
    assert "1 hollow inside it" in said
    assert "the largest is 1.2 mm³ at [6.7, 3.7, 15.6] mm" in said
    values[18:21, 18:21, 40:] = 0.3
    assert hollows(grid.with_values(values)) == [], "it goes on to the outside"
    values = np.array(grid.values)
    values[18:20, 18, 40] = 0.3
    assert hollows(grid.with_values(values)) == []


def test_a_given_lumen_in_pieces_is_told_where_no_wire_crosses() -> None:
    (said,) = in_pieces(cut(0.65).distance, [7.0, 4.0, 4.0])
    assert "in 2 pieces" in said
    assert "12.0] mm; is a slice missing" in said
    assert in_pieces(tube("C").distance, [7.0, 4.0, 4.0])
    assert in_pieces(cut(-1.0).distance, [7.0, 4.0, 4.0]) == []
    apart = cut(0.65).distance
    far = np.array(apart.values)
    far[:, :, 20:40] = 3.0
    assert in_pieces(apart.with_values(far), [7.0, 4.0, 4.0]) == [], "6 mm apart: vessels of their own"
