"""PyElastica: Cosserat rod, explicit Verlet steps to rest, mass scaled by hand.

A static answer does not depend on the inertia, so nodes and sections get what the fastest stretching mode needs at a
step of one unit of time; as documented (true density) the same answer takes a hundred times longer. The first element
lies about the clamp, half a cell behind it.
"""

from __future__ import annotations

from time import process_time
from typing import Any

import elastica as ea
import numpy as np
from numpy.typing import NDArray

from pipeline.benchmark.peers.common import (
    DEPTH_B_MM,
    EI,
    LENGTH_A_MM,
    LOAD_A_N,
    RADIUS_MM,
    STEPS_B,
    Answer,
    wall_of,
)

Array = NDArray[np.float64]

NAME = "PyElastica"
PACKAGE = "pyelastica"
STRETCH = 1e-2
"""The section's stretching and shearing stiffness as a share of the true one: strains stay below 1e-4, steps ten times
longer."""
REST = 1e-7
MOST_STEPS = 400_000
CHECK = 200


class _System(ea.BaseSystemCollection, ea.Constraints, ea.Forcing):  # type: ignore[misc]
    """The modules that are needed."""


class _Clamp(ea.ConstraintBase):  # type: ignore[misc]
    """Holds the first element straight at a place that can be moved."""

    def __init__(self, place: Array, frame: Array, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.place, self.frame = place, frame

    def constrain_values(self, system: Any, time: float) -> None:
        """Place and direction."""
        system.position_collection[:, 0] = self.place
        system.director_collection[..., 0] = self.frame

    def constrain_rates(self, system: Any, time: float) -> None:
        """Nothing of it moves."""
        system.velocity_collection[:, 0] = 0.0
        system.omega_collection[:, 0] = 0.0


class _Push(ea.NoForces):  # type: ignore[misc]
    """The load or the wall, and drag towards rest."""

    def __init__(self, force: Any, drag: float) -> None:
        super().__init__()
        self.force, self.drag = force, drag

    def apply_forces(self, system: Any, time: float = 0.0) -> None:
        """External forces of this step."""
        system.external_forces += self.force(system.position_collection)
        system.external_forces -= self.drag * system.mass * system.velocity_collection

    def apply_torques(self, system: Any, time: float = 0.0) -> None:
        """Drag on the sections' rotation."""
        inertia = np.einsum("iin->in", system.mass_second_moment_of_inertia)
        system.external_torques -= self.drag * inertia * system.omega_collection


class Rod:
    """n elements; node 0 lies half an element before the clamp, the last node is the tip."""

    def __init__(
        self, n: int, length_mm: float, clamp_z: float, slowest_mm: float, force: Any, wall_k: float
    ) -> None:
        self.segment = length_mm / (n - 0.5)
        moment = 0.25 * np.pi * RADIUS_MM**4
        area = np.pi * RADIUS_MM**2
        start = np.array([0.0, 0.0, clamp_z - 0.5 * self.segment])
        rod: Any = ea.CosseratRod.straight_rod(
            n, start, np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]), n * self.segment, RADIUS_MM, 1.0,
            youngs_modulus=EI / moment, shear_modulus=EI / moment / 2.6,
        )  # fmt: skip
        rod.shear_matrix *= STRETCH
        stretch = STRETCH * EI / moment * area / self.segment
        mass = 4.0 * (stretch + wall_k)
        rod.mass[:] = mass
        inertia = mass * self.segment**2 / 3.0
        rod.mass_second_moment_of_inertia[:] = np.eye(3)[:, :, None] * inertia
        rod.inv_mass_second_moment_of_inertia[:] = np.eye(3)[:, :, None] / inertia
        self.pace = 3.52 * np.sqrt(EI * self.segment / mass) / slowest_mm**2
        system = _System()
        system.append(rod)
        self.place = start.copy()
        system.constrain(rod).using(_Clamp, place=self.place, frame=rod.director_collection[..., 0].copy())
        system.add_forcing_to(rod).using(_Push, force, 1.6 * self.pace)
        system.finalize()
        self.rod, self.system = rod, system
        self.stepper = ea.PositionVerlet()
        self.time = np.float64(0.0)

    def settle(self) -> int:
        """Step until at rest; returns the number of steps."""
        before = self.points()
        for count in range(1, MOST_STEPS + 1):
            self.time = self.stepper.step(self.system, self.time, np.float64(1.0))
            if count % CHECK == 0:
                now = self.points()
                if np.abs(now - before).max() < REST * CHECK * 1e3 * self.pace:
                    return count
                before = now
        return MOST_STEPS

    def points(self) -> Array:
        """Nodes (n + 1, 3), mm."""
        return np.array(self.rod.position_collection.T)


def cantilever(n: int) -> Answer:
    """Scene A."""
    load = np.zeros((3, n + 1))
    load[0, -1] = LOAD_A_N
    rod = Rod(n, LENGTH_A_MM, 0.0, LENGTH_A_MM, lambda _: load, 0.0)
    start = process_time()
    steps = rod.settle()
    seconds = process_time() - start
    note = f"Cosserat rod, Verlet, {steps} steps, mass and stretching scaled by hand, clamp shifted"
    return Answer(rod.points(), np.array([seconds]), note)


def bend(n: int, steps: int = STEPS_B, pushes: int | None = None) -> Answer:
    """Scene B."""
    wall = wall_of(n)
    segment = DEPTH_B_MM / (n - 0.5)
    # node 0 lies before the clamp and node 1 half an element behind it
    wall.weights[:] = segment
    wall.weights[0], wall.weights[-1] = 0.0, 0.5 * segment
    push = wall.wall.stiffness_N_mm2 * segment
    rod = Rod(n, DEPTH_B_MM, -DEPTH_B_MM, 0.5 * DEPTH_B_MM, lambda x: wall.forces(x.T).T, push)
    seconds, total = [], 0
    for i in range(pushes or steps):
        start = process_time()
        rod.place[2] = -DEPTH_B_MM * (1 - (i + 1) / steps) - 0.5 * segment
        rod.rod.position_collection[2] += DEPTH_B_MM / steps
        total += rod.settle()
        seconds.append(process_time() - start)
    note = (
        f"Cosserat rod, Verlet, {total / steps:.0f} steps per push, mass and stretching scaled, clamp shifted"
    )
    return Answer(rod.points(), np.array(seconds), note, wall.seconds / sum(seconds))
