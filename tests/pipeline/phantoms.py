"""Small analytic phantoms for segment and trace: tubes along curves, wires in them, blur and noise."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy import ndimage
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree
from scipy.special import erf

BACKGROUND, CONTRAST, WIRE = 100.0, 1000.0, 4000.0


def resample(points, step):
    """A dense curve (n, 3) at equal arc steps."""
    arc = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    spline = CubicSpline(arc, points)
    return spline(np.linspace(0, arc[-1], max(2, round(arc[-1] / step) + 1)))


def random_curve(seed, length=60.0, bend=0.09, start=(0.0, 0.0, 0.0), direction=(0.0, 0.0, 1.0), step=0.05):
    """A smooth space curve whose curvature wanders with standard deviation ``bend`` (1/mm), starting at ``start``."""
    rng = np.random.default_rng(seed)
    n = round(length / step)
    drive = ndimage.gaussian_filter1d(rng.normal(size=(n + 1, 2)), 5.0 / step, axis=0)
    drive *= bend / drive.std()
    t = np.asarray(direction, float) / np.linalg.norm(direction)
    u = np.cross(t, [1.0, 0.0, 0.0] if abs(t[0]) < 0.9 else [0.0, 1.0, 0.0])
    u /= np.linalg.norm(u)
    p = np.asarray(start, float)
    out = [p]
    for a, b in drive:
        v = np.cross(t, u)
        t = t + step * (a * u + b * v)
        t /= np.linalg.norm(t)
        u -= (u @ t) * t
        u /= np.linalg.norm(u)
        p = p + step * t
        out.append(p)
    return np.array(out)


def helix(radius=12.0, pitch=16.0, turns=1.2, step=0.05):
    """A helix about z, mm."""
    length = turns * np.hypot(2 * np.pi * radius, pitch)
    a = np.linspace(0, 2 * np.pi * turns, round(length / step))
    return np.stack([radius * np.cos(a), radius * np.sin(a), pitch * a / (2 * np.pi)], axis=1)


def inside_curve(points, amplitude, seed, wave=10.0):
    """A curve wandering by up to ``amplitude`` mm about another one (a wire in its lumen)."""
    rng = np.random.default_rng(seed)
    arc = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    knots = np.arange(0, arc[-1] + wave, wave)
    shift = CubicSpline(knots, rng.uniform(-1, 1, size=(len(knots), 3)))(arc)
    tangent = np.gradient(points, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    shift -= np.sum(shift * tangent, axis=1)[:, None] * tangent
    return resample(points + amplitude * shift / np.sqrt(3), 0.05)


def distance_to(curve, shape, voxel, origin, reach):
    """Distance of every voxel centre to a dense curve, mm, up to ``reach`` (inf beyond); the ends are cut square.

    Nobody writes into it: it is kept for the next scan of the same tube.
    """
    curve = np.ascontiguousarray(curve, float)
    return _distance_to(curve.tobytes(), tuple(shape), voxel, tuple(origin), reach)


@lru_cache(maxsize=4)
def _distance_to(curve, shape, voxel, origin, reach):
    curve = np.frombuffer(curve).reshape(-1, 3)
    grid = np.stack(np.meshgrid(*[np.arange(n) for n in shape], indexing="ij"), axis=-1).reshape(-1, 3)
    coarse = cKDTree(curve[:: max(1, len(curve) // 400)])
    points = grid * voxel + origin
    out = np.full(len(points), np.inf)
    near = coarse.query(points, distance_upper_bound=reach + 2.0)[0] < reach + 2.0
    d, k = cKDTree(curve).query(points[near])
    ahead = np.sum((points[near] - curve[-1]) * (curve[-1] - curve[-2]), axis=1) > 0
    behind = np.sum((points[near] - curve[0]) * (curve[1] - curve[0]), axis=1) < 0
    d[(ahead & (k == len(curve) - 1)) | (behind & (k == 0))] = np.inf
    out[near] = d
    out.flags.writeable = False
    return out.reshape(shape)


def partial_volume(distance, voxel):
    """Share of a voxel inside a wall at signed ``distance``: a box as wide as the voxel."""
    return np.clip(0.5 - distance / voxel, 0.0, 1.0)


def add_wire(volume, curve, radius, value, voxel, origin, sub=3):
    """Replace grey by ``value`` where the wire is, by sub-sampling the voxels near it (square ends)."""
    shape = np.array(volume.shape)
    index = np.unique(np.rint((curve - origin) / voxel).astype(int), axis=0)
    around = np.stack(np.meshgrid(*[np.arange(-2, 3)] * 3, indexing="ij"), -1).reshape(-1, 3)
    cells = np.unique((index[:, None] + around).reshape(-1, 3), axis=0)
    cells = cells[np.all((cells >= 0) & (cells < shape), axis=1)]
    fine = (np.arange(sub) + 0.5) / sub - 0.5
    offsets = np.stack(np.meshgrid(fine, fine, fine, indexing="ij"), -1).reshape(-1, 3)
    points = ((cells[:, None] + offsets) * voxel + origin).reshape(-1, 3)
    d, k = cKDTree(curve).query(points)
    last, first = curve[-1] - curve[-2], curve[1] - curve[0]
    ahead = (k == len(curve) - 1) & (np.sum((points - curve[-1]) * last, axis=1) > 0)
    behind = (k == 0) & (np.sum((points - curve[0]) * first, axis=1) < 0)
    share = ((d < radius) & ~ahead & ~behind).reshape(len(cells), -1).mean(axis=1)
    i, j, k3 = cells.T
    volume[i, j, k3] += share * (value - volume[i, j, k3])
    return volume


def scan(clean, psf, noise, seed, correlation=0.0):
    """Blur by ``psf`` voxels, add noise of standard deviation ``noise`` (correlated over ``correlation``), as int16."""
    rng = np.random.default_rng(seed)
    grey = ndimage.gaussian_filter(clean.astype(np.float32), psf) if psf else clean.astype(np.float32)
    field = rng.standard_normal(clean.shape, dtype=np.float32)
    if correlation:
        field = ndimage.gaussian_filter(field, correlation)
        field /= field.std()
    return np.rint(grey + noise * field).astype(np.int16)


def wire_peak(radius_vox, psf_vox, jump=WIRE - CONTRAST):
    """Peak of a blurred wire above its surroundings (grey): CNR times noise."""
    return jump * (1 - np.exp(-(radius_vox**2) / (2 * psf_vox**2)))


def blurred_step(distance, sigma):
    """A flat wall at signed ``distance`` blurred by ``sigma``: 1 deep inside, 0 far outside."""
    return 0.5 * (1 - erf(distance / (np.sqrt(2) * sigma)))
