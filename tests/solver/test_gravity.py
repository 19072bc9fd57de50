"""A wire's own weight: beams and columns under it, a naive chain, the balance of forces, and nothing where it is 0."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from solver import GuideWire, Insertion, Status, VesselWall, relax
from tests.naive.chain import energy, joints_of, minimum
from tests.solver.scenes import Array, bend_grid, same_bits, tube_grid

STEEL = 7.9e-6
"""N per mm of steel wire of 0.36 mm."""


def sag(length: float, stiffness: float, weight: float) -> Array:
    """Tip (forward, down) of a horizontal cantilever under its own weight: EI θ'' = -w (L - s) cos θ, any size."""

    def slope(s: Array, y: Array) -> Array:
        return np.array([y[1], -weight * (length - s) * np.cos(y[0]) / stiffness, np.cos(y[0]), np.sin(y[0])])

    def ends(a: Array, b: Array) -> Array:
        return np.array([a[0], b[1], a[2], a[3]])

    s = np.linspace(0.0, length, 201)
    found = solve_bvp(slope, ends, s, np.zeros((4, s.size)), tol=1e-10, max_nodes=100_000)
    assert found.success
    return np.asarray(found.y[2:, -1])


def test_a_soft_tip_of_20_mm_sags_a_quarter_of_a_millimetre() -> None:
    wire = GuideWire(0.5, 0.18, 0.6, weight_N_per_mm=STEEL)
    tip = relax(wire, depth_mm=20.0, entry_direction=[1, 0, 0], down=[0, 3, 0]).joints_mm[-1]
    assert pytest.approx(0.263, abs=1e-3) == STEEL * 20.0**4 / (8 * 0.6)
    # beam theory to the square of the slope, 2e-4, and the chain to (0.5 / 20)²
    assert tip[1] == pytest.approx(STEEL * 20.0**4 / (8 * 0.6), rel=1e-3)
    assert abs(tip[2]) < 1e-12


@pytest.mark.parametrize("load", [0.1, 3.0, 30.0])
def test_a_cantilever_under_its_weight_is_met_at_second_order(load: float) -> None:
    """load : w L³ / EI; at 30 the tip hangs almost straight down."""
    length, stiffness = 100.0, 5.0
    weight = load * stiffness / length**3
    x, y = sag(length, stiffness, weight)
    errors = []
    for n in (20, 40, 80):
        wire = GuideWire(length / n, 0.18, stiffness, weight_N_per_mm=weight)
        solution = relax(wire, depth_mm=length, entry_direction=[1, 0, 0], down=[0, 0, -1])
        assert solution.converged
        errors.append(np.hypot(solution.joints_mm[-1, 0] - x, -solution.joints_mm[-1, 2] - y) / length)
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, rtol=0.0, atol=0.1)
    assert errors[0] < 3e-3


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_column_stands_up_to_greenhills_length_and_hangs_at_any(sign: float) -> None:
    """L³ = 7.8373 EI / w (Greenhill, 1881), to the chain's (π / 2n)² / 12 at n = 50."""
    stiffness, weight = 0.05, 1e-5
    critical = (7.8373 * stiffness / weight) ** (1 / 3)
    for length in (0.98 * critical, 1.02 * critical):
        wire = GuideWire(length / 50, 0.18, stiffness, weight_N_per_mm=weight)
        solution = relax(wire, depth_mm=length, entry_direction=[0, 0, 1], down=[0, 0, sign])
        assert solution.converged
        stands = sign > 0 or length < critical
        assert (np.hypot(*solution.joints_mm[-1, :2]) < 1e-6 * length) == stands


def test_a_naive_chain_hangs_alike() -> None:
    """Weight at the middle of each segment, energies added up in numpy; hooked, rolled, tip load besides."""
    wire = GuideWire(2.0, 0.18, [[0, 0.5], [9, 2.0]], 0.06, 3.0, weight_N_per_mm=2e-3)
    down, tip = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, -0.004])
    entry = np.array([30.0, -20.0, 10.0])
    solution = relax(wire, depth_mm=8.7, entry_mm=entry, load_N=tip, down=down, roll_deg=25.0, tolerance=1e-13)
    k, first = wire.segments_at(8.7)
    length = np.array([first] + [2.0] * (k - 1))
    edges = 8.7 - np.concatenate([[0.0], np.cumsum(length) - length / 2])
    outer, inner = edges[:-1], edges[1:]
    s = [np.linspace(a, b, 20_001) for a, b in zip(inner, outer, strict=True)]
    bend = np.array([1 / np.trapezoid(1 / np.interp(x, [0, 9], [0.5, 2.0]), x) for x in s])
    rest, twist = 0.06 * (outer - inner), 3.0 / (outer - inner)
    base, load = solution.frames[0], np.zeros((k + 1, 3))
    load[k] = tip

    def total(controls: Array) -> float:
        x = joints_of(controls, rest, length, base, entry)
        hanging = 2e-3 * float(length @ (((x[1:] + x[:-1]) / 2 - entry) @ down))
        return energy(controls, bend, twist, rest, length, base, entry, None, 0.0, 0.18, load) - hanging

    controls, least = minimum(k, 3, total, np.zeros((k, 3)))
    np.testing.assert_allclose(solution.joints_mm, joints_of(controls, rest, length, base, entry), rtol=0.0, atol=2e-5)
    assert solution.energy_N_mm == pytest.approx(least, abs=1e-9)


