"""The half-level surface of smoothed grey inside a mask, and the point of it that is closest to each voxel beside it.

Closest points are found by Newton steps on the uniform cubic B-spline of the grey values next to the surface. The grey
at the nodes is used as coefficients, so the result is C2 and lightly smoothed, with variance 1/3 voxel^2 per axis (that
of the cubic B-spline). Coordinates are index * spacing (mm along the grid's axes). A vessel's box is padded by PAD
voxels on every side.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.jets import smoothed
from pipeline.arrays.lattice import clamped, entry_point, grown, kernel, steps_around, unravelled
from pipeline.segment._kernels.tiles import INNER, SHIFT, SIDE, scratch, smooth_tile

PAD = 4
"""Voxels around the box that only feed the spline: a foot moves up to 2 voxels and its spline reaches 2 more."""
FOOT_STEPS = 4
"""Newton steps to a closest point; from 1.5 voxels at a radius of 2 voxels the fourth moves it by < 0.005 voxel."""
Four = tuple[float, float, float, float]


@kernel
def basis(t: float) -> Four:
    """The four cubic B-spline weights at offset ``t`` in [0, 1) from the second node."""
    u = 1.0 - t
    return (
        u * u * u / 6.0,
        (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
        (4.0 - 6.0 * u * u + 3.0 * u * u * u) / 6.0,
        t * t * t / 6.0,
    )


@kernel
def slope(t: float) -> Four:
    """First derivatives of :func:`basis`, per voxel."""
    u = 1.0 - t
    return -0.5 * u * u, 1.5 * t * t - 2.0 * t, 2.0 * u - 1.5 * u * u, 0.5 * t * t


@kernel
def bend(t: float) -> Four:
    """Second derivatives of :func:`basis`, per voxel^2."""
    u = 1.0 - t
    return u, 3.0 * t - 2.0, 3.0 * u - 2.0, t


@kernel
def _row(c: NDArray[Any], i: int, j: int, k: int, w: Four) -> float:
    return float(w[0] * c[i, j, k] + w[1] * c[i, j, k + 1] + w[2] * c[i, j, k + 2] + w[3] * c[i, j, k + 3])


@kernel
def value_gradient(c: NDArray[Any], x: float, y: float, z: float) -> tuple[float, float, float, float]:
    """Value and gradient (per voxel) at a point in index coordinates; the four nodes per axis must lie in ``c``."""
    i, j, k = int(x), int(y), int(z)
    wx, dx = basis(x - i), slope(x - i)
    wy, dy = basis(y - j), slope(y - j)
    wz, dz = basis(z - k), slope(z - k)
    f = gx = gy = gz = 0.0
    for a in range(4):
        fa = ya = za = 0.0
        for b in range(4):
            row = _row(c, i + a - 1, j + b - 1, k - 1, wz)
            fa += wy[b] * row
            ya += dy[b] * row
            za += wy[b] * _row(c, i + a - 1, j + b - 1, k - 1, dz)
        f += wx[a] * fa
        gx += dx[a] * fa
        gy += wx[a] * ya
        gz += wx[a] * za
    return f, gx, gy, gz


@kernel
def hessian(c: NDArray[Any], x: float, y: float, z: float) -> tuple[float, float, float, float, float, float]:
    """Second derivatives xx, yy, zz, xy, xz, yz (per voxel^2) at a point in index coordinates."""
    i, j, k = int(x), int(y), int(z)
    x, y, z = x - i, y - j, z - k
    wx, dx, bx = basis(x), slope(x), bend(x)
    wy, dy, by = basis(y), slope(y), bend(y)
    wz, dz, bz = basis(z), slope(z), bend(z)
    xx = yy = zz = xy = xz = yz = 0.0
    for a in range(4):
        p = py = pyy = pz = pyz = pzz = 0.0
        for b in range(4):
            n, m = i + a - 1, j + b - 1
            r, rz, rzz = _row(c, n, m, k - 1, wz), _row(c, n, m, k - 1, dz), _row(c, n, m, k - 1, bz)
            p, py, pyy = p + wy[b] * r, py + dy[b] * r, pyy + by[b] * r
            pz, pyz, pzz = pz + wy[b] * rz, pyz + dy[b] * rz, pzz + wy[b] * rzz
        xx, yy, zz = xx + bx[a] * p, yy + wx[a] * pyy, zz + wx[a] * pzz
        xy, xz, yz = xy + dx[a] * py, xz + dx[a] * pz, yz + wx[a] * pyz
    return xx, yy, zz, xy, xz, yz


class Wall(NamedTuple):
    """The surface's closest points to n voxels, and what they tell.

    distance : (n,) mm, negative inside; NaN where Newton steps leave two voxels or end over 0.1 voxel off the surface.
    foot, normal : (n, 3), mm and outward unit.  curvature : (n,) sum of principal curvatures, 1/mm, positive for a
    vessel.  steepness : (n,) fall of grey per mm along the normal.
    """

    distance: NDArray[Any]
    foot: NDArray[Any]
    normal: NDArray[Any]
    curvature: NDArray[Any]
    steepness: NDArray[Any]


@entry_point
def dilate(mask: NDArray[Any], order: NDArray[Any], layers: int) -> None:
    """Mark ``layers`` (PAD at most) 26-neighbour layers around the voxels ``order`` with 2, 3, ..."""
    flat, steps = mask.reshape(-1), steps_around(mask.shape, 1)
    found, begin, count = order.copy(), 0, order.shape[0]
    for layer in range(layers):
        stop = count
        for n in range(begin, stop):
            while count + steps.shape[0] > found.shape[0]:  # one voxel has 26 neighbours
                found = grown(found)
            for step in steps:
                if flat[found[n] + step] == 0:
                    flat[found[n] + step] = 2 + layer
                    found[count] = found[n] + step
                    count += 1
        begin = stop


@kernel
def _common(first: int, start: int, volume: int, box: int) -> tuple[int, int]:
    """First and stop index along an axis of a tile's voxels that lie in the box and in the volume."""
    return max(first, -start), min(first + SIDE, volume - start, box)


