"""One relaxation: a state of the wire in, the minimum of its energy and the forces there out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from solver import _tolerances as tol
from solver._kernels.energy import CHEAP, CLEAR, FULL, LEVENBERG, ROLLOUTS, SWEEPS, Switch
from solver._kernels.follow import follow
from solver._kernels.minimise import BROKEN, CONVERGED, EXHAUSTED, STALLED, minimise
from solver.chain import ALL_SKIPS, Buffers, base_frame, unit
from solver.grid import read_only
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
}
TIP_PANELS = 5


@dataclass(frozen=True)
class Settings:
    """How hard to try. tolerance : Newton decrement relative to the energy.  max_iterations : per relaxation."""

    method: str = "newton"
    tolerance: float = tol.DECREMENT
    max_iterations: int = 200
    tip: str = "integrated"
    switch: Switch = field(default=ALL_SKIPS)

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        choices = {"method": ("newton", "closed_form"), "tip": ("integrated", "joint")}
        for name, allowed in choices.items():
            if getattr(self, name) not in allowed:
                msg = (
                    f"solver: {name}: got {getattr(self, name)!r}; allowed: {', '.join(allowed)}; choose one"
                )
                raise ValueError(msg)
        if not 0 < self.tolerance < 1:
            msg = f"solver: tolerance: got {self.tolerance!r}; allowed: above 0, below 1; 1e-9 is the default"
            raise ValueError(msg)
        if self.max_iterations < 1:
            msg = (
                f"solver: max_iterations: got {self.max_iterations!r}; allowed: 1 or more; 200 is the default"
            )
            raise ValueError(msg)


def tip_rule(kind: str) -> tuple[Array, Array]:
    """Places (from the tip, as fractions of the last segment) and weights of its wall integral.

    "joint": the tip joint alone with half a weight. "integrated": two Gauss points on each of a few panels that
    shrink towards the tip, so that a contact run much shorter than the segment is still seen.
    """
    if kind == "joint":
        return np.zeros(1), np.ones(1)
    edges = np.concatenate([[0.0], 0.5 ** np.arange(TIP_PANELS - 1, -1, -1)])
    width, centre = np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    offset = width / (2 * np.sqrt(3.0))
    return np.concatenate([centre - offset, centre + offset]), np.concatenate([width, width]) / 2


def buffers_for(wire: GuideWire, wall: VesselWall | None, settings: Settings) -> Buffers:
    """Work space for a wire in a wall."""
    at, weight = tip_rule(settings.tip)
    if wall is None:
        from solver._kernels.layout import Rule

        return Buffers(wire, None, Rule(np.zeros((0, 2)), 0.0, at, weight))
    return Buffers(wire, wall, wall.rule(wire.radius_mm, at, weight))


def minimise_buffers(b: Buffers, settings: Settings) -> tuple[Status, int, float]:
    """Relax the current state of a work space in place; return status, iterations and energy."""
    outcome, iterations, which, energy = minimise(
        b.field,
        b.stiffness,
        b.spacing,
        b.chain,
        b.state,
        b.k,
        b.scratch,
        settings.switch,
        b.wire.twists,
        settings.tolerance,
        settings.max_iterations,
        b.report,
        b.parts,
    )
    if which == 1:
        for array in b.state:
            array[0] = array[1]
    status = OUTCOMES[outcome]
    if status is Status.CONVERGED and folded(b):
        status = Status.FOLDED
    return status, iterations, energy


def folded(b: Buffers) -> bool:
    """Whether two consecutive segments turn by more than a right angle."""
    along = b.state.r[0, : b.k + 1, :, 2]
    return bool(np.any(np.einsum("na,na->n", along[1:], along[:-1]) < tol.FOLD_COSINE))


def contact_forces(b: Buffers) -> tuple[Array, float]:
    """The wall's force on the wire at each joint (k + 1, 3) and the deepest penetration, mm."""
    k, first = b.k, b.chain.first
    force = np.zeros((k + 1, 3))
    count = int(first[k + 1]) if k and b.stiffness else 0
    if not count:
        return force, 0.0
    depth = b.state.depth[0, :count]
    touching = np.flatnonzero(depth)
    if not touching.size:
        return force, 0.0
    size = b.stiffness * b.chain.weight[touching] * depth[touching]
    each = -size[:, None] * b.state.jet[0, touching, 1:4]
    node = np.searchsorted(first[: k + 2], touching, side="right") - 1
    # a point inside the last segment belongs to its two ends in proportion
    share = -b.chain.offset[touching, 2] / b.chain.length[node - 1]
    np.add.at(force, node, (1 - share)[:, None] * each)
    np.add.at(force, node - 1, share[:, None] * each)
    return force, float(depth.max())


