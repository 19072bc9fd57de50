"""Values, derivatives and crests (ridge lines) of a Gaussian-blurred lattice, at the points asked for and no others.

Coordinates of points are index * spacing (mm along the grid's axes); derivatives are per mm.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.lattice import clamped, entry_point, kernel, nodes_near, unravelled

REACH = 3.0
"""Half width of the Gaussian's window in sigmas."""
WIDEST = 64
"""Most nodes that the window may have along an axis."""
STRIDE = 0.7
"""Longest Newton step to a crest in voxels: as long as the blur, beyond which derivatives at a point say nothing."""


class Blurred(NamedTuple):
    """A lattice (values, voxel size (3,) in mm) that is looked at through a Gaussian of ``sigma`` mm."""

    grey: NDArray[Any]
    spacing: NDArray[Any]
    sigma: float


@kernel
def _bell(x: float, h: float, s: float, n: int, w: NDArray[Any]) -> tuple[int, int, float]:
    """A Gaussian of deviation ``s`` about x at the nodes, into ``w``; returns first and stop node and its sum."""
    first, stop = nodes_near(x, x, REACH * s, h, n)
    stop = min(stop, first + w.shape[0])
    total = 0.0
    for i in range(first, stop):
        d = (i * h - x) / s
        w[i - first] = np.exp(-0.5 * d * d)
        total += w[i - first]
    return first, stop, total


@kernel
def _weights(x: float, h: float, sigma: float, n: int, w: NDArray[Any]) -> tuple[int, int]:
    """Nodes' weights for value, first and second derivative at x, into rows of ``w``; returns first and stop node."""
    s = max(sigma, 0.6 * h)
    first, stop, total = _bell(x, h, s, n, w[0])
    for i in range(first, stop):
        d, g = (i * h - x) / s, w[0, i - first]
        w[1, i - first] = g * d / s
        w[2, i - first] = g * (d * d - 1.0) / (s * s)
    if total > 0.0:
        for m in range(3):
            excess = 0.0
            for i in range(stop - first):
                w[m, i] /= total
                excess += w[m, i]
            # the derivatives of a constant are 0 wherever x lies between the nodes: grey may have any zero
            for i in range(stop - first if m > 0 else 0):
                w[m, i] -= excess * w[0, i]
    return first, stop


@kernel
def jet(field: Blurred, p: NDArray[Any], w: NDArray[Any], out: NDArray[Any]) -> None:
    """Value, gradient (3), and second derivatives xx yy zz xy xz yz of the blurred lattice at ``p``, into out (10).

    ``w`` is scratch (3, 3, WIDEST).
    """
    grey = field.grey
    i0, i1 = _weights(p[0], field.spacing[0], field.sigma, grey.shape[0], w[0])
    j0, j1 = _weights(p[1], field.spacing[1], field.sigma, grey.shape[1], w[1])
    k0, k1 = _weights(p[2], field.spacing[2], field.sigma, grey.shape[2], w[2])
    for m in range(10):
        out[m] = 0.0
    for i in range(i0, i1):
        f = fy = fz = fyy = fzz = fyz = 0.0
        for j in range(j0, j1):
            r = rz = rzz = 0.0
            for k in range(k0, k1):
                v = grey[i, j, k]
                r += w[2, 0, k - k0] * v
                rz += w[2, 1, k - k0] * v
                rzz += w[2, 2, k - k0] * v
            f += w[1, 0, j - j0] * r
            fy += w[1, 1, j - j0] * r
            fyy += w[1, 2, j - j0] * r
            fz += w[1, 0, j - j0] * rz
            fyz += w[1, 1, j - j0] * rz
            fzz += w[1, 0, j - j0] * rzz
        a, b, c = w[0, 0, i - i0], w[0, 1, i - i0], w[0, 2, i - i0]
        out[0] += a * f
        out[1] += b * f
        out[2] += a * fy
        out[3] += a * fz
        out[4] += c * f
        out[5] += a * fyy
        out[6] += a * fzz
        out[7] += b * fy
        out[8] += b * fz
        out[9] += a * fyz


@entry_point
def jets_at(field: Blurred, points: NDArray[Any]) -> NDArray[Any]:
    """Value and gradient (n, 4) of the blurred lattice at points (n, 3)."""
    w, out = np.empty((3, 3, WIDEST)), np.empty(10)
    result = np.empty((points.shape[0], 4))
    for n in range(points.shape[0]):
        jet(field, points[n], w, out)
        result[n] = out[:4]
    return result


