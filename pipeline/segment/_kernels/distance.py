"""Closest points of a wall handed on from voxel to voxel, and the signed distances that follow from them.

Coordinates are index * spacing (mm along the grid's axes).
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.lattice import entry_point, grown, kernel, unravelled

QUEUED = 2
"""Bit of ``inside`` that marks a voxel waiting to hand on its foot (closest point); used by :func:`propagate` alone."""
APART = 1.5
"""Voxels: feet lie one voxel apart, and some are missing."""


class Owned(NamedTuple):
    """A box whose voxels have closest points: ``owner`` (int32) holds the position + 1 of a voxel's closest point in a
    list of feet, or 0; ``inside`` (uint8) holds 1 inside the wall.
    """

    owner: NDArray[Any]
    inside: NDArray[Any]
    spacing: NDArray[Any]


@kernel
def _square(x: float, y: float, z: float, p: NDArray[Any]) -> float:
    return float((x - p[0]) * (x - p[0]) + (y - p[1]) * (y - p[1]) + (z - p[2]) * (z - p[2]))


@kernel
def _takes(at: tuple[float, float, float], known: int, inside: int, foot: NDArray[Any], m: int, most: float) -> bool:
    """Whether a voxel at ``at`` takes over foot m: it has none yet, or one (``known`` - 1) that is further away.

    Outside the wall the first foot must lie within ``most`` (mm^2).
    """
    x, y, z = at
    far = _square(x, y, z, foot[m])
    if known > 0:
        return bool(far < _square(x, y, z, foot[known - 1]) - 1e-9)
    return bool(far <= most or inside & 1)


@entry_point
def propagate(box: Owned, voxels: NDArray[Any], foot: NDArray[Any], outer: float, low: int, high: int) -> int:
    """Hand closest points on from ``voxels``, which have one: to all of the inside, and outside as far as ``outer`` mm.

    voxels : flat, ascending for the sake of the cache.  low, high : planes of the box outside which nothing is read or
    written. Layer by layer; a voxel that gets a nearer foot hands it on again. Returns the number of hand-overs.
    """
    owner, inside, (hx, hy, hz) = box.owner, box.inside, (box.spacing[0], box.spacing[1], box.spacing[2])
    _, nj, nk = owner.shape
    front, following = voxels.copy(), np.empty(max(4096, voxels.shape[0]), np.int64)
    count = visits = voxels.shape[0]
    while count:
        fresh = 0
        for n in range(count):
            i, j, k = unravelled(front[n], owner.shape)
            inside[i, j, k] &= ~QUEUED
            m = owner[i, j, k] - 1
            for a in range(max(low, i - 1), min(high, i + 2)):
                for b in range(max(0, j - 1), min(nj, j + 2)):
                    for c in range(max(0, k - 1), min(nk, k + 2)):
                        known, at, mark = owner[a, b, c], (a * hx, b * hy, c * hz), inside[a, b, c]
                        if known == m + 1 or not _takes(at, known, mark, foot, m, outer * outer):
                            continue
                        owner[a, b, c] = m + 1
                        if not mark & QUEUED:
                            inside[a, b, c] |= QUEUED
                            if fresh + 1 >= following.shape[0]:
                                following = grown(following)
                            following[fresh] = (a * nj + b) * nk + c
                            fresh += 1
        visits += fresh
        front, following = following, front
        count = fresh
    return int(visits)


@entry_point
def lost_feet(box: Owned, voxels: NDArray[Any], foot: NDArray[Any], good: NDArray[Any], moved: float) -> NDArray[Any]:
    """Voxels beside the surface that have no foot of their own, and got none nearer than two voxels from a neighbour.

    moved : by how much feet have moved off the surface at most, mm, which is granted in addition.

    A branch as thin as that peaks at the level of the wall: the wall is put through the voxel itself.
    Returns positions in ``voxels``; their ``owner`` and ``foot`` are set.
    """
    owner, _, spacing = box
    limit = (2.0 * max(spacing[0], spacing[1], spacing[2]) + moved) ** 2
    lost = np.empty(voxels.shape[0], np.int64)
    count = 0
    for n in range(voxels.shape[0]):
        i, j, k = unravelled(voxels[n], owner.shape)
        x, y, z = i * spacing[0], j * spacing[1], k * spacing[2]
        m = owner[i, j, k] - 1
        if good[n] or (m >= 0 and _square(x, y, z, foot[m]) < limit):
            continue
        foot[n, 0], foot[n, 1], foot[n, 2] = x, y, z
        owner[i, j, k] = n + 1
        lost[count] = n
        count += 1
    return lost[:count]


@kernel
def _from_foot(x: float, y: float, z: float, p: NDArray[Any], n: NDArray[Any], bend: float, most: float) -> float:
    """Distance of a point from the sphere of curvature ``bend`` that osculates the surface at its foot p.

    most : square of how far along the surface the closest point may lie from the foot, mm^2.

    For bend 0 (a surface of flat facets, closest points exact) it is the distance to the foot.
    """
    ax, ay, az = x - p[0], y - p[1], z - p[2]
    along = ax * n[0] + ay * n[1] + az * n[2]
    square = ax * ax + ay * ay + az * az
    lift = 1.0 + bend * along
    far = np.sqrt(square)
    if bend == 0.0 or lift <= 0.3:
        return float(far)
    # no point is further from the surface than from its foot, however bent the surface is there
    near = along + 0.5 * bend * max(0.0, square - along * along) / lift
    # nor, since feet lie close together, much nearer to it: beyond a rim of the wall nothing is left of the sphere
    return float(min(max(abs(near), np.sqrt(max(0.0, square - most * lift))), far))


@entry_point
def distances(
    box: Owned, wall: tuple[NDArray[Any], NDArray[Any], NDArray[Any]], outer: float, out: NDArray[Any]
) -> None:
    """Signed distance (float32) of every voxel from its owner's foot; ``outer`` where it has none.

    wall : feet, normals and curvatures.  ``out`` is the inner part of the box, and may be the beginning of ``owner``'s
    memory seen as float32: nothing is written over an owner that is still to be read.
    """
    (owner, inside, spacing), (foot, normal, bend) = box, wall
    hx, hy, hz = spacing[0], spacing[1], spacing[2]
    apart = (APART * max(hx, hy, hz)) ** 2
    skip = (owner.shape[0] - out.shape[0]) // 2
    for a in range(out.shape[0]):
        i = a + skip
        for b in range(out.shape[1]):
            j = b + skip
            for c in range(out.shape[2]):
                k = c + skip
                m, within = owner[i, j, k] - 1, inside[i, j, k] & 1
                d = outer
                if m >= 0:
                    # deep inside, feet are few: a voxel may have taken over one from across the lumen
                    most = np.inf if within else apart
                    d = _from_foot(i * hx, j * hy, k * hz, foot[m], normal[m], bend[m], most)
                out[a, b, c] = -d if within else min(d, outer)
