"""Is what the solver returned sound? Checked from the published state alone, with a second assembly of the statics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.benchmark import statics
from pipeline.benchmark.statics import Joints
from pipeline.benchmark.stress.plan import Plan
from solver import GuideWire, Solution, VesselWall

Array = NDArray[np.float64]

STRETCH = 1e-12
"""Largest change of a segment's length, relative to the larger of the segment and its distance from the origin."""
RESIDUAL = 1e-4
"""Largest moment left at a joint of a wire called converged, relative to the largest moment in it: ten times
what the solver itself asks for, because the last place of a stiff wall is lost in a second assembly."""
ENERGY_PLACE = 1e-12
"""Fraction of the energy that nobody can lower: a residual is nothing if even a wire free of wall would gain less."""
MOMENT_FLOOR_RAD = 1e-6
"""Joint angle whose moment is called nothing: where the rest shape is the answer there is no moment to compare with."""
ROSE = 1e-9
"""Largest rise of the energy over the start, relative."""
SADDLE = 1e-3
"""Curvature below minus this fraction of the softest joint's stiffness may be a way down: no minimum."""
AWAY_RAD = (1e-5, 1e-4, 1e-3)
"""How far a suspected way down is followed. Differences across a contact that opens are no proof by themselves."""
FALL = 1e-11
"""Fall of the energy, relative, averaged over both ways (which cancels the gradient), that proves a way down."""
HESSIAN_DOFS = 120
"""Largest number of joint angles whose Hessian is formed by differences."""


@dataclass(frozen=True)
class Verdict:
    """fault : empty, or what is wrong.     residual : relative moment left.     stretch : relative."""

    fault: str = ""
    detail: str = ""
    residual: float = float("nan")
    stretch: float = float("nan")


def judge(
    plan: Plan, wire: GuideWire, wall: VesselWall | None, solution: Solution, start_energy: float, deep: bool
) -> Verdict:
    """Judge one solution.

    start_energy : of the state that the last relaxation began with, NaN where it is not known.
    deep : also form the Hessian of a small chain and look for a way down.
    """
    broken = _broken(solution)
    if broken:
        return Verdict("nan", broken)
    if len(solution.joints_mm) < 2:
        return Verdict()
    joints = statics.joints_of(wire, solution.depth_mm)
    stretch = _stretch(joints, solution.joints_mm)
    if not stretch <= STRETCH:
        return Verdict("stretched", f"{stretch:.3g}", stretch=stretch)
    if solution.energy_N_mm > start_energy + ROSE * abs(start_energy) + 1e-15:
        return Verdict("energy_rose", f"{start_energy!r} to {solution.energy_N_mm!r}", stretch=stretch)
    if (
        not solution.converged
        or plan.friction > 0.0
        or (plan.hull != "offset" and plan.quadrature != "joints")
    ):
        return Verdict(stretch=stretch)
    return _at_rest(plan, wire, wall, solution, joints, stretch, deep)


def _broken(solution: Solution) -> str:
    fields: tuple[str, ...] = ("joints_mm", "frames", "energy_N_mm", "contact_force_N", "reaction_force_N")
    fields += ("reaction_torque_N_mm", "push_force_N", "max_penetration_mm")
    return ", ".join(name for name in fields if not np.all(np.isfinite(getattr(solution, name))))


def _stretch(joints: Joints, nodes: Array) -> float:
    """Relative to the larger of the length and the coordinates, whose last place bounds what can be kept."""
    steps = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
    reach = np.maximum(joints.length, np.abs(nodes).max())
    return float(np.max(np.abs(steps - joints.length) / reach))


