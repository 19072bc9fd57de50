"""Coulomb friction of the true wire: elastic sliders carried on its material points, at the wall's own normal force.

Every node that is pressed holds on to a point of the wall (its anchor) by a spring that slips at mu N: the return
mapping of elastoplasticity (Simo and Laursen, Comput. Struct. 42 (1992) 97), its history kept from step to step, so
that a wire that is pulled back sticks before it slides. Normal forces lag by one round; rounds go on until they agree.
Slip about the wire's own axis (rolling) is not resisted: its arm is the wire's radius. Without friction nothing of
this is computed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from data_synthetic.geometry.vectors import Array
from data_synthetic.rod.relax import Equilibrium, relax
from data_synthetic.rod.rod import Rod, Shape

ELASTIC_SLIP_MM = 2e-3
"""A slider gives by this much before it slips: a fifth of the truth's own accuracy of 0.01 mm."""

ROUNDS = 60
"""Rounds of normal forces; each shrinks their change by about mu times the angle that the wire bears on."""


@dataclass(frozen=True, eq=False)
class Sliders:
    """limit (n + 1,) = mu N in newton, normal (n + 1, 3), anchor (n + 1, 3): what a node at x is held by."""

    limit: Array
    normal: Array
    anchor: Array

    def stretch(self, points: Array) -> Array:
        """Tangential vectors (n + 1, 3) from anchors to nodes."""
        away = points - self.anchor
        return np.asarray(away - np.sum(away * self.normal, axis=1)[:, None] * self.normal)

    def energy(self, points: Array) -> float:
        """Quadratic up to the elastic slip, linear beyond; N mm."""
        size = np.linalg.norm(self.stretch(points), axis=1)
        held = np.where(size < ELASTIC_SLIP_MM, 0.5 * size**2 / ELASTIC_SLIP_MM, size - 0.5 * ELASTIC_SLIP_MM)
        return float(self.limit @ held)

    def add(self, points: Array, gradient: Array, bands: Array) -> None:
        """Add gradient and Hessian of ``energy``; node 0 is clamped."""
        stretch = self.stretch(points)
        size = np.linalg.norm(stretch, axis=1)
        slides = size > ELASTIC_SLIP_MM
        stiffness = self.limit / np.maximum(size, ELASTIC_SLIP_MM)
        gradient.reshape(-1, 4)[:, 1:] += (stiffness[:, None] * stretch)[1:]
        along = np.where(slides[:, None], stretch / np.maximum(size, ELASTIC_SLIP_MM)[:, None], 0.0)
        block = (
            np.eye(3)
            - self.normal[:, :, None] * self.normal[:, None, :]
            - along[:, :, None] * along[:, None, :]
        )
        block *= stiffness[:, None, None]
        node = 4 * np.arange(len(points) - 1)
        for a in range(3):
            for b in range(a + 1):
                bands[a - b, node + 1 + b] += block[1:, a, b]


def relax_with_friction(
    rod: Rod, start: Shape, anchor: Array, contact_N: Array, coefficient: float, force_N: float
) -> Equilibrium:
    """Relax from ``start`` to ``force_N`` while friction holds every node by its anchor (n + 1, 3).

    contact_N (n + 1, 3) : a first guess of the wall's forces.     coefficient : Coulomb's; 0 is plain ``relax``.
    """
    if not coefficient:
        return relax(rod, start, force_N)
    shape, contact, effort = start, contact_N, 0
    for _ in range(ROUNDS):
        state = relax(replace(rod, sliders=_sliders(coefficient, contact, anchor)), shape, force_N)
        change = coefficient * float(np.linalg.norm(state.contact_N - contact, axis=1).max())
        shape, contact, effort = state.shape, state.contact_N, effort + state.iterations
        if change < force_N:
            break
    return replace(state, iterations=effort, anchor=anchor)


def held_back(state: Equilibrium, coefficient: float) -> Array:
    """Vectors (n + 1, 3) from anchor to node left when all slipping is done; zero where nothing presses."""
    stretch = _sliders(coefficient, state.contact_N, state.anchor).stretch(state.shape.points)
    size = np.linalg.norm(stretch, axis=1)
    pressed = np.linalg.norm(state.contact_N, axis=1) > 0
    kept = np.where(pressed, np.minimum(1.0, ELASTIC_SLIP_MM / np.maximum(size, 1e-300)), 0.0)
    return np.asarray(kept[:, None] * stretch)


def by_tip(values: Array, count: int) -> Array:
    """Rows of ``values`` for ``count`` nodes: counted from the tip they are the same material; new ones get zero."""
    out = np.zeros((count, 3))
    kept = min(count, len(values)) - 1  # node 0 is the introducer, never the same material
    out[count - kept :] = values[len(values) - kept :]
    return out


def _sliders(coefficient: float, contact_N: Array, anchor: Array) -> Sliders:
    """The sliders under given forces of the wall."""
    load = np.linalg.norm(contact_N, axis=1)
    return Sliders(coefficient * load, contact_N / np.maximum(load, 1e-300)[:, None], anchor)
