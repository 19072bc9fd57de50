"""Pieces of crest made one path: where a wire lies twice, whichever way a piece runs, and what is bridged."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.model import arc_length
from pipeline.trace.attempt import _off
from pipeline.trace.crests import Tracklet
from pipeline.trace.link import extended, join, link, with_doubles

UP = np.array([0.0, 0.0, 1.0])


def piece(low, high, grey=100.0):
    """A straight crest along z."""
    z = np.arange(low, high + 1e-9, 0.25)
    return Tracklet(np.outer(z, UP), np.tile(UP, (len(z), 1)), np.full(len(z), grey))


@pytest.mark.parametrize("others", [1, 2, 5])
def test_a_short_bright_piece_may_hold_two_strands_and_is_offered_twice(others):
    dim, bright = [piece(0.0, 20.0)] * others, piece(20.0, 22.0, 200.0)
    assert with_doubles([*dim, bright]) == [*dim, bright, bright]
    assert len(with_doubles([*dim, piece(20.0, 22.0, 110.0)])) == others + 1, "hardly brighter than the others"
    assert len(with_doubles([piece(0.0, 200.0), piece(0.0, 60.0, 200.0)])) == 2, "long: a brighter wire"


def test_a_piece_alone_is_offered_once():
    assert len(with_doubles([piece(0.0, 5.0)])) == 1


@pytest.mark.parametrize("turned", [(), (0,), (1,), (0, 1)])
def test_a_path_goes_on_over_a_gap_whichever_way_its_pieces_run(turned):
    pieces = [piece(0.0, 8.0), piece(9.5, 20.0)]
    pieces = [p.reversed() if n in turned else p for n, p in enumerate(pieces)]
    path = link(pieces, np.array([0.1, 0.0, 0.5]), UP, 3.0, 1.0)
    assert path.bridges == 1
    assert np.all(np.diff(path.points[:, 2]) > -1e-9)
    assert path.points[[0, -1], 2] == pytest.approx([0.0, 20.0])
    inside = path.points[path.bridged, 2]
    assert inside.min() > 8.0 - 1e-9
    assert inside.max() < 9.5 + 1e-9
    assert np.ptp(inside) > 1.0
    np.testing.assert_allclose(path.points[:, :2], 0.0, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("overlap_mm", [0.2, 0.4])
def test_a_path_does_not_run_back_where_pieces_overlap(overlap_mm):
    path = link([piece(0.0, 8.0), piece(8.0 - overlap_mm, 20.0)], np.array([0.1, 0.0, 0.5]), UP, 3.0, 1.0)
    assert np.all(np.diff(path.points[:, 2]) > 0.0)
    assert path.points[[0, -1], 2] == pytest.approx([0.0, 20.0], abs=0.25)


def test_a_path_begins_with_the_wire_not_with_a_speck_that_lies_nearer_the_entry():
    """48 mm of wire in a cone-beam scan were followed for 2 mm: along a streak of 1 mm, a quarter as bright."""
    entry = np.array([0.0, 0.0, 0.5])
    wire, speck = piece(-1.0, 20.0), piece(0.0, 1.0, 25.0)
    beside = Tracklet(wire.points + [0.8, 0.0, 0.0], wire.tangents, wire.values)
    assert link([speck, beside], entry, UP, 3.0, 4.0).points[-1] == pytest.approx([0.8, 0.0, 20.0])
    for shaft in (piece(0.0, 4.0, 25.0), piece(0.0, 1.0, 60.0)):
        assert link([shaft, beside], entry, UP, 3.0, 4.0).points[-1, 0] == 0.0, "a short wire or a dim one is a wire"
    coil = piece(1.5, 20.0)
    assert link([speck, coil], entry, UP, 3.0, 4.0).points[0, 2] == 0.0, "a dim shaft that leads to a bright coil"
    assert link([speck], entry, UP, 3.0, 4.0) is not None


def beyond(gap, angle, tangent_angle):
    """A straight crest that begins ``gap`` mm from the origin, ``angle`` off z, and runs ``tangent_angle`` off it."""
    way, run = (np.array([np.sin(a), 0.0, np.cos(a)]) for a in (angle, tangent_angle))
    along = np.arange(0.0, 8.0, 0.25)
    return Tracklet(gap * way + np.outer(along, run), np.tile(run, (len(along), 1)), np.full(len(along), 100.0))


@pytest.mark.parametrize(("further", "taken"), [(0.9, "s"), (1.1, "s"), (1.5, "s"), (1.8, "c")])
def test_a_bridge_may_bend_there_and_back_sooner_than_twice_one_way(further, taken):
    """Both turn by half a radian at either end: an S costs 1 + 2 a mm, a C 1 + 2 + 2."""
    s, c = beyond(1.0 * further, 0.5, 0.0), beyond(1.0, -0.5, -1.0)
    joined = join([piece(-8.0, 0.0), s, c], 3.0)
    assert joined[1] == {"s": 2, "c": 4}[taken]


def test_no_path_begins_far_from_the_entry_or_across_it():
    assert link([piece(0.0, 8.0)], np.array([2.0, 0.0, 4.0]), UP, 3.0, 1.0) is None
    assert link([piece(0.0, 8.0)], np.array([0.0, 0.0, 4.0]), np.array([1.0, 0.0, 0.0]), 3.0, 1.0) is None


def test_a_path_is_continued_straight_by_what_is_asked():
    points = np.outer(np.arange(0.0, 5.0, 0.1), [0.6, 0.0, 0.8])
    longer = extended(points, 2.0, 0.25)
    assert arc_length(longer)[-1] == pytest.approx(arc_length(points)[-1] + 2.0, abs=0.25)
    np.testing.assert_allclose(longer[-1] / np.linalg.norm(longer[-1]), [0.6, 0.0, 0.8], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("voxel", [0.11, 0.3, 0.42, 0.46, 0.5])
def test_a_path_is_continued_by_as_many_steps_whatever_the_voxel(voxel):
    """Of 0.42 mm four voxels were five: what was read there as the wire's end lay a voxel beyond it."""
    points = np.outer(voxel * np.arange(20.0), [0.6, 0.0, 0.8])
    assert len(extended(points, 4.0 * voxel, voxel)) == len(points) + 4


@pytest.mark.parametrize(("levels", "grey", "counts"), [
    ([1.0], 25.0, True), ([1.0], 15.0, False), ([0.15, 1.0], 15.0, True), ([0.0, 1.0], 15.0, False),
])  # fmt: skip
def test_what_is_off_the_wire_counts_by_its_dimmest_part_that_is_wire(levels, grey, counts):
    """A wire that is missing over half a millimetre at the entry had each of its own streaks against it."""
    tube = SimpleNamespace(
        peak=100.0, length_mm=20.0, intervals=1.0, at=lambda s: np.outer(20.0 * s, UP),
        steps=SimpleNamespace(levels=np.array(levels)),
    )  # fmt: skip
    away = Tracklet(piece(0.0, 5.0).points + [3.0, 0.0, 0.0], np.tile(UP, (21, 1)), np.full(21, grey))
    off = _off(SimpleNamespace(voxel=0.3), tube, [piece(0.0, 20.0), away], np.zeros((0, 3)))
    assert [length for _, length in off] == [5.0] * counts
