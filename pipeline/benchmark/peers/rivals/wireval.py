"""This project's own solver on the same work, measured in the same way; its wall is sampled at the same voxels."""

from pipeline.benchmark.peers.frame import RivalWire, Task
from pipeline.model import Array
from solver import Insertion, relax


class Wire(RivalWire):
    """One relaxation from the straight wire in scene A; in scene B n segments long at the end only."""

    name = "wireval newton"
    segments_a, segments_b = (5, 10, 20, 50, 100, 200), (30, 60, 120)
    per_mm = (1, 2, 3, 4, 8)
    repeats = 9
    note = "newton, slide"

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        scene = task.set_up
        self.wire = scene.wire(self.segment_mm)
        insertion = Insertion(self.wire, self.wall, scene.entry_mm, scene.direction)
        self.solutions = insertion.to_depths(task.depths())

    def push(self, depth_mm: float) -> None:
        """Relax, or go on to the next depth."""
        if self.task.scene == "cantilever":
            self.solution = relax(self.wire, None, depth_mm=depth_mm, load_N=self.load_N[-1])
            self.note = f"newton, {self.solution.iterations} iterations"
        else:
            self.solution = next(self.solutions)
        self.status = self.solution.status.identifier

    def points(self) -> Array:
        """Joints."""
        return self.solution.joints_mm


RIVALS = (Wire,)
