"""The half-level surface of smoothed grey inside a mask, and the distance of every voxel near it.

Closest points are found by Newton steps on the C2 spline of the grey values next to the surface, then handed from
voxel to voxel. Coordinates are index * spacing (mm along the grid's axes).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.arrays.spline import hessian, value_gradient
from pipeline.arrays.tiles import (
    INNER,
    SHIFT,
    SIDE,
    clamped,
    grown,
    scratch,
    smooth_tile,
    smoothed,
    unravelled,
)

PAD = 4
"""Voxels around the box that only feed the spline: a foot moves up to 2 voxels and its spline reaches 2 more."""
FOOT_STEPS = 4
"""Newton steps to a closest point; from 1.5 voxels at a radius of 2 voxels the fourth moves it by < 0.005 voxel."""


@njit(cache=True)
def ends(order: NDArray[Any], shape: tuple[int, int, int]) -> tuple[NDArray[Any], NDArray[Any]]:
    """First and last index (3,) along each axis of the voxels at flat indices."""
    low, high = np.array(shape, np.int64), np.full(3, -1, np.int64)
    for n in range(order.shape[0]):
        i, j, k = unravelled(order[n], shape)
        low[0], low[1], low[2] = min(low[0], i), min(low[1], j), min(low[2], k)
        high[0], high[1], high[2] = max(high[0], i), max(high[1], j), max(high[2], k)
    return low, high


@njit(cache=True)
def into_box(
    order: NDArray[Any], shape: tuple[int, int, int], corner: NDArray[Any], box: tuple[int, int, int]
) -> NDArray[Any]:
    """Flat indices in a padded box, whose voxel (PAD, PAD, PAD) is ``corner``, of flat indices in the volume."""
    out = np.empty(order.shape[0], np.int64)
    for n in range(order.shape[0]):
        i, j, k = unravelled(order[n], shape)
        a, b, c = i - corner[0] + PAD, j - corner[1] + PAD, k - corner[2] + PAD
        out[n] = (a * box[1] + b) * box[2] + c
    return out


@njit(cache=True)
def dilate(mask: NDArray[Any], order: NDArray[Any], layers: int, first: int) -> NDArray[Any]:
    """Mark ``layers`` 26-neighbour layers around the voxels ``order`` with ``first``, ``first + 1`` ... in ``mask``."""
    ni, nj, nk = mask.shape
    found = np.empty(max(4096, order.shape[0]), np.int64)
    count = 0
    front = order
    begin = 0
    for layer in range(layers):
        stop = front.shape[0] if layer == 0 else count
        start = 0 if layer == 0 else begin
        begin = count
        for n in range(start, stop):
            i, j, k = unravelled(front[n] if layer == 0 else found[n], mask.shape)
            for a in range(max(0, i - 1), min(ni, i + 2)):
                for b in range(max(0, j - 1), min(nj, j + 2)):
                    for c in range(max(0, k - 1), min(nk, k + 2)):
                        if mask[a, b, c] == 0:
                            mask[a, b, c] = first + layer
                            if count + 1 >= found.shape[0]:
                                found = grown(found)
                            found[count] = (a * nj + b) * nk + c
                            count += 1
    return found[:count]


@njit(cache=True)
def smooth_lattice(
    volume: NDArray[Any],
    corner: NDArray[Any],
    taps: NDArray[Any],
    state: NDArray[Any],
    voxels: NDArray[Any],
    lattice: NDArray[Any],
) -> None:
    """Fill ``lattice`` where ``state`` is not 0, which is at the flat box indices ``voxels``.

    Its box is padded: voxel (PAD, PAD, PAD) is ``corner`` of the volume. In the padding outside the volume the
    border's smoothed value is repeated.
    """
    work = scratch(taps)
    w = SIDE + 2 * (taps.shape[0] // 2)
    rows = work[1].reshape((w, w, w))
    start = corner - PAD
    ni, nj, nk = lattice.shape
    needed = np.zeros(((ni + INNER) >> SHIFT, (nj + INNER) >> SHIFT, (nk + INNER) >> SHIFT), np.uint8)
    for n in range(voxels.shape[0]):
        i, j, k = unravelled(voxels[n], lattice.shape)
        needed[i >> SHIFT, j >> SHIFT, k >> SHIFT] = 1
        a, b, c = i + start[0], j + start[1], k + start[2]
        if min(a, b, c) < 0 or a >= volume.shape[0] or b >= volume.shape[1] or c >= volume.shape[2]:
            a, b, c = clamped(a, volume.shape[0]), clamped(b, volume.shape[1]), clamped(c, volume.shape[2])
            lattice[i, j, k] = smoothed(volume, taps, a, b, c)
    low = np.maximum(-start, 0)
    high = np.minimum(np.array(volume.shape) - start, np.array(lattice.shape))
    for tile in range(needed.size):
        if needed.flat[tile] == 0:
            continue
        ti, tj, tk = unravelled(tile, needed.shape)
        i0, j0, k0 = ti * SIDE, tj * SIDE, tk * SIDE
        smooth_tile(volume, taps, i0 + start[0], j0 + start[1], k0 + start[2], work[0], work[1])
        for i in range(max(i0, low[0]), min(i0 + SIDE, high[0])):
            for j in range(max(j0, low[1]), min(j0 + SIDE, high[1])):
                for k in range(max(k0, low[2]), min(k0 + SIDE, high[2])):
                    if state[i, j, k]:
                        lattice[i, j, k] = rows[i - i0, j - j0, k - k0]


@njit(cache=True)
def _is_side(
    state: NDArray[Any], lattice: NDArray[Any], level: float, i: int, j: int, k: int, deep: int
) -> bool:
    """Inside: of the dilated mask and above the level (or deep in the mask, where noise or metal may dip)."""
    mark = state[i, j, k]
    return bool(mark != 0 and mark <= deep and lattice[i, j, k] > level)


@njit(cache=True)
def surface_voxels(
    state: NDArray[Any],
    lattice: NDArray[Any],
    level: float,
    deep: int,
    voxels: NDArray[Any],
    inside: NDArray[Any],
) -> NDArray[Any]:
    """Voxels (flat) with a 6-neighbour on the other side, and beside those; ``inside`` gets 1 where it holds.

    ``state`` marks the mask 1 and its dilated layers 2, 3, ...; layers up to ``deep`` may be inside.
    """
    ni, nj, nk = state.shape
    for n in range(voxels.shape[0]):
        i, j, k = unravelled(voxels[n], state.shape)
        inside[i, j, k] = _is_side(state, lattice, level, i, j, k, deep)
    found = np.empty(voxels.shape[0], np.int64)
    count = 0
    for n in range(voxels.shape[0]):
        i, j, k = unravelled(voxels[n], state.shape)
        if i < PAD or j < PAD or k < PAD or i >= ni - PAD or j >= nj - PAD or k >= nk - PAD:
            continue
        here = inside[i, j, k]
        near = False
        for a in range(i - 1, i + 2):
            for b in range(j - 1, j + 2):
                for c in range(k - 1, k + 2):
                    near = near or inside[a, b, c] != here
        if near:
            found[count] = voxels[n]
            count += 1
    return found[:count]


@njit(cache=True)
def feet(
    lattice: NDArray[Any],
    level: float,
    spacing: NDArray[Any],
    voxels: NDArray[Any],
    inside: NDArray[Any],
    foot: NDArray[Any],
    normal: NDArray[Any],
    curvature: NDArray[Any],
    steepness: NDArray[Any],
) -> NDArray[Any]:
    """Closest points on the iso-surface for the voxels (flat box indices) next to it.

    foot, normal : (n, 3), mm and outward unit.  curvature : (n,) sum of principal curvatures, 1/mm, positive for
    a vessel.  steepness : (n,) fall of grey per mm along the normal. Returns distances (n,), mm, negative inside;
    NaN where no closest point was found within two voxels (0.1 voxel off after the last step, say).
    """
    hx, hy, hz = spacing[0], spacing[1], spacing[2]
    reach = 2.0 * max(hx, hy, hz)
    distance = np.empty(voxels.shape[0])
    for n in range(voxels.shape[0]):
        i, j, k = unravelled(voxels[n], lattice.shape)
        qx, qy, qz = i * hx, j * hy, k * hz
        px, py, pz = qx, qy, qz
        gx = gy = gz = gg = 0.0
        good = True
        for _ in range(FOOT_STEPS):
            f, gx, gy, gz = value_gradient(lattice, px / hx, py / hy, pz / hz)
            gx, gy, gz = gx / hx, gy / hy, gz / hz
            gg = gx * gx + gy * gy + gz * gz
            if gg < 1e-12:
                good = False
                break
            ax, ay, az = qx - px, qy - py, qz - pz
            along = (ax * gx + ay * gy + az * gz + f - level) / gg
            px, py, pz = px + ax - along * gx, py + ay - along * gy, pz + az - along * gz
            if abs(px - qx) > reach or abs(py - qy) > reach or abs(pz - qz) > reach:
                good = False
                break
        if not good:
            distance[n] = np.nan
            continue
        f, gx, gy, gz = value_gradient(lattice, px / hx, py / hy, pz / hz)
        if abs(f - level) > 0.1 * (abs(gx) + abs(gy) + abs(gz)):
            distance[n] = np.nan
            continue
        xx, yy, zz, xy, xz, yz = hessian(lattice, px / hx, py / hy, pz / hz)
        gx, gy, gz = gx / hx, gy / hy, gz / hz
        xx, yy, zz = xx / (hx * hx), yy / (hy * hy), zz / (hz * hz)
        xy, xz, yz = xy / (hx * hy), xz / (hx * hz), yz / (hy * hz)
        gg = gx * gx + gy * gy + gz * gz
        g = np.sqrt(gg) + 1e-30
        bend = (
            gx * gx * xx + gy * gy * yy + gz * gz * zz + 2 * (gx * gy * xy + gx * gz * xz + gy * gz * yz)
        ) / gg
        foot[n, 0], foot[n, 1], foot[n, 2] = px, py, pz
        normal[n, 0], normal[n, 1], normal[n, 2] = -gx / g, -gy / g, -gz / g
        curvature[n] = -(xx + yy + zz - bend) / g
        steepness[n] = g
        away = np.sqrt((px - qx) ** 2 + (py - qy) ** 2 + (pz - qz) ** 2)
        distance[n] = -away if inside[i, j, k] else away
    return distance


@njit(cache=True)
def mean_around(
    owner: NDArray[Any], voxels: NDArray[Any], values: NDArray[Any], valid: NDArray[Any], reach: int
) -> NDArray[Any]:
    """Mean of ``values`` over the listed voxels within ``reach`` of each (``owner`` = list position + 1, or 0)."""
    ni, nj, nk = owner.shape
    out = np.empty(voxels.shape[0])
    for n in range(voxels.shape[0]):
        i, j, k = unravelled(voxels[n], owner.shape)
        total = 0.0
        count = 0
        for a in range(max(0, i - reach), min(ni, i + reach + 1)):
            for b in range(max(0, j - reach), min(nj, j + reach + 1)):
                for c in range(max(0, k - reach), min(nk, k + reach + 1)):
                    m = owner[a, b, c] - 1
                    if m >= 0 and valid[m]:
                        total += values[m]
                        count += 1
        out[n] = total / count if count else 0.0
    return out


@njit(cache=True, inline="always")
def _from_foot(x: float, y: float, z: float, p: NDArray[Any], n: NDArray[Any], bend: float) -> float:
    """Signed distance of a point to the sphere of curvature ``bend`` that osculates the surface at its foot p.

    For bend 0 (a surface of flat facets, closest points exact) it is the distance to the foot.
    """
    ax, ay, az = x - p[0], y - p[1], z - p[2]
    along = ax * n[0] + ay * n[1] + az * n[2]
    square = ax * ax + ay * ay + az * az
    lift = 1.0 + bend * along
    far = np.sqrt(square)
    if bend == 0.0 or lift <= 0.3:
        return float(far if along > 0 else -far)
    # no point is further from the surface than from its foot, however bent the surface is there
    near = along + 0.5 * bend * max(0.0, square - along * along) / lift
    return float(min(max(near, -far), far))


@njit(cache=True, inline="always")
def _square(x: float, y: float, z: float, p: NDArray[Any]) -> float:
    return float((x - p[0]) * (x - p[0]) + (y - p[1]) * (y - p[1]) + (z - p[2]) * (z - p[2]))


@njit(cache=True)
def propagate(
    owner: NDArray[Any],
    inside: NDArray[Any],
    spacing: NDArray[Any],
    voxels: NDArray[Any],
    foot: NDArray[Any],
    outer: float,
) -> int:
    """Hand closest points on from voxel to voxel: all of the inside, and outside as far as ``outer`` mm.

    owner : (box) int32, 0 or position of the foot + 1, set for ``voxels`` (ascending, for the sake of the cache)
    beforehand. Layer by layer; a voxel that gets a nearer foot hands it on again. Returns the number of hand-overs.
    """
    ni, nj, nk = owner.shape
    hx, hy, hz = spacing[0], spacing[1], spacing[2]
    front = np.empty(max(4096, voxels.shape[0]), np.int64)
    following = np.empty(front.shape[0], np.int64)
    count = 0
    for n in range(voxels.shape[0]):
        if owner.flat[voxels[n]] > 0:
            front[count] = voxels[n]
            count += 1
    visits = count
    while count:
        fresh = 0
        for n in range(count):
            i, j, k = unravelled(front[n], owner.shape)
            inside[i, j, k] &= 1
            m = owner[i, j, k] - 1
            p = foot[m]
            for a in range(max(0, i - 1), min(ni, i + 2)):
                for b in range(max(0, j - 1), min(nj, j + 2)):
                    for c in range(max(0, k - 1), min(nk, k + 2)):
                        known = owner[a, b, c]
                        if known == m + 1:
                            continue
                        x, y, z = a * hx, b * hy, c * hz
                        far = _square(x, y, z, p)
                        if known > 0:
                            if far >= _square(x, y, z, foot[known - 1]) - 1e-9:
                                continue
                        elif far > outer * outer and not inside[a, b, c] & 1:
                            continue
                        owner[a, b, c] = m + 1
                        if inside[a, b, c] & 2:
                            continue
                        inside[a, b, c] |= 2
                        if fresh + 1 >= following.shape[0]:
                            following = grown(following)
                        following[fresh] = (a * nj + b) * nk + c
                        fresh += 1
        visits += fresh
        front, following = following, front
        count = fresh
    return visits


@njit(cache=True)
def lost_feet(
    owner: NDArray[Any], spacing: NDArray[Any], voxels: NDArray[Any], foot: NDArray[Any], good: NDArray[Any]
) -> NDArray[Any]:
    """Voxels beside the surface whose foot was not found and whose neighbours' are two voxels off and more.

    A branch as thin as that has its peak at the level of the wall: the wall is put through the voxel itself.
    Returns positions in ``voxels``; their ``owner`` and ``foot`` are set.
    """
    limit = (2.0 * max(spacing[0], spacing[1], spacing[2])) ** 2
    lost = np.empty(voxels.shape[0], np.int64)
    count = 0
    for n in range(voxels.shape[0]):
        if good[n]:
            continue
        i, j, k = unravelled(voxels[n], owner.shape)
        x, y, z = i * spacing[0], j * spacing[1], k * spacing[2]
        m = owner[i, j, k] - 1
        if m >= 0 and _square(x, y, z, foot[m]) < limit:
            continue
        foot[n, 0], foot[n, 1], foot[n, 2] = x, y, z
        owner[i, j, k] = n + 1
        lost[count] = n
        count += 1
    return lost[:count]


@njit(cache=True)
def distances(
    owner: NDArray[Any],
    inside: NDArray[Any],
    spacing: NDArray[Any],
    foot: NDArray[Any],
    normal: NDArray[Any],
    bend: NDArray[Any],
    outer: float,
    skip: int,
    out: NDArray[Any],
) -> None:
    """Signed distance (float32) of every voxel from its owner's foot; ``outer`` where it has none.

    ``out`` has ``skip`` voxels less on every side than ``owner``. It may be the beginning of its memory seen as
    float32: a voxel is written after it is read, and never further on.
    """
    hx, hy, hz = spacing[0], spacing[1], spacing[2]
    for a in range(out.shape[0]):
        i = a + skip
        for b in range(out.shape[1]):
            j = b + skip
            for c in range(out.shape[2]):
                k = c + skip
                m = owner[i, j, k] - 1
                if m < 0:
                    out[a, b, c] = -outer if inside[i, j, k] & 1 else outer
                    continue
                d = abs(_from_foot(i * hx, j * hy, k * hz, foot[m], normal[m], bend[m]))
                out[a, b, c] = -d if inside[i, j, k] & 1 else min(d, outer)
