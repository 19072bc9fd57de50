"""Grey that differs along the wall: inside, where medium has settled, and outside, where the vessel leaves one tissue.

Half the vessel's contrast is then not half the contrast that its wall has. Where grey falls from a share s of the
contrast inside to a share o outside, it is a share q at ``sigma Phi^-1((q - o) / (s - o))`` inside the wall (sigma: the
blur, Phi: the normal distribution). s and o are read a little beside the wall that half the contrast gives. q is half
way between the lowest s and the highest o, so that every wall is met, which is then moved by that.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import ndtri

from pipeline.segment.levels import BRIGHTER, GreyLevels, Vessel
from pipeline.segment.uneven import EVEN, HIGHEST, LOWEST
from solver.grid import Array

BESIDE = 2.5
"""How far inside and outside the wall, in voxels, the grey has reached its plateau."""
ROOM = 2.0
"""Least distance from any wall, in voxels, of the place where it is read: nearer, another wall's blur is there, too."""
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
CLEAR = 0.09
"""Share of a wall's own contrast that q must be away from either side of it: nearer, no wall's place can be told."""
ALIKE = 0.18
"""Share of the contrast by which the outside may differ from that at the seed before it counts as another."""
TISSUE = 0.5
"""Share of the contrast up to which something outside is what surrounds the vessel: more is a vessel, bone or metal."""


@dataclass(frozen=True, eq=False)
class Sides:
    """Shares (n,) of the vessel's contrast just inside and just outside its wall, at places of a tree.

    The places are mm from the scan's first voxel.  low : the lowest share inside.  least : that over the highest, or
    over the median if the scan shows a wire, which is bright and no contrast medium.  around : lowest and highest share
    outside.  FEW per cent of the wall are left out of each.
    """

    places: cKDTree
    inside: Array
    outside: Array
    low: float = 1.0
    least: float = 1.0
    around: tuple[float, float] = (0.0, 0.0)

    @property
    def share(self) -> float:
        """The share of the contrast that is passed at every wall."""
        return 0.5 * (self.low + self.around[1])

    def level(self, levels: GreyLevels) -> float:
        """The grey of that share."""
        return levels.outside + self.share * levels.contrast

    def at(self, feet: Array) -> tuple[Array, Array]:
        """By how many blurs (n,) the wall lies outside places (n, 3) where grey falls to ``level``, and its steepness.

        Steepness (n,) is over that of a wall of the whole contrast, half way.
        """
        near = self.places.query(feet)[1]
        step = np.maximum(self.inside[near] - self.outside[near], 0.1)
        blurs = ndtri(np.clip((self.share - self.outside[near]) / step, CLEAR, 1.0 - CLEAR))
        return blurs, step * np.exp(-0.5 * blurs**2)

    def warning(self) -> tuple[str, ...]:
        """One sentence for the report where other tissue lies around the vessel, or none."""
        if self.around == (0.0, 0.0):
            return ()
        low, high = (round(100 * share) for share in self.around)
        return (
            f"segment: what lies around the vessel differs, from {low} to {high} % of the way from what it is at the "
            "seed to the vessel's grey; its wall was moved towards half way to what lies next to it: see the picture",
        )


@dataclass(frozen=True, eq=False)
class _Wall:
    """The wall of a vessel, beside which the scan's grey is read.

    feet : places (n, 3) on it, mm from the scan's first voxel.  normals : (n, 3), outward.
    """

    vessel: Vessel
    feet: Array
    normals: Array

    @property
    def step(self) -> int:
        """Every which of its places makes LOOKED_AT, or so."""
        return max(1, len(self.feet) // LOOKED_AT)

    @property
    def some(self) -> "_Wall":
        """The same with these places alone."""
        return replace(self, feet=self.feet[:: self.step], normals=self.normals[:: self.step])

    def beside(self, way: float) -> tuple[Array, Array]:
        """Places (m, 3) with room beside them, ``way`` -1 inside, 1 outside, and the share (m,) of contrast there."""
        vessel, spacing = self.vessel, self.vessel.scan.spacing_mm
        h = float(np.max(spacing))
        index = np.rint((self.feet + way * BESIDE * h * self.normals) / spacing).astype(np.int64) - vessel.corner
        kept = np.all((index >= 0) & (index < vessel.distance.shape), axis=1)
        kept[kept] = way * vessel.distance.values[tuple(index[kept].T)] > ROOM * h
        return self.feet[kept], vessel.levels.share(vessel.grey_around(index[kept]))


def sides_of(vessel: Vessel, wall: tuple[Array, Array], wire: bool) -> Sides | None:
    """What lies along the wall on both of its sides; None where it is the same all along, or the vessel is thin.

    wall : places (n, 3) on it, mm from the scan's first voxel, and outward normals (n, 3).  wire : whether the scan
    shows one.
    """
    if vessel.levels.foreign:  # with bone or metal in it, nobody can tell; that is said by itself
        return None
    along = _Wall(vessel, *wall)
    # a fainter layer of medium looks like tissue from inside the other: where there is one, nothing is asked of outside
    return _filled(along, wire) or _around_it(along)


def _filled(wall: _Wall, wire: bool) -> Sides | None:
    """How far the vessel is filled along its wall, if that differs."""

    def read(wall: _Wall) -> tuple[Array, Array]:
        feet, share = wall.beside(-1.0)
        return feet, np.clip(share, LOWEST, HIGHEST if wire else BRIGHTER)

    low, full = _extremes(*read(wall.some), wall.step, 50.0 if wire else 100.0 - FEW)
    if not low < EVEN * full:
        return None
    feet, share = read(wall)
    places = cKDTree(feet)
    return Sides(places, _around(places, share, AROUND), np.zeros(len(feet)), low, low / full)


def _around_it(wall: _Wall) -> Sides | None:
    """What surrounds the vessel along its wall, if that differs from what does at the seed."""

    def read(wall: _Wall) -> tuple[Array, Array]:
        feet, share = wall.beside(1.0)
        return feet[share < TISSUE], share[share < TISSUE]

    low, high = _extremes(*read(wall.some), wall.step, 100.0 - FEW)
    if not (low <= -ALIKE or high >= ALIKE):
        return None
    feet, share = read(wall)
    places = cKDTree(feet)
    return Sides(places, np.ones(len(feet)), _around(places, share, WIDELY), around=(low, max(high, 0.0)))


def _extremes(feet: Array, share: Array, step: int, most: float) -> tuple[float, float]:
    """The FEW-th and the ``most``-th percentile of shares (n,) at places (n, 3), each a mean over those around it.

    step : every which of all places these are, of which WIDELY are averaged.  NaN where there are too few.
    """
    if len(feet) * step < LEAST_PLACES:
        return np.nan, np.nan
    places = cKDTree(feet)
    low, high = np.percentile(_around(places, share, max(1, min(WIDELY // step, len(feet) // 4))), (FEW, most))
    return float(low), float(high)


def _around(places: cKDTree, values: Array, count: int) -> Array:
    """Means (n,) of the values (n,) of the ``count`` places next to each."""
    nearest = places.query(places.data, min(count, len(values)))[1]
    return np.asarray(np.mean(values[nearest].reshape(len(values), -1), axis=1))
