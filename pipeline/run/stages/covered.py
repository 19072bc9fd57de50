"""Room for wires and for catheters over them: where one covers a wire, the solver takes the wire's radius."""

from collections.abc import Mapping

import numpy as np

from pipeline.arrays.grids import spelt
from pipeline.arrays.polyline import at_arc, samples
from pipeline.model import Array, OverWire, arc_length
from reports.case_files import counted
from solver import Solution, VesselWall
from solver.self_contact import self_overlap_mm

STEP_MM = 0.5
CLIMB_RADII, CLIMB_STEPS = 2.0, 32
"""Length of the way to the vessel's middle, in radii of what lies in it, and its steps: the room is known to a 32nd of
one. Out of a corner, between a wall and the closed end behind an entry, the way is up to 1.7 radii long."""
CHECK = {
    "wire": "is it the diameter? Check radius_mm, and the lumen there",
    "catheter": "is it the diameter, or in French (6 of them are a radius of 1 mm)? Check its insertion_mm, and the "
    "lumen there",
}
NARROWER_VOXELS = 1.0
"""By how much the room may be less than the radius: a wall is known to half a voxel, and the middle of a vessel between
voxels is up to half a voxel farther from it than they say."""


def too_thick(what: str, radius_mm: float, lines: Mapping[int, Array], wall: VesselWall) -> list[str]:
    """A warning where the lumen has no room for a wire or a catheter. lines : where it lies, (n, 3) by frame."""
    least, where, count = np.inf, "", 0
    lies = {frame: points for frame, points in lines.items() if len(points) and radius_mm > 0.0}
    ends = np.cumsum([len(points) for points in lies.values()])
    # of all frames at once: the wall is looked up 33 times, and not as often for each
    rooms = np.split(room_mm(wall, np.concatenate([*lies.values()]), radius_mm), ends[:-1]) if lies else []
    for (frame, points), room in zip(lies.items(), rooms, strict=True):
        worst = int(np.argmin(room))
        count += bool(radius_mm > room[worst] + NARROWER_VOXELS * float(np.max(wall.distance.spacing_mm)))
        if room[worst] < least:
            least, where = float(room[worst]), f"in frame {frame} near [{spelt(points[worst])}] mm"
    if not count:
        return []
    return [
        f"{counted(count, 'frame')}: the {what} is thicker than the vessel: radius_mm = {radius_mm:g}, and "
        f"{where} the lumen has room for {max(least, 0.0):.2f} mm; the wire is simulated as if it fitted: {CHECK[what]}"
    ]


def along(wire: Solution, end_mm: float = np.inf) -> Array:
    """Points (n, 3) of a wire every STEP_MM from the entry to a depth or its tip; none of one not at rest."""
    end = min(end_mm, float(arc_length(wire.joints_mm)[-1])) if wire.converged else 0.0
    return at_arc(wire.joints_mm, samples(end, STEP_MM)) if end > 0.0 else np.empty((0, 3))


def room_mm(wall: VesselWall, points_mm: Array, radius_mm: float) -> Array:
    """Radii (n,) of the largest balls in the lumen that are met on the way from points (n, 3) to its middle.

    The way is long enough for what has ``radius_mm``, wherever it lies: no place of a vessel that is
    wide enough for it is called narrow, the closed end behind an entry included.
    """
    at, room = np.array(points_mm), np.full(len(points_mm), -np.inf)
    outside = np.maximum(wall.look_up(at)[0], 0.0)[:, None]
    for _ in range(CLIMB_STEPS + 1):
        distance, slope, _ = wall.look_up(at)
        room = np.maximum(room, -distance)
        steep = np.linalg.norm(slope, axis=1, keepdims=True)
        at = at - (outside + CLIMB_RADII * radius_mm) / CLIMB_STEPS * slope / np.where(steep > 0.0, steep, 1.0)
    return room


def deep_in_itself_mm(catheter: OverWire, tip_mm: float, wire: Solution) -> float:
    """How deep a catheter over a wire lies in itself, mm; the wire beyond its tip may touch it unseen."""
    points = along(wire, tip_mm)
    return self_overlap_mm(points, catheter.radius_mm) if len(points) > 1 else 0.0
