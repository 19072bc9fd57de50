"""simulate: the insertion replayed from the clamp to the depth of every frame, each from the one before."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Clamp, Lumen, OverWire, Wall, Wire
from pipeline.ranges import Profile
from pipeline.simulate.config import COARSEST_MM, Segment, SimulateConfig, SolverConfig
from solver import Catheter, Grid, GuideWire, Insertion, Insertions, Solution, VesselWall

__all__ = ["LEVELS", "altered", "guide_wire", "inserted", "insertion_of", "simulate", "together", "wall_of"]


LEVELS = ("wall_look_ups_done_fraction", "start_energy_N_mm")
"""Entries of ``Solution.work`` that do not add up over frames."""


def _scaled(profile: Profile, factor: float) -> float | NDArray[np.float64]:
    """A profile as the solver takes it, its values times ``factor``."""
    if isinstance(profile, (int, float)):
        return profile * factor
    return np.array(profile, dtype=np.float64) * (1.0, factor)


def altered(wire: Wire, config: SimulateConfig) -> Wire:
    """The manifest's wire with another taper and another rest curvature, as a sensitivity run asks for."""
    stiffness = wire.bending_stiffness_N_mm2
    if not isinstance(stiffness, (int, float)):
        stiffness = [(distance * config.taper_scale, value) for distance, value in stiffness]
    curvature = wire.rest_curvature_per_mm
    if isinstance(curvature, (int, float)):
        curvature *= config.rest_curvature_scale
    else:
        curvature = [(distance, value * config.rest_curvature_scale) for distance, value in curvature]
    return replace(wire, bending_stiffness_N_mm2=stiffness, rest_curvature_per_mm=curvature)


def guide_wire(wire: Wire, segment_mm: Segment, bending_scale: float = 1.0) -> GuideWire:
    """The manifest's wire as the solver takes it; "auto" are the longest segments that ``resolution`` begins with."""
    return GuideWire(
        segment_mm=COARSEST_MM if segment_mm == "auto" else segment_mm,
        radius_mm=wire.radius_mm,
        bending_stiffness_N_mm2=_scaled(wire.bending_stiffness_N_mm2, bending_scale),
        rest_curvature_per_mm=_scaled(wire.rest_curvature_per_mm, 1.0),
        torsional_stiffness_N_mm2=wire.torsional_stiffness_N_mm2,
        weight_N_per_mm=wire.weight_N_per_mm,
    )


def simulate(
    insertion: Insertion,
    depths_mm: Sequence[float],
    roll_deg: Sequence[float],
    catheter_mm: Sequence[float] | None = None,
) -> Iterator[Solution]:
    """Yield the simulated wire at each depth (mm from the clamp to the tip), roll and catheter, in the order given.

    A depth that cannot be reached is a status, not an exception; the last good state goes on to the next depth.
    """
    return insertion.to_depths(list(depths_mm), list(roll_deg), 0.0 if catheter_mm is None else list(catheter_mm))


def together(
    insertions: Sequence[Insertion],
    depths_mm: Sequence[Sequence[float]],
    roll_deg: Sequence[float] | Sequence[Sequence[float]],
    catheter_mm: Sequence[float] | None = None,
) -> list[list[Solution]]:
    """The wires of several insertions, each with its own depths, with the same catheter; side by side.

    roll_deg : of every depth, the same for all or for each insertion its own.
    """
    rolls = np.broadcast_to(np.asarray(roll_deg, dtype=np.float64), np.shape(depths_mm)).tolist()
    if catheter_mm is None:
        return Insertions(insertions, threads=1).to_depths(depths_mm, rolls)
    tips = [[min(tip, mm) for tip, mm in zip(catheter_mm, depths, strict=True)] for depths in depths_mm]
    ways = zip(insertions, depths_mm, rolls, tips, strict=True)
    return [list(one.to_depths(depths, roll, tip)) for one, depths, roll, tip in ways]


@lru_cache(maxsize=1)
def wall_of(distance: Grid, hull: str) -> VesselWall:
    """The lumen's wall, filtered once for all insertions of a case: with 256^3 voxels that takes a second."""
    return VesselWall(distance, stiffness_N_mm2=1.0, hull=hull)


def insertion_of(
    wire: Wire,
    wall: Wall,
    lumen: Lumen | VesselWall,
    clamp: Clamp,
    solver: SolverConfig = SolverConfig(),
    config: SimulateConfig = SimulateConfig(),
    catheter: OverWire | None = None,
) -> Insertion:
    """A wire clamped at the entry of a lumen, before its first push; ValueError where the solver refuses it.

    lumen : or its wall, whose own stiffness and friction are replaced.
    """
    vessel = lumen if isinstance(lumen, VesselWall) else wall_of(lumen.distance, solver.hull)
    stiffness = wall.stiffness_N_mm2 * config.wall_scale
    friction = wall.friction if config.friction is None else config.friction
    vessel = vessel.like(stiffness_N_mm2=stiffness, friction=friction)
    return inserted(vessel, altered(wire, config), clamp, solver, config.bending_scale, catheter)


def inserted(
    vessel: VesselWall,
    wire: Wire,
    clamp: Clamp,
    solver: SolverConfig,
    bending_scale: float = 1.0,
    catheter: OverWire | None = None,
) -> Insertion:
    """A wire clamped at the entry of a vessel with a wall that is made already, before its first push."""
    return Insertion(
        guide_wire(wire, solver.segment_mm, bending_scale),
        vessel,
        clamp.entry_mm,
        clamp.direction,
        method=solver.method,
        initial=solver.initial,
        material_axis=clamp.material_axis,
        tolerance=solver.tolerance,
        max_iterations=solver.max_iterations,
        step_mm=solver.step_mm,
        down=clamp.down,
        finest_mm=solver.finest_mm,
        catheter=None if catheter is None else Catheter(catheter.bending_stiffness_N_mm2, catheter.radius_mm),
    )
