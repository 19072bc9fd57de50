"""Is what the solver returned sound? Checked from the published state alone, with a second assembly of the statics."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pipeline.benchmark.stress.lumens import NEAR, changes_vessel, near_vessels
from pipeline.benchmark.stress.plan import ScenePlan, placement
from pipeline.benchmark.stress.rubbing import rubbed
from pipeline.benchmark.stress.statics import Array, StaticChain, assemble
from solver import GuideWire, Solution, VesselWall

STRETCH = 1e-12
"""Largest change of a segment's length, relative to the larger of the segment and the wire's largest coordinate."""
RESIDUAL = 1e-4
"""Largest moment left at a joint of a wire called converged, relative to the largest moment in it: ten times
what the solver itself asks for, because the last place of a stiff wall is lost in a second assembly."""
RUBBED, SETTLED = 1e-2, 5e-4
"""RESIDUAL with friction; and the share of the largest contact force, with the whole wire as its lever, that may be
unbalanced, since loads and their directions are settled to 1e-4."""
TURNED = 0.01
"""Share of mu N, per mm of the wire's radius, that contacts which still stick may be off, with the same lever: settled
directions may have turned by 1e-4 rad, and a spring slips at 1e-3 mm, so one alone may be off by ten times as much."""
ENERGY_PLACE = 1e-12
"""Fraction of the energy: a residual does not count where following it would gain less, even without the wall."""
MOMENT_FLOOR_RAD = 1e-6
"""Joint angle whose moment counts as none: where the rest shape is the answer there is no moment to compare with."""
ROSE = 1e-9
"""Largest rise of the energy over that of the start, relative."""
SADDLE = 1e-3
"""Curvature below minus this fraction of the softest joint's stiffness may be a way down: no minimum."""
AWAY_RAD = (1e-5, 1e-4, 1e-3)
"""How far a suspected way down is followed. Differences across a contact that opens are no proof by themselves."""
FALL = 1e-11
"""Relative fall of the energy, averaged over both ways (which cancels the gradient), that proves a way down."""
HESSIAN_DOFS = 120
"""Largest number of joint angles whose Hessian is formed by differences."""
PUBLISHED = (
    "joints_mm", "frames", "energy_N_mm", "contact_force_N", "reaction_force_N", "reaction_torque_N_mm",
    "push_force_N", "max_penetration_mm",
)  # fmt: skip
"""Fields of a solution that must be finite."""


@dataclass(frozen=True)
class SceneVerdict:
    """fault : empty, or what is wrong.     residual : relative moment left.     stretch : relative."""

    fault: str = ""
    detail: str = ""
    residual: float = float("nan")
    stretch: float = float("nan")


def judge(
    plan: ScenePlan, wire: GuideWire, wall: VesselWall | None, solution: Solution, start_energy: float, deep: bool
) -> SceneVerdict:
    """Judge one solution.

    start_energy : of the state that the last relaxation began with, NaN where it is not known.
    deep : also form the Hessian of a small chain and look for a way down.
    """
    broken = [name for name in PUBLISHED if not np.all(np.isfinite(getattr(solution, name)))]
    if broken:
        return SceneVerdict("nan", ", ".join(broken))
    if len(solution.joints_mm) < 2:
        return SceneVerdict()
    chain = assemble(wire, wall, solution.depth_mm, plan.load_N)
    # relative to the larger of length and coordinates, whose last place bounds what can be kept
    steps = np.linalg.norm(np.diff(solution.joints_mm, axis=0), axis=1)
    reach = np.maximum(chain.length, np.abs(solution.joints_mm).max())
    stretch = float(np.max(np.abs(steps - chain.length) / reach))
    if not stretch <= STRETCH:
        return SceneVerdict("stretched", f"{stretch:.3g}", stretch=stretch)
    if solution.energy_N_mm > start_energy + ROSE * abs(start_energy) + 1e-15:
        return SceneVerdict("energy_rose", f"{start_energy!r} to {solution.energy_N_mm!r}", stretch=stretch)
    if wall is not None and (text := _strays(plan, solution)):
        return SceneVerdict("wrong_lumen", text, stretch=stretch)
    joints, smooth = plan.quadrature == "joints", plan.hull == "offset"
    if not solution.converged or not (joints and smooth if plan.friction else joints or smooth):
        return SceneVerdict(stretch=stretch)
    if plan.friction:
        return replace(_rubs(plan, chain, solution), stretch=stretch)
    return replace(_at_rest(chain, solution, joints, deep), stretch=stretch)


def _strays(plan: ScenePlan, solution: Solution) -> str:
    """A sentence where the wire is in a vessel that it never entered.

    Not checked for a relaxation that failed, which lies where it stopped, nor where noise makes and breaks walls. A
    wall of less than two voxels is not on the grid.
    """
    voxel = float(max(plan.voxel_mm))
    known = solution.converged or plan.way == "insertion"
    if plan.lumen not in NEAR or plan.septum_mm < 2.0 * voxel or plan.noise_mm > 0.0 or plan.defect or not known:
        return ""
    turn, shift = placement(plan)
    joints = (np.asarray(solution.joints_mm) - shift) @ turn
    distances = near_vessels(plan.lumen, joints, plan.lumen_mm, plan.septum_mm)
    return changes_vessel(plan.lumen, joints, distances, voxel)


