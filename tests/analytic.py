"""Closed forms that the solver is checked against; each with its source."""

from __future__ import annotations

import math

from scipy.integrate import quad
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


def whipped_tip(stiffening: float, friction: float, length: float, hand: float) -> float:
    """Roll of the free tip of a shaft of constant rest bend in a tube of constant bend, rad, rolled to ``hand``.

    ψ'' = a sin ψ + b, a = EI κ_rest κ_tube/GJ, b = m/GJ, m the torque of friction per mm; ψ' = 0 at the tip ψ_t:
    ½ ψ'² = a (cos ψ_t - cos ψ) + b (ψ - ψ_t), and the length is the integral of dψ/ψ' from ψ_t to the hand.
    """

    def excess(tip: float) -> float:
        def integrand(y: float) -> float:
            # ψ = ψ_t + y²: the root at the tip cancels
            half = stiffening * (math.cos(tip) - math.cos(tip + y * y)) + friction * y * y
            return 2 * y / math.sqrt(2 * half) if y > 0 else 2 / math.sqrt(2 * (stiffening * math.sin(tip) + friction))

        return float(quad(integrand, 0.0, math.sqrt(hand - tip), limit=200)[0]) - length

    return float(brentq(excess, 1e-3, min(hand, math.pi) - 1e-3, xtol=1e-12))
