"""Stage 4: replay the insertion to the depth of every frame, each from the one before, never restarted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from time import perf_counter
from typing import Any

import numpy as np

from pipeline.model import Lumen, Simulated
from pipeline.simulate.clamp import Entry
from pipeline.simulate.config import SimulateConfig, SolverConfig
from pipeline.study.manifest import Case, Wire
from pipeline.study.schema import Profile
from solver import GuideWire, Insertion, VesselWall


def _scaled(profile: Profile, factor: float) -> Any:
    """A profile as the solver takes it, its values times ``factor``."""
    if isinstance(profile, (int, float)):
        return profile * factor
    return np.array(profile, dtype=np.float64) * (1.0, factor)


def guide_wire(wire: Wire, config: SolverConfig, simulate: SimulateConfig) -> GuideWire:
    """The manifest's wire as the solver takes it."""
    return GuideWire(
        segment_mm=config.segment_mm,
        radius_mm=wire.radius_mm,
        bending_stiffness_N_mm2=_scaled(wire.bending_stiffness_N_mm2, simulate.bending_scale),
        rest_curvature_per_mm=_scaled(wire.rest_curvature_per_mm, 1.0),
        torsional_stiffness_N_mm2=wire.torsional_stiffness_N_mm2,
    )


def vessel_wall(case: Case, lumen: Lumen, config: SolverConfig, simulate: SimulateConfig) -> VesselWall:
    """The lumen's signed distance as an elastic wall."""
    return VesselWall(
        lumen.distance,
        stiffness_N_mm2=case.wall.stiffness_N_mm2 * simulate.wall_scale,
        friction=case.wall.friction,
        hull=config.hull,
    )


def rolls(case: Case, count: int, simulate: SimulateConfig) -> list[float]:
    """Roll of every frame in degrees, the sensitivity offset added."""
    given = case.roll_deg
    values = (
        [0.0] * count
        if isinstance(given, str)
        else list(given)
        if isinstance(given, tuple)
        else [given] * count
    )
    return [value + simulate.roll_offset_deg for value in values]


def simulate(
    case: Case,
    entry: Entry,
    lumen: Lumen,
    depths_mm: Sequence[float],
    roll_deg: Sequence[float],
    solver: SolverConfig = SolverConfig(),
    config: SimulateConfig = SimulateConfig(),
) -> Iterator[Simulated]:
    """Yield the simulated wire, clamped at ``entry``, at each depth (mm from there to the tip), in the order given.

    A depth that cannot be reached is a status, not an exception; the last good state goes on to the next depth.
    """
    insertion = Insertion(
        guide_wire(case.wire, solver, config),
        vessel_wall(case, lumen, solver, config),
        entry.entry_mm,
        entry.direction,
        method=solver.method,
        initial=solver.initial,
        material_axis=case.material_axis,
        tolerance=solver.tolerance,
        max_iterations=solver.max_iterations,
        step_mm=solver.step_mm,
    )
    clock = perf_counter()
    for solution in insertion.to_depths(list(depths_mm), roll_deg=list(roll_deg)):
        yield _simulated(solution, perf_counter() - clock)
        clock = perf_counter()


def _simulated(solution: Any, seconds: float) -> Simulated:
    return Simulated(
        joints_mm=np.asarray(solution.joints_mm),
        contact_force_N=np.asarray(solution.contact_force_N),
        status=solution.status.name.lower(),
        sentence=str(solution.status.value),
        converged=bool(solution.converged),
        depth_mm=float(solution.depth_mm),
        roll_deg=float(solution.roll_deg),
        energy_N_mm=float(solution.energy_N_mm),
        iterations=int(solution.iterations),
        push_force_N=float(solution.push_force_N),
        max_penetration_mm=float(solution.max_penetration_mm),
        seconds=seconds,
        work=_numbers(solution.work),
    )


def _numbers(work: Any) -> dict[str, float]:
    items = work.items() if hasattr(work, "items") else vars(work).items()
    return {str(name): float(value) for name, value in items if isinstance(value, (int, float))}
