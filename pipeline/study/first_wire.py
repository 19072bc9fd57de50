"""Where the wire of the first frame enters the vessel, as the scans show it."""

from pathlib import Path

import numpy as np
from scipy import ndimage

from pipeline.arrays.grids import spread
from pipeline.load.geometry import unusable
from pipeline.model import Array, Volume

AT_EDGE = "the end of the wire nearest to the edge of the first frame"
IN_PLACE = "the end of the wire in the first frame that is where it was in the last"
MOVED_IN = ", moved along it to where the reference shows the vessel"
BRIGHT, FILLED, SHOWN = 75.0, 0.5, 4.0
"""Percentile of grey along the wire that is the medium's, share of it from which a point is in the vessel (the wall's
own level), and how many times it must be above its spread in there: an unfilled phantom tells nothing."""
MOST_OUTSIDE = 0.5
"""Share of the wire that may lie before the vessel: an introducer is a few mm. More of it is medium that is missing."""
NOWHERE = np.zeros((0, 3))


def wire_voxels(frame: Volume, reference: Volume | None) -> Array:
    """Indices (n, 3) of the largest bright component: metal is brighter than anything else in a frame."""
    grey = frame.values.astype(np.float32)
    if reference is not None:
        grey -= reference.values
    grey -= np.median(grey)  # a scan's zero may lie anywhere: half of a peak of 13000 over 10000 is all of the scan
    peak = np.percentile(grey, 99.999)
    labels, count = ndimage.label(grey > 0.5 * peak, np.ones((3, 3, 3)))
    if count == 0:
        return np.zeros((0, 3))
    sizes = np.bincount(labels.ravel())[1:]
    return np.argwhere(labels == 1 + int(sizes.argmax())).astype(float)


def infer_entry(frame: Volume, reference: Volume | None, file: Path, last: Array = NOWHERE) -> tuple[Array, Array, str]:
    """Entry (LPS mm), direction, and in words which end of the wire that is: where it begins, and points from there.

    last : points (n, 3) of the wire in the last frame: its beginning stays in place. Where that does not tell the ends
    apart, the one nearest to the edge of the scan. Raises LoadError, naming the frame's file, where no bright,
    connected structure is found.
    """
    voxels = wire_voxels(frame, reference)
    if len(voxels) < 5:
        why = "no wire is visible in it, the first frame, so the entry cannot be inferred"
        do = "give --entry and --direction, or take the file out of the folder where it is no frame"
        raise unusable(file, f"{why}; {do}")
    points, reach = frame.to_mm(voxels), 4.0 * float(frame.spacing_mm.max()) + 2.0
    edge = np.minimum(voxels, np.array(frame.shape) - 1 - voxels).min(axis=1)
    end, which = points[np.argmin(edge)], AT_EDGE
    if len(last):
        ends = _ends(points)
        off = np.linalg.norm(ends[:, None] - _ends(last), axis=2).min(axis=1)
        if off.min() < 0.5 * reach < off.max() - off.min():
            end, which = ends[np.argmin(off)], IN_PLACE
    entry = end if reference is None else _in_vessel(end, points, voxels, reference)
    which += MOVED_IN * bool(np.any(entry != end))
    near = points[np.linalg.norm(points - entry, axis=1) < reach]
    # without full_matrices=False its unused (n, n) part takes 3 GB for 20 000 voxels
    axis = np.linalg.svd(near - near.mean(axis=0), full_matrices=False)[2][0]
    return entry, np.asarray(axis * np.sign((near.mean(axis=0) - end) @ axis)), which


def _in_vessel(end: Array, points: Array, voxels: Array, reference: Volume) -> Array:
    """The wire's end, or the nearest of its points (n, 3) that lies in the filled vessel.

    A wire seen from its introducer on begins outside, or in the vessel's end, where no lumen is found. Medium thins
    out towards the entry: at 0.9 of its median one that was a fifth thinner there moved the entry 20 voxels in.
    """
    grey = ndimage.uniform_filter(reference.values.astype(np.float32), 3)
    along = grey[tuple(voxels.astype(int).T)] - np.median(grey)
    filled, off = float(np.percentile(along, BRIGHT)), np.linalg.norm(points - end, axis=1)
    inside = along > FILLED * filled
    if filled < SHOWN * spread(along[inside]):
        return end
    first = off[inside].min()
    return np.asarray(points[inside][off[inside].argmin()]) if np.mean(off < first) < MOST_OUTSIDE else end


def _ends(points: Array) -> Array:
    """The two points (2, 3) of (n, 3) that lie farthest apart, as nearly as two looks find them."""
    first = points[np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1))]
    return np.stack([first, points[np.argmax(np.linalg.norm(points - first, axis=1))]])
