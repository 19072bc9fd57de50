"""A wire that passes through itself is found, whatever the length of its segments."""

from __future__ import annotations

import math
import pickle
import tracemalloc
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from solver import Grid, GuideWire, Insertion, Insertions, VesselWall
from solver.self_contact import self_overlap_mm
from tests.naive.passes import closest_mm
from tests.naive.writhe import writhe
from tests.solver.scenes import tube_grid

RADIUS = 0.18


def coil(turns: float, pitch: float, segment: float, radius: float = 4.0) -> np.ndarray:
    """A helix of a radius, mm; pitch in mm per turn."""
    length = turns * math.hypot(2 * math.pi * radius, pitch)
    angle = np.linspace(0.0, 2 * math.pi * turns, max(round(length / segment), 2))
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), pitch * angle / (2 * math.pi)])


@pytest.mark.parametrize("segment", [1.0, 0.5, 0.1])
@pytest.mark.parametrize("pitch", [0.05, 0.2, 0.35, 0.37, 1.0])
def test_turns_of_a_coil_overlap_by_what_their_pitch_lacks(pitch: float, segment: float) -> None:
    rise = pitch / math.hypot(1.0, pitch / (2 * math.pi * 4.0))  # distance of neighbouring turns
    # chords lie inside the helix, all by the same sagitta, and turns need not have their joints above each other
    sagitta = segment**2 / (8 * 4.0)
    expected = max(2 * RADIUS - rise, 0.0)
    assert self_overlap_mm(coil(3, pitch, segment), RADIUS) == pytest.approx(expected, abs=sagitta + 1e-6)


def test_two_strands_that_cross_between_their_joints_are_seen() -> None:
    """A loop whose strands cross at right angles, 0.05 mm apart, at the middle of segments of 1 mm."""
    joints = np.array([[-1.5, 0, 0], [-0.5, 0, 0], [0.5, 0, 0], [1.5, 0, 0], [2.2, 0.7, 0], [1.5, 1.5, 0.05]])
    joints = np.concatenate([joints, [[0.0, 1.5, 0.05], [0.0, 0.5, 0.05], [0.0, -0.5, 0.05]]])
    assert self_overlap_mm(joints, RADIUS) == pytest.approx(2 * RADIUS - 0.05, abs=1e-12)


def test_a_bend_as_tight_as_the_wire_is_no_contact() -> None:
    assert self_overlap_mm(coil(0.5, 0.0, 0.02, RADIUS * 1.001), RADIUS) == 0.0
    assert self_overlap_mm(np.zeros((1, 3)), RADIUS) == 0.0
    assert self_overlap_mm(np.array([[0.0, 0, 0], [0, 0, 1]]), RADIUS) == 0.0


def test_the_number_of_points_on_a_wire_asks_no_memory() -> None:
    """Of 200 000 points on 37 mm each had 2000 within two radii: a MemoryError, and no result for the case."""
    whole, fine = coil(3, 0.2, 0.02), coil(3, 0.2, 0.0004)
    assert len(fine) > 180_000
    tracemalloc.start()
    found = self_overlap_mm(fine, RADIUS)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found == pytest.approx(self_overlap_mm(whole, RADIUS), abs=1e-4)
    assert most < 500e6


@settings(max_examples=40, deadline=None)  # the oracle is slow
@given(st.integers(0, 10_000), st.floats(0.1, 1.0), st.integers(3, 40))
def test_all_pairs_of_dense_points_find_no_closer_pass(seed: int, segment: float, count: int) -> None:
    rng = np.random.default_rng(seed)
    along = np.cumsum(rng.normal(size=(count, 3)) * 0.6, axis=0) + np.array([0.0, 0.0, 1.0])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    joints = np.concatenate([np.zeros((1, 3)), np.cumsum(segment * along, axis=0)])
    overlap, step = self_overlap_mm(joints, RADIUS), 0.02
    # segments count whole: their nearest ends must be further apart than pi radii, so the dense pairs are fewer or more
    wide = closest_mm(joints, math.pi * RADIUS + 2 * segment, step)
    narrow = closest_mm(joints, math.pi * RADIUS, step)
    assert 2 * RADIUS - wide - 1e-9 <= overlap + 1e-12 or wide == math.inf
    assert overlap <= max(2 * RADIUS - narrow, 0.0) + 2 * step


