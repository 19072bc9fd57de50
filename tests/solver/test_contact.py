"""With a wall: bend, Winkler foundation, invariant and push force, helix, order in the segment length."""

from __future__ import annotations

import numpy as np
import pytest

from solver import GuideWire, Insertion, VesselWall, relax
from tests.analytic import helix_contact, helix_pitch, winkler_end, winkler_length
from tests.solver.scenes import Array, bend_distance, bend_grid, last, plane_grid, sampled, tube_grid

STIFFNESS = 10.0


def test_forces_balance_and_push_force_is_the_slope_of_the_energy() -> None:
    wire = GuideWire(1.0, 0.18, [[0, 4.0], [40, 12.0]], [[0, 0.05], [10, 0.05], [10, 0.01]])
    wall = VesselWall(bend_grid(), 1.0)
    insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], tolerance=1e-12, step_mm=0.5)
    depths = np.concatenate([np.arange(1.0, 55.0), [55.2 - 1e-3, 55.2, 55.2 + 1e-3]])
    low, middle, high = list(insertion.to_depths(depths, roll_deg=40.0))[-3:]
    assert middle.push_force_N == pytest.approx((high.energy_N_mm - low.energy_N_mm) / 2e-3, rel=1e-4)
    np.testing.assert_allclose(middle.reaction_force_N, -middle.contact_force_N.sum(axis=0), rtol=0.0, atol=1e-10)
    assert middle.max_penetration_mm > 0.01


@pytest.mark.parametrize("quadrature", ["joints", "tip", "segments"])
@pytest.mark.parametrize("hull", ["offset", "samples:6"])
@pytest.mark.parametrize("depth", [0.6, 2.3, 9.3])
def test_push_force_where_the_first_segment_touches(quadrature: str, hull: str, depth: float) -> None:
    """The clamp lies in the wall: what is looked up inside the first segment grows with it, too."""
    wall = VesselWall(tube_grid(), 20.0, hull=hull)
    wire = GuideWire(1.0, 0.4, 5.0, 0.1)
    insertion = Insertion(wire, wall, [1.75, 0.1, 0], [0.1, 0, 1], quadrature=quadrature, tolerance=1e-13)
    low, middle, high = list(insertion.to_depths([*np.arange(0.4, depth, 0.4), depth - 1e-3, depth, depth + 1e-3]))[-3:]
    assert middle.push_force_N == pytest.approx((high.energy_N_mm - low.energy_N_mm) / 2e-3, rel=1e-4)


def test_the_held_half_of_the_first_segment_bears_half() -> None:
    """A wire that does not give way lies equally deep all along: its ends stand for half a segment each."""
    wall = VesselWall(plane_grid(0.0), 0.1)
    insertion = Insertion(GuideWire(1.0, 0.2, 1e7), wall, [0, 0, -0.15], [1, 0, 0], finest_mm=1.0)
    force = last(insertion, np.array([10.0])).contact_force_N[:, 2]
    np.testing.assert_allclose(force / (-0.1 * 0.05), [0.5, *[1.0] * 9, 0.5], rtol=1e-3)


def test_reaction_torque_is_the_slope_of_the_energy_in_roll() -> None:
    wire = GuideWire(1.0, 0.18, STIFFNESS, 0.03)
    wall = VesselWall(bend_grid(), 1.0)
    insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], tolerance=1e-12)
    rolls = [50.0] * 50 + [50.0 - 0.01, 50.0, 50.0 + 0.01]
    depths = list(np.arange(1.0, 51.0)) + [50.0] * 3
    low, middle, high = list(insertion.to_depths(depths, rolls))[-3:]
    slope = (high.energy_N_mm - low.energy_N_mm) / np.deg2rad(0.02)
    assert abs(middle.reaction_torque_N_mm) > 1e-4
    assert middle.reaction_torque_N_mm == pytest.approx(slope, rel=1e-4)


def test_invariant_of_a_frictionless_tube() -> None:
    """N(s) + ½ EI κ² is constant along a uniform, straight wire, and the push force is minus it."""
    segment = 0.25
    wall = VesselWall(bend_grid(), 1.0)
    insertion = Insertion(GuideWire(segment, 0.18, STIFFNESS), wall, [0, 0, 0], [0, 0, 1])
    solution = last(insertion, np.arange(1.0, 51.0))
    x = solution.joints_mm
    along = np.diff(x, axis=0) / segment
    ahead = np.cumsum(solution.contact_force_N[::-1], axis=0)[::-1]
    tension = np.einsum("na,na->n", ahead[1:], along)
    # both live on segments: curvature squared is averaged over the two joints of a segment
    angle = np.linalg.norm(np.diff(along, axis=0), axis=1) / segment
    square = 0.5 * (angle[1:] ** 2 + angle[:-1] ** 2)
    invariant = tension[1:-1] + 0.5 * STIFFNESS * square
    inner = invariant[2:-8]
    # bending and tension trade along the wire, their sum does not
    assert np.ptp(inner) < 0.15 * np.ptp(tension[1:-1][2:-8])
    assert np.ptp(inner) < 0.01 * abs(inner.mean())
    assert solution.push_force_N == pytest.approx(-inner.mean(), rel=0.01)


