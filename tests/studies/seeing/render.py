"""A renderer of its own: closed forms instead of sub-sampled voxels and filters.

A vessel is the exact profile of a blurred cylinder by the distance from its axis (Marcum's Q), a wire a bundle of point
sources whose blur is integrated over every voxel by error functions. It shares no code with ``data_synthetic`` nor with
``tests.pipeline.phantoms``, which sample shapes finely and filter them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import ndimage
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree
from scipy.special import erf
from scipy.stats import ncx2

TISSUE, CONTRAST, METAL = 100.0, 900.0, 3000.0
"""Grey of what is around, of a full vessel above that, and of solid wire above the vessel."""


def arc_of(points):
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def even(points, step):
    """A smooth curve through points, at equal steps of arc."""
    arc = arc_of(points)
    keep = np.concatenate([[True], np.diff(arc) > 1e-9])
    spline = CubicSpline(arc[keep], points[keep])
    fine = spline(np.linspace(0, arc[-1], 20 * len(points)))
    return CubicSpline(a := arc_of(fine), fine)(np.linspace(0, a[-1], max(2, round(a[-1] / step) + 1)))


def wandering(rng, length, bend, step=1.0):
    """A random walk of direction: a smooth curve whose curvature has the standard deviation ``bend`` (1/mm)."""
    n = round(length / step) + 1
    turn = ndimage.gaussian_filter1d(rng.normal(size=(n, 3)), 4.0 / step, axis=0)
    turn *= bend * step / turn[:, :2].std()
    heading = np.array([0.0, 0.0, 1.0])
    points = [np.zeros(3)]
    for kick in turn:
        heading = heading + np.cross(kick, heading)
        heading /= np.linalg.norm(heading)
        points.append(points[-1] + step * heading)
    return even(np.array(points), 0.05)


def beside(axis, amplitude, rng, wave=9.0):
    """A curve that wanders about another one, at most ``amplitude`` (mm; a number or one per point) off it."""
    arc = arc_of(axis)
    knots = np.arange(-wave, arc[-1] + 2 * wave, wave)
    shift = np.tanh(CubicSpline(knots, rng.normal(size=(len(knots), 3)))(arc))
    t = np.gradient(axis, axis=0)
    t /= np.linalg.norm(t, axis=1)[:, None]
    shift -= np.sum(shift * t, axis=1)[:, None] * t
    size = np.linalg.norm(shift, axis=1)
    shift /= np.maximum(size, 1.0)[:, None]
    return even((axis + np.asarray(amplitude).reshape(-1, 1) * shift)[::8], 0.05)


@dataclass(frozen=True, eq=False)
class Lattice:
    """Voxels (nx, ny, nz) of ``spacing`` (3,) from ``origin`` (3,); ``blur`` : the scanner's, voxels of each axis."""

    shape: tuple
    spacing: np.ndarray
    origin: np.ndarray
    blur: float = 0.8

    @staticmethod
    def around(points, margin, spacing, rng, blur=0.8):
        spacing = np.broadcast_to(np.asarray(spacing, float), 3).copy()
        low = points.min(axis=0) - margin - rng.uniform(0, 1, 3) * spacing
        shape = tuple(int(n) for n in np.ceil((points.max(axis=0) + margin - low) / spacing))
        return Lattice(shape, spacing, low, blur)

    @property
    def sigma(self):
        """The whole blur along each axis, mm: the scanner's and the voxel's own box."""
        return np.sqrt((self.blur * self.spacing.min()) ** 2 + self.spacing**2 / 12)

    def centres(self):
        axes = [o + h * np.arange(n) for o, h, n in zip(self.origin, self.spacing, self.shape, strict=True)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

    def near(self, points, limit, block=6):
        """Flat indices of voxels within ``limit`` of points, and their centres; of far blocks no voxel is looked at."""
        tree = cKDTree(points)
        index = np.stack(np.meshgrid(*(np.arange(0, n, block) for n in self.shape), indexing="ij"), axis=-1)
        half = 0.5 * (block - 1) * self.spacing
        away = tree.query(self.origin + self.spacing * index + half, distance_upper_bound=limit + np.linalg.norm(half))
        voxels = np.isfinite(away[0])
        for axis, n in enumerate(self.shape):
            voxels = np.repeat(voxels, block, axis=axis).take(np.arange(n), axis=axis)
        flat = np.flatnonzero(voxels)
        centres = self.origin + self.spacing * np.stack(np.unravel_index(flat, self.shape), axis=-1)
        found = np.isfinite(tree.query(centres, distance_upper_bound=limit)[0])
        return flat[found], centres[found]


@lru_cache(maxsize=1)
def _cylinders():
    """Share of a blurred cylinder at (radius, distance) in blurs; a table of 0.1."""
    radius, away = np.arange(0.1, 12.0, 0.1)[:, None], np.arange(0.0, 16.0, 0.1)[None]
    return ncx2.cdf(radius**2, 2, np.maximum(away, 1e-6) ** 2)


def cylinder(radius, away, sigma):
    """Grey share of blurred cylinders of ``radius`` (n,) at ``away`` (n,) from their axes, mm."""
    r, d = np.asarray(radius) / sigma, np.asarray(away) / sigma
    table = _cylinders()
    thick = r > 11.0  # a flat wall
    share = ndimage.map_coordinates(
        table, [np.clip(r / 0.1 - 1.0, 0, len(table) - 1), d / 0.1], order=1, mode="nearest"
    )
    share = np.where(r < 0.1, 0.0, np.where(d > 15.5, 0.0, share))
    return np.where(thick, 0.5 * (1 + erf((r - d) / np.sqrt(2))), share)


def vessel(lattice, axis, radius, level=1.0):
    """Grey share (shape) of a vessel along ``axis`` (n, 3) of radius and level (n,) or numbers, ends round."""
    radius, level = (np.broadcast_to(np.asarray(v, float), len(axis)) for v in (radius, level))
    sigma = float(np.prod(lattice.sigma) ** (1 / 3))
    near, points = lattice.near(axis[::10], radius.max() + 4 * sigma + 0.6)
    away, at = cKDTree(axis).query(points)
    out = np.zeros(int(np.prod(lattice.shape)), np.float32)
    out[near] = level[at] * cylinder(radius[at], away, sigma)
    return out.reshape(lattice.shape)


def _bundle(radius, sigma):
    """Offsets (n, 2) of equal sources that fill a disc."""
    n = max(7, int(np.ceil((radius / (0.45 * sigma)) ** 2 * 3)))
    k = np.arange(n) + 0.5
    rho, phi = radius * np.sqrt(k / n), np.pi * (1 + 5**0.5) * k
    return np.stack([rho * np.cos(phi), rho * np.sin(phi)], axis=1)


def wire(lattice, curve, radius, opacity=1.0):
    """Share of solid wire (shape): ``curve`` (n, 3) evenly spaced, ``opacity`` (n,) or a number along it."""
    opacity = np.broadcast_to(np.asarray(opacity, float), len(curve))
    sigma = float(lattice.sigma.min())
    step = arc_of(curve)[-1] / (len(curve) - 1)
    t = np.gradient(curve, axis=0)
    t /= np.linalg.norm(t, axis=1)[:, None]
    u = np.cross(t, [0.36, 0.48, 0.8])
    u /= np.linalg.norm(u, axis=1)[:, None]
    v = np.cross(t, u)
    disc = _bundle(radius, sigma)
    mass = np.ones(len(curve))
    mass[[0, -1]] = 0.5
    mass *= opacity * step * np.pi * radius**2 / len(disc) / float(np.prod(lattice.spacing))
    out = np.zeros(int(np.prod(lattice.shape)))
    for a, b in disc:
        _splat(out, lattice, curve + a * u + b * v, mass)
    return out.reshape(lattice.shape).astype(np.float32)


def _splat(out, lattice, points, mass):
    """Add blurred point sources, integrated over every voxel near them."""
    index = (points - lattice.origin) / lattice.spacing
    blur = lattice.blur * lattice.spacing.min() / lattice.spacing
    half = int(np.ceil(4 * blur.max())) + 1
    keep = (mass != 0) & np.all((index > -half) & (index < np.array(lattice.shape) + half), axis=1)
    index, mass = index[keep], mass[keep]
    base = np.rint(index).astype(int)
    rows, weights = [], []
    for axis in range(3):
        at = base[:, axis, None] + np.arange(-half, half + 1)
        edge = (at[:, :, None] + np.array([-0.5, 0.5]) - index[:, axis, None, None]) / (np.sqrt(2) * blur[axis])
        share = 0.5 * np.diff(erf(edge), axis=2)[:, :, 0]
        inside = (at >= 0) & (at < lattice.shape[axis])
        rows.append(np.where(inside, at, 0))
        weights.append(np.where(inside, share, 0.0))
    (i, j, k), (a, b, c) = rows, weights
    for piece in np.array_split(np.arange(len(mass)), max(1, len(mass) // 400)):
        flat = (i[piece][:, :, None, None] * lattice.shape[1] + j[piece][:, None, :, None]) * lattice.shape[2]
        flat = flat + k[piece][:, None, None, :]
        amount = mass[piece, None, None, None] * a[piece][:, :, None, None] * b[piece][:, None, :, None]
        amount = amount * c[piece][:, None, None, :]
        out += np.bincount(flat.ravel(), amount.ravel(), minlength=len(out))


def peak(lattice, radius):
    """Grey of a straight wire above the vessel, at its axis."""
    sigma = float(np.prod(lattice.sigma) ** (1 / 3))
    return METAL * (1 - np.exp(-(radius**2) / (2 * sigma**2)))


def noisy(grey, sd, rng, correlation=0.0):
    """The scan as int16: noise of ``sd``, correlated over so many voxels."""
    field = rng.standard_normal(grey.shape, dtype=np.float32)
    if correlation:
        field = ndimage.gaussian_filter(field, correlation)
        field /= field.std()
    return np.asfortranarray(np.clip(np.rint(grey + sd * field), -32000, 32000).astype(np.int16))
