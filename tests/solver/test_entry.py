"""Where a wire may begin and lie, for one relaxation as for an insertion; what a depth says that nothing moved to."""

from __future__ import annotations

import numpy as np
import pytest

from solver import Grid, GuideWire, Insertion, Insertions, Solution, Status, VesselWall, relax
from solver.entry import refused_at

WIRE = GuideWire(0.5, 0.18, 1.0)


@pytest.fixture(scope="module")
def two_tubes() -> VesselWall:
    """Lumens of 1.2 mm radius along z, 3 mm apart, in voxels of 0.3 mm; beyond 30 mm nothing is known."""
    axes = (np.arange(-3, 7, 0.3), np.arange(-3, 3.1, 0.3), np.arange(-3, 30, 0.3))
    x, y, _ = np.meshgrid(*axes, indexing="ij")
    distance = np.minimum(np.hypot(x, y) - 1.2, np.hypot(x - 3, y) - 1.2)
    return VesselWall(Grid(distance, [0.3] * 3, [-3, -3, -3]), 1.0)


@pytest.mark.parametrize(
    ("entry", "depth_mm", "status"),
    [
        ((0.0, 0.0, 0.0), 20.0, Status.CONVERGED),
        ((0.0, 0.0, 0.0), 60.0, Status.LEFT_GRID),
        ((1.5, 0.0, 0.0), 20.0, Status.ENTRY_IN_SEPTUM),
        ((0.0, 2.9, 0.0), 20.0, Status.ENTRY_OUTSIDE),
    ],
)
def test_one_relaxation_is_as_strict_as_an_insertion(
    two_tubes: VesselWall, entry: tuple[float, float, float], depth_mm: float, status: Status
) -> None:
    """It was converged 30 mm outside the grid, and from the middle of a septum."""
    (pushed,) = Insertion(WIRE, two_tubes, entry, [0.0, 0.0, 1.0]).to_depths([depth_mm])
    once = relax(WIRE, two_tubes, depth_mm=depth_mm, entry_mm=entry)
    assert (pushed.status, once.status) == (status, status)
    assert once.converged == (status is Status.CONVERGED)
    assert np.isnan(once.least_pivot) == (not once.converged)


@pytest.mark.parametrize(("thinnest", "status"), [(0.7, Status.ENTRY_IN_SEPTUM), (0.3, None)])
def test_two_lumens_are_joined_where_what_parts_them_is_half_as_thick(thinnest: float, status: Status | None) -> None:
    """Of a septum of 1.2 mm, which is thinner 0.4 mm beside the entry."""
    x, y, z = np.meshgrid(*[np.arange(-4.0, 4.1, 0.4)] * 3, indexing="ij")
    half = 0.6 * np.interp(np.hypot(x, y), [0.0, 0.4], [1.0, thinnest])
    wall = VesselWall(Grid(half - np.abs(z), [0.4] * 3, [-4.0] * 3), 1.0)
    assert refused_at(wall, np.zeros(3)) is status


def test_a_depth_that_is_too_long_took_nothing(two_tubes: VesselWall) -> None:
    """It repeated what the depth before it had dissipated: sums over depths counted that twice."""
    rough = two_tubes.like(friction=0.2)
    wire = GuideWire(0.5, 0.18, 1.0, [[0.0, 0.1], [8.0, 0.1], [8.0, 0.0]])
    insertion = Insertion(wire, rough, [0.3, 0.1, 0.0], [0.0, 0.0, 1.0], max_joints=40)
    moved, *stayed = insertion.to_depths([18.0, 100.0, 200.0])
    assert moved.converged
    assert moved.friction_energy_N_mm > 0.0
    for solution in stayed:
        assert solution.status is Status.TOO_LONG
        assert (solution.dissipated_N_mm, solution.friction_energy_N_mm, len(solution.snaps)) == (0.0, 0.0, 0)


def test_a_roll_with_friction_hangs_on_no_step() -> None:
    """In steps of 15 degrees this tip was 0.04 and 0.05 mm off those of 0.1, silently; others 0.26."""
    axes = (np.arange(-4, 16, 0.4), np.arange(-6, 6.1, 0.4), np.arange(-3, 40, 0.4))
    x, y, z = np.meshgrid(*axes, indexing="ij")
    bent = np.hypot(np.hypot(x - 12.0, np.maximum(z - 8.0, 0.0)) - 12.0, y) - 2.6
    wall = VesselWall(Grid(bent, [0.4] * 3, [-4, -6, -3]), 5.0, friction=0.1)
    wire = GuideWire(1.0, 0.18, [[0.0, 1.0], [15.0, 8.0]], [[0.0, 0.29], [10.0, 0.29], [10.0, 0.0]])

    def rolled(**how: float) -> list[np.ndarray]:
        insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1.0], material_axis=[1.0, 0, 0], **how)
        found = list(insertion.to_depths([10.0, 22.0, 22.0, 22.0, 22.0], [0.0, 0.0, 60.0, 120.0, 180.0]))
        assert all(solution.converged for solution in found)
        return [solution.joints_mm for solution in found]

    for usual, fine in zip(rolled(), rolled(roll_step_deg=0.1), strict=True):
        assert np.abs(usual - fine).max() < 0.01  # 0.003 in steps of a degree


def pressed_flat(deep: float, hull: str = "offset", stiffness: float = 20.0) -> VesselWall:
    """A flat wall across y that a wire of 0.18 mm radius on the z axis lies ``deep`` mm in."""
    axes = (np.arange(-3, 3.1, 0.5), np.arange(-3, 3.1, 0.5), np.arange(-3, 45, 0.5))
    _, y, _ = np.meshgrid(*axes, indexing="ij")
    return VesselWall(Grid(y - (0.18 - deep), [0.5] * 3, [-3, -3, -3]), stiffness, hull=hull)


