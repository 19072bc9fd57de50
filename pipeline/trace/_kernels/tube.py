"""A wire as a blurred line: the grey of a spline curve convolved with a Gaussian, and its derivatives.

Model at a voxel x:  sum_m a_m W_m exp(-|x - c_m|^2 / 2 sigma^2) / (sqrt(2 pi) sigma) + offset, with
c_m = sum_k B_k(u_m) P_k on the curve, W_m its arc weight (quadrature weight times |c'|), a_m the peak amplitude there.
The arc weights depend on the control points too: that is what places the tip along the wire.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.lattice import entry_point, grown, kernel, nodes_near, unravelled

BLOCKS = 14
"""Control points that one voxel may see: 5 for one strand, 10 for two in contact, with room for a third."""
TINTS = 8
"""Amplitude nodes that one voxel may see."""


class Samples(NamedTuple):
    """Fixed sampling of a uniform cubic B-spline, n samples.

    measure : quadrature weight in u.  first : of the four control points; value, slope : (n, 4) their weights and d/du.
    tint_first, tint_share : linear interpolation of the amplitude nodes.  opacity : factor of the amplitude.
    """

    measure: NDArray[Any]
    first: NDArray[Any]
    value: NDArray[Any]
    slope: NDArray[Any]
    tint_first: NDArray[Any]
    tint_share: NDArray[Any]
    opacity: NDArray[Any]


class Line(NamedTuple):
    """A wire at its samples: points and d/du (n, 3) in kernel coordinates, |d/du| and amplitude (n,)."""

    curve: NDArray[Any]
    velocity: NDArray[Any]
    speed: NDArray[Any]
    amplitude: NDArray[Any]
    samples: Samples


class Blob(NamedTuple):
    """What a point of the wire looks like: its Gaussian's sigma, cut off at ``radius`` (mm), over ``offset``."""

    sigma: float
    radius: float
    offset: float


class Claim(NamedTuple):
    """Voxels (flat) that a wire claims, their position + 1 on the box (``slot``), and their weights (n,) in the fit."""

    voxels: NDArray[Any]
    slot: NDArray[Any]
    weight: NDArray[Any]


class _Rows(NamedTuple):
    """The model (n,) of n voxels and its derivatives: by sigma (n,), and a row per voxel by the control points and
    amplitude nodes (``ids``) that it sees; ``used`` counts its entries. What finds a row full goes into the row's last
    place, which nobody reads.
    """

    model: NDArray[Any]
    by_sigma: NDArray[Any]
    ids: NDArray[Any]
    used: NDArray[Any]
    by_control: NDArray[Any]
    tint_ids: NDArray[Any]
    tint_used: NDArray[Any]
    by_tint: NDArray[Any]


class Equations(NamedTuple):
    """J^T W J, J^T W r, the residuals r (n,) and their weighted sum of squares."""

    normal: NDArray[Any]
    right: NDArray[Any]
    residual: NDArray[Any]
    square: float


@kernel
def _around(
    x: float, y: float, z: float, radius: float, spacing: NDArray[Any], shape: tuple[int, int, int]
) -> tuple[tuple[int, int], tuple[int, int], tuple[int, int]]:
    """First and stop index, along each axis, of the voxels within ``radius`` mm of a point."""
    (ni, nj, nk), (hx, hy, hz) = shape, (spacing[0], spacing[1], spacing[2])
    return (nodes_near(x, x, radius, hx, ni), nodes_near(y, y, radius, hy, nj), nodes_near(z, z, radius, hz, nk))


@entry_point
def active_voxels(slot: NDArray[Any], spacing: NDArray[Any], curve: NDArray[Any], radius: float) -> NDArray[Any]:
    """Flat indices of the voxels within ``radius`` mm of the samples (n, 3); ``slot`` gets their position + 1."""
    _, nj, nk = slot.shape
    found = np.empty(4096, np.int64)
    count = 0
    for x, y, z in curve:
        (i0, i1), (j0, j1), (k0, k1) = _around(x, y, z, radius, spacing, slot.shape)
        for i in range(i0, i1):
            for j in range(j0, j1):
                flat = (i * spacing[0] - x) ** 2 + (j * spacing[1] - y) ** 2
                for k in range(k0, k1):
                    if slot[i, j, k] or flat + (k * spacing[2] - z) ** 2 > radius * radius:
                        continue
                    if count >= found.shape[0]:
                        found = grown(found)
                    found[count] = (i * nj + j) * nk + k
                    count += 1
                    slot[i, j, k] = count
    return found[:count]


