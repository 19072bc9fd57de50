"""PyElastica: Cosserat rod, explicit Verlet steps to rest, mass scaled by hand.

A static answer does not depend on the inertia, so nodes and sections get what the fastest stretching mode needs at a
step of one unit of time; as documented (true density) the same answer takes a hundred times longer. The first element
lies about the clamp, half a cell behind it.
"""

from typing import Any

import elastica as ea
import numpy as np

from pipeline.benchmark.peers.frame import EA_N, EI, MOMENT_MM4, RADIUS_MM, RivalWire, Task
from pipeline.model import Array

STRETCH = 1e-2
"""The section's stretching and shearing stiffness as a share of the true one: strains stay below 1e-4, steps ten times
longer."""
STILL_MM = 1e-4
"""Relative to the slowest mode's own pace, as MuJoCo's."""
MOST_STEPS = 400_000
CHECK = 200


class _System(ea.BaseSystemCollection, ea.Constraints, ea.Forcing):  # type: ignore[misc]
    """The modules that are needed."""


class _Clamp(ea.OneEndFixedBC):  # type: ignore[misc]
    """Holds the first element straight at a place that can be moved."""

    def __init__(self, *fixed: Any, place: Array, **kwargs: Any) -> None:
        super().__init__(*fixed, **kwargs)
        self.fixed_position_collection = place


class _Push(ea.NoForces):  # type: ignore[misc]
    """The load or the wall, and drag towards rest."""

    def __init__(self, wire: "Wire", drag: float) -> None:
        super().__init__()
        self.wire, self.drag = wire, drag

    def apply_forces(self, system: Any, time: float = 0.0) -> None:
        """External forces of this step."""
        system.external_forces += self.wire.forces(system.position_collection.T).T
        system.external_forces -= self.drag * system.mass * system.velocity_collection

    def apply_torques(self, system: Any, time: float = 0.0) -> None:
        """Drag on the sections' rotation."""
        inertia = np.einsum("iin->in", system.mass_second_moment_of_inertia)
        system.external_torques -= self.drag * inertia * system.omega_collection


class Wire(RivalWire):
    """n elements; node 0 lies half an element before the clamp and node 1 half behind it, the last one is the tip."""

    name = "PyElastica"
    segments_a, segments_b = (20, 50), (30, 60)
    before_clamp = 0.5

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        by_hand = "mass and stretching scaled" + (" by hand" if self.wall is None else "")
        self.note = f"Cosserat rod, Verlet, {{steps}}, {by_hand}, clamp shifted"
        self.place = np.array([0.0, 0.0, self.start_mm - 0.5 * self.segment_mm])
        rod = ea.CosseratRod.straight_rod(
            task.n, self.place.copy(), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]),
            task.n * self.segment_mm, RADIUS_MM, 1.0,
            youngs_modulus=EI / MOMENT_MM4, shear_modulus=EI / MOMENT_MM4 / 2.6,
        )  # fmt: skip
        rod.shear_matrix *= STRETCH
        mass = 4.0 * (STRETCH * EA_N / self.segment_mm + self.wall_N_mm)
        rod.mass[:] = mass
        inertia = mass * self.segment_mm**2 / 3.0
        rod.mass_second_moment_of_inertia[:] = np.eye(3)[:, :, None] * inertia
        rod.inv_mass_second_moment_of_inertia[:] = np.eye(3)[:, :, None] / inertia
        pace = self.pace(mass)
        self.still_mm = STILL_MM * pace * CHECK
        system = _System()
        system.append(rod)
        held = {"constrained_position_idx": (0,), "constrained_director_idx": (0,)}
        system.constrain(rod).using(_Clamp, place=self.place, **held)
        system.add_forcing_to(rod).using(_Push, self, 1.6 * pace)
        system.finalize()
        self.rod, self.system = rod, system
        self.stepper, self.time = ea.PositionVerlet(), np.float64(0.0)

    def push(self, depth_mm: float) -> None:
        """Move the clamp and the whole wire with it, and wait."""
        z = depth_mm - self.length_mm - 0.5 * self.segment_mm
        self.rod.position_collection[2] += z - self.place[2]
        self.place[2] = z
        self.rest(self._advance, self.still_mm, MOST_STEPS // CHECK)

    def _advance(self) -> Array:
        for _ in range(CHECK):
            self.time = self.stepper.step(self.system, self.time, np.float64(1.0))
        self.steps += CHECK
        return self.points()

    def points(self) -> Array:
        """All nodes."""
        return np.array(self.rod.position_collection.T)


RIVALS = (Wire,)
