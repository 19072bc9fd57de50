"""A contrast that differs across the vessel: medium that has settled at the bottom, or flows beside unmixed blood.

Half the vessel's contrast is then not half the contrast that its wall has. Where the vessel is filled to a share s,
grey falls to a share q of the whole at ``sigma Phi^-1(q / s)`` inside the wall (sigma: the blur, Phi: the normal
distribution). s is read a little inside the wall that half the contrast gives. q is half of the lowest s, so that every
wall is met, which is then moved by that.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import ndtri

from pipeline.segment.levels import BRIGHTER, GreyLevels, Index, grey_around
from pipeline.segment.uneven import EVEN, HIGHEST, LOWEST
from solver.grid import Array, Grid

INWARDS = 2.5
"""How far inside the wall, in voxels, the grey has reached its plateau."""
ROOM = 2.0
"""Least depth, in voxels, of the place where it is read: in a thinner vessel the far wall's blur is there, too."""
LEAST_PLACES = 200
AROUND = 40
"""Places beside each other whose shares are averaged; each is a mean over 3^3 voxels before."""
WIDELY = 300
"""The same where it is looked whether the vessel is filled evenly: with 40, correlated noise at a contrast of 4 to 6
looks like sides filled to 0.78 of the fullest, with 300 to 0.87."""
LOOKED_AT = 2000
"""Places, or so, at which that is looked at, of all vessels: all places are for those that are filled unevenly."""
FEW = 5.0
"""Percentage of the wall that may be filled otherwise before the vessel counts as filled unevenly."""
FAINT = 0.55
"""Share over the lowest below which no wall's place can be told: its level is hardly reached."""


@dataclass(frozen=True, eq=False)
class Filled:
    """Share (n,) of the vessel's contrast just inside its wall, at places of a tree, mm from the scan's first voxel.

    low : the lowest share, FEW per cent of the wall left out.  least : that over the highest, likewise; over the median
    if the scan shows a wire, which is bright and no contrast medium.
    """

    places: cKDTree
    share: Array
    low: float
    least: float

    def level(self, levels: GreyLevels) -> float:
        """Half way to the lowest share: the grey that is passed at every wall."""
        return levels.outside + 0.5 * self.low * levels.contrast

    def at(self, feet: Array) -> tuple[Array, Array]:
        """By how many blurs (n,) the wall lies outside places (n, 3) where grey falls to ``level``, and its steepness.

        Steepness (n,) is over that of a wall of the whole contrast, half way.
        """
        share = np.maximum(self.share[self.places.query(feet)[1]], FAINT * self.low)
        blurs = ndtri(0.5 * self.low / share)
        return blurs, share * np.exp(-0.5 * blurs**2)


def filled_unevenly(
    scan: Grid, distance: Grid, corner: Index, levels: GreyLevels, wall: tuple[Array, Array], wire: bool
) -> Filled | None:
    """How far the vessel is filled along its wall, if that differs; None where it is filled evenly or is thin.

    distance : signed distance on the vessel's box, which begins at ``corner`` of the scan.  wall : places (n, 3) on it,
    mm from the scan's first voxel, and outward normals (n, 3).  wire : whether the scan shows one.
    """
    if levels.foreign:  # with bone or metal in it, nobody can tell; that is said by itself
        return None
    h = float(np.max(scan.spacing_mm))
    feet, normals = wall
    inner = np.rint((feet - INWARDS * h * normals) / scan.spacing_mm).astype(np.int64) - corner
    kept = np.all((inner >= 0) & (inner < distance.shape), axis=1)
    kept[kept] = distance.values[tuple(inner[kept].T)] < -ROOM * h
    at = np.flatnonzero(kept)
    if len(at) < LEAST_PLACES:
        return None

    def read(at: Index) -> tuple[cKDTree, Array]:
        share = (grey_around(scan, inner[at] + corner) - levels.outside) / levels.contrast
        return cKDTree(feet[at]), np.clip(share, LOWEST, HIGHEST if wire else BRIGHTER)

    step = max(1, len(at) // LOOKED_AT)
    places, share = read(at[::step])
    few = _around(places, share, min(WIDELY // step, places.n // 4))
    low, full = np.percentile(few, (FEW, 50.0 if wire else 100.0 - FEW))
    if low >= EVEN * full:
        return None
    places, share = read(at)
    return Filled(places, _around(places, share, AROUND), float(low), float(low / full))


def _around(places: cKDTree, values: Array, count: int) -> Array:
    """Means (n,) of the values (n,) of the ``count`` places next to each."""
    return np.asarray(np.mean(values[places.query(places.data, count)[1]], axis=1))
