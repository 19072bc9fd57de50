"""One relaxation: a state of the wire in, the minimum of its energy and the forces there out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver import _tolerances as tol
from solver._kernels.chain import Rule
from solver._kernels.data import (
    BENDING,
    DEEPEST,
    PUSH,
    RUBBING,
    START,
    WALL,
    Switch,
)
from solver._kernels.follow import follow
from solver._kernels.handle import Journey, bind
from solver._kernels.insertion import AT, ENERGY, Base, advance
from solver._kernels.minimise import BROKEN, CONVERGED, EXHAUSTED, STALLED
from solver._kernels.relaxation import FOLDED, LEFT_GRID, UNSETTLED, Orders
from solver.chain import Buffers, base_frame, unit
from solver.errors import refuse
from solver.solution import Solution
from solver.status import Status
from solver.wall import VesselWall
from solver.wire import GuideWire

Array = NDArray[np.float64]

OUTCOMES = {
    CONVERGED: Status.CONVERGED,
    EXHAUSTED: Status.MAX_ITERATIONS,
    STALLED: Status.STALLED,
    BROKEN: Status.NON_FINITE,
    UNSETTLED: Status.FRICTION,
    FOLDED: Status.FOLDED,
    LEFT_GRID: Status.LEFT_GRID,
}
METHODS = ("newton", "closed_form")
QUADRATURES = ("tip", "joints", "segments")
TIP_PANELS = 5
"""Panels of the last segment, each half as long as the one before: the last is 1/16 of it."""
TIP_ZONE = 4
"""Segments before the last with two Gauss points each: they cover the tip's contact run where segments are short."""


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
    switch: Switch = field(default_factory=Switch)

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
    def orders(self) -> Orders:
        """The same for the kernels."""
        closed = self.method == "closed_form"
        sweeps = tol.SWEEPS_PER_ITERATION if closed else 1
        count = int(self.max_iterations)
        work = tol.WORK + tol.WORK_PER_ITERATION * count
        return Orders(closed, float(self.tolerance), count * sweeps, work)


def look_up_rule(wire: GuideWire, wall: VesselWall | None, quadrature: str) -> Rule:
    """Where a wire's segments look the wall up.

    The last segment has two Gauss points on each of a few panels that shrink towards the tip, so that a contact
    run much shorter than the segment is still seen.
    """
    hull, reach = wall.hull_points(wire.radius_mm) if wall is not None else (np.zeros((0, 2)), 0.0)
    if quadrature == "joints":
        return Rule(hull, reach, np.zeros(1), np.ones(1), 0)
    edges = np.concatenate([[0.0], 0.5 ** np.arange(TIP_PANELS - 1, -1, -1)])
    width, centre = np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    offset = width / (2 * np.sqrt(3.0))
    at, weight = np.concatenate([centre - offset, centre + offset]), np.concatenate([width, width]) / 2
    return Rule(hull, reach, at, weight, TIP_ZONE if quadrature == "tip" else 2**62)


def buffers_for(wire: GuideWire, wall: VesselWall | None, settings: Settings) -> Buffers:
    """Work space for a wire in a wall."""
    if settings.method == "closed_form" and wire.twists:
        stiffness = wire.torsional_stiffness_N_mm2
        refuse(
            "solver",
            "torsional_stiffness_N_mm2",
            stiffness,
            "inf with method closed_form",
            "use method newton",
        )
    return Buffers(wire, wall, look_up_rule(wire, wall, settings.quadrature), settings.switch)


def relax_buffers(b: Buffers, settings: Settings) -> tuple[Status, int, float]:
    """Relax the current state of a work space in place; return status, iterations and energy, N mm."""
    nowhere = Base(np.zeros(3), np.eye(3), np.zeros(3), False, False, 1.0, 1.0, 0.0, 0.0)
    at = np.zeros(AT)
    depth = float(b.chain.length[: b.k].sum())
    journey = bind(Journey(b.problem, b.cut, nowhere, settings.orders, at, b.report, b.force))
    outcome, iterations, _ = advance(journey, depth, 0.0, b.k)
    return OUTCOMES[outcome], iterations, float(at[ENERGY])