@pytest.mark.parametrize("quadrature", ["tip", "joints"])
@pytest.mark.parametrize(("segment_mm", "left_N"), [(0.25, 2.5e-3), (0.0625, 2.5e-4)])
def test_a_wire_pressed_at_its_entry_takes_no_push(segment_mm: float, left_N: float, quadrature: str) -> None:
    """A beam on springs takes none. Without the half segment at the entry the push was off by -k d^2/4 = -0.0125 N.

    What is left is of second order: the wire leaves the wall within (4 EI/k)^1/4 = 1 mm.
    """
    wire = GuideWire(segment_mm, 0.18, 5.0)
    insertion = Insertion(wire, pressed_flat(0.05), [0.0, 0.0, 0.0], [0.0, 0.0, 1.0], quadrature=quadrature)
    found = list(insertion.to_depths(np.arange(25.0, 26.0, 0.01).tolist()))
    assert np.mean([s.push_force_N for s in found]) == pytest.approx(0.0, abs=left_N)
    assert sum(s.dissipated_N_mm for s in found[1:]) == pytest.approx(0.0, abs=left_N)
    assert all(s.max_penetration_mm >= 0.05 for s in found)


@pytest.mark.parametrize("hull", ["offset", "samples:8"])
def test_forces_at_a_pressed_entry_are_derivatives_of_the_energy(hull: str) -> None:
    """Push by the depth, reaction by the balance of all forces, torque by the roll: what Hooke's law there adds."""
    wall, wire, load = pressed_flat(0.05, hull), GuideWire(1.0, 0.18, 5.0, 0.02), [0.001, -0.002, 0.0]

    def at(depth: float, roll: float) -> Solution:
        axis, tight = [1.0, 0.0, 0.0], 1e-14
        return relax(wire, wall, depth_mm=depth, roll_deg=roll, material_axis=axis, load_N=load, tolerance=tight)

    here = at(20.2, 10.0)
    balance = here.contact_force_N.sum(axis=0) + load + here.reaction_force_N
    np.testing.assert_allclose(balance, 0.0, rtol=0.0, atol=1e-9)
    assert abs(here.contact_force_N[0, 1]) > 0.05
    push = (at(20.201, 10.0).energy_N_mm - at(20.199, 10.0).energy_N_mm) / 0.002
    assert here.push_force_N == pytest.approx(push, abs=1e-6)
    torque = (at(20.2, 10.1).energy_N_mm - at(20.2, 9.9).energy_N_mm) / np.radians(0.2)
    assert here.reaction_torque_N_mm == pytest.approx(torque, abs=1e-6)


def test_wires_in_lanes_have_the_wall_at_their_entry_as_well() -> None:
    wall, wire = pressed_flat(0.05), GuideWire(1.0, 0.18, 5.0)
    many = [Insertion(wire, wall, [0.0, 0.0, z], [0.0, 0.0, 1.0]) for z in (0.0, 1.0)]
    (together, *_), (alone,) = Insertions(many).to_depths([20.0]), many[0].clone().to_depths([20.0])
    assert together[0].contact_force_N[0, 1] == pytest.approx(alone.contact_force_N[0, 1], rel=1e-6)
    assert together[0].push_force_N == pytest.approx(alone.push_force_N, abs=1e-6)


@pytest.mark.parametrize("load_N", [(0.01, 0.0, 0.0), (-0.02, 0.0, 0.0), (0.0, 0.01, -0.004)])
def test_the_push_of_a_preshaped_wire_is_what_the_manual_says(load_N: tuple[float, float, float]) -> None:
    """The manual took the bending energy per length off, M^2/2EI alone: 0.002 N instead of 0.010."""
    stiffness, curvature = 0.6, 0.15
    wire = GuideWire(0.02, 0.18, stiffness, curvature)
    insertion = Insertion(wire, None, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0], tip_load_N=load_N, step_mm=1.0)
    (bent,) = insertion.to_depths([8.0])
    moment = np.cross(bent.joints_mm[-1], load_N)
    less = moment[:2] @ moment[:2] / (2.0 * stiffness) + moment[1] * curvature
    assert bent.reaction_force_N[2] - bent.push_force_N == pytest.approx(less, abs=1e-6)


def test_frames_follow_a_roll_that_moves_nothing() -> None:
    """Of a straight wire without friction that is only rolled, they kept the roll before."""
    insertion = Insertion(GuideWire(1.0, 0.2, 5.0), None, [0, 0, 0], [0, 0, 1.0], material_axis=[1.0, 0, 0])
    for solution in insertion.to_depths([20.0, 20.0, 20.0, 25.0], [0.0, 90.0, 200.0, 200.0]):
        angle = np.radians(solution.roll_deg)
        axes = np.array([[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        np.testing.assert_allclose(
            solution.frames, np.broadcast_to(axes.T, solution.frames.shape), rtol=0.0, atol=1e-12
        )


def test_a_load_on_the_joint_at_the_entry_is_held_there() -> None:
    """It was in the energy, and not in the reaction."""
    load = np.zeros((6, 3))
    load[0] = [0.5, 0.2, 0.1]
    assert relax(GuideWire(1.0, 0.2, 5.0), None, depth_mm=5.0, load_N=load).reaction_force_N == pytest.approx(-load[0])
