"""The brightest way on from a wire's tip, in short straight pieces: what a faint wire shows only over its whole length.

A wire 1.5 noises bright is 6 standard deviations over 3 mm, and may be 2 over any one of them.
"""

import numpy as np

from pipeline.model import Array
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction

CONE = 0.6
"""Least cosine between the wire's end and the way to what goes on from it (53 degrees)."""
CONE_STEP = 0.15
"""Angle (rad) from one first piece to the next: 0.75 voxel at its end."""
TURN, TURN_STEP = 0.35, 0.175
"""Largest angle (rad) between two pieces, a bend of 14 voxels radius, and from one that is tried to the next."""
PIECE_VOXELS, PIECES = 5, 6
"""Length of a piece, and how many are put together: 9 mm of voxels of 0.3 mm."""
KEPT = 30
"""Ways that are followed on, the brightest, their ends in different voxels."""
FIRST_VOXELS = 1.0
"""What is left out behind the tip, as the fit of the wire takes some of it."""
SURE = 5.0
"""Standard deviations of its mean from which the brightest of all ways is no noise: in noise it had at most 4.7 (107
tips of plain wires and of wires behind gaps), along dim ends of 1.5 to 3.2 noises 5 and more in 78 of 80."""


def cone(heading: Array, widest: float, step: float) -> Array:
    """Directions (n, 3) up to ``widest`` (rad) off a heading, ``step`` apart."""
    side = np.cross(heading, np.eye(3)[int(np.argmin(np.abs(heading)))])
    side /= np.linalg.norm(side)
    other = np.cross(heading, side)
    rings = [heading[None]]
    for angle in np.arange(step, widest, step):
        phi = np.arange(0.0, 2 * np.pi, step / np.sin(angle))[:, None]
        rings.append(np.cos(angle) * heading + np.sin(angle) * (np.cos(phi) * side + np.sin(phi) * other))
    return np.concatenate(rings)


def _longer(image: Subtraction, ways: Array, sums: Array, headings: Array) -> tuple[Array, Array, Array]:
    """The KEPT brightest of ways (m, n, 3) with one more piece, the sums (m,) of their grey and last directions."""
    h, first = image.voxel, ways.shape[1] == 1
    fans = [cone(d, float(np.arccos(CONE)), CONE_STEP) if first else cone(d, TURN + 0.01, TURN_STEP) for d in headings]
    parent, heading = np.repeat(np.arange(len(ways)), [len(f) for f in fans]), np.concatenate(fans)
    s = (np.arange(1, PIECE_VOXELS + 1) + FIRST_VOXELS * first) * h
    points = ways[parent, -1] + s[:, None, None] * heading
    total = sums[parent] + image.along(points.reshape(-1, 3)).reshape(PIECE_VOXELS, -1).sum(axis=0)
    order = np.argsort(-total, kind="stable")
    voxels = np.rint(points[-1][order] / image.spacing).astype(np.int64)
    best = order[np.sort(np.unique(voxels, axis=0, return_index=True)[1])[:KEPT]]
    return np.concatenate([ways[parent[best]], points[-1][best][:, None]], axis=1), total[best], heading[best]


def faint_way(image: Subtraction, tip: Array, heading: Array, least: float) -> Array:
    """Points (n, 3) of the brightest way on from a tip, up to where it stands out most; none where noise may be one.

    least : grey that a wire has at the least.
    """
    # grey blurred by s is correlated over 2 sqrt(pi) s
    noise = image.noise_in(CREST_VOXELS) * float(np.sqrt(2.0 * np.sqrt(np.pi) * CREST_VOXELS))
    ways, sums, headings = tip[None, None], np.zeros(1), heading[None]
    found, sure = np.zeros((0, 3)), SURE
    for n in range(1, PIECES + 1):
        ways, sums, headings = _longer(image, ways, sums, headings)
        height = float(sums[0]) / (noise * np.sqrt(n * PIECE_VOXELS))
        if height > sure and sums[0] > least * n * PIECE_VOXELS:
            found, sure = ways[0, 1:], height
    return np.asarray(found)