def solution_of(
    b: Buffers, status: Status, iterations: int, energy: float, depth: float, roll: float
) -> Solution:
    """Dress the current state of a work space."""
    n, state = b.k + 1, b.state
    report, parts = b.report.tolist(), state.parts[0].tolist()
    kept = [state.x[0, :n].copy(), state.r[0, :n].copy(), b.force[:n].copy(), b.report[6:9].copy()]
    for array in kept:
        array.setflags(write=False)
    solution = object.__new__(Solution)
    # a frozen dataclass sets its fields one by one, which takes 2 µs of the 40 that a step may take
    vars(solution).update(
        joints_mm=kept[0],
        frames=kept[1],
        energy_N_mm=energy,
        bending_energy_N_mm=parts[BENDING],
        wall_energy_N_mm=parts[WALL],
        friction_energy_N_mm=parts[RUBBING],
        status=status,
        iterations=iterations,
        contact_force_N=kept[2],
        reaction_force_N=kept[3],
        reaction_torque_N_mm=report[11],
        push_force_N=report[PUSH],
        max_penetration_mm=report[DEEPEST],
        depth_mm=depth,
        roll_deg=roll,
        counts=tuple(b.counter.tolist()),
        start_energy_N_mm=report[START],
    )
    return solution


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
    switch: Switch | None = None,
) -> Solution:
    """Relax one wire from a start shape, with optional dead loads and no wall if there is none.

    depth_mm : length beyond the entry.     start_mm : (m, 3) polyline from the entry that the wire is laid along
    before it relaxes (straight along entry_direction by default); friction acts against leaving it.
    load_N : (3,) dead force on the tip, or (k + 1, 3) on every joint, k from ``wire.segments_at(depth_mm)``.
    Raises ValueError for arguments that cannot be used; failures of the relaxation are a Status.
    """
    settings = Settings(method, tolerance, max_iterations, quadrature, switch or Switch())
    if not (np.isfinite(depth_mm) and depth_mm > 0):
        refuse("relax", "depth_mm", depth_mm, "a positive length", "give the length beyond the entry")
    b = buffers_for(wire, wall, settings)
    b.lay_out(depth_mm)
    set_loads(b, load_N)
    direction = unit(entry_direction, "entry_direction")
    entry = np.asarray(entry_mm, dtype=np.float64)
    curve = (
        np.array([entry, entry + direction * depth_mm])
        if start_mm is None
        else np.array(start_mm, dtype=float)
    )
    if curve.ndim != 2 or curve.shape[1] != 3 or len(curve) < 2 or not np.all(np.isfinite(curve)):
        refuse("relax", "start_mm", curve.shape, "(m, 3) finite points, m >= 2", "start at the entry")
    b.state.x[:, 0] = entry
    b.state.r[:, 0] = base_frame(direction, material_axis, roll_deg)
    follow(curve, len(curve), b.chain, b.state.u[0], b.state.x[0], b.state.r[0], b.k)
    status, iterations, energy = relax_buffers(b, settings)
    return solution_of(b, status, iterations, energy, depth_mm, roll_deg)


def set_loads(b: Buffers, load_N: ArrayLike | None) -> None:
    """Put dead loads on the joints of the current chain."""
    if load_N is None:
        return
    load = np.asarray(load_N, dtype=np.float64)
    if load.shape not in ((3,), (b.k + 1, 3)) or not np.all(np.isfinite(load)):
        refuse(
            "relax", "load_N", load.shape, f"(3,) on the tip or ({b.k + 1}, 3)", "see GuideWire.segments_at"
        )
    b.chain.load[:] = 0.0
    b.chain.load[b.k if load.ndim == 1 else slice(0, b.k + 1)] = load
