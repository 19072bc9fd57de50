"""A vessel in a wall of its own, as silicone in air or water: two edges lie beside each other, and half way is neither.

Half the contrast between contrast medium and air is met outside the silicone: the lumen came out 0.4 to 1.9 mm too
wide. The median grey over the distance from the wall that was found tells: it is one blurred step, or two. Of two the
inner one is the wall. The scan is then shown to the method with what is darker than the layer as bright as the layer.
"""

import numpy as np

from pipeline.arrays.edges import EVERY, Layer, layer_in
from pipeline.arrays.grids import unflattened
from pipeline.segment.levels import Vessel, grey_around
from solver.grid import Grid

REACH = 8.5, 6.0
"""How far inside and outside the wall grey is looked at, in voxels."""
LOOKED_AT = 200_000
"""Voxels that are looked at."""
MOVED = 0.3
"""Voxels by which the inner edge must lie inside the wall that was found; segmentation is right to 0.1."""


def layer_around(vessel: Vessel) -> Layer | None:
    """The layer between a vessel and what surrounds it, where the wall that was found lies in it; None elsewhere.

    The grey at its seed is the vessel's: of bone and the vessel that it hangs together with, the vessel is not the
    layer.
    """
    grid, values, seed = vessel.scan, vessel.distance.values, vessel.levels.seed
    h = float(np.mean(grid.spacing_mm))
    known_mm = min(REACH[1] * h, float(values.max()) - EVERY * h)
    near = np.flatnonzero((values > -REACH[0] * h) & (values < known_mm))
    near = near[:: max(1, len(near) // LOOKED_AT)]
    index = unflattened(near, values.shape) + vessel.corner
    layer = layer_in(values.reshape(-1)[near] / h, grid.values[tuple(index.T)])
    if layer is None or layer.inner > -MOVED or seed is None:
        return None
    at_seed = float(grey_around(grid, np.array([seed]))[0])
    return layer if abs(layer.vessel - at_seed) < 0.3 * (layer.vessel - layer.grey) else None


def with_layer_alone(layer: Layer, vessel: Vessel) -> Grid:
    """The scan with nothing darker than the floor beyond the middle of the layer; nearer, noise stays as it is."""
    grid, box = vessel.scan, vessel.box
    values = np.maximum(grid.values, np.asarray(np.ceil(layer.floor), grid.values.dtype))
    middle = 0.5 * (layer.inner + layer.outer) * float(np.mean(grid.spacing_mm))
    values[box] = np.where(vessel.distance.values < middle, grid.values[box], values[box])
    return grid.with_values(values)


def surrounded(layer: Layer, voxel_mm: float) -> str:
    """The sentence for the report."""
    thick = (layer.outer - layer.inner) * voxel_mm
    return (
        f"segment: a layer of grey {layer.grey:.0f}, {thick:.1f} mm thick, surrounds the vessel, and grey "
        f"{layer.beyond:.0f} lies beyond it: it is taken for the wall of a phantom, and the lumen ends where it "
        "begins; where it is a clot, or contrast medium that has not mixed, give the lumen as a file (manifest key "
        "lumen)"
    )
