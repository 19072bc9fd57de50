"""Closed forms that the solver is checked against; each with its source."""

from __future__ import annotations

import math

from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc


def elastica_tip(alpha: float) -> tuple[float, float]:
    """Tip (x, y) over L of a cantilever under a dead transverse tip load, α = F L²/EI (Bisshopp & Drucker 1945)."""

    def length(phi0: float) -> float:
        p = math.sqrt(0.5 * (1 + math.sin(phi0)))
        return float(ellipk(p * p) - ellipkinc(math.asin(1 / (p * math.sqrt(2))), p * p)) - math.sqrt(alpha)

    phi0 = brentq(length, 1e-9, math.pi / 2 - 1e-12, xtol=1e-15)
    p = math.sqrt(0.5 * (1 + math.sin(phi0)))
    phi1 = math.asin(1 / (p * math.sqrt(2)))
    y = 1 - 2 / math.sqrt(alpha) * float(ellipe(p * p) - ellipeinc(phi1, p * p))
    return math.sqrt(2 * math.sin(phi0) / alpha), y


def hencky_load(stiffness: float, segment: float, n: int) -> float:
    """Buckling load of a clamped-free chain of n segments with half a cell at the clamp (Hencky 1920), exact."""
    return 4 * stiffness / segment**2 * math.sin(math.pi / (4 * n)) ** 2


def winkler_length(stiffness: float, wall: float) -> float:
    """Decay length (4 EI/k)^¼ of a beam on an elastic foundation, mm (Hetényi 1946)."""
    return (4 * stiffness / wall) ** 0.25


def winkler_end(stiffness: float, wall: float, force: float) -> tuple[float, float]:
    """Deflection under a force at the free end of a half-infinite beam on a foundation, and its slope there."""
    length = winkler_length(stiffness, wall)
    return 2 * force / (wall * length), 2 * force / (wall * length**2)


def helix_pitch(stiffness: float, force: float) -> float:
    """Pitch of a rod compressed into a helix in a tube, sqrt(8 π² EI/F) (Lubinski 1962)."""
    return math.sqrt(8 * math.pi**2 * stiffness / force)


def helix_contact(stiffness: float, force: float, clearance: float) -> float:
    """Contact load per length of that helix, F² r/(4 EI), N/mm."""
    return force**2 * clearance / (4 * stiffness)
