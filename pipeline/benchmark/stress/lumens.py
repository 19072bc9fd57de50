"""Vessels that come close to each other, and which of them a wire is in: both from their closed form.

A place in the wall belongs to the nearest vessel. No grid, no gradient and nothing of the solver takes part in that.
"""

import numpy as np

from pipeline.benchmark.stress.statics import Array

NEAR = ("pair", "crossing", "u_turn")
"""Two parallel vessels; one that crosses the other; two limbs of one vessel, joined by half a circle."""
CROSSING_MM, TURN_MM = 8.0, 20.0
"""Where the vessels cross, and where the half circle begins, mm from the entry."""
PAST_VOXELS = 1.0
"""How much nearer to another vessel a joint must be to lie in it: half a voxel beyond the ridge between them."""
ROUND_THE_EDGE_MM = 1.5
"""How far behind the edge of a septum a wire may cut the corner."""


def near_vessels(kind: str, points: Array, radius: float, septum: float) -> Array:
    """Signed distances (2, ...) of points (..., 3), mm, to the vessel of the entry and to the other one.

    The half circle of a U-turn belongs to both limbs.
    """
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    apart = 2.0 * radius + septum
    own, other = np.hypot(x, y), np.hypot(x - apart, y)
    if kind == "crossing":
        other = np.hypot(x - apart, z - CROSSING_MM)
    if kind == "u_turn":
        turn = np.hypot(np.hypot(x - 0.5 * apart, z - TURN_MM) - 0.5 * apart, y)
        own, other = (np.where(z < TURN_MM, limb, turn) for limb in (own, other))
    return np.stack([own, other]) - radius


def changes_vessel(kind: str, joints: Array, distances: Array, voxel: float) -> str:
    """A sentence where a wire passes from one vessel to the other through the wall between them, from joint to joint.

    joints : (k + 1, 3) mm in the scene's own frame.     distances : (2, k + 1), see ``near_vessels``.
    voxel : mm; joints that are as near to both vessels, to within that, are skipped.
    """
    nearer = distances[0] - distances[1]
    sure = np.flatnonzero(np.abs(nearer) > PAST_VOXELS * voxel)
    vessel = nearer[sure] > 0.0
    for change in np.flatnonzero(vessel[1:] != vessel[:-1]):
        here, there = sure[change], sure[change + 1]
        # the way round the septum's edge leads through the half circle
        edge = TURN_MM - ROUND_THE_EDGE_MM - float(np.linalg.norm(joints[here] - joints[here + 1]))
        if kind != "u_turn" or joints[here : there + 1, 2].max() < edge:
            return f"joints {here} and {there} of {len(joints) - 1} lie in different vessels"
    return ""
