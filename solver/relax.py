"""One relaxation: a state of the wire in, the minimum of its energy and the forces there out.

Also the settings of a relaxation, and the frame in which the introducer holds the wire.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver import _tolerances as tol
from solver._kernels.data import CURRENT, Limits
from solver._kernels.minimise import CLOSED_FORM, METHODS
from solver._kernels.start import follow
from solver.errors import refuse
from solver.grid import Array
from solver.solution import Solution
from solver.wall import VesselWall
from solver.wire import GuideWire
from solver.workspace import QUADRATURES, Workspace


def vector(name: str, value: ArrayLike) -> Array:
    """Three finite numbers as an array; ValueError where they are not."""
    v = np.array(value, dtype=np.float64)
    if v.shape != (3,) or not np.all(np.isfinite(v)):
        refuse("insertion", name, value, "three finite numbers", "LPS, in the unit of its name")
    return v


def unit(value: ArrayLike, name: str) -> Array:
    """The direction of a 3-vector; ValueError where it has none."""
    v = np.asarray(value, dtype=np.float64)
    size = float(np.linalg.norm(v)) if v.shape == (3,) else 0.0
    if not (np.isfinite(size) and size > 0):
        refuse("insertion", name, np.asarray(value).tolist(), "three finite numbers, not all 0", "give LPS")
    return v / size


def base_frame(direction: Array, material_axis: ArrayLike | None, roll_deg: float) -> Array:
    """Columns: material axes 1 and 2 and the direction of the wire at the entry, rolled right-handed about it."""
    if material_axis is None:
        axis = np.zeros(3)
        axis[int(np.argmin(np.abs(direction)))] = 1.0
    else:
        axis = unit(material_axis, "material_axis")
    across = axis - direction * float(axis @ direction)
    if float(np.linalg.norm(across)) < tol.PARALLEL:
        advice = "leave it out for the default"
        refuse("insertion", "material_axis", axis.tolist(), "not along entry_direction", advice)
    one = across / float(np.linalg.norm(across))
    two = _cross(direction, one)
    roll = np.deg2rad(roll_deg)
    first = np.cos(roll) * one + np.sin(roll) * two
    return np.column_stack([first, _cross(direction, first), direction])


def _cross(a: Array, b: Array) -> Array:
    """A x b: numpy's own costs 30 µs for three numbers."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@dataclass(frozen=True)
class Settings:
    """How to relax.

    tolerance : Newton decrement relative to the energy.     max_iterations : of one relaxation; the closed form
    may use five hundred sweeps for each.
    quadrature : of the wall's energy. "tip" integrates it under the last segments and sums joints elsewhere,
    "joints" is the seed's sum over joints (half a weight at the tip), "segments" integrates under all of them.
    """

    method: str = "newton"
    tolerance: float = tol.DECREMENT
    max_iterations: int = 200
    quadrature: str = "tip"

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        for name, allowed in (("method", METHODS), ("quadrature", QUADRATURES)):
            if getattr(self, name) not in allowed:
                refuse("solver", name, getattr(self, name), ", ".join(allowed), "choose one of these")
        if not 0 < self.tolerance < 1:
            refuse("solver", "tolerance", self.tolerance, "above 0, below 1", "1e-9 is the default")
        if self.max_iterations < 1:
            refuse("solver", "max_iterations", self.max_iterations, "1 or more", "200 is the default")

    @property
    def limits(self) -> Limits:
        """The same for the kernels."""
        method, count = METHODS.index(self.method), int(self.max_iterations)
        sweeps = tol.SWEEPS_PER_ITERATION if method == CLOSED_FORM else 1
        work = tol.WORK + tol.WORK_PER_ITERATION * count
        return Limits(method, float(self.tolerance), count * sweeps, work)


def relax(
    wire: GuideWire,
    wall: VesselWall | None = None,
    *,
    depth_mm: float,
    entry_mm: ArrayLike = (0.0, 0.0, 0.0),
    entry_direction: ArrayLike = (0.0, 0.0, 1.0),
    material_axis: ArrayLike | None = None,
    roll_deg: float = 0.0,
    start_mm: ArrayLike | None = None,
    load_N: ArrayLike | None = None,
    method: str = "newton",
    tolerance: float = tol.DECREMENT,
    max_iterations: int = 200,
    quadrature: str = "tip",
) -> Solution:
    """Relax one wire from a start shape, with optional dead loads and no wall if there is none.

    depth_mm : length beyond the entry.     start_mm : (m, 3) polyline from the entry that the wire is laid along
    before it relaxes (straight along entry_direction by default); friction acts against leaving it.
    load_N : (3,) dead force on the tip, or (k + 1, 3) on every joint, k from ``wire.segments_at(depth_mm)``.
    Raises ValueError for arguments that cannot be used; failures of the relaxation are a Status.
    """
    settings = Settings(method, tolerance, max_iterations, quadrature)
    if not (np.isfinite(depth_mm) and depth_mm > 0):
        refuse("relax", "depth_mm", depth_mm, "a positive length", "give the length beyond the entry")
    direction = unit(entry_direction, "entry_direction")
    entry = np.asarray(entry_mm, dtype=np.float64)
    curve = _polyline([entry, entry + direction * depth_mm] if start_mm is None else start_mm)
    work = Workspace(wire, wall, settings.quadrature, settings.limits)
    work.lay_out(depth_mm)
    if load_N is not None:
        work.load(load_N)
    work.clamp(entry, base_frame(direction, material_axis, roll_deg))
    chain, state = work.problem.chain, work.problem.state
    follow(curve, len(curve), chain, state.u[CURRENT], state.x[CURRENT], state.r[CURRENT], (0, work.k))
    status, iterations = work.advance(depth_mm, 0.0, work.k)
    solution = work.solution(status, iterations)
    vars(solution).update(depth_mm=depth_mm, roll_deg=roll_deg)
    return solution


def _polyline(points: ArrayLike) -> NDArray[np.float64]:
    """A start shape as an array (m, 3) mm; ValueError where it is none."""
    curve = np.array(points, dtype=np.float64)
    if curve.ndim != 2 or curve.shape[1] != 3 or len(curve) < 2 or not np.all(np.isfinite(curve)):
        refuse("relax", "start_mm", curve.shape, "(m, 3) finite points, m >= 2", "start at the entry")
    return curve
