"""Opens a lumen where traces of the real wire run outside it: there it was too small."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import map_coordinates

from pipeline.arrays.grids import in_memory_order, reorder, spelt
from pipeline.model import Array, Curve, Lumen
from pipeline.segment._kernels.solids import cones
from pipeline.segment.contact import how_many
from pipeline.segment.pieces import Gap, between_pieces, crossed
from solver.grid import Grid, read_only

OUTSIDE_VOXELS = 1.0
"""How far outside the wall a wire's axis lies before the wall is at fault: both are known to a fraction of that."""
SIGMAS = 3.0
"""Standard deviations of the trace to be added to that: at CNR 3 a trace ran 1.2 voxels outside a correct lumen."""
PRESSED_N_MM = 0.05
"""Line load with which a wire may press on its wall, N/mm: a tip that is caught in a soft tube presses with 0.03. A
wall of 0.03 N/mm² gives way by 1.7 mm under it: where it was opened for that, the simulated wire met none."""
Place = tuple[float, Array]
ROOM_VOXELS = 0.5
"""Room around the wire where the lumen is opened: the error of a trace that was bridged."""


def may_lie_outside_mm(voxel_mm: float, stiffness_N_mm2: float) -> float:
    """How far outside its wall a wire's axis may lie, mm, before the wall is at fault: a voxel, and what it yields."""
    return OUTSIDE_VOXELS * voxel_mm + PRESSED_N_MM / stiffness_N_mm2


def opened(
    lumen: Lumen, curves: Sequence[Curve], radius_mm: float, stiffness_N_mm2: float = np.inf, *, given: bool = False
) -> Lumen:
    """The lumen with room for every trace of a wire of this radius, and a warning that says where it had none.

    The lumen itself where all traces lie within it; with a warning alone where they lie no further outside than its
    wall may yield. Where they run from one piece of a given lumen to another it is opened, narrow as the gap may be.

    stiffness_N_mm2 : of the wall.     given : whether it was given as a file instead of segmented.
    """
    grid, axes = in_memory_order(lumen.distance)
    spacing = grid.spacing_mm
    voxel, most = grid.voxel_mm, float(np.max(grid.values))
    limit, allowed = OUTSIDE_VOXELS * voxel, may_lie_outside_mm(voxel, stiffness_N_mm2)
    _, pressed = _outside(grid, curves, limit)
    gaps = between_pieces(grid, curves) if given else []
    if not pressed and not gaps:
        return lumen
    links, said = _outside(grid, curves, allowed)
    do = "correct the file of the lumen" if given else "give the lumen as a file (manifest key lumen)"
    do = f"the lumen was opened there: look whether vessel is missing, or {do}"
    told, rooms = [], []
    if gaps:
        told.append(f"{crossed(gaps)}; {do}")
        rooms.append(_joined(gaps))
    if said:
        told.append(f"{_told(said, allowed)}; {do}")
        rooms.append(_along(links, radius_mm + ROOM_VOXELS * voxel))
    elif pressed:
        why = f"no further than a wall of {stiffness_N_mm2:g} N/mm² yields, and it was not opened"
        told.append(f"{_told(pressed, limit)}: {why}; look whether vessel is missing there")
    values = np.array(grid.values)
    for (first, last), (before, after) in rooms:
        cones(first * spacing, last * spacing, before, after, spacing, most, values)
    distance = reorder(grid.with_values(read_only(values)), axes) if rooms else lumen.distance
    return replace(lumen, distance=distance, warnings=(*lumen.warnings, *told))


Room = tuple[tuple[Array, Array], tuple[Array, Array]]
"""Both ends (n, 3) of round cones, as indices, and their radii (n,) there, mm."""


def _along(links: Sequence[tuple[Array, Array]], radius_mm: float) -> Room:
    """Room for a wire along the pieces of curves."""
    first, last = (np.concatenate(ends) for ends in zip(*links, strict=True))
    radius = np.full(len(first), radius_mm)
    return (first, last), (radius, radius)


def _joined(gaps: Sequence[Gap]) -> Room:
    """Vessel across gaps, as wide as on both sides: a hole of the wire's own width would lead the simulated one."""
    ends, radii = np.array([gap.ends for gap in gaps]), np.array([gap.radii_mm for gap in gaps])
    return (ends[:, 0], ends[:, 1]), (radii[:, 0].copy(), radii[:, 1].copy())


def _outside(grid: Grid, curves: Sequence[Curve], allowed: float) -> tuple[list[tuple[Array, Array]], list[Place]]:
    """Where curves lie further outside the wall than is allowed (mm, and SIGMAS): both ends of their pieces there, as
    indices of the grid; and how deep each of their runs lies, with its middle, LPS mm.
    """
    links, said = [], []
    for curve in curves:
        index, depth = grid.to_index(curve.points_mm), outside_mm(grid, curve.points_mm)
        out = depth > allowed + SIGMAS * np.nan_to_num(curve.sigma_mm)
        pieces = np.flatnonzero(out[:-1] | out[1:])
        links.append((index[pieces], index[pieces + 1]))
        runs = np.split(np.flatnonzero(out), np.flatnonzero(np.diff(np.flatnonzero(out)) > 1) + 1)
        said += [(float(depth[run].max()), curve.points_mm[run[len(run) // 2]]) for run in runs if len(run)]
    return links, said


def _told(said: Sequence[Place], allowed: float) -> str:
    """The places as the begin of a sentence."""
    deepest, place = max(said, key=lambda one: one[0])
    return (
        f"segment: traced wires ran up to {deepest:.2f} mm outside the lumen in {how_many(said)}, allowed "
        f"{allowed:.2f} and {SIGMAS:g} standard deviations; furthest at [{spelt(place)}] mm"
    )


def outside_mm(grid: Grid, points_mm: Array) -> Array:
    """Signed distance (n,), mm, at places (n, 3); beyond the scan's end an upper bound of it.

    A scan ends half a voxel beyond the middle of its last slice, and a wire enters through that end: there the vessel
    goes on, as far as anybody sees.
    """
    index = grid.to_index(points_mm)
    inside = map_coordinates(grid.values, index.T, order=1, mode="nearest")
    return np.asarray(inside + grid.beyond_mm(points_mm))
