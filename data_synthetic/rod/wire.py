"""The true wire's properties: profiles over the distance from its tip, and their means over cells."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from data_synthetic.geometry import Array, ends_of

Profile = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class TrueWire:
    """A guide wire. Profiles are (distance from the tip mm, value) knots, linear between, constant beyond.

    bending : EI in N mm2.     rest_curvature : 1/mm towards material axis 1.     torsional : GJ in N mm2; the
    rod needs a finite one, and inf is stood in for by ``RIGID_TORSION``.     axial : EA in N.
    """

    radius_mm: float = 0.18
    bending_N_mm2: Profile = ((0.0, 0.5), (10.0, 0.5), (30.0, 1.5), (80.0, 4.0))
    rest_curvature_per_mm: Profile = ((0.0, 0.12), (8.0, 0.12), (8.0, 0.0))
    torsional_N_mm2: float = float("inf")
    axial_N: float = 2.0e4


RIGID_TORSION_N_MM2 = 1.0e4
"""Stands in for infinite GJ: a tip torque of 0.05 N mm turns 100 mm of it by 5e-4 rad, 0.005 mm at a 10 mm hook."""


def cell_means(profile: Sequence[tuple[float, float]], low: Array, high: Array) -> Array:
    """Mean of a piecewise linear profile over cells [low, high] (n,), jumps (repeated knots) integrated exactly."""
    knots = np.array(profile, dtype=np.float64)
    place, value = knots[:, 0], knots[:, 1]
    integral = ends_of(0.5 * (value[1:] + value[:-1]) * np.diff(place))

    def antiderivative(s: Array) -> Array:
        inside = np.clip(s, place[0], place[-1])
        k = np.clip(np.searchsorted(place, inside, side="right") - 1, 0, max(len(place) - 2, 0))
        width = np.diff(place, append=place[-1] + 1.0)[k]
        slope = np.where(width > 0, np.diff(value, append=value[-1])[k] / np.where(width > 0, width, 1.0), 0.0)
        u = inside - place[k]
        middle = integral[k] + value[k] * u + 0.5 * slope * u * u
        return np.asarray(middle + (s - inside) * np.where(s > place[-1], value[-1], value[0]))

    return np.asarray((antiderivative(high) - antiderivative(low)) / (high - low))
