"""What lies beyond the end of a fitted wire: fainter wire, wire behind a gap, or the edge of the scan.

Looked for in what the fit leaves, in a box around the tip alone, at a lower height than crests of the whole lumen are.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from pipeline.arrays.grids import unflattened
from pipeline.arrays.polyline import tip_tangent
from pipeline.model import Array
from pipeline.trace.crests import Tracklet, find_crests
from pipeline.trace.link import Path, hermite
from pipeline.trace.profile import INDEPENDENT_VOXELS
from pipeline.trace.region import SearchRegion
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction
from pipeline.trace.tube import Tube
from pipeline.trace.ways import CONE, cone

GOES_ON = "beyond the tip that could not be followed"
"""How a doubt about a line there ends: what one frame has may be too faint to be seen in others."""
REACH_MM = 9.0
"""How far beyond the tip more wire is looked for: a gap of 8 mm and a millimetre."""
WIDE_VOXELS = 1.2
"""Blur in which it is looked for."""
SIGMAS = 3.7
"""Height at which it starts, in standard deviations of the smoothed noise."""
SURE_APART = 9.0
"""Significance (as SURE) from which a piece behind a gap is wire: any noise within the reach might be taken for one."""
APART_TIMES = 4.0
"""How much brighter than the faintest a piece behind a gap must be: a quarter of the wire at least."""
SHORTEST_VOXELS = 5.0
"""Shorter pieces are noise."""
SURE = 5.0
"""Significance of a piece's mean grey from which it is no noise: it was chosen among a hundred."""
FAINTEST = 0.06
"""Share of the wire's peak below which its own streaks lie; blur leaves two thirds of a plastic tip's 0.15."""
RAY_MM = 3.0
"""Length of a straight piece along which grey is averaged: a bend of 15 mm radius leaves it by a voxel."""
RAY_STEP = 0.1
"""Angle (rad) from one such piece that is tried to the next: a voxel at its end."""
RAY_SURE = 4.5
"""Standard deviations of its mean, or its first half's, from which the brightest of a hundred is no noise."""
OUTER_SURE = 2.5
"""The same for the mean of its outer half."""
MOST_RAYS = 24
"""Most straight pieces that are followed."""
BESIDE_VOXELS = 2.0
"""A piece nearer to the wire than this is what the fit left of it."""
LEADS_ON = 0.3
"""Least cosine between the way from the tip to a piece and the direction of the piece where it begins."""
TOUCHING_MM = 1.0
"""Distance from the tip at which a piece needs no way to it."""
TANGENT_MM = 1.5
"""Length over which the wire's last direction is taken."""


def _near(region: SearchRegion, corner: Array, high: Array) -> SearchRegion:
    """The region with the axis's voxels within a box (indices) alone."""
    layer = int(np.prod(region.box.shape[1:]))
    # whole numbers: for others all of the axis's voxels would be turned into such
    first, stop = np.searchsorted(region.axis, np.array([corner[0], high[0] + 1], np.int64) * layer)
    flat = region.axis[first:stop]
    index = unflattened(flat, region.box.shape)
    return replace(region, axis=flat[np.all((index >= corner) & (index <= high), axis=1)])


def _stands_out(piece: Tracklet, noise: float, voxel: float) -> bool:
    """Whether a piece is long and bright enough not to be noise."""
    return piece.length > SHORTEST_VOXELS * voxel and _height(piece, noise, voxel) > SURE


def _height(piece: Tracklet, noise: float, voxel: float) -> float:
    """A piece's mean grey in standard deviations of that mean."""
    return float(np.mean(piece.values)) / noise * float(np.sqrt(piece.length / (2.0 * WIDE_VOXELS * voxel)))


def _apart(run: Tracklet, tip: Array) -> bool:
    """Whether a gap lies before a piece."""
    return float(np.linalg.norm(run.points[0] - tip)) > TOUCHING_MM


def _onward(piece: Tracklet, tip: Array, heading: Array) -> Tracklet | None:
    """The part of a piece that lies ahead of the tip, from its nearer end; None where it does not lead on."""
    away = np.linalg.norm(piece.points - tip, axis=1)
    run = piece if away[0] <= away[-1] else piece.reversed()
    ahead = np.flatnonzero((run.points - tip) @ heading > 0.0)
    if len(ahead) < 3:
        return None
    run = Tracklet(run.points[ahead[0] :], run.tangents[ahead[0] :], run.values[ahead[0] :])
    chord = run.points[0] - tip
    size = float(np.linalg.norm(chord))
    touching = size < TOUCHING_MM
    straight = chord @ heading > CONE * size and run.tangents[0] @ chord > LEADS_ON * size
    return run if size < REACH_MM and (touching or straight) else None


