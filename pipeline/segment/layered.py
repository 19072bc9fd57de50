"""A vessel in a wall of its own, as silicone in air or water: two edges lie beside each other, and half way is neither.

Half the contrast between contrast medium and air is met outside the silicone: the lumen came out 0.4 to 1.9 mm too
wide. The median grey over the distance from the wall that was found tells: it is one blurred step, or two. Of two the
inner one is the wall. The scan is then shown to the method with what is darker than the layer as bright as the layer.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.special import ndtr

from pipeline.segment.levels import Index
from solver.grid import Array, Grid

REACH = 8.5, 6.0
"""How far inside and outside the wall grey is looked at, in voxels."""
NEEDED = 2.0
"""How far inside and outside it must be known."""
EVERY = 0.5
LEAST, LOOKED_AT = 100, 200_000
"""Voxels that a distance needs, and how many are looked at."""
ONE_STEP = 0.004
"""Misfit of one step, over the contrast, from which two are tried: noise of a tenth leaves 0.001 of it."""
FITS = 0.55
"""Misfit of two steps over that of one from which they are two: 0.02 to 0.5 in layers of 1.3 to 7 voxels, 0.8 and more
in vessels without (27 scenes)."""
THINNEST = 0.8
"""Voxels: two edges that are nearer to each other are one that is blurred."""
STARTS = (-4.0, 4.0), (-2.0, 2.0), (-0.5, 1.5), (0.0, 3.0)
"""Where the inner edge and how thick the layer may be, in voxels, for the fit to begin with."""
MOVED = 0.3
"""Voxels by which the inner edge must lie inside the wall that was found; segmentation is right to 0.1."""


@dataclass(frozen=True)
class Layer:
    """What surrounds a vessel: its grey, that beyond it, and its thickness.

    floor : the grey below which there is no vessel; half way from it to the vessel's is met at the wall on average.
    inner, outer : voxels from the wall that was found, outwards.
    """

    grey: float
    beyond: float
    floor: float
    inner: float
    outer: float

    def shown(self, grid: Grid, distance: Grid, corner: Index) -> Grid:
        """The scan with nothing darker than the floor beyond the middle of the layer.

        distance : signed, on a box that begins at ``corner`` of the scan.  Nearer to the wall noise stays as it is.
        """
        values = np.maximum(grid.values, np.asarray(np.ceil(self.floor), grid.values.dtype))
        box = tuple(slice(int(c), int(c) + n) for c, n in zip(corner, distance.shape, strict=True))
        middle = 0.5 * (self.inner + self.outer) * float(np.mean(grid.spacing_mm))
        values[box] = np.where(distance.values < middle, grid.values[box], values[box])
        return grid.with_values(values)

    def said(self, voxel_mm: float) -> str:
        """The sentence for the report."""
        thick = (self.outer - self.inner) * voxel_mm
        return (
            f"segment: a layer of grey {self.grey:.0f}, {thick:.1f} mm thick, surrounds the vessel, and grey "
            f"{self.beyond:.0f} lies beyond it: it is taken for the wall of a phantom, and the lumen ends where it "
            "begins; where it is a clot, or contrast medium that has not mixed, give the lumen as a file (manifest key "
            "lumen)"
        )


def layer_around(grid: Grid, distance: Grid, corner: Index) -> Layer | None:
    """The layer between a vessel and what surrounds it, where the wall that was found lies in it; None elsewhere.

    distance : signed, mm, from that wall, on a box that begins at ``corner`` of the scan.
    """
    off = distance.values / float(np.mean(grid.spacing_mm))
    near = np.flatnonzero((off > -REACH[0]) & (off < min(REACH[1], float(off.max()) - EVERY)))
    near = near[:: max(1, len(near) // LOOKED_AT)]
    index = np.stack(np.unravel_index(near, distance.shape), axis=1) + corner
    layer = layer_in(off.reshape(-1)[near], grid.values[tuple(index.T)])
    return layer if layer is not None and layer.inner < -MOVED else None


def layer_in(off: Array, grey: Array) -> Layer | None:
    """The layer that grey (n,) at distances (n,) from a wall, in voxels, tells of; None where it falls in one step."""
    off, grey = _profile(off, grey)
    contrast = float(np.ptp(grey)) if len(grey) else 0.0
    if contrast <= 0.0 or off[0] > -NEEDED or off[-1] < NEEDED:
        return None
    one = _fitted(lambda q: _steps(off, q[:1], q[1]), grey, [0.0, 1.0], ([-8.0, 0.4], [4.0, 3.0]))
    if one[1] < ONE_STEP * contrast:
        return None
    room = [-8.0, THINNEST, 0.4], [2.0, 9.0, 2.0]
    fits = [_fitted(lambda q: _steps(off, np.cumsum(q[:2]), q[2]), grey, [*start, 1.0], room) for start in STARTS]
    (inner, thick, blur), misfit, (vessel, layer, beyond) = min(fits, key=lambda fit: fit[1])
    slack = 0.05 * contrast
    ordered = grey.max() + slack > vessel > layer > beyond > grey.min() - slack
    if not ordered or misfit > FITS * one[1]:
        return None
    at_wall = beyond + (layer - beyond) * float(ndtr(thick / blur)) + 0.5 * (vessel - layer)
    return Layer(layer, beyond, 2.0 * at_wall - vessel, inner, inner + thick)


def _profile(off: Array, grey: Array) -> tuple[Array, Array]:
    """Distances, EVERY voxels apart, and the median grey there, where enough of it is known."""
    bins = np.rint(off / EVERY).astype(int)
    steps, count = np.unique(bins, return_counts=True)
    steps = steps[count >= LEAST]
    return steps * EVERY, np.array([np.median(grey[bins == step]) for step in steps], float)


def _steps(off: Array, edges: Array, blur: float) -> Array:
    """Shares (n, levels) of the greys between blurred edges, at distances (n,)."""
    inside = np.stack([ndtr((edge - off) / blur) for edge in edges], axis=1)
    return np.diff(inside, axis=1, prepend=0.0, append=1.0)


def _fitted(
    shares: Callable[[Array], Array], grey: Array, start: list[float], room: tuple[list[float], list[float]]
) -> tuple[Array, float, Array]:
    """Edges and blur, the misfit (rms) and the greys, by least squares; the greys are linear."""

    def greys(q: Array) -> Array:
        return np.asarray(np.linalg.lstsq(shares(q), grey, rcond=None)[0])

    def left(q: Array) -> Array:
        return np.asarray(shares(q) @ greys(q) - grey)

    found = least_squares(left, start, bounds=room)
    return found.x, float(np.sqrt(np.mean(found.fun**2))), greys(found.x)
