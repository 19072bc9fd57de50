"""The wall at the entry: half of the first segment belongs to a joint that the introducer holds.

No minimum depends on that half. To the kernels it is a constant, which energy and push have; the forces have it here.
"""

import math

import numpy as np

from solver._kernels.data import Rule
from solver.doors import Array
from solver.solution import Solution
from solver.wall import VesselWall

AROUND = 512
"""Points around the hull where it is sampled: so many more than its own that no roll changes what is held (to 1e-5)."""


class EntryContact:
    """A wire's hull where it is held, at an entry (3,), mm, with a frame (3, 3).

    energy, force : of the wall per mm of wire, N and (3,) N/mm.     deep : penetration, mm.
    """

    def __init__(self, wall: VesselWall, rule: Rule, radius_mm: float, entry: Array, frame: Array) -> None:
        self.rule, points = rule, entry[None]
        if wall.samples:
            angle = 2 * math.pi * np.arange(AROUND) / AROUND
            points = entry + radius_mm * np.column_stack([np.cos(angle), np.sin(angle)]) @ frame[:, :2].T
        phi, gradient, _ = wall.look_up(points)
        depth, stiffness = np.maximum(phi + rule.reach, 0.0), wall.stiffness_N_mm2
        self.energy = 0.5 * stiffness * float(np.mean(depth**2))
        self.force = -stiffness * np.mean(depth[:, None] * gradient, axis=0)
        self.deep = float(depth.max())

    def add(self, solution: Solution) -> None:
        """Add the wall's force here, and what the introducer holds against it, to a solution that nobody has seen yet.

        Where points inside the first segment stand for all of it, nothing is missing (``chain.place_points``).
        """
        k = len(solution.joints_mm) - 1
        if self.deep == 0.0 or k == 0 or (self.rule.tip_at.size > 1 and k - 1 <= self.rule.zone):
            return
        force = 0.5 * float(np.linalg.norm(solution.joints_mm[1] - solution.joints_mm[0])) * self.force
        contact, reaction = solution.contact_force_N.copy(), solution.reaction_force_N - force
        contact[0] += force
        for array in (contact, reaction):
            array.setflags(write=False)
        deepest = max(solution.max_penetration_mm, self.deep)
        vars(solution).update(contact_force_N=contact, reaction_force_N=reaction, max_penetration_mm=deepest)
