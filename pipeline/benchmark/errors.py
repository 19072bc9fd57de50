"""Distance of a chain from a converged curve, at equal arc lengths."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]

SAMPLE_MM = 0.5
"""Arc step of the comparison: the same for every segment length, so that coarse chains are not flattered."""


def arc_samples(depth_mm: float) -> Array:
    """Arc lengths (m,) from 0 to the depth at about SAMPLE_MM."""
    return np.linspace(0.0, depth_mm, max(2, round(depth_mm / SAMPLE_MM) + 1))


def resampled(joints_mm: ArrayLike, arcs_mm: Array, samples_mm: Array, *, smooth: bool = False) -> Array:
    """Points (m, 3) at arc lengths (m,) of a chain with joints (n, 3) at arc lengths (n,).

    smooth : through a cubic spline, fourth order, for a reference; the chain itself is straight between its joints.
    """
    joints = np.asarray(joints_mm, dtype=np.float64)
    if smooth and len(joints) > 3:
        return np.asarray(CubicSpline(arcs_mm, joints)(samples_mm))
    return np.column_stack([np.interp(samples_mm, arcs_mm, joints[:, a]) for a in range(3)])


def shape_error(points: Array, reference: Array) -> tuple[float, float]:
    """Root mean square and tip distance, mm, of points (m, 3) at the same arc lengths."""
    apart = np.linalg.norm(points - reference, axis=1)
    return float(np.sqrt(np.mean(apart**2))), float(apart[-1])
