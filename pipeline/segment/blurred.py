"""What blur does to a wall's steepness and to the place of its half-level surface.

Blur puts the half-level surface of a curved wall inside the true wall. For a wall of small curvature the offset is
sigma^2 (k1 + k2) / 2; for a tube as thin as the blur it is far more, so the offset is taken from the exact profile of a
blurred cylinder (a Marcum Q function, here the non-central chi^2).
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import chndtr

THINNEST = 1.2
"""Radius over blur below which a blurred cylinder no longer reaches half its contrast (1.177), with a margin."""


def _half_radius(radius: float) -> float:
    """Radius at which a cylinder of ``radius``, blurred by sigma 1, falls to half its contrast."""
    return float(brentq(lambda r: chndtr(radius**2, 2, r**2) - 0.5, 1e-9, radius))


@lru_cache(maxsize=1)
def _table() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Of blurred cylinders of radius R in units of the blur: curvature 1/r of the half-level surface (ascending), its
    offset R - r, and the slope there over that of a flat wall, 1 / sqrt(2 pi).
    """
    radii = np.concatenate([np.geomspace(60.0, 2.0, 30), np.linspace(1.95, THINNEST, 30)])
    half = np.array([_half_radius(float(r)) for r in radii])
    d = 1e-4
    fall = chndtr(radii**2, 2, (half - d) ** 2) - chndtr(radii**2, 2, (half + d) ** 2)
    slope = np.sqrt(2 * np.pi) * fall / (2 * d)
    bulge, offset, slope = (np.concatenate([[a], b]) for a, b in ((0.0, 1.0 / half), (0.0, radii - half), (1.0, slope)))
    return bulge, offset, slope


def blur_of_wall(steepness: NDArray[np.float64], curvature: NDArray[np.float64], contrast: float) -> float:
    """The blur (mm) that makes a wall of this curvature (n,), 1/mm, as steep as measured (n,), grey per mm.

    A flat wall falls by contrast / (sigma sqrt(2 pi)) per mm, a thin vessel's by less: a fixed point in sigma. The
    60th percentile of steepness stands for a wall that nothing else touches.
    """
    bulge, _, slope = _table()
    typical = float(np.percentile(steepness, 60))
    bend = max(0.0, float(np.median(curvature)))
    flat = contrast / (np.sqrt(2 * np.pi) * typical)
    sigma = flat
    for _ in range(20):
        sigma = 0.5 * (sigma + flat * float(np.interp(sigma * bend, bulge, slope)))
    return float(sigma)


def half_level_offset(curvature: NDArray[np.float64], sigma: float) -> NDArray[np.float64]:
    """How far the true wall lies outside the half-level surface.

    curvature : (n,) sum of principal curvatures of that surface, 1/mm, positive where it bulges outwards.
    sigma : the whole blur (scanner and smoothing), mm. Returns mm; negative where the surface is hollow.
    """
    scaled = sigma * np.asarray(curvature, float)
    bulge, offset, _ = _table()
    thin = np.interp(np.maximum(scaled, 0.0), bulge, offset)
    return np.asarray(sigma * np.where(scaled > 0, thin, 0.5 * scaled))