def _ray(image: Subtraction, start: Array, heading: Array, least: float) -> Array | None:
    """The end (3,) of the straight piece from a point along which grey stands out most; None for none.

    Half of RAY_MM long, as the wire may end within it; the whole where half of it is too little to be sure.
    """
    h = image.voxel
    s = np.arange(1.5 * h, RAY_MM, h)
    directions = cone(heading, float(np.arccos(CONE)), RAY_STEP)
    grey = image.along((start + s[:, None, None] * directions).reshape(-1, 3)).reshape(len(s), -1)
    noise = image.noise_in(CREST_VOXELS)
    for stop in filter(None, (len(s) // 2, len(s))):  # of voxels of 1 mm and more there is no half
        mean, outer = np.mean(grey[:stop], axis=0), np.mean(grey[stop // 2 : stop], axis=0)
        # a way that only noise suggests begins on the wire's last voxels, and has nothing further out
        ends = outer * np.sqrt((stop - stop // 2) / INDEPENDENT_VOXELS) > OUTER_SURE * noise
        best = int(np.argmax(np.where(ends, mean, -np.inf)))
        if mean[best] * np.sqrt(stop / INDEPENDENT_VOXELS) > RAY_SURE * noise and mean[best] > least and ends[best]:
            return np.asarray(start + s[stop - 1] * directions[best])
    return None


def _walked(image: Subtraction, line: Array, least: float) -> Array:
    """Points (n, 3) beyond the tip, from one straight piece to the next, as long as they stand out."""
    found = [line[-1]]
    heading = tip_tangent(line, TANGENT_MM)
    while len(found) < MOST_RAYS:
        end = _ray(image, found[-1], heading, least)
        if end is None:
            break
        heading = (end - found[-1]) / np.linalg.norm(end - found[-1])
        found.append(end)
    return np.array(found[1:]).reshape(-1, 3)


def _from_crests(image: Subtraction, line: Array, known: Array, faintest: float) -> tuple[Tracklet | None, bool]:
    """The nearest piece of crest in the box around the tip that leads on from it; and whether there is one that is as
    sure but leads elsewhere.
    """
    tip, heading = line[-1], tip_tangent(line, TANGENT_MM)
    reach, at = np.ceil(REACH_MM / image.spacing), np.rint(tip / image.spacing)
    near = _near(image.region, at - reach, at + reach)
    if len(near.axis) == 0:
        return None, False
    noise, tree = image.noise_in(WIDE_VOXELS), cKDTree(np.concatenate([line, known]))
    runs, stray = [], False
    for piece in find_crests(replace(image, region=near), WIDE_VOXELS, SIGMAS):
        run = _onward(piece, tip, heading)
        if not _stands_out(piece, noise, image.voxel) or not _off(run or piece, tree, image.voxel):
            continue
        sure = _height(piece, noise, image.voxel) > SURE_APART and piece.grey > 0.5 * faintest * APART_TIMES
        if run is not None and (sure or (not _apart(run, tip) and piece.grey > 0.5 * faintest)):
            runs.append(run)
        stray |= sure
    return min(runs, key=lambda r: float(np.linalg.norm(r.points[0] - tip))) if runs else None, stray


def _off(piece: Tracklet, tree: cKDTree, voxel: float) -> bool:
    """Whether most of a piece lies off the wire that was fitted, whose points are in ``tree``."""
    return bool(np.mean(tree.query(piece.points)[0] > BESIDE_VOXELS * voxel) > 0.5)


def beyond(image: Subtraction, tube: Tube, line: Array, known: Array) -> tuple[Path | None, bool]:
    """The wire's line (n, 3) continued along what goes on from its tip, None where nothing does; and whether something
    bright near the tip, off all ``known`` points (m, 3), leads elsewhere.
    """
    h = image.voxel
    tip, heading = line[-1], tip_tangent(line, TANGENT_MM)
    faintest = FAINTEST * tube.peak * float(tube.steps.levels[-1])
    with image.showing(tube.voxels, tube.rest):
        run, stray = _from_crests(image, line, known, faintest)
        if run is None:
            walked = _walked(image, line, faintest)
    if run is not None:
        gap = hermite(tip, heading, run.points[0], run.tangents[0], 0.5 * h)
        more, empty = np.concatenate([gap, run.points]), len(gap) if len(gap) * h > 2.0 * TOUCHING_MM else 0
    elif len(walked):
        more, empty = walked, 0
    else:
        return None, stray
    bridged = np.zeros(len(line) + len(more), bool)
    bridged[len(line) : len(line) + empty] = True
    return Path(np.concatenate([line, more]), bridged, int(empty > 0)), stray
