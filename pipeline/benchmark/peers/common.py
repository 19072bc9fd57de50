"""What every rival is asked: the same two pieces of work, and what it hands back."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import process_time

import numpy as np
from numpy.typing import NDArray

from pipeline.benchmark import scenes
from solver import VesselWall

Array = NDArray[np.float64]

LENGTH_A_MM = 200.0
EI = scenes.STIFFNESS
RADIUS_MM = scenes.RADIUS_MM
LOAD_A_N = 5.0 * EI / LENGTH_A_MM**2
"""P L² / EI = 5."""
EA_N = 4.0 * EI / RADIUS_MM**2
"""Of a round wire of one material: with 1.2 kN, 1 mN stretch it by 1e-6, as good as the chain's not at all."""
GJ = EI / 1.3
"""Of the same material with a Poisson number of 0.3."""
DEPTH_B_MM = 60.0
STEPS_B = 60


@dataclass(frozen=True, eq=False)
class Answer:
    """points_mm (m, 3) from the clamp to the tip.     seconds (steps,) of processor time, one per step.

    callback : share of the time spent in the Python callback that is the wall.     note : how it was set up.
    energy : N mm, where the simulator says.     status : what the simulator itself says of its answer.
    """

    points_mm: Array
    seconds: Array
    note: str
    callback: float = float("nan")
    energy: float = float("nan")
    status: str = "converged"


@dataclass
class WallAtNodes:
    """Scene B's wall as a force on points, and the time that asking it took.

    weights (m,) : mm of wire that each point stands for: a segment inside, half of one at the tip, none at the clamp.
    """

    wall: VesselWall
    weights: Array
    seconds: float = 0.0
    calls: int = 0
    radius_mm: float = field(default=RADIUS_MM)

    def forces(self, points: Array) -> Array:
        """Forces (m, 3), N."""
        return self.forces_and_stiffness(points)[0]

    def forces_and_stiffness(self, points: Array) -> tuple[Array, Array]:
        """Forces (m, 3) and the derivative of minus the force by the place (m, 3, 3), N/mm."""
        start = process_time()
        phi, gradient, hessian = self.wall.look_up(points)
        depth = np.maximum(phi + self.radius_mm, 0.0)
        stiffness = self.wall.stiffness_N_mm2 * self.weights
        force = -(stiffness * depth)[:, None] * gradient
        touching = (stiffness * (depth > 0))[:, None, None]
        outer = gradient[:, :, None] * gradient[:, None, :]
        matrix = touching * (outer + depth[:, None, None] * hessian)
        self.seconds += process_time() - start
        self.calls += 1
        return force, matrix


def wall_of(joints: int, clamp_weight: float = 0.0) -> WallAtNodes:
    """Scene B's wall for ``joints`` equal segments over the whole depth: (joints + 1) points."""
    segment = DEPTH_B_MM / joints
    weights = np.full(joints + 1, segment)
    weights[0], weights[-1] = clamp_weight * segment, 0.5 * segment
    wall = scenes.bend(DEPTH_B_MM).wall()
    assert wall is not None
    return WallAtNodes(wall, weights)