def test_tip_in_a_bend_presses_as_a_tangent_clamped_beam() -> None:
    """A beam clamped tangentially at ℓ behind a tip on a wall of radius R: tip force 3 EI κ/(2 ℓ), clamp 1.5 κ."""
    radius, clearance, segment = 200.0, 0.02, 0.5
    wall_radius = radius + clearance

    def distance(p: Array) -> Array:
        return np.hypot(radius - p[..., 0], p[..., 2]) - wall_radius

    wall = VesselWall(sampled(distance, 0.5, (-4, -3, -3), (6, 3, 30)), 1000.0)
    solution = relax(GuideWire(segment, 0.0, STIFFNESS), wall, depth_mm=20.0)
    assert solution.converged
    force = np.linalg.norm(solution.contact_force_N, axis=1)
    # the free length runs from the last contact behind the tip
    touching = np.flatnonzero(force > 1e-6 * force.max())
    behind = touching[touching < len(force) - 4]
    start = behind.max() if behind.size else 0
    tip = np.linalg.norm(solution.contact_force_N[-3:].sum(axis=0))
    free = (len(force) - 1 - start) * segment
    assert tip == pytest.approx(1.5 * STIFFNESS / (radius * free), rel=0.06)


def test_winkler_foundation() -> None:
    """A wire lying in a plane wall with a force on its free end: a beam on an elastic foundation."""
    wall_stiffness, force, height = 0.5, 5e-3, 5.0
    decay = winkler_length(STIFFNESS, wall_stiffness)
    # the whole wire is in the wall by a constant depth, so that the foundation answers in both directions
    wall = VesselWall(plane_grid(height), wall_stiffness)
    errors = []
    for n in (20, 40):
        wire = GuideWire(16.0 / n, 0.0, STIFFNESS)
        common = {"depth_mm": 16.0, "entry_mm": (-14.0, 0.0, height + 0.5), "entry_direction": (1.0, 0.0, 0.0)}
        k, _ = wire.segments_at(16.0)
        share = np.full(k + 1, wire.segment_mm)
        share[[0, -1]] *= 0.5
        weight = np.zeros((k + 1, 3))
        weight[:, 2] = 0.5 * wall_stiffness * share
        loaded = weight + 0.0
        loaded[-1, 2] += force
        lifted = [
            relax(wire, wall, load_N=load, quadrature="joints", **common).joints_mm[-1, 2]  # type: ignore[arg-type]
            for load in (weight, loaded)
        ]
        assert lifted[0] == pytest.approx(height + 0.5, abs=1e-6)
        errors.append(abs((lifted[1] - lifted[0]) / winkler_end(STIFFNESS, wall_stiffness, force)[0] - 1))
    assert 4 * decay < 16.0
    assert errors[1] < 5e-3


def test_compressed_wire_winds_into_a_helix() -> None:
    force, clearance, segment = 0.05, 1.0, 1.5
    pitch = helix_pitch(STIFFNESS, force)
    length = 4.0 * pitch
    grid = sampled(lambda p: np.hypot(p[..., 0], p[..., 1]) - clearance, 0.25, (-3, -3, -4), (3, 3, length + 4))
    wall = VesselWall(grid, 20.0)
    s = np.linspace(0, length, 800)
    ramp = np.minimum(s / (0.5 * pitch), 1.0) * clearance
    start = np.column_stack([ramp * np.cos(2 * np.pi * s / pitch), ramp * np.sin(2 * np.pi * s / pitch), s])
    start[0] = 0.0
    wire = GuideWire(segment, 0.0, STIFFNESS)
    solution = relax(wire, wall, depth_mm=length, load_N=[0, 0, -force], start_mm=start, max_iterations=2000)
    assert solution.converged, solution.sentence
    middle = slice(int(1.2 * pitch / segment), int(2.8 * pitch / segment))
    x = solution.joints_mm[middle]
    phase = np.unwrap(np.arctan2(x[:, 1], x[:, 0]))
    got = 2 * np.pi * (x[-1, 2] - x[0, 2]) / abs(phase[-1] - phase[0])
    assert got == pytest.approx(pitch, rel=0.05)
    contact = np.linalg.norm(solution.contact_force_N[middle], axis=1).mean() / segment
    assert contact == pytest.approx(helix_contact(STIFFNESS, force, clearance), rel=0.1)


