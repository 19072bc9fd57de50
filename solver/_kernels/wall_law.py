"""The law of the wall: what it costs the wire to be d mm beyond the lumen, d > 0. No other file of the solver knows it.

Hooke's law, the paper's eq. 6 and 7: ½ k d² per mm of wire. Arguments: the wall's stiffness k in N/mm per mm of wire,
the length of wire in mm that a look-up point stands for, and d in mm. At d = 0 energy and force must be 0; no function
here is asked about d < 0.
"""

from solver._kernels.flags import inlined


@inlined
def energy(stiffness: float, length: float, d: float) -> float:
    """Energy, N mm."""
    return 0.5 * stiffness * length * d * d


@inlined
def energy_per_mm(stiffness: float, d: float) -> float:
    """Energy of a mm of wire, N."""
    return 0.5 * stiffness * d**2


@inlined
def force(stiffness: float, length: float, d: float) -> float:
    """Derivative of the energy with respect to d, N."""
    return stiffness * length * d


@inlined
def curvature(stiffness: float, length: float, d: float) -> float:
    """Derivative of the force with respect to d, N/mm."""
    return stiffness * length
