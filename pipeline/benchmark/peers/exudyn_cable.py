"""Exudyn: absolute nodal coordinate cable elements, static Newton; the wall is a Python callback with its Jacobian."""

from __future__ import annotations

from itertools import pairwise
from time import process_time
from typing import Any

import exudyn as exu
import numpy as np
from exudyn import itemInterface as items
from numpy.typing import NDArray

from pipeline.benchmark.peers.common import (
    DEPTH_B_MM,
    EA_N,
    EI,
    LENGTH_A_MM,
    LOAD_A_N,
    STEPS_B,
    Answer,
    WallAtNodes,
    wall_of,
)

Array = NDArray[np.float64]

NAME = "Exudyn"
PACKAGE = "exudyn"
LOAD_STEPS = 10
SMALLEST_STEP_MM = 0.05
"""A push that has no answer even in steps of this length is given up."""
DENSITY = 1e-6
"""kg/mm of wire; a static answer does not depend on it."""


def _settings(load_steps: int, sparse: bool) -> Any:
    settings = exu.SimulationSettings()
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.solutionInformation = ""
    settings.solutionSettings.coordinatesSolutionFileName = ""
    settings.displayComputationTime = False
    settings.displayStatistics = False
    settings.staticSolver.verboseMode = 0
    settings.staticSolver.verboseModeFile = 0
    settings.staticSolver.numberOfLoadSteps = load_steps
    # with 1e-9 and 1e-10 N the residual of 120 stiff elements stalls in round-off and scene B has no answer
    settings.staticSolver.newton.relativeTolerance = 1e-8
    settings.staticSolver.newton.absoluteTolerance = 1e-9
    settings.staticSolver.newton.maxIterations = 50
    settings.staticSolver.adaptiveStep = True
    settings.linearSolverSettings.ignoreSingularJacobian = False
    settings.linearSolverType = exu.LinearSolverType.EigenSparse if sparse else exu.LinearSolverType.EXUdense
    return settings


def cantilever(n: int, reduced: int = 2) -> Answer:
    """Scene A in the plane: x along the wire, y along the load."""
    mbs = exu.SystemContainer().AddSystem()
    element = LENGTH_A_MM / n
    start = [[i * element, 0.0, 1.0, 0.0] for i in range(n + 1)]
    nodes = [mbs.AddNode(items.NodePoint2DSlope1(referenceCoordinates=place)) for place in start]
    for a, b in pairwise(nodes):
        mbs.AddObject(
            items.ObjectANCFCable2D(
                physicsLength=element, physicsMassPerLength=DENSITY, physicsBendingStiffness=EI,
                physicsAxialStiffness=EA_N, nodeNumbers=[a, b], useReducedOrderIntegration=reduced,
            )
        )  # fmt: skip
    ground = mbs.AddMarker(
        items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0)
    )
    for coordinate in (0, 1, 3):
        mark = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=coordinate))
        mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[ground, mark]))
    tip = mbs.AddMarker(items.MarkerNodePosition(nodeNumber=nodes[-1]))
    mbs.AddLoad(items.LoadForceVector(markerNumber=tip, loadVector=[0.0, LOAD_A_N, 0.0]))
    mbs.Assemble()
    settings = _settings(LOAD_STEPS, sparse=n > 20)
    clock = process_time()
    mbs.SolveStatic(settings)
    seconds = process_time() - clock
    flat = np.array([mbs.GetNodeOutput(node, exu.OutputVariableType.Position) for node in nodes])
    points = np.column_stack([flat[:, 1], np.zeros(n + 1), flat[:, 0]])
    return Answer(points, np.array([seconds]), f"ANCFCable2D, static, {LOAD_STEPS} load steps")


def bend(n: int, steps: int = STEPS_B, pushes: int | None = None, *, jacobian: bool = True) -> Answer:
    """Scene B: a wire of 60 mm starts in the straight tube before the entry and is pushed in by its clamp.

    jacobian : hand Exudyn the wall's own sparse Jacobian; without it, it differentiates the callback numerically.
    """
    wall = wall_of(n)
    model = _Model(n, wall, jacobian)
    seconds = []
    for i in range(pushes or steps):
        start = process_time()
        model.push(DEPTH_B_MM * (i + 1) / steps, DEPTH_B_MM / steps)
        seconds.append(process_time() - start)
    given = "force and sparse Jacobian" if jacobian else "force alone"
    note = f"ANCFCable (3D), static Newton, wall through GenericODE2 callbacks ({given})"
    note += f", {model.halved} steps halved"
    return Answer(model.points(), np.array(seconds), note, wall.seconds / sum(seconds))