def _rubs(plan: ScenePlan, chain: StaticChain, solution: Solution) -> SceneVerdict:
    """Does friction keep its law, and do the moments balance with it?"""
    text, held = rubbed(plan, chain, solution)
    if text:
        return SceneVerdict("friction", text)
    state = (np.asarray(solution.joints_mm), np.asarray(solution.frames))
    gradient, elastic = chain.moments(*state, np.asarray(solution.contact_force_N), held)
    scale = max(float(np.abs(elastic).max()), MOMENT_FLOOR_RAD * float(chain.bend.max()))
    residual = float(np.abs(gradient).max()) / scale
    unsettled = SETTLED + TURNED * plan.friction * plan.radius_mm
    unsettled *= float(np.abs(solution.contact_force_N).max() * chain.length.sum())
    if residual > RUBBED + (_noise(chain, solution) + unsettled) / scale:
        return SceneVerdict("not_at_rest", f"moment {residual:.3g} of the largest, friction held", residual)
    return SceneVerdict(residual=residual)


def _at_rest(chain: StaticChain, solution: Solution, at_joints: bool, deep: bool) -> SceneVerdict:
    """Do the moments of a wire called converged balance, and is there no way down from it?

    at_joints : the solver looks the wall up where the second assembly does; else its own contact forces are taken.
    """
    state = (solution.joints_mm, solution.frames)
    parts = abs(solution.bending_energy_N_mm) + abs(solution.wall_energy_N_mm)
    energy = chain.energy(*state)
    if at_joints and abs(energy - solution.energy_N_mm) > 1e-6 * (parts + 1e-9 + abs(energy)):
        return SceneVerdict("wrong_energy", f"{solution.energy_N_mm!r}, is {energy!r}")
    gradient, elastic = chain.moments(*state, None if at_joints else np.asarray(solution.contact_force_N))
    scale = max(float(np.abs(elastic).max()), MOMENT_FLOOR_RAD * float(chain.bend.max()))
    residual = float(np.abs(gradient).max()) / scale
    left = float(np.sum(gradient**2 / (2.0 * chain.bend[:, None])))
    if not (residual <= RESIDUAL + _noise(chain, solution) / scale or left <= ENERGY_PLACE * parts):
        return SceneVerdict("not_at_rest", f"moment {residual:.3g} of the largest", residual)
    down = _way_down(chain, solution, parts) if deep and at_joints else ""
    return SceneVerdict("no_minimum" if down else "", down, residual)


def _noise(chain: StaticChain, solution: Solution) -> float:
    """Moment, N mm, that rounding of the coordinates causes through the wall's stiffness."""
    if chain.wall is None:
        return 0.0
    touching = int(np.count_nonzero(np.any(solution.contact_force_N != 0.0, axis=1)))
    place = 4 * np.finfo(float).eps * float(np.abs(solution.joints_mm).max())
    length = chain.length
    return place * chain.wall.stiffness_N_mm2 * float(length.max()) * touching * float(length.sum())


def _way_down(chain: StaticChain, solution: Solution, parts: float) -> str:
    """A sentence where the Hessian, by central differences of the second assembly, has a negative direction."""
    if chain.kinds * len(chain.length) > HESSIAN_DOFS:
        return ""
    start = chain.angles(solution.frames)
    start[:, chain.kinds :] = 0.0

    def state(angles: Array) -> tuple[Array, Array]:
        return chain.roll_out(angles, solution.joints_mm[0], solution.frames[0])

    def energy(angles: Array) -> float:
        return chain.energy(*state(angles))

    def gradient(angles: Array) -> Array:
        return chain.moments(*state(angles))[0][:, : chain.kinds].ravel()

    curvature, direction = _lowest(gradient, start, chain.kinds)
    if curvature > -SADDLE * float(chain.bend.min()):
        return ""
    here = energy(start)
    for away in AWAY_RAD:
        fall = here - 0.5 * (energy(start + away * direction) + energy(start - away * direction))
        if fall > FALL * (parts + abs(here)):
            return f"curvature {curvature:.3g} N mm, the energy falls by {fall:.3g} of {here:.3g}"
    return ""


def _lowest(gradient: Callable[[Array], Array], start: Array, kinds: int) -> tuple[float, Array]:
    """Smallest eigenvalue and its direction (k, 3) of the Hessian by central differences."""
    step, free = 1e-6, [(joint, kind) for joint in range(len(start)) for kind in range(kinds)]
    hessian = np.empty((len(free), len(free)))
    for row, place in zip(hessian, free, strict=True):
        moved = np.zeros_like(start)
        moved[place] = step
        row[:] = (gradient(start + moved) - gradient(start - moved)) / (2 * step)
    values, vectors = np.linalg.eigh(0.5 * (hessian + hessian.T))
    direction = np.zeros_like(start)
    direction[:, :kinds] = vectors[:, 0].reshape(-1, kinds)
    return float(values[0]), direction
