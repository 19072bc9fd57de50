"""The wire's energy and its minimum, slow and obvious: scipy rotations, a distance function, BFGS.

Shares no code with the solver; the wall is a Python function, the quadrature the sum over joints.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def hooke(d: Array) -> Array:
    """Energy of a mm of wire that is d mm beyond the lumen, over the wall's stiffness (eq. 6 and 7)."""
    return np.asarray(0.5 * d**2)


def joints_of(controls: Array, rest: Array, length: Array, base: Array, entry: ArrayLike) -> Array:
    """Joints (k + 1, 3): each joint turns by a rotation vector, control plus rest bend about axis 2."""
    frame, x = Rotation.from_matrix(base), [np.asarray(entry, dtype=float)]
    for u, beta, step in zip(controls, rest, length, strict=True):
        frame = frame * Rotation.from_rotvec([u[0], u[1] + beta, u[2]])
        x.append(x[-1] + step * frame.apply([0, 0, 1]))
    return np.array(x)


def energy(
    controls: Array,
    bend: Array,
    twist: Array,
    rest: Array,
    length: Array,
    base: Array,
    entry: ArrayLike,
    wall: Callable[[Array], Array] | None,
    stiffness: float,
    radius: float,
    load: Array,
    law: Callable[[Array], Array] = hooke,
) -> float:
    """Eq. 1-7 with half a weight at the tip, loads counted from the entry, N mm."""
    x = joints_of(controls, rest, length, base, entry)
    total = 0.5 * float(np.sum(bend * np.sum(controls[:, :2] ** 2, axis=1)))
    total += 0.5 * float(np.sum(twist[controls[:, 2] != 0] * controls[controls[:, 2] != 0, 2] ** 2))
    if wall is not None:
        weight = 0.5 * (length + np.append(length[1:], 0.0))
        depth = np.maximum(wall(x[1:]) + radius, 0.0)
        total += stiffness * float(np.sum(weight * law(depth)))
    return total - float(np.sum(load * (x - x[0])))


def minimum(k: int, components: int, function: Callable[[Array], float], start: Array) -> tuple[Array, float]:
    """Controls (k, 3) and energy of the minimum near a start; 2 components are bending, 3 bending and twist."""

    def padded(flat: Array) -> Array:
        return np.column_stack([flat.reshape(k, components), np.zeros((k, 3 - components))])

    best = minimize(lambda v: function(padded(v)), start[:, :components].ravel(), method="BFGS", tol=1e-10)
    best = minimize(lambda v: function(padded(v)), best.x, method="Nelder-Mead" if k == 1 else "BFGS", tol=1e-12)
    return padded(best.x), float(best.fun)
