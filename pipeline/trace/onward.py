"""What lies beyond the end of a fitted wire: fainter wire, wire behind a gap, or the edge of the scan.

Looked for in what the fit leaves, in a box around the tip alone, at a lower height than crests of the whole lumen are.
"""

from dataclasses import replace

import numpy as np

from pipeline.arrays.polyline import tip_tangent
from pipeline.model import Array, arc_length
from pipeline.trace.crests import Tracklet, find_crests
from pipeline.trace.link import Path, link
from pipeline.trace.region import SearchRegion
from pipeline.trace.subtraction import Subtraction
from pipeline.trace.tube import Tube

REACH_MM = 9.0
"""How far beyond the tip more wire is looked for: a gap of 8 mm and a millimetre."""
WIDE_VOXELS = 1.2
"""Blur in which it is looked for."""
SIGMAS = 4.5
"""Height at which it starts, in standard deviations of the smoothed noise."""
SHORTEST_VOXELS = 5.0
"""Shorter pieces are noise."""
SURE = 9.0
"""Significance of a piece's mean grey from which it is no noise: it was chosen among a hundred."""
CONE = 0.6
"""Least cosine between the wire's end and the way to what goes on from it (53 degrees)."""
TANGENT_MM = 1.5
"""Length over which the wire's last direction is taken."""


def _near(region: SearchRegion, corner: Array, high: Array) -> SearchRegion:
    """The region's rows within a box (indices), its ends shortened to it."""
    runs = region.runs
    keep = np.all((runs[:, :2] >= corner[:2]) & (runs[:, :2] <= high[:2]), axis=1)
    rows = runs[keep].copy()
    rows[:, 2] = np.maximum(rows[:, 2], corner[2])
    rows[:, 3] = np.minimum(rows[:, 3], high[2] + 1)
    return replace(region, runs=np.ascontiguousarray(rows[rows[:, 3] > rows[:, 2]]))


def _stands_out(piece: Tracklet, noise: float, voxel: float) -> bool:
    """Whether a piece is long and bright enough not to be noise."""
    independent = piece.length / (2.0 * WIDE_VOXELS * voxel)
    height = float(np.mean(piece.values)) / noise
    return piece.length > SHORTEST_VOXELS * voxel and height * np.sqrt(independent) > SURE


def beyond(image: Subtraction, tube: Tube, line: Array) -> Path | None:
    """The wire's line (n, 3) continued along what goes on from its tip; None where nothing does."""
    h = image.voxel
    tip, heading = line[-1], tip_tangent(line, TANGENT_MM)
    reach = np.ceil(REACH_MM / image.spacing)
    at = np.rint(tip / image.spacing)
    near = _near(image.region, at - reach, at + reach)
    if len(near.runs) == 0:
        return None
    local = replace(image, region=near)
    with local.showing(tube.voxels, tube.rest):
        pieces = find_crests(local, WIDE_VOXELS, SIGMAS)
    noise = image.noise * 0.12
    offsets = [p.points - tip for p in pieces]
    ahead = [float(np.max(o @ heading - CONE * np.linalg.norm(o, axis=1))) > 0 for o in offsets]
    good = [p for p, a in zip(pieces, ahead, strict=True) if a and _stands_out(p, noise, h)]
    if not good:
        return None
    onward = link(good, tip, heading, REACH_MM, REACH_MM)
    if onward is None:
        return None
    along = (onward.points - tip) @ heading > 0
    first = int(np.argmax(along)) if along.any() else len(along)
    points = onward.points[first:]
    if len(points) < 2:
        return None
    gap = np.linspace(tip, points[0], max(2, round(float(np.linalg.norm(points[0] - tip)) / h)))[1:-1]
    whole = np.concatenate([line, gap, points])
    bridged = np.concatenate([np.zeros(len(line), bool), np.ones(len(gap), bool), onward.bridged[first:]])
    if arc_length(whole)[-1] - arc_length(line)[-1] < SHORTEST_VOXELS * h:
        return None
    return Path(whole, bridged, onward.bridges + (len(gap) * h > 1.0))
