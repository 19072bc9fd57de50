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
