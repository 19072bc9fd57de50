"""Coulomb friction of the true wire: elastic sliders carried on its material points, at the wall's own normal force.

Every node that is pressed holds on to a point of the wall (its anchor) by a spring that slips at mu N: the return
mapping of elastoplasticity (Simo and Laursen, Comput. Struct. 42 (1992) 97), its history kept from step to step, so
that a wire that is pulled back sticks before it slides. Normal forces lag by one round; rounds go on until they agree.
Slip about the wire's own axis (rolling) is not resisted: its arm is the wire's radius. Without friction nothing of
this is computed.
"""

from dataclasses import replace

import numpy as np

from data_synthetic.geometry import Array
from data_synthetic.rod._kernels import Shape
from data_synthetic.rod.relax import Equilibrium, relax
from data_synthetic.rod.rod import ELASTIC_SLIP_MM, Rod, Sliders

ROUNDS = 60
"""Rounds of normal forces; each shrinks their change by about mu times the angle that the wire bears on."""


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
        state = relax(replace(rod, sliders=Sliders.under(coefficient, contact, anchor)), shape, force_N)
        change = coefficient * float(np.linalg.norm(state.contact_N - contact, axis=1).max())
        shape, contact, effort = state.shape, state.contact_N, effort + state.iterations
        if change < force_N:
            break
    return replace(state, iterations=effort, anchor=anchor)


def held_back(state: Equilibrium, coefficient: float) -> Array:
    """Vectors (n + 1, 3) from anchor to node left when all slipping is done; zero where nothing presses."""
    stretch = Sliders.under(coefficient, state.contact_N, state.anchor).stretch(state.shape.points)
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
