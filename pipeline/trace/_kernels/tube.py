"""A wire as a blurred line: the grey of a spline curve convolved with a Gaussian, and its derivatives.

Model at a voxel x:  sum_m a_m W_m exp(-|x - c_m|^2 / 2 sigma^2) / (sqrt(2 pi) sigma) + offset, with
c_m = sum_k B_k(u_m) P_k on the curve, W_m its arc weight (quadrature weight times |c'|), a_m the peak amplitude there.
The arc weights depend on the control points too: that is what places the tip along the wire.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

BLOCKS = 14
"""Control points that one voxel may see: 5 for one strand, 10 for two in contact, with room for a third."""
TINTS = 8
"""Amplitude nodes that one voxel may see."""


@njit(cache=True)
def _find(ids: NDArray[Any], count: int, wanted: int) -> int:
    for m in range(count):
        if ids[m] == wanted:
            return m
    return -1


@njit(cache=True)
def active_voxels(
    shape: tuple[int, int, int], spacing: NDArray[Any], curve: NDArray[Any], radius: float, slot: NDArray[Any]
) -> NDArray[Any]:
    """Flat indices of the voxels within ``radius`` mm of the samples (n, 3); ``slot`` gets their position + 1."""
    ni, nj, nk = shape
    found = np.empty(4096, np.int64)
    count = 0
    for m in range(curve.shape[0]):
        i0, i1 = _window(curve[m, 0], radius, spacing[0], ni)
        j0, j1 = _window(curve[m, 1], radius, spacing[1], nj)
        k0, k1 = _window(curve[m, 2], radius, spacing[2], nk)
        for i in range(i0, i1):
            dx = (i * spacing[0] - curve[m, 0]) ** 2
            for j in range(j0, j1):
                dy = dx + (j * spacing[1] - curve[m, 1]) ** 2
                if dy > radius * radius:
                    continue
                for k in range(k0, k1):
                    if slot[i, j, k] or dy + (k * spacing[2] - curve[m, 2]) ** 2 > radius * radius:
                        continue
                    if count >= found.shape[0]:
                        larger = np.empty(2 * count, np.int64)
                        larger[:count] = found
                        found = larger
                    found[count] = (i * nj + j) * nk + k
                    count += 1
                    slot[i, j, k] = count
    return found[:count]


@njit(cache=True, inline="always")
def _window(x: float, radius: float, h: float, n: int) -> tuple[int, int]:
    return max(0, int(np.ceil((x - radius) / h))), min(n, int(np.floor((x + radius) / h)) + 1)


@njit(cache=True)
def render(
    shape: tuple[int, int, int],
    spacing: NDArray[Any],
    slot: NDArray[Any],
    count: int,
    curve: NDArray[Any],
    weight: NDArray[Any],
    sigma: float,
    radius: float,
) -> NDArray[Any]:
    """The model's grey (count,) at the voxels numbered in ``slot``; ``weight`` is amplitude times arc weight."""
    out = np.zeros(count)
    norm = 1.0 / (np.sqrt(2.0 * np.pi) * sigma)
    for m in range(curve.shape[0]):
        x, y, z = curve[m, 0], curve[m, 1], curve[m, 2]
        i0, i1 = _window(x, radius, spacing[0], shape[0])
        j0, j1 = _window(y, radius, spacing[1], shape[1])
        k0, k1 = _window(z, radius, spacing[2], shape[2])
        for i in range(i0, i1):
            for j in range(j0, j1):
                flat = (i * spacing[0] - x) ** 2 + (j * spacing[1] - y) ** 2
                for k in range(k0, k1):
                    square = flat + (k * spacing[2] - z) ** 2
                    if slot[i, j, k] and square <= radius * radius:
                        out[slot[i, j, k] - 1] += weight[m] * norm * np.exp(-0.5 * square / (sigma * sigma))
    return out


