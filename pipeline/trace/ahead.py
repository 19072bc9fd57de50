"""What lies ahead of a curve's end and is not seen as wire: a line that the reference has, too, or a dark one; or grey
so dark all about it that a wire in it is not seen."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.arrays.grids import unflattened
from pipeline.arrays.jets import Blurred, values_at
from pipeline.arrays.polyline import tip_tangent
from pipeline.model import Array
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction
from pipeline.trace.ways import KEPT, MAYBE, QUICK, Grey, cone, highest, ways_on

FIRST_VOXELS, VOXELS = 2.0, 4
"""Where, and over what length, the grey ahead is averaged: beyond the wire's own blur."""
WIDEST_RAD = 0.5
"""How far off the curve's last direction: the wire bends."""
HIDDEN = 0.19
"""Share of the wire's brightness, and of the contrast medium's, that the reference has there at the least: it had at
most 0.08 ahead of tips that are right (200 traces), 0.15 in correlated noise, and 0.23 and more where a piece of wire
in it bends away."""
DARK = 6.0
"""Noises by which the darkest way on stands out, over its length, from what is as far from the end: it had at most 4.6
where nothing lay ahead (110 tips), and 7.7 and more along 4 to 8 mm of a wire less dense than the contrast medium."""
DARK_REACH_VOXELS, DEEP_VOXELS, EDGE_VOXELS = 32, 0.5, 3.0
"""How far a dark way may lead (and what lies further away), and how far inside the wall and the scan grey counts."""
ABOUT_VOXELS, BESIDE_BLURS, LEAST_ABOUT = (2.0, 5.0), 3.0, 30
"""Distances from a curve's end between which the lumen's grey is looked at, more than so many blurs beside the curve,
and how many voxels there must be."""
DEEP_BLUR = 1.0
"""How many voxels inside the wall grey is the lumen's own then."""
WASHED = 0.2
"""Share of the wire's brightness by which the medium about its end is darker than the reference's, from which its tip
may lie in what is darker still: it was 0.04 at most about ends that are right, 0.29 and more where a tip was hidden."""


def hidden_ahead(image: Subtraction, points: Array) -> bool:
    """Whether the reference, within the lumen ahead of a curve's end (n, 3), is as bright as the wire: it has one, too.

    Subtraction leaves nothing there: a wire that reaches as far in the frame seems to end where that one begins.
    """
    rays, (inside, outside) = _rays(image, points, VOXELS), image.wall_greys
    if image.modelled or not len(rays):
        return False
    ahead, frame = rays.reshape(-1, 3), Blurred(image.scan.values, image.spacing, CREST_VOXELS * image.voxel)
    reference = values_at(frame, ahead + image.region.corner * image.spacing) - image.along(ahead)
    least = HIDDEN * max(float(np.median(image.along(points))), abs(inside - outside))
    return bool(reference.reshape(rays.shape[:2]).mean(axis=1).max() - inside > least)


def dark_ahead(image: Subtraction, points: Array) -> bool:
    """Whether a way ahead of a curve's end (n, 3), within the lumen, is darker than all else as far from the end.

    A wire whose end is less dense than the contrast medium (plastic) goes on so: 6 mm were missing, and ok. A front of
    contrast is as dark on all ways.
    """
    tip, last = points[-1], tip_tangent(points, VOXELS * image.voxel)

    def dark(at: Array) -> Array:
        inside = (image.from_side(at) > EDGE_VOXELS) & (image.depth_at(at) < -DEEP_VOXELS * image.voxel)
        return np.where(inside, -image.along(at), -np.inf)

    def stands_out(along: Grey) -> bool:
        tries = (QUICK, MAYBE), (KEPT, DARK)
        return all(highest(ways_on(image, tip, last, kept, along), 0.0) > least for kept, least in tries)

    if not stands_out(dark):
        return False
    usual = _usual_ahead(image, tip, last)
    return stands_out(lambda at: dark(at) + usual[_voxels_from(image, tip, at)])


def washed_out(image: Subtraction, points: Array, sigma: float) -> float:
    """By which share of the wire's brightness the lumen about a curve's end (n, 3) is darker than in the reference, and
    more so than the rest of it; 0 for less than WASHED, and without a reference.

    Where contrast medium is thin, a wire is as dark as the medium of the reference, and the difference shows none of
    it. image : before its background is levelled, which takes such places for the lumen's own.     sigma : blur.
    """
    if image.without_reference:
        return 0.0
    deep = image.deep(DEEP_BLUR)
    places = unflattened(deep, image.region.box.shape) * image.spacing
    away = np.linalg.norm(places - points[-1], axis=1) / image.voxel
    about = np.flatnonzero((away > ABOUT_VOXELS[0]) & (away < ABOUT_VOXELS[1]))
    about = about[cKDTree(points).query(places[about])[0] > BESIDE_BLURS * sigma] if len(about) else about
    usual = float(np.median(image.along(points)))
    if len(about) < LEAST_ABOUT or not usual > 0.0:
        return 0.0
    rest = float(np.median(image.grey.reshape(-1)[deep]))
    darker = (rest - float(np.median(image.along(places[about])))) / usual
    return darker if darker > WASHED else 0.0


def _usual_ahead(image: Subtraction, tip: Array, heading: Array) -> Array:
    """Median grey (DARK_REACH_VOXELS,) of the lumen ahead of a tip, by whole voxels from it."""
    places = unflattened(image.deep(DEEP_VOXELS), image.region.box.shape) * image.spacing
    away = _voxels_from(image, tip, places)
    ahead = (places - tip) @ heading > 0.0  # the wire brightens what lies behind
    grey, usual = image.along(places[ahead]), np.full(DARK_REACH_VOXELS, -np.inf)
    for far in np.unique(away[ahead]):
        usual[far] = np.median(grey[away[ahead] == far])
    return usual


def _voxels_from(image: Subtraction, tip: Array, points: Array) -> NDArray[np.int64]:
    """How many whole voxels points (n, 3) are from a tip, up to the most of DARK_REACH_VOXELS."""
    away = (np.linalg.norm(points - tip, axis=1) / image.voxel).astype(np.int64)
    return np.asarray(np.minimum(away, DARK_REACH_VOXELS - 1))


def _rays(image: Subtraction, points: Array, voxels: int) -> Array:
    """Straight ways (m, voxels, 3) ahead of a curve's end that lie within the lumen."""
    away = image.voxel * np.arange(FIRST_VOXELS, FIRST_VOXELS + voxels)[:, None]
    last = tip_tangent(points, voxels * image.voxel)
    rays = points[-1] + away * cone(last, WIDEST_RAD, 0.5 * WIDEST_RAD)[:, None]
    within = image.depth_at(rays.reshape(-1, 3)).reshape(rays.shape[:2]) < -image.voxel
    return np.asarray(rays[within.all(axis=1)])