@entry_point
def render(slot: NDArray[Any], spacing: NDArray[Any], count: int, line: Line, blob: Blob) -> NDArray[Any]:
    """The grey (count,) above the offset that the model gives the voxels numbered in ``slot``."""
    out, curve, weight = np.zeros(count), line.curve, line.amplitude * line.samples.measure * line.speed
    sigma, radius, _ = blob
    norm = 1.0 / (np.sqrt(2.0 * np.pi) * sigma)
    for m in range(curve.shape[0]):
        x, y, z = curve[m, 0], curve[m, 1], curve[m, 2]
        (i0, i1), (j0, j1), (k0, k1) = _around(x, y, z, radius, spacing, slot.shape)
        for i in range(i0, i1):
            for j in range(j0, j1):
                flat = (i * spacing[0] - x) ** 2 + (j * spacing[1] - y) ** 2
                for k in range(k0, k1):
                    square = flat + (k * spacing[2] - z) ** 2
                    if slot[i, j, k] and square <= radius * radius:
                        out[slot[i, j, k] - 1] += weight[m] * norm * np.exp(-0.5 * square / (sigma * sigma))
    return out


@kernel
def _find(row: NDArray[Any], count: int, wanted: int) -> int:
    """The place of ``wanted`` among the first ``count`` of a row; -1 if it is not there."""
    for m in range(count):
        if row[m] == wanted:
            return m
    return -1


@kernel
def _add_tints(
    ids: NDArray[Any], used: NDArray[Any], by_tint: NDArray[Any], s: int, first: int, share: float, shade: float
) -> None:
    """Add to a voxel's derivatives by the two amplitude nodes that a sample lies between."""
    for q in range(2):
        at = _find(ids[s], used[s], first + q)
        if at < 0:
            at = used[s]
            ids[s, at] = first + q
            used[s] = min(at + 1, TINTS)
        by_tint[s, at] += shade * (share if q else 1.0 - share)


@kernel
def _add_line(rows: _Rows, line: Line, slot: NDArray[Any], spacing: NDArray[Any], blob: Blob) -> None:
    """Add what every sample m of the wire contributes to the model and derivatives of the voxels s around it."""
    model, by_sigma, ids, used, by_control, tint_ids, tint_used, by_tint = rows
    curve, velocity, speed, amplitude, (measure, first, value, slope, tint_first, tint_share, opacity) = line
    (sigma, radius, _), (hx, hy, hz) = blob, (spacing[0], spacing[1], spacing[2])
    norm, inverse = 1.0 / (np.sqrt(2.0 * np.pi) * sigma), 1.0 / (sigma * sigma)
    for m in range(curve.shape[0]):
        x, y, z = curve[m, 0], curve[m, 1], curve[m, 2]
        vx, vy, vz, base = velocity[m, 0], velocity[m, 1], velocity[m, 2], first[m]
        (i0, i1), (j0, j1), (k0, k1) = _around(x, y, z, radius, spacing, slot.shape)
        gz = np.exp(-0.5 * inverse * (np.arange(k0, k1) * hz - z) ** 2)
        for i in range(i0, i1):
            dx = i * hx - x
            gx = norm * measure[m] * np.exp(-0.5 * inverse * dx * dx)
            for j in range(j0, j1):
                dy = j * hy - y
                gxy = gx * np.exp(-0.5 * inverse * dy * dy)
                for k in range(k0, k1):
                    dz, s = k * hz - z, slot[i, j, k] - 1
                    square = dx * dx + dy * dy + dz * dz
                    if s < 0 or square > radius * radius:
                        continue
                    g = gxy * gz[k - k0]
                    shade, pull = g * speed[m], amplitude[m] * g / speed[m]
                    push = amplitude[m] * shade * inverse
                    model[s] += amplitude[m] * shade
                    by_sigma[s] += amplitude[m] * shade * (square * inverse - 1.0) / sigma
                    at = _find(ids[s], used[s] - 3, base)
                    together = at >= 0 and ids[s, at + 3] == base + 3
                    for q in range(4):
                        place = at + q if together else _find(ids[s], used[s], base + q)
                        if place < 0:
                            place = used[s]
                            ids[s, place], used[s] = base + q, min(place + 1, BLOCKS)
                        b, d = push * value[m, q], pull * slope[m, q]
                        by_control[s, place, 0] += b * dx + d * vx
                        by_control[s, place, 1] += b * dy + d * vy
                        by_control[s, place, 2] += b * dz + d * vz
                    _add_tints(tint_ids, tint_used, by_tint, s, tint_first[m], tint_share[m], opacity[m] * shade)


