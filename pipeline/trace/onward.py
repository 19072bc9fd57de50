"""What lies beyond the end of a fitted wire: fainter wire, wire behind a gap, or the edge of the scan.

Looked for in what the fit leaves, in a box around the tip alone, at a lower height than crests of the whole lumen are.
"""

from dataclasses import replace

import numpy as np

from scipy.spatial import cKDTree

from pipeline.arrays.polyline import tip_tangent
from pipeline.model import Array
from pipeline.trace.crests import Tracklet, find_crests
from pipeline.trace.link import Path, hermite
from pipeline.trace.region import SearchRegion
from pipeline.trace.subtraction import Subtraction
from pipeline.trace.tube import Tube

REACH_MM = 9.0
"""How far beyond the tip more wire is looked for: a gap of 8 mm and a millimetre."""
WIDE_VOXELS = 1.2
"""Blur in which it is looked for."""
SIGMAS = 3.7
"""Height at which it starts, in standard deviations of the smoothed noise."""
SHORTEST_VOXELS = 5.0
"""Shorter pieces are noise."""
SURE = 5.0
"""Significance of a piece's mean grey from which it is no noise: it was chosen among a hundred."""
CONE = 0.6
"""Least cosine between the wire's end and the way to what goes on from it (53 degrees)."""
FAINTEST = 0.03
"""Share of the wire's peak below which its own streaks lie; the wide blur leaves a third of a plastic tip's 0.15."""
BESIDE_VOXELS = 2.0
"""A piece nearer to the wire than this is what the fit left of it."""
LEADS_ON = 0.3
"""Least cosine between that way and the direction of the piece where it begins."""
TOUCHING_MM = 1.0
"""Distance from the tip at which a piece needs no way to it."""
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
    noise = image.noise_in(WIDE_VOXELS)
    least = FAINTEST * tube.peak * float(tube.steps.levels[-1])
    found = [_onward(p, tip, heading) for p in pieces if p.grey > least and _stands_out(p, noise, h)]
    tree = cKDTree(line)
    runs = [r for r in found if r is not None and np.mean(tree.query(r.points)[0] > BESIDE_VOXELS * h) > 0.5]
    if not runs:
        return None
    run = min(runs, key=lambda r: float(np.linalg.norm(r.points[0] - tip)))
    gap = hermite(tip, heading, run.points[0], run.tangents[0], 0.5 * h)
    whole = np.concatenate([line, gap, run.points])
    bridged = np.zeros(len(whole), bool)
    bridged[len(line) : len(line) + len(gap)] = len(gap) * h > 2.0 * TOUCHING_MM
    return Path(whole, bridged, int(bridged.any()))