@kernel
def _shares(x: float, h: float, sigma: float, n: int, w: NDArray[Any]) -> tuple[int, int]:
    """The weights of ``_weights`` for the value alone."""
    first, stop, total = _bell(x, h, max(sigma, 0.6 * h), n, w)
    if total > 0.0:
        for i in range(stop - first):
            w[i] /= total
    return first, stop


@entry_point
def _values(field: Blurred, points: NDArray[Any]) -> NDArray[Any]:
    """What ``jets_at`` has in its first column: without derivatives that takes half as long."""
    grey, spacing, sigma = field
    a, b, c = np.empty(WIDEST), np.empty(WIDEST), np.empty(WIDEST)
    result = np.zeros(points.shape[0])
    for n in range(points.shape[0]):
        i0, i1 = _shares(points[n, 0], spacing[0], sigma, grey.shape[0], a)
        j0, j1 = _shares(points[n, 1], spacing[1], sigma, grey.shape[1], b)
        k0, k1 = _shares(points[n, 2], spacing[2], sigma, grey.shape[2], c)
        for i in range(i0, i1):
            plane = 0.0
            for j in range(j0, j1):
                row = 0.0
                for k in range(k0, k1):
                    row += c[k - k0] * grey[i, j, k]
                plane += b[j - j0] * row
            result[n] += a[i - i0] * plane
    return result


def values_at(field: Blurred, points: NDArray[Any]) -> NDArray[Any]:
    """The blurred lattice (n,) at points (n, 3)."""
    return np.asarray(_values(field, np.ascontiguousarray(points)))


def gaussian_taps(sigma_voxel: float) -> NDArray[np.float32]:
    """A normalised Gaussian of ``sigma_voxel`` cut at two and a half sigmas."""
    reach = max(1, int(np.ceil(2.5 * sigma_voxel - 0.5)))
    x = np.arange(-reach, reach + 1)
    g = np.exp(-0.5 * (x / sigma_voxel) ** 2)
    return np.asarray(g / g.sum(), np.float32)


@kernel
def smoothed(volume: NDArray[Any], taps: NDArray[Any], i: int, j: int, k: int) -> float:
    """The separable kernel ``taps`` (2r+1) applied at one voxel; the border voxel is repeated outside."""
    size, reach = taps.shape[0], taps.shape[0] // 2
    ni, nj, nk = volume.shape
    inside = k >= reach and k + reach < nk
    total = 0.0
    for a in range(size):
        ia = clamped(i + a - reach, ni)
        plane = 0.0
        for b in range(size):
            jb = clamped(j + b - reach, nj)
            row = 0.0
            if inside:  # 0.6 of the time, with an index that cannot be negative
                for c in range(size):
                    row += taps[c] * volume[ia, jb, np.uint64(k - reach + c)]
            else:
                for c in range(size):
                    row += taps[c] * volume[ia, jb, clamped(k - reach + c, nk)]
            plane += taps[b] * row
        total += taps[a] * plane
    return total


@entry_point
def smooth_voxels(grey: NDArray[Any], taps: NDArray[Any], voxels: NDArray[Any]) -> NDArray[Any]:
    """The separable kernel ``taps`` at flat indices of a box, float32."""
    out = np.empty(voxels.shape[0], np.float32)
    for n in range(voxels.shape[0]):
        i, j, k = unravelled(voxels[n], grey.shape)
        out[n] = smoothed(grey, taps, i, j, k)
    return out


class Probe(NamedTuple):
    """A point on its way to a crest: place and tangent (3,), the jet (10,) there, the last step (3,), and scratch."""

    place: NDArray[Any]
    tangent: NDArray[Any]
    jet: NDArray[Any]
    step: NDArray[Any]
    weights: NDArray[Any]


@kernel
def new_probe() -> Probe:
    """A probe at the origin that has no tangent yet."""
    return Probe(np.zeros(3), np.zeros(3), np.empty(10), np.empty(3), np.empty((3, 3, WIDEST)))


