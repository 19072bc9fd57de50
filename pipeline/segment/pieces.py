"""A given lumen that is in several pieces: no wire goes from one to another, and a missing slice is easily overlooked.

Two voxels that were missing across a vessel let every frame be ok: the simulated wire turned back at a wall that is
none, centreline predictors fell away beyond it, and the skill against those that were left rose.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import label, map_coordinates
from scipy.spatial import cKDTree

from pipeline.arrays.grids import indices_of, spelt
from pipeline.model import Array, Curve
from pipeline.segment.levels import box_around
from solver.grid import Grid

NEAR_MM = 3.0
"""Pieces farther apart are vessels of their own; a slice of a CT series is 0.5 to 3 mm thick."""
LEAST_SHARE = 0.01
"""Share of the entry's piece below which another one is a speck."""
AROUND_MM = 3.0
"""How far from a gap the vessel's middle is looked for: one of radius r is as wide as itself r from where it is cut."""


class Gap(NamedTuple):
    """Where a curve crosses from one piece to another: how long that is, mm along it, and its middle, LPS mm.

    ends : indices (2, 3) of the grid in the middle of both pieces beside the gap.     radii_mm : of the lumen there.
    """

    long_mm: float
    middle_mm: Array
    ends: Array
    radii_mm: tuple[float, float]


def in_pieces(distance: Grid, entry_mm: ArrayLike) -> list[str]:
    """A warning where the lumen goes on in another piece close to that which the wire enters."""
    pieces = _pieces(distance)
    inside = indices_of(pieces > 0)
    whose = pieces[tuple(inside.T)]
    if not len(inside) or whose.max() < 2:
        return []
    places = distance.to_mm(inside)
    entered = whose[np.argmin(np.sum((places - np.asarray(entry_mm)) ** 2, axis=1))]
    own = whose == entered
    sizes = np.bincount(whose)
    others = ~own & (sizes[whose] >= LEAST_SHARE * np.count_nonzero(own))
    if not others.any():
        return []
    apart, nearest = (np.atleast_1d(found) for found in cKDTree(places[own]).query(places[others]))
    closest = int(np.argmin(apart))
    if apart[closest] > NEAR_MM:
        return []
    middle = 0.5 * (places[others][closest] + places[own][nearest[closest]])
    count = len(np.unique(whose[others])) + 1
    return [
        f"segment: the given lumen is in {count} pieces, and no simulated wire goes from one to another: one begins "
        f"{apart[closest]:.1f} mm (between the middles of voxels) from that which the wire enters, near "
        f"[{spelt(middle)}] mm; is a slice missing there, or a part of the surface, or do two surfaces overlap? Close "
        "the gap, or unite them, in the file"
    ]


def between_pieces(distance: Grid, curves: Sequence[Curve]) -> list[Gap]:
    """Where curves run from one piece of the lumen to another, narrow as the gap may be."""
    pieces = _pieces(distance)
    gaps = []
    for curve in curves if pieces.max() > 1 else ():
        index = distance.to_index(curve.points_mm)
        at = map_coordinates(pieces, index.T, order=0, mode="nearest")
        for first, last in pairwise(np.flatnonzero(at > 0)):
            if at[first] != at[last]:
                (one, here), (other, there) = (_middle(distance, pieces, at[n], index[n]) for n in (first, last))
                ends = curve.points_mm[[first, last]]
                long = float(np.linalg.norm(ends[1] - ends[0]))
                gaps.append(Gap(long, ends.mean(axis=0), np.array([one, other]), (here, there)))
    return gaps


def _middle(distance: Grid, pieces: NDArray[np.int32], number: int, near: Array) -> tuple[Array, float]:
    """Index (3,) of a numbered piece's place farthest from its wall, close to an index, and how far that is, mm."""
    box = box_around(distance, np.clip(np.rint(near), 0, np.array(distance.shape) - 1), AROUND_MM, 0)
    depth = np.where(pieces[box] == number, -distance.values[box], 0.0)
    place = np.array(np.unravel_index(np.argmax(depth), depth.shape))
    return place + [float(side.start) for side in box], float(depth.max())


def crossed(gaps: Sequence[Gap]) -> str:
    """The gaps as a sentence's beginning."""
    longest = max(gaps, key=lambda gap: gap.long_mm)
    times = f"{len(gaps)} time{'s' * (len(gaps) != 1)}"
    return (
        f"segment: traced wires run from one piece of the given lumen to another, {times}, over at most "
        f"{longest.long_mm:.2f} mm; furthest at [{spelt(longest.middle_mm)}] mm"
    )


def _pieces(distance: Grid) -> NDArray[np.int32]:
    """The number, from 1 up, of the piece that each voxel is in; 0 outside. Voxels of a piece share faces."""
    numbers: NDArray[np.int32] = np.asarray(label(distance.values < 0.0)[0], dtype=np.int32)
    return numbers
