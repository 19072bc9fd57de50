"""This project's own solver on the same work, measured in the same way; its wall is sampled at the same voxels."""

from __future__ import annotations

from time import process_time

import numpy as np

from pipeline.benchmark import scenes
from pipeline.benchmark.peers.common import DEPTH_B_MM, LENGTH_A_MM, LOAD_A_N, STEPS_B, Answer
from solver import Insertion, relax

NAME = "wireval newton"
PACKAGE = "wireval"
REPEATS = 9


def cantilever(n: int) -> Answer:
    """Scene A: one relaxation from the straight wire; median of a few, as each takes about a millisecond."""
    wire = scenes.cantilever().wire(LENGTH_A_MM / n)
    seconds = []
    for _ in range(REPEATS):
        start = process_time()
        solution = relax(wire, None, depth_mm=LENGTH_A_MM, load_N=[LOAD_A_N, 0.0, 0.0])
        seconds.append(process_time() - start)
    note = f"newton, {solution.iterations} iterations"
    status = solution.status.identifier
    return Answer(
        solution.joints_mm, np.array([np.median(seconds)]), note, energy=solution.energy_N_mm, status=status
    )


def bend(n: int, steps: int = STEPS_B, pushes: int | None = None) -> Answer:
    """Scene B: pushed in from the entry; the wire is n segments long at the end only."""
    scene = scenes.bend(DEPTH_B_MM)
    runs = []
    for _ in range(REPEATS):
        insertion = Insertion(scene.wire(DEPTH_B_MM / n), scene.wall(), scene.entry_mm, scene.direction)
        seconds, solutions = [], insertion.to_depths([DEPTH_B_MM * (i + 1) / steps for i in range(steps)])
        for _ in range(pushes or steps):
            start = process_time()
            solution = next(solutions)
            seconds.append(process_time() - start)
        runs.append(seconds)
    each = np.median(runs, axis=0)
    return Answer(
        solution.joints_mm,
        each,
        "newton, slide",
        energy=solution.energy_N_mm,
        status=solution.status.identifier,
    )
