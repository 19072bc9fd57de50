"""simulate: the insertion replayed from the clamp to the depth of every frame, each from the one before."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

from pipeline.arrays.grids import wall_of_grid
from pipeline.model import Clamp, Lumen, OverWire, Wall, Wire
from pipeline.ranges import scaled
from pipeline.simulate.config import COARSEST_MM, Segment, SimulateConfig, SolverConfig
from pipeline.simulate.way import Way
from solver import Catheter, Grid, GuideWire, Insertion, Insertions, Solution, VesselWall

__all__ = ["LEVELS", "altered", "guide_wire", "inserted", "insertion_of", "simulate", "together", "wall_of"]


LEVELS = ("wall_look_ups_done_fraction", "start_energy_N_mm")
"""Entries of ``Solution.work`` that do not add up over frames."""


def altered(wire: Wire, config: SimulateConfig) -> Wire:
    """The manifest's wire with another taper and another rest curvature, as a sensitivity run asks for."""
    stiffness = wire.bending_stiffness_N_mm2
    if not isinstance(stiffness, (int, float)):
        stiffness = [(distance * config.taper_scale, value) for distance, value in stiffness]
    curvature = scaled(wire.rest_curvature_per_mm, config.rest_curvature_scale)
    return replace(wire, bending_stiffness_N_mm2=stiffness, rest_curvature_per_mm=curvature)


def guide_wire(wire: Wire, segment_mm: Segment, bending_scale: float = 1.0) -> GuideWire:
    """The manifest's wire as the solver takes it; "auto" are the longest segments that ``resolution`` begins with."""
    return GuideWire(
        segment_mm=COARSEST_MM if segment_mm == "auto" else segment_mm,
        radius_mm=wire.radius_mm,
        bending_stiffness_N_mm2=scaled(wire.bending_stiffness_N_mm2, bending_scale),
        rest_curvature_per_mm=wire.rest_curvature_per_mm,
        torsional_stiffness_N_mm2=wire.torsional_stiffness_N_mm2,
        weight_N_per_mm=wire.weight_N_per_mm,
    )


def simulate(insertion: Insertion, way: Way) -> Iterator[Solution]:
    """Yield the simulated wire at each stop of a way that is read, in its order; all stops are gone through.

    A depth that cannot be reached is a status, not an exception; the last good state goes on to the next depth.
    ValueError where the solver refuses the way.
    """
    return iter(way.of(insertion.to_depths(way.depths_mm, way.rolls_deg, way.tips_mm)))


def together(insertions: Sequence[Insertion], ways: Sequence[Way], threads: int | None = 1) -> list[list[Solution]]:
    """The wires of several insertions, each on its own way, at its stops that are read.

    They are made side by side; those with a catheter, which cannot be, one after the other.     threads : of those side
    by side; None is one per core.
    """
    found: list[list[Solution]] = [[] for _ in ways]
    plain = [i for i, way in enumerate(ways) if not way.sheathed]
    if plain:
        depths, rolls = [ways[i].depths_mm for i in plain], [ways[i].rolls_deg for i in plain]
        beside = Insertions([insertions[i] for i in plain], threads=threads).to_depths(depths, rolls)
        for i, wires in zip(plain, beside, strict=True):
            found[i] = [*ways[i].of(wires)]
    for i, way in enumerate(ways):
        if way.sheathed:
            found[i] = [*simulate(insertions[i], way)]
    return found


@lru_cache(maxsize=1)
def wall_of(distance: Grid, hull: str) -> VesselWall:
    """The lumen's wall, filtered once for all insertions of a case: with 256^3 voxels that takes a second."""
    return wall_of_grid(distance, hull=hull)


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