@njit(cache=True)
def normal_equations(
    grey: NDArray[Any],
    spacing: NDArray[Any],
    slot: NDArray[Any],
    weight: NDArray[Any],
    voxels: NDArray[Any],
    curve: NDArray[Any],
    velocity: NDArray[Any],
    first: NDArray[Any],
    value: NDArray[Any],
    slope: NDArray[Any],
    measure: NDArray[Any],
    tint_first: NDArray[Any],
    tint_share: NDArray[Any],
    tint: NDArray[Any],
    sigma: float,
    offset: float,
    radius: float,
    controls: int,
    normal: NDArray[Any],
    right: NDArray[Any],
    residual: NDArray[Any],
) -> float:
    """J^T W J and J^T W r of the tube model over the active voxels; returns the weighted sum of squares of r.

    curve, velocity : (n, 3) samples and d/du.  first : (n,) first of the four control points, value and slope (n, 4)
    their weights and d/du.  measure : (n,) quadrature weight in u.  tint_first, tint_share : linear interpolation of
    the amplitude nodes ``tint``.  weight, residual : (voxels,).  Columns: 3 controls, amplitude nodes, sigma, offset.
    """
    _, nj, nk = grey.shape
    total = voxels.shape[0]
    tints = tint.shape[0]
    ids = np.empty((total, BLOCKS), np.int32)
    used = np.zeros(total, np.int32)
    jac = np.zeros((total, BLOCKS, 3))
    tint_ids = np.empty((total, TINTS), np.int32)
    tint_used = np.zeros(total, np.int32)
    tint_jac = np.zeros((total, TINTS))
    sigma_jac = np.zeros(total)
    model = np.full(total, offset)
    norm = 1.0 / (np.sqrt(2.0 * np.pi) * sigma)
    inverse = 1.0 / (sigma * sigma)
    hx, hy, hz = spacing[0], spacing[1], spacing[2]
    gz = np.empty(256)
    for m in range(curve.shape[0]):
        x, y, z = curve[m, 0], curve[m, 1], curve[m, 2]
        i0, i1 = _window(x, radius, hx, grey.shape[0])
        j0, j1 = _window(y, radius, hy, nj)
        k0, k1 = _window(z, radius, hz, nk)
        vx, vy, vz = velocity[m, 0], velocity[m, 1], velocity[m, 2]
        speed = np.sqrt(vx * vx + vy * vy + vz * vz) + 1e-30
        tf = tint_first[m]
        share = tint_share[m]
        amplitude = tint[tf] * (1.0 - share) + tint[tf + 1] * share
        base = first[m]
        for k in range(k0, k1):
            gz[k - k0] = np.exp(-0.5 * inverse * (k * hz - z) ** 2)
        for i in range(i0, i1):
            dx = i * hx - x
            gx = norm * measure[m] * np.exp(-0.5 * inverse * dx * dx)
            for j in range(j0, j1):
                dy = j * hy - y
                if dx * dx + dy * dy > radius * radius:
                    continue
                gxy = gx * np.exp(-0.5 * inverse * dy * dy)
                for k in range(k0, k1):
                    dz = k * hz - z
                    square = dx * dx + dy * dy + dz * dz
                    s = slot[i, j, k] - 1
                    if s < 0 or square > radius * radius:
                        continue
                    g = gxy * gz[k - k0]
                    shade = g * speed
                    model[s] += amplitude * shade
                    push = amplitude * shade * inverse
                    pull = amplitude * g / speed
                    at = _find(ids[s], used[s], base)
                    if at < 0 or at + 3 >= used[s] or ids[s, at + 3] != base + 3:
                        at = -1
                    for q in range(4):
                        place = at + q if at >= 0 else _find(ids[s], used[s], base + q)
                        if place < 0:
                            if used[s] >= BLOCKS:
                                continue
                            place = used[s]
                            ids[s, place] = base + q
                            used[s] += 1
                        b = push * value[m, q]
                        d = pull * slope[m, q]
                        jac[s, place, 0] += b * dx + d * vx
                        jac[s, place, 1] += b * dy + d * vy
                        jac[s, place, 2] += b * dz + d * vz
                    for q in range(2):
                        place = _find(tint_ids[s], tint_used[s], tf + q)
                        if place < 0:
                            if tint_used[s] >= TINTS:
                                continue
                            place = tint_used[s]
                            tint_ids[s, place] = tf + q
                            tint_used[s] += 1
                        tint_jac[s, place] += shade * (share if q else 1.0 - share)
                    sigma_jac[s] += amplitude * shade * (square * inverse - 1.0) / sigma
    return _accumulate(
        grey,
        weight,
        voxels,
        model,
        ids,
        used,
        jac,
        tint_ids,
        tint_used,
        tint_jac,
        sigma_jac,
        controls,
        tints,
        normal,
        right,
        residual,
    )


@njit(cache=True)
def _accumulate(
    grey: NDArray[Any],
    weight: NDArray[Any],
    voxels: NDArray[Any],
    model: NDArray[Any],
    ids: NDArray[Any],
    used: NDArray[Any],
    jac: NDArray[Any],
    tint_ids: NDArray[Any],
    tint_used: NDArray[Any],
    tint_jac: NDArray[Any],
    sigma_jac: NDArray[Any],
    controls: int,
    tints: int,
    normal: NDArray[Any],
    right: NDArray[Any],
    residual: NDArray[Any],
) -> float:
    """Sum the rows of J into the (full, symmetric) normal matrix."""
    _, nj, nk = grey.shape
    column = np.empty(3 * BLOCKS + TINTS + 2, np.int64)
    row = np.empty(3 * BLOCKS + TINTS + 2)
    total = 0.0
    for s in range(voxels.shape[0]):
        flat = voxels[s]
        rest = flat // nk
        r = grey[rest // nj, rest % nj, flat % nk] - model[s]
        residual[s] = r
        w = weight[s]
        if w == 0.0:
            continue
        n = 0
        for m in range(used[s]):
            for q in range(3):
                column[n] = 3 * ids[s, m] + q
                row[n] = jac[s, m, q]
                n += 1
        for m in range(tint_used[s]):
            column[n] = 3 * controls + tint_ids[s, m]
            row[n] = tint_jac[s, m]
            n += 1
        column[n] = 3 * controls + tints
        row[n] = sigma_jac[s]
        column[n + 1] = 3 * controls + tints + 1
        row[n + 1] = 1.0
        n += 2
        total += w * r * r
        for a in range(n):
            ja = w * row[a]
            right[column[a]] += ja * r
            for b in range(n):
                normal[column[a], column[b]] += ja * row[b]
    return total