@kernel
def _rows(line: Line, slot: NDArray[Any], spacing: NDArray[Any], blob: Blob, total: int) -> _Rows:
    """The model and its derivatives at the ``total`` voxels numbered in ``slot``."""
    rows = _Rows(
        np.full(total, blob.offset), np.zeros(total), np.empty((total, BLOCKS + 1), np.int32),
        np.zeros(total, np.int32), np.zeros((total, BLOCKS + 1, 3)), np.empty((total, TINTS + 1), np.int32),
        np.zeros(total, np.int32), np.zeros((total, TINTS + 1)),
    )  # fmt: skip
    _add_line(rows, line, slot, spacing, blob)
    return rows


@kernel
def _add_products(
    normal: NDArray[Any], right: NDArray[Any], column: NDArray[Any], row: NDArray[Any], w: float, r: float
) -> None:
    """Add a voxel's products to the lower half: both halves together take twice as long."""
    size, run = column.shape[0], 1
    while run < size and column[run] == column[0] + run:
        run += 1
    ordered = True
    for a in range(run, size):
        ordered = ordered and column[a] > column[a - 1]
    for a in range(size):
        ja, at = w * row[a], column[a]
        right[at] += ja * r
        # the columns of one strand are neighbours in memory, several are added at a time: 0.8 of the time
        together, line = min(run, a + 1) if ordered else 0, normal[at, column[0] :]
        for b in range(together):
            line[b] += ja * row[b]
        for b in range(together, a + 1):
            normal[max(at, column[b]), min(at, column[b])] += ja * row[b]


@entry_point
def normal_equations(
    grey: NDArray[Any], spacing: NDArray[Any], claim: Claim, line: Line, blob: Blob, controls: int, tints: int
) -> Equations:
    """The normal equations (full, symmetric) of the tube model over the claimed voxels.

    Columns: 3 ``controls``, ``tints`` amplitude nodes, sigma, offset.
    """
    voxels, slot, weight = claim
    rows = _rows(line, slot, spacing, blob, voxels.shape[0])
    model, by_sigma, ids, used, by_control, tint_ids, tint_used, by_tint = rows
    size = 3 * controls + tints + 2
    normal, right, residual = np.zeros((size, size)), np.zeros(size), np.zeros(voxels.shape[0])
    column, row = np.empty(3 * BLOCKS + TINTS + 2, np.int64), np.empty(3 * BLOCKS + TINTS + 2)
    total = 0.0
    for s in range(voxels.shape[0]):
        i, j, k = unravelled(voxels[s], grey.shape)
        w, r = weight[s], grey[i, j, k] - model[s]
        residual[s] = r
        if w == 0.0:
            continue
        n = 0
        for m in range(used[s]):
            for q in range(3):
                column[n], row[n] = 3 * ids[s, m] + q, by_control[s, m, q]
                n += 1
        for m in range(tint_used[s]):
            column[n], row[n] = 3 * controls + tint_ids[s, m], by_tint[s, m]
            n += 1
        column[n], row[n] = 3 * controls + tints, by_sigma[s]
        column[n + 1], row[n + 1] = 3 * controls + tints + 1, 1.0
        total += w * r * r
        _add_products(normal, right, column[: n + 2], row, w, r)
    return Equations(normal + np.tril(normal, -1).T, right, residual, total)
