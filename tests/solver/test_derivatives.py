"""Derivatives: of the interpolated distance, of the energy, and the Newton step as a whole."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from solver import Grid, GuideWire, Status, VesselWall
from solver._kernels.start import follow
from solver.relax import Settings, base_frame
from solver.workspace import Workspace
from tests.solver.entry_points import (
    iterate,
    jacobian_terms,
    least_curvature,
    look_again,
    place,
    sine_terms,
    solve_stiffened,
)
from tests.solver.scenes import bend_distance, bend_grid, sampled, tube_grid

Array = NDArray[np.float64]


def workspace(wire: GuideWire, wall: VesselWall | None, depth: float, quadrature: str = "tip") -> Workspace:
    b = Workspace(wire, wall, quadrature, Settings().limits)
    b.lay_out(depth)
    b.clamp(np.zeros(3), base_frame(np.array([0.0, 0.0, 1.0]), None, 30.0))
    return b


def energy_of(b: Workspace, controls: Array) -> float:
    b.problem.state.u[0, : b.k] = controls
    place(b.handle, 0, b.k)
    return energy_at(b, 0)


def energy_at(b: Workspace, slot: int) -> float:
    look_again(b.handle, slot, b.k)
    return float(sum(b.problem.state.energies[slot].tolist()))


def aim(b: Workspace, j: int, way: Array) -> None:
    """Bend joint j of state 1 towards a direction, without twist."""
    s = b.problem.state
    s.u[1, j, 2] = 0.0
    curve = s.x[1, j] + np.outer([0.0, 2.0 * b.problem.chain.length[j]], way)
    follow(curve, 2, b.problem.chain, s.u[1], s.x[1], s.r[1], (j, j + 1))


def judge(b: Workspace) -> None:
    """Judge state 0 as the closed form does before it moves on to state 1.

    Newton's decrement goes to the first report, NaN where the Hessian is not positive, the forces on the base as well;
    the closed form's own gradients go to the gains.
    """
    now = b.problem.scratch.descent[0]
    now.slot, now.iterations, now.next_check, now.share = 0, 0, 1, 1.0
    now.energy, now.checked_energy = energy_at(b, 0), math.inf
    b.report[0].decrement = math.nan
    iterate(b.handle, b.k, now, b.report[0])


@pytest.mark.parametrize("q", [1e-12, 1e-3, 0.2, 0.2499999, 0.25, 0.3, 4.0])
def test_rotation_series_meets_its_closed_form(q: float) -> None:
    exact = Fraction(q)

    def series(shift: int, factor: Callable[[int], int] = lambda n: 1) -> float:
        terms = ((-exact) ** n * factor(n) / math.factorial(2 * n + shift) for n in range(25))
        return float(sum(terms, Fraction(0)))

    s, a = sine_terms(q)
    b, da, db = jacobian_terms(q, s, a)
    np.testing.assert_allclose((s, a, b), (series(1), series(2), series(3)), rtol=0.0, atol=2e-15)
    # derivatives with respect to the angle, over the angle
    slopes = (-series(4, lambda n: 2 * n + 2), -series(5, lambda n: 2 * n + 2))
    np.testing.assert_allclose((da, db), slopes, rtol=0.0, atol=1e-13)


@pytest.mark.filterwarnings("ignore:wall")  # any values have a spline: these are no distances
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_wall_takes_the_values_at_the_nodes_and_differentiates_its_own_interpolant(dtype: str) -> None:
    rng = np.random.default_rng(0)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    grid = Grid(rng.normal(size=(9, 8, 7)).astype(dtype), np.array([0.3, 0.5, 0.4]), rng.normal(size=3), turn)
    wall = VesselWall(grid, 1.0)
    nodes = np.argwhere(np.ones(grid.shape, bool))
    np.testing.assert_allclose(wall.look_up(grid.to_mm(nodes))[0], grid.values[tuple(nodes.T)], rtol=0.0, atol=3e-6)
    # beyond the faces as well: the continuation is linear along each axis
    points = grid.to_mm(rng.uniform(-1.5, 9.0, size=(200, 3)))
    _, gradient, hessian = wall.look_up(points)
    step = 1e-5
    for a in range(3):
        d = np.zeros(3)
        d[a] = step
        up, down = wall.look_up(points + d), wall.look_up(points - d)
        np.testing.assert_allclose(gradient[:, a], (up[0] - down[0]) / (2 * step), rtol=0.0, atol=1e-6)
        np.testing.assert_allclose(hessian[:, :, a], (up[1] - down[1]) / (2 * step), rtol=0.0, atol=2e-5)


def test_wall_bounds_hold_where_the_lumen_is() -> None:
    wall = VesselWall(sampled(bend_distance, 0.5, (-5, -5, 0), (10, 5, 45)), 1.0)
    rng = np.random.default_rng(1)
    points = rng.uniform((-4, -4, 1), (9, 4, 44), size=(4000, 3))
    value, gradient, _ = wall.look_up(points)
    inside = value < 0
    assert inside.sum() > 400
    assert np.linalg.norm(gradient[inside], axis=1).max() <= wall.field.slope + 1e-12
    # trilinear interpolation of the coefficients, spelled out
    index = wall.distance.to_index(points) + 1
    cell = np.floor(index).astype(int)
    t = index - cell
    linear = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(corner, t, 1 - t), axis=1)
        linear += weight * wall.field.coefficients[tuple((cell + corner).T)]
    assert np.abs(linear - value)[inside].max() <= wall.field.gap + 1e-12


WIRES = {
    "straight": GuideWire(2.0, 0.18, 10.0),
    "curved tip": GuideWire(2.0, 0.18, [[0, 1.0], [40, 10.0]], [[0, 0.1], [20, 0.1], [20, 0.0]]),
    "twisting": GuideWire(2.0, 0.18, 10.0, 0.05, torsional_stiffness_N_mm2=8.0),
}


@pytest.mark.parametrize("hull", ["offset", "samples:3"])
@pytest.mark.parametrize("quadrature", ["tip", "joints", "segments"])
@pytest.mark.parametrize("name", WIRES)
def test_gradient_at_the_base_is_the_derivative_of_the_energy(name: str, quadrature: str, hull: str) -> None:
    b = workspace(WIRES[name], VesselWall(bend_grid(0.5), 0.05, hull=hull), 40.0, quadrature)
    components = 3 if b.problem.twisting else 2
    rng = np.random.default_rng(0)
    controls = np.zeros((b.k, 3))
    controls[:, :components] = 0.05 * rng.normal(size=(b.k, components))
    energy_of(b, controls)
    judge(b)
    force, moment, step = b.report[0].force.copy(), b.report[0].torque.copy(), 1e-6
    frame = b.problem.state.r[0, 0].copy()
    for a in range(3):
        ends = []
        for side in (step, -step):
            b.problem.state.x[0, 0, a] += side
            ends.append(energy_of(b, controls))
            b.problem.state.x[0, 0, a] -= side
        assert force[a] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-6)
        ends = []
        for side in (step, -step):
            axis = np.zeros(3)
            axis[a] = side
            skew = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
            b.problem.state.r[0, 0] = frame @ (np.eye(3) + skew + skew @ skew / 2)
            ends.append(energy_of(b, controls))
        b.problem.state.r[0, 0] = frame
        assert moment[a] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-5)


@pytest.mark.parametrize("name", WIRES)
def test_newton_decrement_is_that_of_the_dense_hessian(name: str) -> None:
    """Near a minimum the recursion must predict what a dense Hessian, by differences, predicts."""
    b = workspace(WIRES[name], VesselWall(tube_grid(0.5), 0.05), 24.0)
    components = 3 if b.problem.twisting else 2
    b.load([2e-3, 1e-3, -2e-3])
    n = components * b.k
    rng = np.random.default_rng(0)

    def padded(v: Array) -> Array:
        return np.column_stack([v.reshape(b.k, components), np.zeros((b.k, 3 - components))])

    energy_of(b, np.zeros((b.k, 3)))
    status, _ = b.advance(24.0, 0.0, b.k)
    assert status is Status.CONVERGED
    v = b.problem.state.u[0, : b.k, :components].ravel() + 1e-5 * rng.normal(size=n)
    gradient, hessian = dense(lambda w: energy_of(b, padded(w)), v)
    energy_of(b, padded(v))
    judge(b)
    assert b.report[0].decrement == pytest.approx(0.5 * gradient @ np.linalg.solve(hessian, gradient), rel=2e-3)


@pytest.mark.parametrize("drag", [0.0, 0.05])
@pytest.mark.parametrize("hull", ["offset", "samples:5"])
@pytest.mark.parametrize("name", ["curved tip", "twisting"])
def test_newton_decrement_with_friction_is_that_of_the_dense_hessian(name: str, hull: str, drag: float) -> None:
    """Hulls that rub at a radius from the axis, and a shaft that is held outside; loads and normals are kept."""
    b = Workspace(WIRES[name], VesselWall(tube_grid(0.5), 0.5, 0.3, hull), "tip", Settings().limits, 20.0, drag)
    b.lay_out(24.0)
    b.clamp(np.zeros(3), base_frame(np.array([0.0, 0.0, 1.0]), None, 30.0))
    b.problem.shaft.frame[0], b.problem.shaft.step[:] = b.problem.state.r[0, 0], (0.01, 0.0)
    b.load([2e-2, 1e-2, -2e-3])
    components = 3 if b.problem.twisting else 2
    straight = np.zeros((b.k, 3))
    straight[:, 1] = -b.problem.chain.rest[: b.k]
    energy_of(b, straight)
    status, _ = b.advance(24.0, 0.0, b.k)
    assert status is Status.CONVERGED
    assert np.count_nonzero(b.problem.friction.load) > 3

    def padded(v: Array) -> Array:
        return np.column_stack([v.reshape(b.k, components), np.zeros((b.k, 3 - components))])

    # far enough that what slips goes on slipping, near enough for a minimum
    away = 1e-3 * np.random.default_rng(0).normal(size=components * b.k)
    v = b.problem.state.u[0, : b.k, :components].ravel() + away
    gradient, hessian = dense(lambda w: energy_of(b, padded(w)), v, 2e-6)
    energy_of(b, padded(v))
    judge(b)
    assert b.report[0].decrement == pytest.approx(0.5 * gradient @ np.linalg.solve(hessian, gradient), rel=5e-3)


def dense(function: object, v: Array, step: float = 1e-4) -> tuple[Array, Array]:
    """Gradient and Hessian by central differences."""
    f, n = function, len(v)
    e = step * np.eye(n)
    up = np.array([f(v + d) for d in e])  # type: ignore[operator]
    down = np.array([f(v - d) for d in e])  # type: ignore[operator]
    here = f(v)  # type: ignore[operator]
    hessian = np.diag((up - 2 * here + down) / step**2)
    for i in range(n):
        for j in range(i):
            cross = f(v + e[i] + e[j]) - up[i] - up[j] + 2 * here - down[i] - down[j] + f(v - e[i] - e[j])  # type: ignore[operator]
            hessian[i, j] = hessian[j, i] = cross / (2 * step**2)
    return (up - down) / (2 * step), hessian


@pytest.mark.parametrize("hull", ["offset", "samples:5"])
def test_closed_form_turns_against_the_exact_gradient(hull: str) -> None:
    """The numerator of eq. 10, corrected: turning one segment alone, roll handed on to every bend behind it."""
    b = workspace(WIRES["curved tip"], VesselWall(bend_grid(0.5), 1.0, hull=hull), 50.0)
    rng = np.random.default_rng(0)
    controls = np.zeros((b.k, 3))
    controls[:, :2] = 0.05 * rng.normal(size=(b.k, 2))
    energy_of(b, controls)
    judge(b)
    slope = -b.problem.scratch.gain[: b.k, :2, 0]
    step = 1e-6
    for i in range(b.k):
        for a in range(2):
            ends = [turned(b, i, a, side) for side in (step, -step)]
            assert slope[i, a] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-5)


def test_closed_form_reads_nothing_of_a_wire_that_was_deeper() -> None:
    """Stiffness and angles of segments that were pulled out stay in memory; eq. 10 has no term of them."""
    b, found = workspace(WIRES["curved tip"], VesselWall(bend_grid(0.5), 1.0), 30.0), []
    assert len(b.problem.chain.bend) > b.k
    energy_of(b, 0.02 * np.sin(np.arange(3.0 * b.k)).reshape(-1, 3) * [1, 1, 0])
    for left in (0.0, 0.7):
        b.problem.chain.bend[b.k :] = b.problem.state.u[0, b.k :] = left
        judge(b)
        found.append(b.problem.scratch.gain[: b.k, :, :2].copy())
    np.testing.assert_array_equal(*found)


def turned(b: Workspace, segment: int, axis: int, angle: float) -> float:
    """Energy with one segment turned about its own axis 1 or 2, the others keeping their directions."""
    s = b.problem.state
    s.x[1, 0], s.r[1, 0] = s.x[0, 0], s.r[0, 0]
    for j in range(b.k):
        along = s.r[0, j + 1, :, 2].copy()
        if j == segment:
            along += angle * (s.r[0, j + 1, :, 0] if axis == 1 else -s.r[0, j + 1, :, 1])
        aim(b, j, along)
    return energy_at(b, 1)


@pytest.mark.parametrize("twisting", [False, True])
def test_a_joints_block_is_judged_stiffened_and_solved_as_the_matrix_it_is(twisting: bool) -> None:
    """Against numpy's eigenvalues and inverse; entries stand as xx yy zz xy xz yz."""
    rng, size = np.random.default_rng(4), 3 if twisting else 2
    for shift in (-1.0, 0.0, 3.0):
        root = rng.normal(size=(3, 3))
        whole = root @ root.T + shift * np.eye(3)
        q = tuple(whole[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
        least = least_curvature(q, twisting)
        bending = np.linalg.eigvalsh(whole[:2, :2])[0]
        if np.linalg.eigvalsh(whole[:size, :size])[0] > 0.0:
            assert least == pytest.approx(bending)
        else:
            assert least in (-math.inf, pytest.approx(bending))
            assert least < 0.0
        stiffer = whole + np.diag([0.7, 0.7, 0.0])
        found = np.reshape(solve_stiffened(q, 0.7, twisting), (3, 3))
        inverse = np.zeros((3, 3))
        inverse[:size, :size] = -np.linalg.inv(stiffer[:size, :size])
        np.testing.assert_allclose(found, inverse, rtol=0.0, atol=1e-9)


def test_frames_stay_turns_along_a_long_curve() -> None:
    """A frame is the one before, turned: what one lacks in length must not double from joint to joint."""
    b = workspace(WIRES["curved tip"], None, 150.0)
    s, angle = b.problem.state, 0.3
    s.x[1, 0], s.r[1, 0] = s.x[0, 0], s.r[0, 0]
    for j in range(b.k):
        way = [np.cos(0.2 * j) * np.sin(angle), np.sin(0.2 * j) * np.sin(angle), np.cos(angle)]
        aim(b, j, np.array(way))
        np.testing.assert_allclose(s.r[1, j + 1, :, 2], way, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(
        s.r[1, : b.k + 1].transpose(0, 2, 1) @ s.r[1, : b.k + 1],
        np.eye(3)[None].repeat(b.k + 1, 0),
        rtol=0.0,
        atol=1e-13,
    )
    # the controls alone lead to the same wire
    s.u[0, : b.k], s.r[0, 0], s.x[0, 0] = s.u[1, : b.k], s.r[1, 0], s.x[1, 0]
    place(b.handle, 0, b.k)
    np.testing.assert_allclose(s.x[0, : b.k + 1], s.x[1, : b.k + 1], rtol=0.0, atol=1e-11)
