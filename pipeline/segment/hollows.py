"""Hollows in a given lumen: a vessel has none, and the simulated wire meets a wall there where the real one passed."""

import numpy as np
from scipy.ndimage import label

from pipeline.arrays.grids import spelt
from solver.grid import Grid

LEAST_VOXELS = 8
"""Fewer are a speck that the spline of the distance smooths away."""


def hollows(distance: Grid) -> list[str]:
    """A warning where the lumen encloses what it does not hold: it hangs together with nothing outside."""
    numbers, count = label(distance.values >= 0.0)
    faces = [numbers.take(end, axis) for axis in range(3) for end in (0, -1)]
    sizes = np.bincount(numbers.reshape(-1), minlength=count + 1)
    sizes[np.unique(np.concatenate([face.reshape(-1) for face in faces]))] = 0
    sizes[0] = 0
    if sizes.max() < LEAST_VOXELS:
        return []
    largest = int(np.argmax(sizes))
    middle = distance.to_mm(np.argwhere(numbers == largest).mean(axis=0))
    volume, many = sizes[largest] * float(np.prod(distance.spacing_mm)), int((sizes >= LEAST_VOXELS).sum())
    what = f"the given lumen has {many} hollow{'s' * (many > 1)} inside it, and no simulated wire passes there"
    return [
        f"segment: {what}: the largest is {volume:.1f} mm³ at [{spelt(middle)}] mm; was a wire, air or calcium left "
        "out of it, or does a surface lie within another? Fill it in the file"
    ]