@pytest.mark.parametrize("walled", [False, True])
def test_forces_balance_and_the_hand_feels_the_change_of_energy(walled: bool) -> None:
    wire = GuideWire(1.0, 0.18, 3.0, [[0, 0.05], [8, 0.05], [8, 0]], weight_N_per_mm=2e-4)
    wall = VesselWall(bend_grid(), 1.0) if walled else None
    down, depth, step = np.array([0.0, 0.6, 0.8]), 36.4, 1e-4
    push = Insertion(wire, wall, [0.2, 0.1, 0.5], [0, 0, 1], tolerance=1e-12, down=down)
    *_, before, here, after = push.to_depths([10.0, 20.0, 30.0, depth - step, depth, depth + step])
    assert here.converged
    force = here.contact_force_N.sum(axis=0) + 2e-4 * depth * down + here.reaction_force_N
    np.testing.assert_allclose(force, 0.0, rtol=0.0, atol=1e-7)
    slope = (after.energy_N_mm - before.energy_N_mm) / (2 * step)
    assert here.push_force_N == pytest.approx(slope, abs=1e-6)


def test_a_wire_lies_on_the_bottom_of_a_horizontal_tube() -> None:
    wire = GuideWire(1.0, 0.18, 1.0, weight_N_per_mm=5e-3)
    push = Insertion(wire, VesselWall(tube_grid(), 1.0), [0, 0, 0], [0, 0, 1], down=[0, 1, 0])
    *_, solution = push.to_depths([20.0, 40.0, 55.0])
    assert solution.converged
    # it comes down from the axis within (72 EI h / w)^¼ = 13 mm
    np.testing.assert_allclose(solution.contact_force_N[25:45], [[0.0, -5e-3, 0.0]] * 20, rtol=0.0, atol=5e-6)


def test_a_rigid_motion_far_from_the_origin_moves_the_answer() -> None:
    rng = np.random.default_rng(5)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    shift = np.array([300.0, -200.0, 900.0])
    wire = GuideWire(1.0, 0.18, 0.6, 0.01, weight_N_per_mm=STEEL)
    where = {
        "entry_mm": np.zeros(3),
        "entry_direction": np.eye(3)[0],
        "material_axis": np.eye(3)[2],
        "down": np.eye(3)[1],
    }
    here = relax(wire, depth_mm=60.0, **where)
    moved = {name: turn @ v + shift * (name == "entry_mm") for name, v in where.items()}
    there = relax(wire, depth_mm=60.0, **moved)
    assert here.status is there.status is Status.CONVERGED
    np.testing.assert_allclose(here.joints_mm @ turn.T + shift, there.joints_mm, rtol=0.0, atol=1e-6)
    assert here.energy_N_mm == pytest.approx(there.energy_N_mm, rel=1e-9)


def test_without_weight_nothing_is_weighed() -> None:
    for wall in (None, VesselWall(bend_grid(), 1.0)):
        wire = GuideWire(1.0, 0.18, 5.0, 0.02)
        plain = Insertion(wire, wall, [0, 0, 0], [0, 0, 1]).to_depths([10.0, 33.0])
        told = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], down=[1, 0, 0]).to_depths([10.0, 33.0])
        for a, b in zip(plain, told, strict=True):
            same_bits(a, b)


def test_a_weight_needs_to_know_where_down_is() -> None:
    wire = GuideWire(1.0, 0.18, 5.0, weight_N_per_mm=STEEL)
    with pytest.raises(ValueError, match=r"relax: down: got None; allowed: .*; \[0, 1, 0\]"):
        relax(wire, depth_mm=5.0)
    with pytest.raises(ValueError, match=r"insertion: down: got None"):
        Insertion(wire, None, [0, 0, 0], [0, 0, 1])
