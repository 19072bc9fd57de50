"""pyPBD: the direct position-based solver for stiff rods (Deul et al. 2018), rigid segments with XPBD compliances.

Segments lie about the nodes, so that the first joint is half a cell behind the clamp: the shift that makes a chain of
this kind second order. Statics by time steps with momentum kept and partly taken away, until nothing moves.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import pypbd as pbd
from numpy.typing import NDArray

from pipeline.benchmark.peers.common import (
    DEPTH_B_MM,
    EI,
    GJ,
    LENGTH_A_MM,
    LOAD_A_N,
    RADIUS_MM,
    STEPS_B,
    Answer,
    WallAtNodes,
    wall_of,
)

Array = NDArray[np.float64]

NAME = "pyPBD"
PACKAGE = "pyPBD"
DT_S = 0.05
ITERATIONS = 5
KEEP_A, KEEP_B = 0.7, 0.9
"""Share of the momentum kept, tuned by hand at 20 and 30 segments."""
MASS_A = 2e-7
"""Of the whole wire in scene A: light enough to rest in about 50 steps, heavy enough not to overshoot."""
REST_A_MM, REST_B_MM = 1e-6, 1e-5
"""A step that moves no node by more ends the wait; ten times tighter changes the answers by less than 1 %."""
MOST_STEPS = 4000
GRAVITY = np.array([0.0, -9.81, 0.0])
"""The library's own, which its Python door cannot turn off; it is taken out of the velocity before each step."""
ALONG = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""The library twists about a segment's own y, so y is laid along the wire."""
CUBE = """v -0.5 -0.5 -0.5
v 0.5 -0.5 -0.5
v 0.5 0.5 -0.5
v -0.5 0.5 -0.5
v -0.5 -0.5 0.5
v 0.5 -0.5 0.5
v 0.5 0.5 0.5
v -0.5 0.5 0.5
f 1 3 2
f 1 4 3
f 5 6 7
f 5 7 8
f 1 2 6
f 1 6 5
f 2 3 7
f 2 7 6
f 3 4 8
f 3 8 7
f 4 1 5
f 4 5 8
"""


class Rod:
    """n segments of one length along +z, the first one (about the clamp) held."""

    def __init__(self, n: int, length_mm: float, first_z: float, mass: float) -> None:
        self.n, self.segment, self.mass = n, length_mm / n, mass
        pbd.Logger.addConsoleSink(pbd.LogLevel.ERR)
        self.simulation = pbd.Simulation.getCurrent()
        self.simulation.initDefault()
        self.model = self.simulation.getModel()
        self._bodies(first_z)
        pairs = [(i, i + 1) for i in range(n)]
        joints = [np.array([0.0, 0.0, first_z + (i + 0.5) * self.segment]) for i in range(n)]
        inertia = 0.25 * np.pi * RADIUS_MM**4
        young, shear = EI / inertia, 0.5 * GJ / inertia
        self.model.addDirectPositionBasedSolverForStiffRodsConstraint(
            pairs, joints, [RADIUS_MM] * n, [self.segment] * n, [young] * n, [shear] * n
        )
        controller = self.simulation.getTimeStep()
        controller.setValueUInt(pbd.TimeStepController.NUM_SUB_STEPS, 1)
        controller.setValueUInt(pbd.TimeStepController.MAX_ITERATIONS, ITERATIONS)
        pbd.TimeManager.getCurrent().setTimeStepSize(DT_S)
        self.controller: Any = controller

    def _bodies(self, first_z: float) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "cube.obj"
            path.write_text(CUBE, encoding="utf-8")
            vertices, mesh = pbd.OBJLoader.loadObjToMesh(str(path), [1.0, 1.0, 1.0])
        for i in range(self.n + 1):
            self.model.addRigidBody(
                1.0, vertices, mesh, np.array([0.0, 0.0, first_z + i * self.segment]), ALONG,
                np.array([2 * RADIUS_MM, self.segment, 2 * RADIUS_MM]),
            )  # fmt: skip
        bodies = self.model.getRigidBodies()
        self.bodies = [bodies[i] for i in range(self.n + 1)]
        for body in self.bodies:
            body.setMass(self.mass)
            body.setInertiaTensor(np.full(3, self.mass * self.segment**2 / 12.0))
        self.bodies[0].setMass(0.0)

    def points(self) -> Array:
        """Centres of the segments, which are the nodes (n + 1, 3)."""
        return np.array([np.ravel(body.getPosition()) for body in self.bodies])

    def settle(self, force: Any, keep: float, rest_mm: float) -> int:
        """Step until no node moves by more than ``rest_mm`` in a step; returns the number of steps.

        keep : share of the momentum kept from one step to the next.
        """
        now = self.points()
        velocity = np.zeros_like(now)
        for count in range(1, MOST_STEPS + 1):
            velocity = keep * velocity + DT_S * force(now) / self.mass - DT_S * GRAVITY
            for body, v in zip(self.bodies[1:], velocity[1:], strict=True):
                body.setVelocity(v)
                body.setAngularVelocity(keep * np.ravel(body.getAngularVelocity()))
            self.controller.step(self.model)
            before, now = now, self.points()
            velocity = (now - before) / DT_S
            if np.abs(now - before).max() < rest_mm:
                return count
        return MOST_STEPS


def cantilever(n: int) -> Answer:
    """Scene A."""
    rod = Rod(n, LENGTH_A_MM, 0.0, MASS_A / n)
    load = np.zeros((n + 1, 3))
    load[-1, 0] = LOAD_A_N
    start = process_time()
    steps = rod.settle(lambda _: load, KEEP_A, REST_A_MM)
    seconds = process_time() - start
    note = f"direct stiff rods, dt {DT_S} s, {ITERATIONS} iterations, {steps} steps, clamp shifted"
    return Answer(rod.points(), np.array([seconds]), note)


def bend(n: int, steps: int = STEPS_B, pushes: int | None = None) -> Answer:
    """Scene B; the wall's force is added to the velocity before each step, the only door for it."""
    wall: WallAtNodes = wall_of(n)
    # an explicit wall force is stable up to dt² k w / m = 4; the lighter the segments the sooner they rest
    mass = DT_S**2 * wall.wall.stiffness_N_mm2 * DEPTH_B_MM / n
    rod = Rod(n, DEPTH_B_MM, -DEPTH_B_MM, mass)
    seconds, total = [], 0
    for i in range(pushes or steps):
        start = process_time()
        rod.bodies[0].setPosition(np.array([0.0, 0.0, -DEPTH_B_MM * (1 - (i + 1) / steps)]))
        total += rod.settle(wall.forces, KEEP_B, REST_B_MM)
        seconds.append(process_time() - start)
    note = f"direct stiff rods, dt {DT_S} s, {ITERATIONS} iterations, {total / steps:.0f} steps per push, clamp shifted"
    return Answer(rod.points(), np.array(seconds), note, wall.seconds / sum(seconds))