def _at_rest(
    plan: Plan,
    wire: GuideWire,
    wall: VesselWall | None,
    solution: Solution,
    joints: Joints,
    stretch: float,
    deep: bool,
) -> Verdict:
    load = tip_load(plan, len(joints.length))
    forces = statics.wall_forces(wall, wire, joints, solution.joints_mm, solution.frames)
    if plan.quadrature == "joints":
        energy = statics.energy_of(joints, solution.frames, forces.energy, solution.joints_mm, load)
        scale = abs(solution.bending_energy_N_mm) + abs(solution.wall_energy_N_mm) + 1e-9
        if abs(energy - solution.energy_N_mm) > 1e-6 * (scale + abs(energy)):
            return Verdict("wrong_energy", f"{solution.energy_N_mm!r}, is {energy!r}", stretch=stretch)
    else:
        node = np.arange(len(solution.joints_mm))
        forces = statics.WallForces(solution.joints_mm, np.asarray(solution.contact_force_N), node, 0.0)
    gradient, elastic = statics.residual_moments(joints, solution.joints_mm, solution.frames, forces, load)
    scale = max(float(np.abs(elastic).max()), MOMENT_FLOOR_RAD * float(joints.bend.max()))
    noise = _noise(wall, joints, solution)
    residual = float(np.abs(gradient).max()) / scale
    left = float(np.sum(gradient**2 / (2.0 * joints.bend[:, None])))
    energies = abs(solution.bending_energy_N_mm) + abs(solution.wall_energy_N_mm)
    if not (residual <= RESIDUAL + noise / scale or left <= ENERGY_PLACE * energies):
        return Verdict("not_at_rest", f"moment {residual:.3g} of the largest", residual, stretch)
    if deep and plan.quadrature == "joints":
        down = way_down(wire, wall, solution, joints, load)
        if down:
            return Verdict("no_minimum", down, residual, stretch)
    return Verdict("", "", residual, stretch)


def _noise(wall: VesselWall | None, joints: Joints, solution: Solution) -> float:
    """Moment that the last place of the coordinates makes through the wall's stiffness, N mm."""
    if wall is None:
        return 0.0
    touching = int(np.count_nonzero(np.any(solution.contact_force_N != 0.0, axis=1)))
    place = 4 * np.finfo(float).eps * float(np.abs(solution.joints_mm).max())
    return place * wall.stiffness_N_mm2 * float(joints.length.max()) * touching * float(joints.length.sum())


def tip_load(plan: Plan, k: int) -> Array | None:
    """The plan's dead load on every node (k + 1, 3), or None."""
    if not any(plan.load_N):
        return None
    load = np.zeros((k + 1, 3))
    load[k] = plan.load_N
    return load


def way_down(
    wire: GuideWire, wall: VesselWall | None, solution: Solution, joints: Joints, load: Array | None
) -> str:
    """A sentence where the Hessian, by central differences of the second assembly, has a negative direction."""
    kinds = 3 if np.all(np.isfinite(joints.twist)) else 2
    k = len(joints.length)
    if kinds * k > HESSIAN_DOFS:
        return ""
    u = statics.angles_of(solution.frames, joints)
    u[:, kinds:] = 0.0

    def state(angles: Array) -> tuple[Array, Array, statics.WallForces]:
        nodes, frames = statics.roll_out(joints, angles, solution.joints_mm[0], solution.frames[0])
        return nodes, frames, statics.wall_forces(wall, wire, joints, nodes, frames)

    def gradient(angles: Array) -> Array:
        nodes, frames, forces = state(angles)
        return statics.residual_moments(joints, nodes, frames, forces, load)[0][:, :kinds].ravel()

    def energy(angles: Array) -> float:
        nodes, frames, forces = state(angles)
        return statics.energy_of(joints, frames, forces.energy, nodes, load)

    curvature, direction = _lowest(gradient, u, kinds)
    if curvature > -SADDLE * float(joints.bend.min()):
        return ""
    here, scale = energy(u), abs(solution.bending_energy_N_mm) + abs(solution.wall_energy_N_mm)
    for away in AWAY_RAD:
        fall = here - 0.5 * (energy(u + away * direction) + energy(u - away * direction))
        if fall > FALL * (scale + abs(here)):
            return f"curvature {curvature:.3g} N mm, the energy falls by {fall:.3g} of {here:.3g}"
    return ""


def _lowest(gradient: Callable[[Array], Array], u: Array, kinds: int) -> tuple[float, Array]:
    """Smallest eigenvalue and its direction (k, 3) of the Hessian by central differences."""
    step, size = 1e-6, kinds * len(u)
    hessian = np.empty((size, size))
    for i in range(size):
        moved = np.zeros_like(u)
        moved[i // kinds, i % kinds] = step
        hessian[i] = (gradient(u + moved) - gradient(u - moved)) / (2 * step)
    values, vectors = np.linalg.eigh(0.5 * (hessian + hessian.T))
    direction = np.zeros_like(u)
    direction[:, :kinds] = vectors[:, 0].reshape(-1, kinds)
    return float(values[0]), direction