@cache
def sac() -> VesselWall:
    """A sac of 6 mm radius behind an inlet of 1 mm radius that enters it 0.8 mm aside."""
    axes = np.arange(-9.0, 9.0, 0.4), np.arange(-9.0, 9.0, 0.4), np.arange(-20.0, 9.0, 0.4)
    x, y, z = np.meshgrid(*axes, indexing="ij")
    tube = np.maximum(np.hypot(x + 0.23, y - 0.75) - 1.0, z)
    sphere = 0.75 * (np.sqrt((x / 0.79) ** 2 + (y / 0.75) ** 2 + (z / 0.94) ** 2) - 6.0)
    distance = gaussian_filter(np.minimum(sphere, tube), 0.7)
    return VesselWall(Grid(distance, [0.4] * 3, [axes[0][0], axes[1][0], axes[2][0]]), 20.0)


def in_sac() -> Insertion:
    wire = GuideWire(0.5, RADIUS, [[0, 0.3], [20, 0.3], [40, 2.0]], [[0, 0.2], [15, 0.2], [15, 0.0]])
    return Insertion(wire, sac(), [-0.23, 0.75, -14.0], [0, 0, 1])


@pytest.mark.slow
def test_a_wire_that_passed_through_itself_between_two_depths_says_so_from_there_on() -> None:
    """At 55 mm it is at rest and free of itself, but one strand lies on the other side of another one."""
    alone = in_sac()
    before, after = alone.to_depths([45.0, 55.0], 160.0)
    assert math.isinf(before.passed_itself_mm)
    assert abs(writhe(after.joints_mm) - writhe(before.joints_mm)) == pytest.approx(2.0, abs=0.2)
    assert (after.converged, after.self_overlap_mm) == (True, 0.0)
    assert 49.0 < after.passed_itself_mm < 51.0
    for twin in (alone.clone(), pickle.loads(pickle.dumps(alone))):
        still, out = twin.to_depths([48.0, 5.0], 160.0)
        assert still.passed_itself_mm <= after.passed_itself_mm, "both strands are in the sac still"
        assert math.isinf(out.passed_itself_mm), "the hind strand is out"


def test_a_helix_that_slides_along_a_tube_does_not_pass_through_itself() -> None:
    """Its strands turn over each other, three turns in 50 mm, and stay 5 mm apart."""
    wire = GuideWire(0.5, RADIUS, 2.0, 0.4, torsional_stiffness_N_mm2=1.0)
    helix = Insertion(wire, VesselWall(tube_grid(0.5, 1.5), 20.0), [0, 0, 0], [0, 0, 1])
    short, whole, back = helix.to_depths([30.0, 50.0, 20.0])
    along = np.diff(whole.joints_mm, axis=0) / wire.segment_mm
    assert np.linalg.norm(np.diff(along, axis=0), axis=1).sum() > 6.0 * math.pi
    assert all(math.isinf(found.passed_itself_mm) for found in (short, whole, back))


def test_wires_side_by_side_note_it_too() -> None:
    beside = [in_sac(), in_sac()]
    found = Insertions(beside, threads=1).to_depths([45.0, 55.0], [160.0, 280.0])
    assert math.isinf(found[0][0].passed_itself_mm)
    assert 49.0 < found[0][1].passed_itself_mm < 51.0
    assert math.isinf(found[1][1].passed_itself_mm), "turned to another side, it does not"
    assert next(beside[0].to_depths([54.0], 160.0)).passed_itself_mm == found[0][1].passed_itself_mm