@kernel
def ridge_frame(out: NDArray[Any], t: NDArray[Any]) -> tuple[float, float]:
    """Tangent (into ``t``, sign kept towards its old value) of a bright ridge from a jet, and the two curvatures
    across it, ascending: eigenvalues of the Hessian, the tangent belonging to the largest.
    """
    xx, yy, zz, xy, xz, yz = out[4], out[5], out[6], out[7], out[8], out[9]
    q = (xx + yy + zz) / 3.0
    p2 = (xx - q) ** 2 + (yy - q) ** 2 + (zz - q) ** 2 + 2.0 * (xy * xy + xz * xz + yz * yz)
    p = np.sqrt(p2 / 6.0) + 1e-300
    a, b, c = (xx - q) / p, (yy - q) / p, (zz - q) / p
    d, e, f = xy / p, xz / p, yz / p
    det = a * (b * c - f * f) - d * (d * c - f * e) + e * (d * f - b * e)
    angle = np.arccos(min(1.0, max(-1.0, 0.5 * det))) / 3.0
    high = q + 2.0 * p * np.cos(angle)
    low = q + 2.0 * p * np.cos(angle + 2.0 * np.pi / 3.0)
    middle = 3.0 * q - high - low
    best = 0.0
    bx = by = bz = 0.0
    ax, ay, az = xx - high, yy - high, zz - high
    for cx, cy, cz in (
        (xy * yz - xz * ay, xz * xy - ax * yz, ax * ay - xy * xy),
        (xy * az - xz * yz, xz * xz - ax * az, ax * yz - xy * xz),
        (ay * az - yz * yz, yz * xz - xy * az, xy * yz - ay * xz),
    ):
        size = cx * cx + cy * cy + cz * cz
        if size > best:
            best, bx, by, bz = size, cx, cy, cz
    if best > 0.0:
        scale = 1.0 / np.sqrt(best)
        if bx * t[0] + by * t[1] + bz * t[2] < 0.0:
            scale = -scale
        t[0], t[1], t[2] = bx * scale, by * scale, bz * scale
    return low, middle


@kernel
def ridge_step(out: NDArray[Any], t: NDArray[Any], limit: float, step: NDArray[Any]) -> None:
    """Newton step (3,) across the tangent to the ridge's crest, at most ``limit`` mm long."""
    ux, uy, uz = (1.0, 0.0, 0.0) if abs(t[0]) < 0.7 else (0.0, 1.0, 0.0)
    dot = ux * t[0] + uy * t[1] + uz * t[2]
    ux, uy, uz = ux - dot * t[0], uy - dot * t[1], uz - dot * t[2]
    size = np.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / size, uy / size, uz / size
    vx, vy, vz = t[1] * uz - t[2] * uy, t[2] * ux - t[0] * uz, t[0] * uy - t[1] * ux
    xx, yy, zz, xy, xz, yz = out[4], out[5], out[6], out[7], out[8], out[9]
    hux, huy, huz = xx * ux + xy * uy + xz * uz, xy * ux + yy * uy + yz * uz, xz * ux + yz * uy + zz * uz
    hvx, hvy, hvz = xx * vx + xy * vy + xz * vz, xy * vx + yy * vy + yz * vz, xz * vx + yz * vy + zz * vz
    a = ux * hux + uy * huy + uz * huz
    b = vx * hux + vy * huy + vz * huz
    c = vx * hvx + vy * hvy + vz * hvz
    g = out[1] * ux + out[2] * uy + out[3] * uz
    h = out[1] * vx + out[2] * vy + out[3] * vz
    det = a * c - b * b
    if det <= 0.0 or a + c >= 0.0:
        size = np.sqrt(g * g + h * h) + 1e-30
        s, r = limit * g / size, limit * h / size
    else:
        s, r = -(c * g - b * h) / det, -(a * h - b * g) / det
    size = np.sqrt(s * s + r * r)
    if size > limit:
        s, r = s * limit / size, r * limit / size
    step[0], step[1], step[2] = s * ux + r * vx, s * uy + r * vy, s * uz + r * vz


@kernel
def to_ridge(field: Blurred, probe: Probe, rounds: int) -> float:
    """Move the probe onto the crest and set its tangent; returns the weaker curvature across (negative)."""
    p, limit = probe.place, STRIDE * min(field.spacing[0], field.spacing[1], field.spacing[2])
    middle = 0.0
    for m in range(rounds + 1):
        jet(field, p, probe.weights, probe.jet)
        _, middle = ridge_frame(probe.jet, probe.tangent)
        if m < rounds:
            ridge_step(probe.jet, probe.tangent, limit, probe.step)
            p[0] += probe.step[0]
            p[1] += probe.step[1]
            p[2] += probe.step[2]
    return middle
