"""Equilibrium of a clamped, stretchable Kirchhoff rod against a wall: Newton's method on node positions."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, solveh_banded

from data_synthetic.geometry import Array
from data_synthetic.rod import _kernels as kernels
from data_synthetic.rod._kernels import Shape
from data_synthetic.rod.contact import Near, add_wall, near_wall, wall_energy
from data_synthetic.rod.rod import Rod

LONGEST_MOVE_MM = 0.15
"""Most that a node may move in one Newton step: below a wire radius, so that no step jumps a wall."""


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A relaxed shape with the largest unbalanced nodal force, the wall's force on every node, and the effort.

    anchor (n + 1, 3) : the points of the wall that friction holds the nodes by; the nodes themselves without it.
    """

    shape: Shape
    residual_N: float
    contact_N: Array
    energy_N_mm: float
    iterations: int
    anchor: Array


def relax(rod: Rod, start: Shape, force_N: float, max_iterations: int = 400) -> Equilibrium:
    """Newton's method with a Levenberg shift where the Hessian is not positive definite, to ``force_N``."""
    shape, shift = start, 0.0
    n = len(rod.lengths)
    gradient, bands = np.empty(4 * n), np.empty((kernels.BANDS, 4 * n))
    near = _near(rod, shape.points)
    energy = _energy(rod, shape, shape.points, np.zeros(n), near)
    residual, contact, count = np.inf, np.zeros((n + 1, 3)), 0
    for count in range(max_iterations):  # noqa: B007 - the count is reported
        contact = _system(rod, shape, near, gradient, bands)
        residual = float(np.abs(gradient).max())
        if residual < force_N:
            break
        step, shift = _newton_step(gradient, bands, shift)
        moved = _line_search(rod, shape, energy, gradient, step)
        if moved is None:
            if shift > 1e6:
                break
            shift = max(10.0 * shift, 1e-3)
            continue
        shape, near, energy, share = moved
        shift = shift * 0.2 if share > 0.5 and shift > 1e-6 else (0.0 if share > 0.5 else shift)
    return Equilibrium(shape, residual, contact, energy, count, shape.points)


def _near(rod: Rod, points: Array) -> Near | None:
    """Where nodes lie to the wall; None without one."""
    return near_wall(rod, rod.wall, points) if rod.wall is not None else None


def _energy(rod: Rod, shape: Shape, points: Array, angles: Array, near: Near | None) -> float:
    """Energy in N mm of nodes (n + 1, 3), angles (n,) counted from the directors of a shape."""
    total = float(kernels.elastic_energy(points, angles, shape, rod.elastic))
    if near is not None:
        total += wall_energy(rod, near)
    if rod.sliders is not None:
        total += rod.sliders.energy(points)
    if rod.loads_N is not None:
        total -= float(np.sum(rod.loads_N * points))
    return total


def _system(rod: Rod, shape: Shape, near: Near | None, gradient: Array, bands: Array) -> Array:
    """Fill gradient and Hessian; returns the wall's force on every node (n + 1, 3)."""
    kernels.elastic_system(shape, rod.elastic, gradient, bands)
    if rod.loads_N is not None:
        gradient.reshape(-1, 4)[:, 1:] -= rod.loads_N[1:]
    if rod.sliders is not None:
        rod.sliders.add(shape.points, gradient, bands)
    if rod.wall is None or near is None:
        return np.zeros_like(shape.points)
    return add_wall(rod, rod.wall, near, gradient, bands)


def _newton_step(gradient: Array, bands: Array, shift: float) -> tuple[Array, float]:
    """The step and the shift (N/mm) that made the Hessian positive definite."""
    while True:
        trial = bands.copy()
        trial[0] += shift
        try:
            return np.asarray(solveh_banded(trial, -gradient, lower=True, check_finite=False)), shift
        except LinAlgError:
            shift = max(4.0 * shift, 1e-3)


def _line_search(
    rod: Rod, shape: Shape, energy: float, gradient: Array, step: Array
) -> tuple[Shape, Near | None, float, float] | None:
    """The first shortened step that lowers the energy enough; None when none does."""
    move = step.reshape(-1, 4)
    longest = float(np.max(np.linalg.norm(move[:, 1:], axis=1)))
    share = min(1.0, LONGEST_MOVE_MM / longest) if longest > 0 else 1.0
    slope = float(gradient @ step)
    # rounding of the energy: below this a Newton step is taken on trust
    noise = 1e-13 * (abs(energy) + 1.0)
    while share > 1e-6:
        points = shape.points.copy()
        points[1:] += share * move[:, 1:]
        angles = np.ascontiguousarray(share * move[:, 0])
        near = _near(rod, points)
        trial = _energy(rod, shape, points, angles, near)
        if trial <= energy + 1e-4 * share * slope + noise:
            tangents, directors = shape.tangents.copy(), shape.directors.copy()
            kernels.carry(points, angles, tangents, directors, False)
            return Shape(points, tangents, directors), near, trial, share
        share *= 0.5
    return None
