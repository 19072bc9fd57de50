"""A lumen that the real wire ran out of was too small: opened where traces say so."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import map_coordinates

from pipeline.arrays.grids import in_memory_order, reorder
from pipeline.model import Curve, Lumen
from pipeline.segment._kernels.solids import cones
from solver.grid import read_only

OUTSIDE_VOXELS = 1.0
"""How far outside the wall a wire's axis lies before the wall is at fault: both are known to a fraction of that."""
SIGMAS = 3.0
"""and by so many standard deviations of the trace: at CNR 3 one ran 1.2 voxels outside a lumen that was right."""
ROOM_VOXELS = 0.5
"""Room around the wire where the lumen is opened: the error of a trace that was bridged."""


def opened(lumen: Lumen, curves: Sequence[Curve], radius_mm: float) -> Lumen:
    """The lumen with room for every trace of a wire of this radius, and a warning that says where it had none.

    The lumen itself where they all lie within it.
    """
    grid, axes = in_memory_order(lumen.distance)
    spacing = np.asarray(grid.spacing_mm)
    voxel, most = float(spacing.min()), float(np.max(grid.values))
    starts, ends, said = [], [], []
    for curve in curves:
        index = grid.to_index(curve.points_mm)
        depth = map_coordinates(grid.values, index.T, order=1, mode="constant", cval=most)
        out = depth > OUTSIDE_VOXELS * voxel + SIGMAS * np.nan_to_num(curve.sigma_mm)
        links = np.flatnonzero(out[:-1] | out[1:])
        starts.append((index * spacing)[links])
        ends.append((index * spacing)[links + 1])
        runs = np.split(np.flatnonzero(out), np.flatnonzero(np.diff(np.flatnonzero(out)) > 1) + 1)
        said += [(float(depth[run].max()), curve.points_mm[run[len(run) // 2]]) for run in runs if len(run)]
    if not said:
        return lumen
    values, first, last = np.array(grid.values), np.concatenate(starts), np.concatenate(ends)
    radius = np.full(len(first), radius_mm + ROOM_VOXELS * voxel)
    cones(first, last, radius, radius, spacing, most, values)
    deepest, place = max(said, key=lambda one: one[0])
    where = ", ".join(f"{x:.1f}" for x in place)
    text = (
        f"segment: traced wires ran up to {deepest:.2f} mm outside the lumen in {len(said)} place(s), allowed "
        f"{OUTSIDE_VOXELS * voxel:.2f} and {SIGMAS:g} standard deviations; furthest at [{where}] mm; the lumen was "
        "opened there: look whether vessel is missing, or give the lumen as a file (manifest key lumen)"
    )
    distance = reorder(grid.with_values(read_only(values)), axes)
    return replace(lumen, distance=distance, warnings=(*lumen.warnings, text))
