"""One relaxation: a state of the wire in, the minimum of its energy and the forces there out.

Also the settings of a relaxation, and the frame in which the introducer holds the wire.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from solver import _tolerances as tol
from solver._kernels.data import CURRENT, Limits
from solver._kernels.minimise import CLOSED_FORM, METHODS
from solver._kernels.start import follow
from solver.doors import (
    ANGLE_DEG,
    ANYWHERE_MM,
    FAR_MM,
    Array,
    Found,
    Range,
    choice,
    instance,
    number,
    numbers,
    unit,
    vector,
    whole,
)
from solver.entry import refused_at
from solver.errors import refuse
from solver.solution import Solution, Status
from solver.wall import VesselWall
from solver.wire import GuideWire
from solver.workspace import QUADRATURES, Workspace

TOLERANCE = Range(1e-300, 1.0 - 1e-9, "1e-9 is the default")


def base_frame(direction: Array, material_axis: ArrayLike | None, roll_deg: float) -> Array:
    """Columns: material axes 1 and 2 and the direction of the wire at the entry, rolled right-handed about it."""
    if material_axis is None:
        axis = np.zeros(3)
        axis[int(np.argmin(np.abs(direction)))] = 1.0
    else:
        axis = unit("insertion", "material_axis", material_axis)
    across = axis - direction * float(axis @ direction)
    if float(np.linalg.norm(across)) < tol.PARALLEL:
        advice = "leave it out for the default"
        refuse("insertion", "material_axis", axis.tolist(), "not along entry_direction", advice)
    one = across / float(np.linalg.norm(across))
    two = _cross(direction, one)
    roll = np.deg2rad(roll_deg)
    first = np.cos(roll) * one + np.sin(roll) * two
    return np.column_stack([first, _cross(direction, first), direction])


def weight_of(what: str, wire: GuideWire, down: ArrayLike | None) -> Array:
    """Weight of the wire as a vector (3,), N/mm; ValueError where it has a weight but ``down`` is not given."""
    if down is not None:
        return unit(what, "down", down) * wire.weight_N_per_mm
    if wire.weight_N_per_mm > 0.0:
        refuse(what, "down", None, "a direction (3,), as the wire has a weight", "[0, 1, 0] for a patient on the back")
    return np.zeros(3)


def _cross(a: Array, b: Array) -> Array:
    """A x b: numpy's own costs 30 µs for three numbers."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


@dataclass(frozen=True)
class Settings:
    """How a relaxation is computed, and when it is finished.

    tolerance : the Newton decrement, relative to the energy, below which the wire is at rest.
    max_iterations : of one relaxation; the closed form may use five hundred sweeps for each of them.
    quadrature : how the energy of the wall is summed along the wire. "tip" integrates it under the last segments and
    takes the sum over joints elsewhere; "joints" is the paper's sum over joints, with half a weight at the tip;
    "segments" integrates it under all segments.
    """

    method: str = "newton"
    tolerance: float = tol.DECREMENT
    max_iterations: int = 200
    quadrature: str = "tip"

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        choice("solver", "method", self.method, METHODS)
        choice("solver", "quadrature", self.quadrature, QUADRATURES)
        number("solver", "tolerance", self.tolerance, TOLERANCE)
        whole("solver", "max_iterations", self.max_iterations, 1_000_000)

    @property
    def limits(self) -> Limits:
        """These settings as the kernels take them."""
        method, count = METHODS.index(self.method), int(self.max_iterations)
        sweeps = tol.SWEEPS_PER_ITERATION if method == CLOSED_FORM else 1
        return Limits(method, float(self.tolerance), count * sweeps, tol.WORK + tol.WORK_PER_ITERATION * count)


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
    down: ArrayLike | None = None,
    method: str = "newton",
    tolerance: float = tol.DECREMENT,
    max_iterations: int = 200,
    quadrature: str = "tip",
) -> Solution:
    """Relax one wire from a start shape, in a wall or (``wall=None``) in free space, under loads if there are any.

    depth_mm : length of wire beyond the entry.     start_mm : (m, 3) LPS polyline from the entry along which the wire
    is laid before it relaxes (by default straight along entry_direction); with friction it resists leaving that.
    load_N : (3,) a force on the tip, or (k + 1, 3) one on every joint, with k from ``wire.segments_at(depth_mm)``;
    forces keep their direction.     down : (3,) LPS, the direction of gravity.
    Raises ValueError for arguments that cannot be used; a relaxation that fails says so in the solution's status.
    """
    settings = Settings(method, tolerance, max_iterations, quadrature)
    check_scene("relax", wire, wall)
    longest = Range(1e-6, min(tol.USUAL_JOINTS * wire.segment_mm, FAR_MM), "use longer segments for a longer wire")
    depth_mm = number("relax", "depth_mm", depth_mm, longest)
    roll_deg = number("relax", "roll_deg", roll_deg, ANGLE_DEG)
    direction, entry = unit("relax", "entry_direction", entry_direction), vector("relax", "entry_mm", entry_mm)
    straight = np.stack([entry, entry + direction * depth_mm])
    curve = straight if start_mm is None else _polyline(start_mm, entry, wire.segment_mm)
    work = Workspace(wire, wall, settings.quadrature, settings.limits)
    work.lay_out(depth_mm)
    work.load((0.0, 0.0, 0.0) if load_N is None else load_N)
    work.clamp(entry, base_frame(direction, material_axis, roll_deg), weight=weight_of("relax", wire, down))
    chain, state = work.problem.chain, work.problem.state
    follow(curve - work.middle_mm, len(curve), chain, state.u[CURRENT], state.x[CURRENT], state.r[CURRENT], (0, work.k))
    return _judged(_allowed(work.solution(*work.advance(depth_mm, 0.0, work.k), depth_mm, roll_deg), wall, entry))


def _allowed(solution: Solution, wall: VesselWall | None, entry: Array) -> Solution:
    """The solution; one that is at rest where no insertion may begin or lead is not converged."""
    if wall is None or not solution.converged:
        return solution
    status = refused_at(wall, entry)
    if status is None and np.max(wall.distance.beyond_mm(solution.joints_mm)) > solution.radius_mm:
        status = Status.LEFT_GRID
    return solution if status is None else replace(solution, status=status)


def _judged(solution: Solution) -> Solution:
    """Without a pivot where the wire is not at rest: the last one may be of a state that it left long ago."""
    return solution if solution.converged else replace(solution, least_pivot=math.nan)


def _polyline(points: ArrayLike, entry: Array, within_mm: float) -> Array:
    """A start shape as an array (m, 3) mm, without repeated points; ValueError where it is no curve from the entry."""
    curve = numbers("relax", "start_mm", points, (None, 3), ANYWHERE_MM)
    apart = np.linalg.norm(np.diff(curve, axis=0), axis=1) > tol.MATCH_DEPTH_MM
    curve = np.asarray(curve[np.append(True, apart)[: len(curve)]])
    if len(curve) < 2:
        refuse("relax", "start_mm", Found(f"{len(curve)} different points"), "two or more", "start at the entry")
    away = float(np.linalg.norm(curve[0] - entry))
    if away > within_mm:
        refuse("relax", "start_mm", Found(f"a start {away:g} mm from entry_mm"), "a start there", "give both in LPS mm")
    return curve


def check_scene(what: str, wire: object, wall: object) -> None:
    """Refuse what is no wire, and what is neither a wall nor None."""
    instance(what, "wire", wire, GuideWire)
    if wall is not None:
        instance(what, "wall", wall, VesselWall)