class _Model:
    """The wire, its wall and its moving clamp."""

    def __init__(self, n: int, wall: WallAtNodes, jacobian: bool) -> None:
        self.n, self.wall, self.halved = n, wall, 0
        self.element = DEPTH_B_MM / n
        self.mbs = exu.SystemContainer().AddSystem()
        self.start = np.zeros((n + 1, 6))
        self.start[:, 2] = -DEPTH_B_MM + self.element * np.arange(n + 1)
        self.start[:, 5] = 1.0
        self.nodes = [
            self.mbs.AddNode(items.NodePointSlope1(referenceCoordinates=row)) for row in self.start.tolist()
        ]
        for pair in pairwise(self.nodes):
            self.mbs.AddObject(
                items.ObjectANCFCable(
                    physicsLength=self.element, physicsMassPerLength=DENSITY, physicsBendingStiffness=EI,
                    physicsAxialStiffness=EA_N, nodeNumbers=list(pair), useReducedOrderIntegration=2,
                )
            )  # fmt: skip
        self.clamp = self._clamp()
        zero = np.zeros((6 * (n + 1), 6 * (n + 1)))
        self.mbs.AddObject(
            items.ObjectGenericODE2(
                nodeNumbers=self.nodes, massMatrix=zero, forceUserFunction=self._force,
                jacobianUserFunction=self._jacobian if jacobian else 0,
            )
        )  # fmt: skip
        self.mbs.Assemble()
        self.settings = _settings(1, sparse=True)

    def _clamp(self) -> int:
        """Hold place and direction of the first node; returns the connector that is pushed."""
        ground = self.mbs.AddMarker(
            items.MarkerNodeCoordinate(nodeNumber=self.mbs.AddNode(items.NodePointGround()), coordinate=0)
        )
        held = {}
        for coordinate in (0, 1, 2, 3, 4):
            mark = self.mbs.AddMarker(
                items.MarkerNodeCoordinate(nodeNumber=self.nodes[0], coordinate=coordinate)
            )
            held[coordinate] = self.mbs.AddObject(
                items.ObjectConnectorCoordinate(markerNumbers=[ground, mark])
            )
        return int(held[2])

    def _places(self, q: Any) -> Array:
        return np.asarray((np.asarray(q).reshape(-1, 6) + self.start)[:, :3])

    def _force(self, _mbs: Any, _t: float, _item: int, q: Any, _q_t: Any) -> Array:
        """The right-hand side: the applied force."""
        out = np.zeros((self.n + 1, 6))
        out[:, :3] = self.wall.forces(self._places(q))
        return out.ravel()

    def _jacobian(self, _mbs: Any, _t: float, _item: int, q: Any, _q_t: Any, f: float, _f_t: float) -> Any:
        """Sparse: one 3x3 block per touching node."""
        matrix = self.wall.forces_and_stiffness(self._places(q))[1]
        touching = np.flatnonzero(np.any(matrix != 0.0, axis=(1, 2)))
        rows = []
        for i in touching:
            for a in range(3):
                rows += [[6 * i + a, 6 * i + b, f * matrix[i, a, b]] for b in range(3)]
        size = 6 * (self.n + 1)
        container = exu.MatrixContainer()
        container.SetWithSparseMatrix(np.array(rows or [[0.0, 0.0, 0.0]]), size, size)
        return container

    def push(self, depth_mm: float, step_mm: float) -> None:
        """Push to a depth; a step that finds no answer is taken back and halved, as its user would."""
        before = np.asarray(self.mbs.systemData.GetODE2Coordinates()).copy()
        if self._step(before, depth_mm, step_mm):
            return
        self.halved += 1
        if step_mm < SMALLEST_STEP_MM:
            msg = f"Exudyn: no static solution at {depth_mm:g} mm"
            raise RuntimeError(msg)
        self.mbs.systemData.SetODE2Coordinates(before, configuration=exu.ConfigurationType.Initial)
        self.mbs.systemData.SetODE2Coordinates(before)
        self.push(depth_mm - 0.5 * step_mm, 0.5 * step_mm)
        self.push(depth_mm, 0.5 * step_mm)

    def _step(self, before: Array, depth_mm: float, step_mm: float) -> bool:
        """One static step: the material slides along the wire's own curve, then Newton."""
        self.mbs.SetObjectParameter(self.clamp, "offset", depth_mm)
        state, count = before.copy(), 6 * (self.n + 1)
        now = state[:count].reshape(-1, 6) + self.start
        tangent = now[:, 3:] / np.linalg.norm(now[:, 3:], axis=1)[:, None]
        moved = now.copy()
        moved[:, :3] += step_mm * tangent
        state[:count] = (moved - self.start).ravel()
        self.mbs.systemData.SetODE2Coordinates(state, configuration=exu.ConfigurationType.Initial)
        try:
            return bool(self.mbs.SolveStatic(self.settings, updateInitialValues=True))
        except exu.SolverError:
            return False

    def points(self) -> Array:
        """Nodes (n + 1, 3) mm."""
        return np.array(
            [self.mbs.GetNodeOutput(node, exu.OutputVariableType.Position) for node in self.nodes]
        )
