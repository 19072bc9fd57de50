"""The promises of the solver, measured: each a number, its aim, and whether it is met."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from pipeline.benchmark import scenes
from pipeline.benchmark.claim import Claim
from pipeline.benchmark.clock import timed
from pipeline.benchmark.insert import Run, Setting, insert
from pipeline.benchmark.orders import SOFT, errors_of, orders, voxel_order
from pipeline.benchmark.reference import reference
from pipeline.benchmark.scenes import BenchScene
from pipeline.benchmark.skips import skips
from solver import Insertion

PEERS_RMS_MM = 0.026
"""Shape error in scene B at 60 joints that every published solver shares: the tip's contact, joint by joint."""
SUB_STEPS = (1, 2, 3, 4, 8)


def claims(
    studies: Sequence[Callable[[], Iterator[Claim]]] | None = None,
    tick: Callable[[Claim], None] = lambda _: None,
) -> list[Claim]:
    """Measure everything, or the studies given."""
    found = []
    for measure in studies or STUDIES:
        for claim in measure():
            found.append(claim)
            tick(claim)
    return found


def step_time() -> Iterator[Claim]:
    """A 1 mm step at 200 joints in the bend, and what four times the joints cost."""
    scene, seconds = scenes.bend(100.0, SOFT), {}
    wall = scene.wall()
    for joints in (200, 400, 800):
        seconds[joints] = min(_last_steps(scene, wall, 100.0 / joints) for _ in range(3))
    yield Claim(
        "a 1 mm step at 200 joints, bend, voxel wall",
        1e3 * seconds[200],
        "ms",
        "0.25 ms",
        seconds[200] <= 2.5e-4,
    )
    ratio = seconds[800] / seconds[400]
    yield Claim("time(800 joints) / time(400 joints)", ratio, "1", "at most 2.3", ratio <= 2.3)


def _last_steps(scene: BenchScene, wall: Any, segment_mm: float, steps: int = 20) -> float:
    """Median seconds of one of the last steps into the scene."""
    insertion = Insertion(scene.wire(segment_mm), wall, scene.entry_mm, scene.direction)
    depths = np.linspace(scene.depth_mm - steps, scene.depth_mm, steps + 1)
    list(insertion.to_depths([*range(5, int(depths[0]), 5), float(depths[0])]))
    each = [timed(lambda d=d: list(insertion.to_depths([float(d)])), 1)[0] for d in depths[1:]]  # type: ignore[misc]
    return float(np.median(each))


def against_closed_form() -> Iterator[Claim]:
    """The seed's method against Newton's, both to the same energy."""
    scene = scenes.bend(60.0, SOFT)
    wall = scene.wall()
    common = {"segment_mm": 1.0, "quadrature": "joints"}
    fast, newton = timed(lambda: insert(scene, Setting(**common), wall))  # type: ignore[arg-type]
    seed = Setting(**common, method="closed_form", tolerance=1e-9, max_iterations=20_000)  # type: ignore[arg-type]
    slow, closed = timed(lambda: insert(scene, seed, wall), 1)
    apart = abs(closed.energy_N_mm / newton.energy_N_mm - 1.0)
    reached = closed.reached and newton.reached
    yield Claim("closed form and newton, energy apart", apart, "1", "at most 1e-6", reached and apart <= 1e-6)
    yield Claim("newton faster than closed form, times", slow / fast, "1", "at least 25", slow / fast >= 25)


def sub_steps() -> Iterator[Claim]:
    """Scene B at 60 joints with other numbers of steps per mm: the same minimum, or a status."""
    energies: dict[int, Run] = {}
    for count in SUB_STEPS:
        scene = scenes.bend(60.0).with_(step_mm=1.0 / count)
        energies[count] = insert(scene, Setting(1.0))
    one = energies[1].energy_N_mm
    for count, run in energies.items():
        apart = abs(run.energy_N_mm / one - 1.0)
        name = f"{count} steps per mm ({run.status.identifier}): energy {1e3 * run.energy_N_mm:.6f} µJ, apart"
        yield Claim(name, apart, "1", "at most 1e-6", run.reached and apart <= 1e-6)


def scene_b() -> Iterator[Claim]:
    """Shape error at 60 joints on a soft and on a hard wall."""
    for stiffness in (1.0, 100.0):
        scene = scenes.bend(60.0, stiffness)
        rms, tip, _ = errors_of(scene, 1.0, reference(scene))
        name = f"scene B, 60 joints, wall {stiffness:g} N/mm²: RMS shape error"
        yield Claim(name, rms, "mm", f"at most {PEERS_RMS_MM / 3:.4f}", rms <= PEERS_RMS_MM / 3)
        yield Claim(f"scene B, 60 joints, wall {stiffness:g} N/mm²: tip error", tip, "mm")


def in_a_sheath() -> Iterator[Claim]:
    """Scene B behind 400 mm of sheath, in which the pushed wire buckles: every depth at rest, and the time."""
    for bore, stiffness in SHEATHS:
        scene = scenes.sheath(bore, stiffness)
        wall = scene.wall()
        seconds, run = timed(lambda s=scene, w=wall: insert(s, Setting(1.0), w), 1)  # type: ignore[misc]
        name = f"sheath of {bore:g} mm, wall {stiffness:g} N/mm², 460 joints: "
        yield Claim(name + "all depths at rest", float(run.reached), "1", "1", run.reached)
        yield Claim(name + "a 1 mm step, mean of all", 1e3 * seconds / run.steps, "ms")


SHEATHS = ((0.25, 1.0), (0.3, 1.0), (0.5, 1.0), (0.3, 100.0), (0.5, 100.0))
"""Bore radius, mm, and wall stiffness, N/mm². The wire's own radius is 0.18 mm."""

COLD = """
from time import perf_counter, process_time
from solver import warm_up
wall, cpu = perf_counter(), process_time()
warm_up(beside=True)
print(perf_counter() - wall, process_time() - cpu)
"""


def compilation() -> Iterator[Claim]:
    """Compile everything of the solver in a fresh process that finds nothing compiled."""
    with tempfile.TemporaryDirectory() as folder:
        found = subprocess.run(
            [sys.executable, "-c", COLD],
            env={**os.environ, "NUMBA_CACHE_DIR": folder},
            capture_output=True,
            text=True,
            check=True,
        )
    wall, cpu = (float(word) for word in found.stdout.split())
    yield Claim("cold compilation of the solver", wall, "s", "at most 30 s", wall <= 30.0)
    yield Claim("cold compilation of the solver, processor time", cpu, "s")


STUDIES: tuple[Callable[[], Iterator[Claim]], ...] = (
    step_time,
    against_closed_form,
    sub_steps,
    scene_b,
    orders,
    voxel_order,
    in_a_sheath,
    skips,
    compilation,
)
