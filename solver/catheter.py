"""A catheter over the wire: up to its tip the two bend as one, beyond it the wire bends alone."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from solver._kernels.data import Profile, Sleeve
from solver.doors import Array, Range, instance, number
from solver.errors import refuse
from solver.grid import read_only
from solver.wire import THICKEST_MM, GuideWire

PIECES = 32
"""Pieces of a stretch with a curved rest shape in which stiffness or curvature change: the pair's rest curvature is not
linear there, nor is the energy stored. From an EI of 1 to one of 1000 the sum over the pieces is right to 1e-3."""


@dataclass(frozen=True)
class Catheter:
    """A straight tube over the wire, clamped with it at the entry.

    bending_stiffness_N_mm2 : EI of the tube alone, 0 or more.     radius_mm : outer radius, more than the wire's.
    Where the tube covers the wire, the two bend as one beam whose EI is the sum of both, and whose curvature at rest is
    the wire's times the wire's share of that sum. They slide and turn on each other without friction. Friction between
    vessel and catheter is borne by the hand that holds the catheter, and is not modelled; the wire rubs on the vessel
    only beyond the catheter's tip.
    """

    bending_stiffness_N_mm2: float
    radius_mm: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        stiffness = Range(0.0, 1e12, "20 to 200 is usual")
        number("catheter", "bending_stiffness_N_mm2", self.bending_stiffness_N_mm2, stiffness)
        radius = Range(1e-6, THICKEST_MM, "0.9 is one of 5 French; write Catheter(bending_stiffness_N_mm2, radius_mm)")
        number("catheter", "radius_mm", self.radius_mm, radius)


def sleeve_of(wire: GuideWire, catheter: Catheter | None) -> Sleeve:
    """The catheter for the kernels, with its tip at the entry; ValueError where it does not go over the wire."""
    tip, cells = np.zeros(1), np.zeros((1, 2))
    if catheter is None:
        nothing = read_only(np.zeros(1))
        return Sleeve(False, tip, wire.profile, cells, nothing, nothing)
    instance("insertion", "catheter", catheter, Catheter)
    if not catheter.radius_mm > wire.radius_mm:
        advice = "a catheter goes over the wire"
        refuse("catheter", "radius_mm", catheter.radius_mm, f"more than the wire's {wire.radius_mm:g}", advice)
    own, more = wire.profile, float(catheter.bending_stiffness_N_mm2)
    at, stiffness, curvature = (read_only(line) for line in _both(own))
    share = stiffness / (stiffness + more)
    profile = Profile(own.stiffness_at, read_only(own.stiffness + more), at, read_only(share * curvature), own.twist)
    stored = 0.5 * more * share * curvature**2
    return Sleeve(True, tip, profile, cells, at, read_only(stored))


def _both(own: Profile) -> tuple[Array, Array, Array]:
    """Common abscissae, mm from the tip, with a wire's stiffness and rest curvature there; dense where both matter."""
    edges = np.unique(np.concatenate([[0.0], own.stiffness_at, own.rest_at]))
    rows = []
    for a, b in pairwise(edges):
        # inside a stretch, short of its ends, both are straight lines
        inner = np.array([0.25, 0.75]) * (b - a) + a
        lines = [np.interp(inner, x, y) for x, y in ((own.stiffness_at, own.stiffness), (own.rest_at, own.rest))]
        alike = np.ptp(lines[0]) <= 1e-3 * lines[0][0] and np.ptp(lines[1]) == 0.0
        count = 1 if alike or not np.any(lines[1]) else PIECES
        t = np.linspace(0.0, 1.0, count + 1)
        s = [line[0] + (2.0 * t - 0.5) * (line[1] - line[0]) for line in lines]
        rows.append(np.stack([a + t * (b - a), *s]))
    ends = np.array([[edges[-1]], [own.stiffness[-1]], [own.rest[-1]]])
    at, stiffness, curvature = np.concatenate([*rows, ends], axis=1)
    return at, stiffness, curvature
