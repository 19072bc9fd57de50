"""simulate: the insertion replayed from the clamp to the depth of every frame, each from the one before."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Clamp, Lumen, Simulated, Wall, Wire
from pipeline.ranges import Profile
from pipeline.simulate.clamp import measured_clamp
from pipeline.simulate.config import SimulateConfig, SolverConfig
from solver import GuideWire, Insertion, Solution, VesselWall

__all__ = ["guide_wire", "insertion_of", "measured_clamp", "simulate"]


LEVELS = ("wall_look_ups_done_fraction", "start_energy_N_mm")
"""Entries of ``Solution.work`` that do not add up over frames."""


def _scaled(profile: Profile, factor: float) -> float | NDArray[np.float64]:
    """A profile as the solver takes it, its values times ``factor``."""
    if isinstance(profile, (int, float)):
        return profile * factor
    return np.array(profile, dtype=np.float64) * (1.0, factor)


def guide_wire(wire: Wire, segment_mm: float, bending_scale: float = 1.0) -> GuideWire:
    """The manifest's wire as the solver takes it."""
    return GuideWire(
        segment_mm=segment_mm,
        radius_mm=wire.radius_mm,
        bending_stiffness_N_mm2=_scaled(wire.bending_stiffness_N_mm2, bending_scale),
        rest_curvature_per_mm=_scaled(wire.rest_curvature_per_mm, 1.0),
        torsional_stiffness_N_mm2=wire.torsional_stiffness_N_mm2,
    )


def vessel_wall(wall: Wall, lumen: Lumen, hull: str, stiffness_scale: float = 1.0) -> VesselWall:
    """The lumen's signed distance as an elastic wall."""
    stiffness = wall.stiffness_N_mm2 * stiffness_scale
    return VesselWall(lumen.distance, stiffness_N_mm2=stiffness, friction=wall.friction, hull=hull)


def simulate(
    insertion: Insertion, depths_mm: Sequence[float], roll_deg: Sequence[float]
) -> Iterator[Simulated]:
    """Yield the simulated wire at each depth (mm from the clamp to the tip) and roll, in the order given.

    A depth that cannot be reached is a status, not an exception; the last good state goes on to the next depth.
    """
    clock = perf_counter()
    for solution in insertion.to_depths(list(depths_mm), roll_deg=list(roll_deg)):
        yield _simulated(solution, perf_counter() - clock)
        clock = perf_counter()


def insertion_of(
    wire: Wire,
    wall: Wall,
    lumen: Lumen,
    clamp: Clamp,
    solver: SolverConfig = SolverConfig(),
    config: SimulateConfig = SimulateConfig(),
) -> Insertion:
    """A wire clamped at the entry of a lumen, before its first push; ValueError where the solver refuses it."""
    return Insertion(
        guide_wire(wire, solver.segment_mm, config.bending_scale),
        vessel_wall(wall, lumen, solver.hull, config.wall_scale),
        clamp.entry_mm,
        clamp.direction,
        method=solver.method,
        initial=solver.initial,
        material_axis=clamp.material_axis,
        tolerance=solver.tolerance,
        max_iterations=solver.max_iterations,
        step_mm=solver.step_mm,
    )


def _simulated(solution: Solution, seconds: float) -> Simulated:
    return Simulated(
        joints_mm=solution.joints_mm,
        contact_force_N=solution.contact_force_N,
        status=solution.status.name.lower(),
        sentence=solution.sentence,
        converged=solution.converged,
        depth_mm=solution.depth_mm,
        iterations=solution.iterations,
        push_force_N=solution.push_force_N,
        max_penetration_mm=solution.max_penetration_mm,
        seconds=seconds,
        work={name: value for name, value in solution.work.items() if name not in LEVELS},
        levels={name: solution.work[name] for name in LEVELS},
    )