def push_force(b: Buffers) -> float:
    """dU/d(depth), N: the axial force of the hand, at the minimum, when the introducer guides without friction."""
    if b.k == 0:
        return 0.0
    c, u = b.chain, b.state.u[0]
    force = float(b.report[6:9] @ b.state.r[0, 1, :, 2])
    force -= 0.5 * c.bend[0] * float(u[0, :2] @ u[0, :2]) / b.first_mm
    if b.k > 1:
        force -= 0.5 * c.bend[1] * float(u[1, :2] @ u[1, :2]) / (b.first_mm + c.length[1])
    return float(force)


def work_of(counter: NDArray[np.int64]) -> Mapping[str, float]:
    """Counters by name."""
    looked = int(counter[FULL] + counter[CHEAP] + counter[CLEAR])
    return {
        "wall_look_ups": float(counter[FULL]),
        "wall_look_ups_cheap": float(counter[CHEAP]),
        "wall_look_ups_proven_unnecessary": float(counter[CLEAR]),
        "wall_look_ups_done_fraction": float(counter[FULL]) / looked if looked else 0.0,
        "sweeps": float(counter[SWEEPS]),
        "rollouts": float(counter[ROLLOUTS]),
        "levenberg": float(counter[LEVENBERG]),
    }


def solution_of(
    b: Buffers, status: Status, iterations: int, energy: float, depth: float, roll: float
) -> Solution:
    """Dress the current state of a work space."""
    n = b.k + 1
    force, deepest = contact_forces(b)
    return Solution(
        joints_mm=read_only(b.state.x[0, :n].copy()),
        frames=read_only(b.state.r[0, :n].copy()),
        energy_N_mm=energy,
        bending_energy_N_mm=float(b.parts[0]),
        wall_energy_N_mm=float(b.parts[1]),
        status=status,
        iterations=iterations,
        contact_force_N=read_only(force),
        reaction_force_N=read_only(b.report[6:9].copy()),
        reaction_torque_N_mm=float(b.report[11]),
        push_force_N=push_force(b),
        max_penetration_mm=deepest,
        depth_mm=depth,
        roll_deg=roll,
        work=work_of(b.counter),
    )


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
    tip: str = "integrated",
) -> Solution:
    """Relax one wire from a start shape, with optional dead loads and no wall if there is none.

    depth_mm : length beyond the entry.     start_mm : (m, 3) polyline from the entry that the wire is laid along
    before it relaxes (straight along entry_direction by default).
    load_N : (3,) dead force on the tip, or (k + 1, 3) on every joint, k from ``wire.segments_at(depth_mm)``.
    Raises ValueError for arguments that cannot be used; failures of the relaxation are a Status.
    """
    settings = Settings(method=method, tolerance=tolerance, max_iterations=max_iterations, tip=tip)
    if not (np.isfinite(depth_mm) and depth_mm > 0):
        msg = (
            f"relax: depth_mm: got {depth_mm!r}; allowed: a positive length; give the length beyond the entry"
        )
        raise ValueError(msg)
    b = buffers_for(wire, wall, settings)
    b.lay_out(depth_mm)
    set_loads(b, load_N)
    direction = unit(entry_direction, "entry_direction")
    entry = np.asarray(entry_mm, dtype=np.float64)
    b.state.x[:, 0] = entry
    b.state.r[:, 0] = base_frame(direction, material_axis, roll_deg)
    curve = (
        np.array([entry, entry + direction * depth_mm])
        if start_mm is None
        else np.array(start_mm, dtype=float)
    )
    follow(curve, len(curve), b.chain, b.state.u[0], b.state.x[0], b.state.r[0], b.k)
    status, iterations, energy = minimise_buffers(b, settings)
    return solution_of(b, status, iterations, energy, depth_mm, roll_deg)


def set_loads(b: Buffers, load_N: ArrayLike | None) -> None:
    """Put dead loads on the joints of the current chain."""
    if load_N is None:
        return
    load = np.asarray(load_N, dtype=np.float64)
    if load.shape == (3,):
        b.chain.load[b.k] = load
    elif load.shape == (b.k + 1, 3):
        b.chain.load[: b.k + 1] = load
    else:
        msg = f"relax: load_N: got shape {load.shape}; allowed: (3,) on the tip or ({b.k + 1}, 3); see segments_at"
        raise ValueError(msg)
