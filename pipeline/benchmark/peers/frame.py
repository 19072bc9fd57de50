"""What every rival is asked, what its file has to provide, and how it is timed."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import process_time
from typing import ClassVar

import numpy as np

from pipeline.benchmark import scenes
from pipeline.benchmark.scenes import BenchScene
from pipeline.model import Array
from solver import VesselWall

EI = scenes.STIFFNESS
RADIUS_MM = scenes.RADIUS_MM
MOMENT_MM4 = 0.25 * np.pi * RADIUS_MM**4
"""Second moment of area of the round section."""
EA_N = 4.0 * EI / RADIUS_MM**2
"""Axial stiffness of a round wire of one material, 1.2 kN: 1 mN stretches it by 1e-6, practically not at all."""
GJ = EI / 1.3
"""Torsional stiffness of the same material with a Poisson number of 0.3, N mm^2."""


@dataclass(frozen=True)
class Task:
    """Scene A ("cantilever") or B ("bend") with the wire in ``n`` segments, pushed in by so many steps per mm."""

    scene: str
    n: int
    per_mm: int = 1

    @property
    def set_up(self) -> BenchScene:
        """Wire, wall and load."""
        return scenes.cantilever() if self.scene == "cantilever" else scenes.bend()

    def depths(self) -> list[float]:
        """How much of the wire lies beyond the entry after each push; a free wire is bent at once."""
        length = self.set_up.depth_mm
        count = 1 if self.scene == "cantilever" else round(length) * self.per_mm
        return [length * (i + 1) / count for i in range(count)]


class RivalWire(ABC):
    """A rival's wire in one task, built before the clock runs.

    name : as the tables call it.     segments_a, segments_b : numbers of segments to try in scenes A and B.
    per_mm : steps per mm to try in scene B with 60 segments.     repeats : of a task, whose median times count.
    before_clamp : share of a segment that lies before the clamp.
    status : what the simulator itself says of its answer.     note : how it was set up; "{steps}" stands for the
    time steps that it took.
    """

    name: ClassVar[str]
    segments_a: ClassVar[Sequence[int]] = ()
    segments_b: ClassVar[Sequence[int]] = ()
    per_mm: ClassVar[Sequence[int]] = (1,)
    repeats: ClassVar[int] = 1
    before_clamp: ClassVar[float] = 0.0
    status = "converged"
    note = ""

    def __init__(self, task: Task) -> None:
        """Compute what all rivals need."""
        scene, wall = task.set_up, task.set_up.wall()
        self.task, self.length_mm, self.steps = task, scene.depth_mm, 0
        self.segment_mm = scene.depth_mm / (task.n - self.before_clamp)
        self.wall, self.wall_seconds = wall, 0.0
        # the wall's stiffness at an inner node, N/mm; the tip stands for half a segment of wire, the clamp for none
        self.wall_N_mm = 0.0 if wall is None else wall.stiffness_N_mm2 * self.segment_mm
        self.nodal_N_mm = np.full(task.n + 1, self.wall_N_mm)
        self.nodal_N_mm[[0, -1]] *= (0.0, 0.5)
        # where the clamp is before the first push: scene B's wire starts in the tube before the entry
        self.start_mm = 0.0 if wall is None else -scene.depth_mm
        # the longest stretch that nothing holds: in the tube about half the wire
        self.free_mm = scene.depth_mm if wall is None else 0.5 * scene.depth_mm
        self.load_N = np.zeros((task.n + 1, 3))
        self.load_N[-1] = scene.load_N

    def pace(self, mass: float) -> float:
        """Circular frequency of the slowest mode, for nodes of this mass: that of a cantilever's free stretch."""
        return float(3.52 * np.sqrt(EI * self.segment_mm / mass) / self.free_mm**2)

    def forces(self, points: Array) -> Array:
        """Load or wall at the nodes, both (n + 1, 3), N and mm."""
        return self.load_N if self.wall is None else self.wall_forces(self.wall, points)[0]

    def wall_forces(self, wall: VesselWall, points: Array) -> tuple[Array, Array]:
        """Forces (n + 1, 3) and the derivative of minus the force by the place (n + 1, 3, 3), N/mm; timed."""
        start = process_time()
        phi, gradient, hessian = wall.look_up(points)
        depth = np.maximum(phi + RADIUS_MM, 0.0)
        force = -(self.nodal_N_mm * depth)[:, None] * gradient
        touching = (self.nodal_N_mm * (depth > 0))[:, None, None]
        outer = gradient[:, :, None] * gradient[:, None, :]
        matrix = touching * (outer + depth[:, None, None] * hessian)
        self.wall_seconds += process_time() - start
        return force, matrix

    def rest(self, advance: Callable[[], Array], still_mm: float, most: int) -> None:
        """Call ``advance`` until no coordinate of a node changes by ``still_mm``; RuntimeError after ``most`` calls."""
        before = self.points()
        for _ in range(most):
            now = advance()
            if np.abs(now - before).max() < still_mm:
                return
            before = now
        raise RuntimeError(f"{self.name}: not at rest after {self.steps} steps")

    @abstractmethod
    def push(self, depth_mm: float) -> None:
        """Bring the wire to rest with ``depth_mm`` of it beyond the entry."""

    @abstractmethod
    def points(self) -> Array:
        """Nodes (m, 3) mm, the last one at the tip."""


def pushed(rival: type[RivalWire], task: Task, most: int | None = None) -> tuple[RivalWire, list[float]]:
    """Build a rival's wire and push it in, all the way or ``most`` times; also each push's processor time, s."""
    wire, seconds = rival(task), []
    for depth in task.depths()[:most]:
        start = process_time()
        wire.push(depth)
        seconds.append(process_time() - start)
    return wire, seconds
