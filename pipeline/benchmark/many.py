"""Many insertions at once against one after the other: 256 variations of a scene, as in an uncertainty study."""

from collections.abc import Sequence
from time import perf_counter, process_time
from typing import NamedTuple

import numpy as np

from pipeline.benchmark.scenes import BenchScene
from pipeline.model import Array
from solver import GuideWire, Insertion, Insertions, Solution, VesselWall

COUNT, DEPTHS, PART = 256, 30, 64
"""Insertions, depths of each, and insertions in a part: the three ways take turns, part by part."""


class Outcome(NamedTuple):
    """Speed-up over one after the other, on one core and on two.     apart : (COUNT, DEPTHS) largest difference, mm."""

    one_core: float
    two_cores: float
    apart: Array


def varied(scene: BenchScene, wall: VesselWall, seed: int) -> tuple[Insertion, float]:
    """The scene's insertion with another wire, wall, clamp and roll, each by about what calibration leaves open."""
    normal = np.random.default_rng(seed).standard_normal(9)
    given = scene.guide_wire
    stiffness = np.array(given.bending_stiffness_N_mm2) * [1.0, np.exp(0.1 * normal[0])]
    rest = np.array(given.rest_curvature_per_mm) * [1.0, 1.0 + 0.05 * normal[1]]
    wire = GuideWire(1.0, given.radius_mm, stiffness, rest)
    softer = wall.like(stiffness_N_mm2=wall.stiffness_N_mm2 * float(np.exp(0.2 * normal[2])))
    entry, direction = scene.entry_mm + 0.05 * normal[3:6], scene.direction + 0.01 * np.append(normal[6:8], 0.0)
    return Insertion(wire, softer, entry, direction, material_axis=scene.material_axis), scene.roll_deg + 3 * normal[8]


def compared(scene: BenchScene, seed: int) -> Outcome:
    """Simulate one after the other, at once on one core, and at once on two; medians over the parts."""
    wall = scene.wall()
    assert wall is not None
    depths = np.linspace(scene.depth_mm / DEPTHS, scene.depth_mm, DEPTHS).tolist()
    together(scene, wall, depths, range(seed, seed + 2), 1)
    ratios, apart = [], []
    for start in range(seed, seed + COUNT, PART):
        seeds, times = range(start, start + PART), []
        wall_clock, clock = perf_counter(), process_time()
        alone = [list(one.to_depths(depths, roll)) for one, roll in (varied(scene, wall, n) for n in seeds)]
        times.append((process_time() - clock, perf_counter() - wall_clock))
        for threads in (1, 2):
            wall_clock, clock = perf_counter(), process_time()
            found = together(scene, wall, depths, seeds, threads)
            times.append((process_time() - clock, perf_counter() - wall_clock))
        ratios.append((times[0][0] / times[1][0], times[0][1] / times[2][1]))
        apart += [[_apart(a, b) for a, b in zip(*pair, strict=True)] for pair in zip(alone, found, strict=True)]
    one_core, two_cores = np.median(ratios, axis=0)
    return Outcome(float(one_core), float(two_cores), np.array(apart))


def together(
    scene: BenchScene, wall: VesselWall, depths: Sequence[float], seeds: Sequence[int], threads: int
) -> list[list[Solution]]:
    """The wires of the variations with these seeds, simulated at once."""
    insertions, rolls = zip(*(varied(scene, wall, n) for n in seeds), strict=True)
    return Insertions(insertions, threads=threads).to_depths(depths, rolls)


def _apart(a: Solution, b: Solution) -> float:
    """Largest distance of a joint's coordinate, mm."""
    same = a.joints_mm.shape == b.joints_mm.shape
    return float(np.abs(a.joints_mm - b.joints_mm).max()) if same else np.inf
