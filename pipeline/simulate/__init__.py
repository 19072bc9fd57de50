"""simulate: the insertion replayed from the clamp to the depth of every frame, each from the one before.

The clamp is measured in the scans: a hand-picked entry is off by half a voxel and a degree or two, and a clamp turned
by 2 degrees puts a free wire 0.35 mm off after 10 mm, more than everything else in the pipeline. The wire's first
millimetres are the same in every frame, so the frames together tell position and direction of the clamp. This is a
boundary condition, not a fit of the model: nothing beyond ``REACH_MM`` enters, and the report states it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.polyline import angle_deg, at_arc
from pipeline.model import Array, Clamp, Curve, Lumen, OverWire, Wall, Wire
from pipeline.ranges import Profile
from pipeline.simulate.config import COARSEST_MM, Segment, SimulateConfig, SolverConfig
from solver import Catheter, Grid, GuideWire, Insertion, Solution, VesselWall

REACH_MM = 8.0
"""Length of wire behind the entry that is used: long against the trace's error, short against a vessel's bend."""
SKIPPED_MM = 0.5  # the trace's own end lies here
FARTHEST_MM, LARGEST_TURN_DEG = 1.0, 10.0


def _start(curve: Curve) -> tuple[Array, Array]:
    """Point and tangent at arc length 0 from a parabola through the first millimetres."""
    arc = np.arange(SKIPPED_MM, REACH_MM + 1e-9, 0.25)
    terms = np.vander(arc, 3, increasing=True)
    coefficients, *_ = np.linalg.lstsq(terms, at_arc(curve.points_mm, arc), rcond=None)
    return coefficients[0], coefficients[1] / np.linalg.norm(coefficients[1])


def measured_clamp(curves: Sequence[Curve], given: Clamp) -> Clamp:
    """The clamp from the traced wires: medians over frames; the given one where they are too short or too far off.

    curves : traced wires that are to be trusted.     given : the clamp as the manifest has it.
    """
    starts = [_start(curve) for curve in curves if curve.length_mm > REACH_MM + 1.0]
    if not starts:
        return given
    point = np.median([p for p, _ in starts], axis=0)
    tangent = np.median([t for _, t in starts], axis=0)
    tangent /= np.linalg.norm(tangent)
    moved = float(np.linalg.norm(point - given.entry_mm))
    turned = angle_deg(tangent, given.direction)
    offset = f"{moved:.2f} mm and {turned:.1f} degrees from the manifest's"
    if moved > FARTHEST_MM or turned > LARGEST_TURN_DEG:
        warning = (
            f"the traced wires start {offset} (accepted: {FARTHEST_MM} mm and {LARGEST_TURN_DEG} degrees); the "
            "manifest's entry was kept: check entry_mm and entry_direction"
        )
        return replace(given, warning=warning)
    note = (
        f"the clamp was measured in the scans: median over {len(starts)} frames of the first {REACH_MM:g} mm of the "
        f"traced wire, {offset} entry (simulate.entry = manifest switches this off)"
    )
    return replace(given, entry_mm=point, direction=tangent, note=note)


__all__ = ["LEVELS", "altered", "guide_wire", "insertion_of", "measured_clamp", "simulate"]


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


@lru_cache(maxsize=1)
def _wall_of(distance: Grid, hull: str) -> VesselWall:
    """The lumen's wall, filtered once for all insertions of a case: with 256^3 voxels that takes a second."""
    return VesselWall(distance, stiffness_N_mm2=1.0, hull=hull)


def insertion_of(
    wire: Wire,
    wall: Wall,
    lumen: Lumen,
    clamp: Clamp,
    solver: SolverConfig = SolverConfig(),
    config: SimulateConfig = SimulateConfig(),
    catheter: OverWire | None = None,
) -> Insertion:
    """A wire clamped at the entry of a lumen, before its first push; ValueError where the solver refuses it."""
    stiffness = wall.stiffness_N_mm2 * config.wall_scale
    friction = wall.friction if config.friction is None else config.friction
    return Insertion(
        guide_wire(altered(wire, config), solver.segment_mm, config.bending_scale),
        _wall_of(lumen.distance, solver.hull).like(stiffness_N_mm2=stiffness, friction=friction),
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