def test_order_of_the_soft_bend() -> None:
    """The scene of the physics notes: 100 mm, wall 0.1 N/mm²; energy of order 2, tip within 0.01 mm at 2.5 mm."""
    wall = VesselWall(bend_grid(), 0.1)
    energies, tips = [], []
    for segment in (5.0, 2.5, 1.25, 0.3125):
        wire = GuideWire(segment, 0.18, STIFFNESS)
        solution = last(Insertion(wire, wall, [0, 0, 0], [0, 0, 1]), np.arange(1.0, 101.0))
        energies.append(solution.energy_N_mm)
        tips.append(solution.joints_mm[-1])
    error = np.abs(np.array(energies[:3]) - energies[-1])
    assert np.log2(error[0] / error[1]) > 1.8
    assert np.log2(error[1] / error[2]) > 1.8
    assert np.linalg.norm(tips[1] - tips[-1]) < 0.01


def test_order_of_contact_with_the_tip_integrated() -> None:
    """60 mm in the bend at 1 N/mm²: a point force on a soft wall, resolved inside the last segment."""
    wall = VesselWall(bend_grid(), 1.0)

    def final(segment: float, quadrature: str) -> tuple[float, Array]:
        wire = GuideWire(segment, 0.18, STIFFNESS)
        insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], quadrature=quadrature)
        solution = last(insertion, np.arange(1.0, 61.0))
        return solution.energy_N_mm, solution.joints_mm[-1]

    limit, tip = final(0.0625, "tip")
    errors = [abs(final(segment, "tip")[0] - limit) for segment in (2.0, 1.0, 0.5)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.mean(orders) > 1.8
    # by joints alone the tip is a tenth of a millimetre off at these lengths
    assert np.linalg.norm(final(1.0, "tip")[1] - tip) < 0.005 < np.linalg.norm(final(1.0, "joints")[1] - tip)


def test_order_in_the_voxel_size_of_the_wall() -> None:
    """Cubic splines are of order 4 in the distance; where the bend begins the lumen's curvature jumps: 2 at least.

    Nodes are off the tube's axis, on which every voxel size would agree by symmetry.
    """
    voxels = (0.8, 0.4, 0.2, 0.1)
    wire, shapes = GuideWire(0.5, 0.18, STIFFNESS), []
    for voxel in voxels:
        low = np.full(3, -4.2) - 0.37 * voxel  # two voxels and more around the lumen that the wire lies in
        wall = VesselWall(sampled(bend_distance, voxel, low, (20.0, 4.2, 61.0), "float32"), 1.0)
        shapes.append(last(Insertion(wire, wall, [0, 0, 0], [0, 0, 1]), np.arange(1.0, 61.0)).joints_mm)
    errors = [np.sqrt(np.mean(np.sum((x - shapes[-1]) ** 2, axis=1))) for x in shapes[:-1]]
    order = np.polyfit(np.log(voxels[:-1]), np.log(errors), 1)[0]
    assert order > 2.0
    # a voxel of clinical size costs less than segments of a millimetre do (0.0012 mm)
    assert errors[1] < 0.0012


@pytest.mark.parametrize("samples", [4, 16])
def test_hull_points_converge_to_the_smooth_limit_of_a_wide_contact(samples: int) -> None:
    """Averaged hull points touch later and softer than the smooth hull; both vanish inside the lumen."""
    wire = GuideWire(1.0, 0.3, STIFFNESS)
    load = [0.0, 0.01, 0.0]
    depth = {}
    for hull in ("offset", f"samples:{samples}"):
        wall = VesselWall(tube_grid(), 5.0, hull=hull)
        solution = relax(wire, wall, depth_mm=40.0, load_N=load)
        assert solution.converged
        depth[hull] = np.hypot(*solution.joints_mm[-1, :2])
    assert depth[f"samples:{samples}"] > depth["offset"] > 2.0 - 0.3
    assert depth[f"samples:{samples}"] < 2.0 + 0.3


def test_scaling_wall_and_wire_together_leaves_the_shape() -> None:
    shapes = []
    for factor in (1.0, 37.0):
        wall = VesselWall(bend_grid(), factor)
        insertion = Insertion(GuideWire(1.0, 0.18, factor * STIFFNESS), wall, [0, 0, 0], [0, 0, 1])
        shapes.append(last(insertion, np.arange(2.0, 61.0, 2.0)).joints_mm)
    np.testing.assert_allclose(shapes[0], shapes[1], rtol=0.0, atol=1e-7)
