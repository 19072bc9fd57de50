"""pyPBD: the direct position-based solver for stiff rods (Deul et al. 2018), rigid segments with XPBD compliances.

Segments lie about the nodes, so that the first joint is half a cell behind the clamp: the shift that makes a chain of
this kind second order. Statics by time steps with momentum kept and partly taken away, until nothing moves.
"""

import tempfile
from pathlib import Path

import numpy as np
import pypbd as pbd

from pipeline.benchmark.peers.frame import EI, GJ, MOMENT_MM4, RADIUS_MM, RivalWire, Task
from pipeline.model import Array

DT_S = 0.05
ITERATIONS = 5
KEEP = {"cantilever": 0.7, "bend": 0.9}
"""Share of the momentum kept from one step to the next, tuned by hand at 20 and 30 segments."""
MASS_A = 2e-7
"""Mass of the whole wire in scene A: light enough to rest in about 50 steps, heavy enough not to overshoot."""
STILL_MM = {"cantilever": 1e-6, "bend": 1e-5}
"""A step that moves no node by more ends the wait; ten times tighter changes the answers by less than 1 %."""
MOST_STEPS = 4000
GRAVITY = np.array([0.0, -9.81, 0.0])
"""The library's own gravity, which Python cannot turn off; it is taken out of the velocity before each step."""
ALONG = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""The library twists about a segment's own y, so y is laid along the wire."""
CORNERS = "--- +-- ++- -+- --+ +-+ +++ -++"
FACES = "132 143 567 578 126 165 237 276 348 387 415 458"
"""Signs of the corners of a cube about 0, and the numbers of the corners of its triangles."""


class Wire(RivalWire):
    """n + 1 segments of one length along +z, the first one (about the clamp) held."""

    name = "pyPBD"
    segments_a, segments_b = (20, 50, 100), (30, 60, 120)
    note = f"direct stiff rods, dt {DT_S} s, {ITERATIONS} iterations, {{steps}}, clamp shifted"

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        n, segment = task.n, self.segment_mm
        # an explicit wall force is stable up to dt² k w / m = 4; the lighter the segments the sooner they rest
        self.mass = DT_S**2 * self.wall_N_mm if self.wall else MASS_A / n
        pbd.Logger.addConsoleSink(pbd.LogLevel.ERR)
        simulation = pbd.Simulation.getCurrent()
        simulation.initDefault()
        self.model = simulation.getModel()
        self._add_bodies()
        pairs = [(i, i + 1) for i in range(n)]
        joints = [np.array([0.0, 0.0, self.start_mm + (i + 0.5) * segment]) for i in range(n)]
        young, shear = EI / MOMENT_MM4, 0.5 * GJ / MOMENT_MM4
        self.model.addDirectPositionBasedSolverForStiffRodsConstraint(
            pairs, joints, [RADIUS_MM] * n, [segment] * n, [young] * n, [shear] * n
        )
        self.controller = simulation.getTimeStep()
        self.controller.setValueUInt(pbd.TimeStepController.NUM_SUB_STEPS, 1)
        self.controller.setValueUInt(pbd.TimeStepController.MAX_ITERATIONS, ITERATIONS)
        pbd.TimeManager.getCurrent().setTimeStepSize(DT_S)

    def _add_bodies(self) -> None:
        corners = ["v " + " ".join(f"{sign}0.5" for sign in corner) for corner in CORNERS.split()]
        faces = ["f " + " ".join(face) for face in FACES.split()]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "cube.obj"
            path.write_text("\n".join([*corners, *faces, ""]), encoding="utf-8")
            vertices, mesh = pbd.OBJLoader.loadObjToMesh(str(path), [1.0, 1.0, 1.0])
        size = np.array([2 * RADIUS_MM, self.segment_mm, 2 * RADIUS_MM])
        for i in range(self.task.n + 1):
            place = np.array([0.0, 0.0, self.start_mm + i * self.segment_mm])
            self.model.addRigidBody(1.0, vertices, mesh, place, ALONG, size)
        bodies = self.model.getRigidBodies()
        self.bodies = [bodies[i] for i in range(self.task.n + 1)]
        for body in self.bodies:
            body.setMass(self.mass)
            body.setInertiaTensor(np.full(3, self.mass * self.segment_mm**2 / 12.0))
        self.bodies[0].setMass(0.0)

    def points(self) -> Array:
        """Centres of the segments, which are the nodes."""
        return np.array([np.ravel(body.getPosition()) for body in self.bodies])

    def push(self, depth_mm: float) -> None:
        """Move the held segment; a force can only be given as a change of velocity before each step."""
        self.bodies[0].setPosition(np.array([0.0, 0.0, depth_mm - self.length_mm]))
        self.now = self.points()
        self.velocity = np.zeros_like(self.now)
        self.rest(self._step, STILL_MM[self.task.scene], MOST_STEPS)

    def _step(self) -> Array:
        keep, before = KEEP[self.task.scene], self.now
        velocity = keep * self.velocity + DT_S * self.forces(before) / self.mass - DT_S * GRAVITY
        for body, v in zip(self.bodies[1:], velocity[1:], strict=True):
            body.setVelocity(v)
            body.setAngularVelocity(keep * np.ravel(body.getAngularVelocity()))
        self.controller.step(self.model)
        self.steps += 1
        self.now = self.points()
        self.velocity = (self.now - before) / DT_S
        return self.now


RIVALS = (Wire,)