@entry_point
def smooth_lattice(
    volume: NDArray[Any],
    corner: NDArray[Any],
    taps: NDArray[Any],
    state: NDArray[Any],
    voxels: NDArray[Any],
    lattice: NDArray[Any],
) -> None:
    """Fill ``lattice`` with smoothed grey where ``state`` is not 0, that is at the flat box indices ``voxels``.

    Voxel (PAD, PAD, PAD) of the box is ``corner`` of the volume. Outside the volume the border's smoothed value is
    repeated.
    """
    work, w = scratch(taps), SIDE + 2 * (taps.shape[0] // 2)
    rows = work[1].reshape((w, w, w))
    si, sj, sk = corner[0] - PAD, corner[1] - PAD, corner[2] - PAD
    (vi, vj, vk), (ni, nj, nk) = volume.shape, lattice.shape
    needed = np.zeros(((ni + INNER) >> SHIFT, (nj + INNER) >> SHIFT, (nk + INNER) >> SHIFT), np.uint8)
    for voxel in voxels:
        i, j, k = unravelled(voxel, lattice.shape)
        needed[i >> SHIFT, j >> SHIFT, k >> SHIFT] = 1
        a, b, c = i + si, j + sj, k + sk
        if min(a, b, c) < 0 or a >= vi or b >= vj or c >= vk:
            lattice[i, j, k] = smoothed(volume, taps, clamped(a, vi), clamped(b, vj), clamped(c, vk))
    for tile in range(needed.size):
        if needed.flat[tile]:
            a, b, c = unravelled(tile, needed.shape)
            i0, j0, k0 = a * SIDE, b * SIDE, c * SIDE
            smooth_tile(volume, taps, (i0 + si, j0 + sj, k0 + sk), work[0], work[1])
            for i in range(*_common(i0, si, vi, ni)):
                for j in range(*_common(j0, sj, vj, nj)):
                    for k in range(*_common(k0, sk, vk, nk)):
                        if state[i, j, k]:
                            lattice[i, j, k] = rows[i - i0, j - j0, k - k0]


@entry_point
def surface_voxels(
    state: NDArray[Any], lattice: NDArray[Any], level: float, deep: int, voxels: NDArray[Any], inside: NDArray[Any]
) -> NDArray[Any]:
    """Voxels (flat) with a 26-neighbour on the other side of the wall, padding left out; sets ``inside`` to 1 inside.

    Inside are those brighter than ``level`` in the mask (``state`` 1) and in its dilated layers (2, 3, ...) up to
    ``deep``: noise or metal may make the mask itself darker.
    """
    marks, grey, sides, steps = (
        state.reshape(-1),
        lattice.reshape(-1),
        inside.reshape(-1),
        steps_around(state.shape, 1),
    )
    for voxel in voxels:
        sides[voxel] = 0 < marks[voxel] <= deep and grey[voxel] > level
    found = np.empty(voxels.shape[0], np.int64)
    count = 0
    for voxel in voxels:
        i, j, k = unravelled(voxel, state.shape)
        if min(i, j, k) < PAD or max(i - state.shape[0], j - state.shape[1], k - state.shape[2]) >= -PAD:
            continue
        near = False
        for step in steps:
            near = near or sides[voxel + step] != sides[voxel]
        if near:
            found[count] = voxel
            count += 1
    return found[:count]


@kernel
def _held(x: float, n: int) -> bool:
    """Whether the four nodes of an index coordinate lie among n; NaN has none."""
    return 1.0 <= x < n - 2.0


@kernel
def _closest(
    lattice: NDArray[Any], level: float, spacing: NDArray[Any], q: tuple[float, float, float]
) -> tuple[bool, float, float, float]:
    """Whether Newton steps stay in the box and within two voxels of ``q``, and where on the surface they end."""
    hx, hy, hz = spacing[0], spacing[1], spacing[2]
    reach = 2.0 * max(hx, hy, hz)
    px, py, pz = q
    for _ in range(FOOT_STEPS):
        f, gx, gy, gz = value_gradient(lattice, px / hx, py / hy, pz / hz)
        gx, gy, gz = gx / hx, gy / hy, gz / hz
        gg = gx * gx + gy * gy + gz * gz
        if gg < 1e-12:
            return False, px, py, pz
        ax, ay, az = q[0] - px, q[1] - py, q[2] - pz
        along = (ax * gx + ay * gy + az * gz + f - level) / gg
        px, py, pz = px + ax - along * gx, py + ay - along * gy, pz + az - along * gz
        if max(abs(px - q[0]), abs(py - q[1]), abs(pz - q[2])) > reach:
            return False, px, py, pz
        # two voxels as long as slices are thick may be ten across: further than the padding
        ni, nj, nk = lattice.shape
        if not (_held(px / hx, ni) and _held(py / hy, nj) and _held(pz / hz, nk)):
            return False, px, py, pz
    return True, px, py, pz


@entry_point
def feet(
    lattice: NDArray[Any], level: float, spacing: NDArray[Any], voxels: NDArray[Any], inside: NDArray[Any]
) -> Wall:
    """The wall at the voxels (flat box indices) next to it."""
    hx, hy, hz = spacing[0], spacing[1], spacing[2]
    n = voxels.shape[0]
    wall = Wall(np.full(n, np.nan), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros(n), np.zeros(n))
    distance, foot, normal, curvature, steepness = wall
    for m in range(n):
        i, j, k = unravelled(voxels[m], lattice.shape)
        good, px, py, pz = _closest(lattice, level, spacing, (i * hx, j * hy, k * hz))
        if not good:
            continue
        f, gx, gy, gz = value_gradient(lattice, px / hx, py / hy, pz / hz)
        if abs(f - level) > 0.1 * (abs(gx) + abs(gy) + abs(gz)):
            continue
        xx, yy, zz, xy, xz, yz = hessian(lattice, px / hx, py / hy, pz / hz)
        gx, gy, gz = gx / hx, gy / hy, gz / hz
        xx, yy, zz = xx / (hx * hx), yy / (hy * hy), zz / (hz * hz)
        xy, xz, yz = xy / (hx * hy), xz / (hx * hz), yz / (hy * hz)
        gg = gx * gx + gy * gy + gz * gz
        g = np.sqrt(gg) + 1e-30
        along = gx * gx * xx + gy * gy * yy + gz * gz * zz + 2 * (gx * gy * xy + gx * gz * xz + gy * gz * yz)
        foot[m, 0], foot[m, 1], foot[m, 2] = px, py, pz
        normal[m, 0], normal[m, 1], normal[m, 2] = -gx / g, -gy / g, -gz / g
        curvature[m] = -(xx + yy + zz - along / gg) / g
        steepness[m] = g
        away = np.sqrt((px - i * hx) ** 2 + (py - j * hy) ** 2 + (pz - k * hz) ** 2)
        distance[m] = -away if inside[i, j, k] else away
    return wall


@entry_point
def mean_around(
    owner: NDArray[Any], voxels: NDArray[Any], values: NDArray[Any], valid: NDArray[Any], reach: int
) -> NDArray[Any]:
    """Mean of ``values`` over the listed voxels within ``reach`` of each (``owner`` = list position + 1, or 0)."""
    owners, steps = owner.reshape(-1), steps_around(owner.shape, reach)
    out = np.zeros(voxels.shape[0])
    for n in range(voxels.shape[0]):
        total = 0.0
        count = 0
        for step in steps:
            m = owners[voxels[n] + step] - 1
            if m >= 0 and valid[m]:
                total += values[m]
                count += 1
        if count:
            out[n] = total / count
    return out
