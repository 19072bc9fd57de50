"""Exudyn: absolute nodal coordinate cable elements, static Newton; the wall is a Python callback with its Jacobian."""

from contextlib import suppress
from itertools import pairwise
from typing import Any

import exudyn as exu
import numpy as np
from exudyn import itemInterface as items

from pipeline.benchmark.peers.frame import EA_N, EI, RivalWire, Task
from pipeline.model import Array
from solver import VesselWall

LOAD_STEPS = 10
SMALLEST_STEP_MM = 0.05
"""A push that has no answer even in steps of this length is given up."""
DENSITY = 1e-6
"""kg/mm of wire; a static answer does not depend on it."""


class WithoutJacobian(RivalWire):
    """As a first script sets it up: Exudyn differentiates the wall's force callback to have its Jacobian.

    n elements: scene A in the plane, x along the wire and y along the load; scene B in space.
    """

    name = "Exudyn, force callback alone"
    segments_b = (30, 60, 120)
    jacobian, given = False, "force alone"
    note = f"ANCFCable2D, static, {LOAD_STEPS} load steps"

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        flat, size = self.wall is None, 2 if self.wall is None else 3
        self.mbs, self.halved, self.depth_mm = exu.SystemContainer().AddSystem(), 0, 0.0
        # place and direction of each node, along x in the plane, along z in space
        self.start = np.zeros((task.n + 1, 2 * size))
        self.start[:, 0 if flat else 2] = self.start_mm + self.segment_mm * np.arange(task.n + 1)
        self.start[:, 2 if flat else 5] = 1.0
        node = items.NodePoint2DSlope1 if flat else items.NodePointSlope1
        self.nodes = [self.mbs.AddNode(node(referenceCoordinates=row)) for row in self.start.tolist()]
        cable = items.ObjectANCFCable2D if flat else items.ObjectANCFCable
        for pair in pairwise(self.nodes):
            self.mbs.AddObject(
                cable(
                    physicsLength=self.segment_mm, physicsMassPerLength=DENSITY, physicsBendingStiffness=EI,
                    physicsAxialStiffness=EA_N, nodeNumbers=list(pair), useReducedOrderIntegration=2,
                )
            )  # fmt: skip
        held = {coordinate: self._hold(coordinate) for coordinate in ((0, 1, 3) if flat else (0, 1, 2, 3, 4))}
        if self.wall is None:
            tip = self.mbs.AddMarker(items.MarkerNodePosition(nodeNumber=self.nodes[-1]))
            force = [0.0, self.load_N[-1, 0], 0.0]
            self.mbs.AddLoad(items.LoadForceVector(markerNumber=tip, loadVector=force))
        else:
            self.clamp = held[2]
            self._add_wall(self.wall)
        self.mbs.Assemble()
        self.settings = _settings(LOAD_STEPS if flat else 1, sparse=not flat or task.n > 20)

    def _hold(self, coordinate: int) -> int:
        """Hold one coordinate of the first node; returns the connector, whose offset can be pushed."""
        ground = self.mbs.AddNode(items.NodePointGround())
        marks = [
            self.mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=which))
            for node, which in ((ground, 0), (self.nodes[0], coordinate))
        ]
        return int(self.mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=marks)))

    def _add_wall(self, wall: VesselWall) -> None:
        """The wall as a right-hand side of its own: force, and one 3x3 block of Jacobian per touching node."""
        size = self.start.size

        def places(q: Any) -> Array:
            return np.asarray((np.asarray(q).reshape(-1, 6) + self.start)[:, :3])

        def force(_mbs: Any, _t: float, _item: int, q: Any, _q_t: Any) -> Array:
            out = np.zeros_like(self.start)
            out[:, :3] = self.forces(places(q))
            return out.ravel()

        def jacobian(_mbs: Any, _t: float, _item: int, q: Any, _q_t: Any, f: float, _f_t: float) -> Any:
            matrix = self.wall_forces(wall, places(q))[1]
            touching = np.flatnonzero(np.any(matrix != 0.0, axis=(1, 2)))
            i, a, b = (each.ravel() for each in np.meshgrid(touching, range(3), range(3), indexing="ij"))
            rows = np.column_stack([6 * i + a, 6 * i + b, f * matrix[i, a, b]])
            container = exu.MatrixContainer()
            container.SetWithSparseMatrix(rows if len(rows) else np.zeros((1, 3)), size, size)
            return container

        self.mbs.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=self.nodes, massMatrix=np.zeros((size, size)), forceUserFunction=force,
                jacobianUserFunction=jacobian if self.jacobian else 0,
            )
        )  # fmt: skip

    def push(self, depth_mm: float) -> None:
        """Find the loaded shape, or push; a step that finds no answer is taken back and halved, as its user would."""
        if self.wall is None:
            self.mbs.SolveStatic(self.settings)
            return
        step = depth_mm - self.depth_mm
        if not self._step(depth_mm, step):
            self.halved += 1
            if step < SMALLEST_STEP_MM:
                raise RuntimeError(f"Exudyn: no static solution at {depth_mm:g} mm")
            self.push(depth_mm - 0.5 * step)
            self.push(depth_mm)
        how = f"static Newton, wall through GenericODE2 callbacks ({self.given})"
        self.depth_mm, self.note = depth_mm, f"ANCFCable (3D), {how}, {self.halved} steps halved"

    def _step(self, depth_mm: float, step_mm: float) -> bool:
        """One static step: the material slides along the wire's own curve, then Newton. False: all is as before."""
        self.mbs.SetObjectParameter(self.clamp, "offset", depth_mm)
        system, initial = self.mbs.systemData, exu.ConfigurationType.Initial
        before = np.array(system.GetODE2Coordinates())
        moved = before.reshape(-1, 6) + self.start
        moved[:, :3] += step_mm * moved[:, 3:] / np.linalg.norm(moved[:, 3:], axis=1)[:, None]
        system.SetODE2Coordinates((moved - self.start).ravel(), configuration=initial)
        with suppress(exu.SolverError):
            if self.mbs.SolveStatic(self.settings, updateInitialValues=True):
                return True
        system.SetODE2Coordinates(before, configuration=initial)
        system.SetODE2Coordinates(before)
        return False

    def points(self) -> Array:
        """Nodes in our axes."""
        found = np.array([self.mbs.GetNodeOutput(n, exu.OutputVariableType.Position) for n in self.nodes])
        # the plane's z is 0
        return found if self.wall else found[:, [1, 2, 0]]


class WithJacobian(WithoutJacobian):
    """With the wall's own sparse Jacobian; and scene A, which has no wall."""

    name = "Exudyn"
    segments_a = (5, 10, 20, 50, 100, 200)
    per_mm = (1, 2, 3, 4, 8)
    jacobian, given = True, "force and sparse Jacobian"


def _settings(load_steps: int, sparse: bool) -> Any:
    settings = exu.SimulationSettings()
    settings.solutionSettings.writeSolutionToFile = False
    settings.staticSolver.verboseMode = 0
    settings.staticSolver.numberOfLoadSteps = load_steps
    # with 1e-9 and 1e-10 N the residual of 120 stiff elements stalls in round-off and scene B has no answer
    settings.staticSolver.newton.relativeTolerance = 1e-8
    settings.staticSolver.newton.absoluteTolerance = 1e-9
    settings.staticSolver.newton.maxIterations = 50
    settings.linearSolverType = exu.LinearSolverType.EigenSparse if sparse else exu.LinearSolverType.EXUdense
    return settings


RIVALS = (WithJacobian, WithoutJacobian)
