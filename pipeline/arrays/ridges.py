"""Crests of bright lines: which way one runs at a point, and the way from a point onto it.

Coordinates are those of :mod:`pipeline.arrays.jets`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.jets import WIDEST, Blurred, jet
from pipeline.arrays.lattice import kernel

STRIDE = 0.7
"""Longest step to a crest in voxels: a window of that blur sees no further."""


class Probe(NamedTuple):
    """A point on its way to a crest: place and tangent (3,), the jet (10,) there, the last step (3,), and scratch."""

    place: NDArray[Any]
    tangent: NDArray[Any]
    jet: NDArray[Any]
    step: NDArray[Any]
    weights: NDArray[Any]


@kernel
def new_probe() -> Probe:
    """A probe that is nowhere yet."""
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
    for m in range(3):
        if m == 0:
            cx, cy, cz = xy * yz - xz * ay, xz * xy - ax * yz, ax * ay - xy * xy
        elif m == 1:
            cx, cy, cz = xy * az - xz * yz, xz * xz - ax * az, ax * yz - xy * xz
        else:
            cx, cy, cz = ay * az - yz * yz, yz * xz - xy * az, xy * yz - ay * xz
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
    ux, uy, uz = 0.0, 0.0, 0.0
    if abs(t[0]) < 0.7:
        ux = 1.0
    else:
        uy = 1.0
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
