"""The promises of the solver, one function each: measured numbers, their targets, and whether they are met."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache, partial
from itertools import chain
from pathlib import Path

import numpy as np
import pandas as pd

from pipeline.benchmark import many, scenes
from pipeline.benchmark.insert import SolverSetting, insert, timed
from pipeline.benchmark.reference import reference, shape_error
from pipeline.benchmark.scenes import BenchScene
from reports.schema import CLAIMS, ORDERS
from solver import Insertion, VesselWall
from solver.skips import Skips, off

CLAIMS_CSV, ORDERS_CSV = "claims.csv", "orders.csv"
PEERS_RMS_MM = 0.026
"""Shape error in scene B at 60 joints that every published solver shares: the tip's contact, joint by joint."""
SUB_STEPS = (1, 2, 3, 4, 8)
SOFT = 0.1
"""Stiffness of the soft bend's wall, N/mm²."""
SHEATHS = ((0.25, 1.0), (0.3, 1.0), (0.5, 1.0), (0.3, 100.0), (0.5, 100.0))
"""Bore radius, mm, and wall stiffness, N/mm². The wire's own radius is 0.18 mm."""
SHAPE, TIP, ENERGY = range(3)
VOXELS_MM = (0.8, 0.4, 0.2, 0.1)
"""Sizes of the wall's voxels; the finest one is the limit."""
OFF_LATTICE = 0.37
"""Shift of the grid in voxels: nodes exactly on the axis of the tube would be luck."""
MANY_LOOK_UPS = "samples:16"
"""The hull with which skips of look-ups are measured; with one look-up a joint there is little to save."""
PAIRS = 9
MANY_SEED, SAME_MM = 100, 1e-9
COLD = """
from os import times
from time import perf_counter
from solver import warm_up
wall, before = perf_counter(), sum(times()[:4])
warm_up(beside=True)
print(perf_counter() - wall, sum(times()[:4]) - before)
"""
"""Of the processes that it starts, too: the first four of ``times``."""


@dataclass(frozen=True)
class Claim:
    """One measured promise. aim : in words; met : None where no aim is set; timed : of run time, never a failure.

    An order of convergence keeps what it was fitted to. against : what was made smaller, with its unit.
    sizes, errors : its values, and the errors found there in ``error_unit``.
    """

    claim: str
    value: float
    unit: str
    aim: str = ""
    met: bool | None = None
    against: str = ""
    sizes: tuple[float, ...] = ()
    errors: tuple[float, ...] = ()
    error_unit: str = ""
    timed: bool = False


def step_time() -> Iterator[Claim]:
    """A 1 mm step at 200 joints in the bend, and what four times the joints cost."""
    scene, seconds = scenes.bend(100.0, SOFT), {}
    wall = scene.wall()
    for joints in (200, 400, 800):
        seconds[joints] = min(_last_steps(scene, wall, 100.0 / joints) for _ in range(3))
    name = "a 1 mm step at 200 joints, bend, voxel wall"
    yield Claim(name, 1e3 * seconds[200], "ms", "0.25 ms", seconds[200] <= 2.5e-4, timed=True)
    ratio = seconds[800] / seconds[400]
    yield Claim("time(800 joints) / time(400 joints)", ratio, "1", "at most 2.3", ratio <= 2.3, timed=True)


def _last_steps(scene: BenchScene, wall: VesselWall | None, segment_mm: float) -> float:
    """Median seconds of one of the last 20 steps of 1 mm into the scene."""
    insertion = Insertion(scene.wire(segment_mm), wall, scene.entry_mm, scene.direction)
    depths = np.linspace(scene.depth_mm - 20.0, scene.depth_mm, 21)
    list(insertion.to_depths([*range(5, int(depths[0]), 5), float(depths[0])]))
    pushes = insertion.to_depths(depths[1:])
    return float(np.median([timed(partial(next, pushes), 1)[0] for _ in depths[1:]]))


def against_closed_form() -> Iterator[Claim]:
    """The seed's method against Newton's, both to the same energy."""
    scene = scenes.bend(60.0, SOFT)
    wall, ours = scene.wall(), SolverSetting(1.0, quadrature="joints")
    seed = replace(ours, method="closed_form", max_iterations=20_000)
    fast, newton = timed(partial(insert, scene, ours, wall))
    slow, closed = timed(partial(insert, scene, seed, wall), 1)
    apart = abs(closed.last.energy_N_mm / newton.last.energy_N_mm - 1.0)
    reached = closed.reached and newton.reached
    yield Claim("closed form and newton, energy apart", apart, "1", "at most 1e-6", reached and apart <= 1e-6)
    yield Claim("newton faster than closed form, times", slow / fast, "1", "at least 25", slow / fast >= 25, timed=True)


def sub_steps() -> Iterator[Claim]:
    """Scene B at 60 joints with other numbers of steps per mm: the same minimum, or a status."""
    runs = {n: insert(replace(scenes.bend(), step_mm=1.0 / n), SolverSetting(1.0)) for n in SUB_STEPS}
    for count, run in runs.items():
        energy, status = run.last.energy_N_mm, run.last.status.identifier
        apart = abs(energy / runs[1].last.energy_N_mm - 1.0)
        name = f"{count} steps per mm ({status}): energy {1e3 * energy:.6f} µJ, apart"
        yield Claim(name, apart, "1", "at most 1e-6", run.reached and apart <= 1e-6)


@cache
def errors_at(scene: BenchScene, segment_mm: float) -> tuple[float, float, float]:
    """RMS and tip error, mm, and the size of the relative energy error; NaN where the depth is not reached."""
    shape, tip, energy = reference(scene).errors_of(insert(scene, SolverSetting(segment_mm)))
    return shape, tip, abs(energy)


def scene_b() -> Iterator[Claim]:
    """Shape error at 60 joints on a soft and on a hard wall."""
    for stiffness in (1.0, 100.0):
        rms, tip, _ = errors_at(scenes.bend(60.0, stiffness), 1.0)
        name, limit = f"scene B, 60 joints, wall {stiffness:g} N/mm²: ", PEERS_RMS_MM / 3
        yield Claim(name + "RMS shape error", rms, "mm", f"at most {limit:.4f}", rms <= limit)
        yield Claim(name + "tip error", tip, "mm")


def orders() -> Iterator[Claim]:
    """Errors against segment length: free, in the soft bend, and with the tip in contact."""
    free, soft, hard = scenes.cantilever(), scenes.bend(100.0, SOFT), scenes.bend()
    yield _order("free cantilever, tip", free, (10.0, 5.0, 2.5), TIP, "2.00 ± 0.05", (1.95, 2.05))
    yield _order("soft bend, energy", soft, (5.0, 2.5, 1.25), ENERGY, "at least 1.9", (1.9, np.inf))
    tip = errors_at(soft, 2.5)[TIP]
    yield Claim("soft bend, tip error at 2.5 mm segments", tip, "mm", "at most 0.01", tip <= 0.01)
    for name, which in (("shape", SHAPE), ("energy", ENERGY)):
        yield _order(f"scene B, {name}", hard, (2.0, 1.0, 0.5), which, "at least 1.8", (1.8, np.inf))


def _order(
    name: str, scene: BenchScene, segments: tuple[float, ...], which: int, aim: str, span: tuple[float, float]
) -> Claim:
    """The order of one of a scene's errors in the segment length; met where it lies in ``span``."""
    found = tuple(errors_at(scene, segment)[which] for segment in segments)
    order, unit = fitted(segments, found), ("mm", "mm", "1")[which]
    claim, against = f"order of the {name} over {segments} mm", f"{name}: segment length, mm"
    met = span[0] <= order <= span[1]
    return Claim(claim, order, "1", aim, met, against, segments, found, unit)


def fitted(sizes: Sequence[float], errors: Sequence[float]) -> float:
    """Slope of a straight line through the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(np.maximum(errors, 1e-300)), 1)[0])


def voxel_order() -> Iterator[Claim]:
    """Errors against the voxel size of scene B's wall, on grids off its lattice.

    The lumen's curvature jumps where the bend begins and ends, so the fourth order of cubic splines is not reached.
    """
    scene, shapes = scenes.bend(), []
    assert scene.box is not None
    (x, y, z), high = scene.box
    for voxel in VOXELS_MM:
        shift = OFF_LATTICE * voxel
        wall = replace(scene, box=((x - shift, y - shift, z - shift), high)).wall(voxel_mm=voxel)
        shapes.append(insert(scene, SolverSetting(0.5, tolerance=1e-13), wall).last.joints_mm)
    sizes = VOXELS_MM[:-1]
    found = tuple(shape_error(points, shapes[-1])[0] for points in shapes[:-1])
    name = "scene B, shape"
    claim, against = f"order of the {name} over voxels of {sizes} mm", f"{name}: voxel of the wall, mm"
    yield Claim(claim, fitted(sizes, found), "1", "none, reported", None, against, sizes, found, "mm")


def in_a_sheath() -> Iterator[Claim]:
    """Scene B behind 400 mm of sheath, in which the pushed wire buckles: every depth at rest, and the time."""
    for bore, stiffness in SHEATHS:
        scene = scenes.sheath(bore, stiffness)
        seconds, run = timed(partial(insert, scene, SolverSetting(1.0), scene.wall()), 1)
        name = f"sheath of {bore:g} mm, wall {stiffness:g} N/mm², 460 joints: "
        yield Claim(name + "all depths at rest", float(run.reached), "1", "1", run.reached)
        yield Claim(name + "a 1 mm step, mean of all", 1e3 * seconds / run.steps, "ms")


def skips() -> Iterator[Claim]:
    """Every skip off in turn: the same wire, and what the skip saves."""
    for name in Skips._fields:
        hull = MANY_LOOK_UPS if name in ("clearance", "cheap") else "offset"
        # only in a long sheath is the base not affected by what the tip meets
        scene, segment = (scenes.sheath(), 1.0) if name == "window" else (scenes.bend(), 0.5)
        wall = scene.wall(hull)
        # wires are compared at a tolerance so tight that where an iteration stops does not show
        tight = SolverSetting(segment, hull=hull, tolerance=1e-13)
        # with all skips, and with all but this one
        runs = [off(*names)(insert) for names in ((), (name,))]
        with_skip, without = (run(scene, tight, wall).last.joints_mm for run in runs)
        apart = float(np.abs(with_skip - without).max())
        aim = "at most 1e-6 (algebraic skips 1e-12)"
        where = f"skip {name} off ({scene.name}, hull {hull})"
        yield Claim(f"{where}: wire apart", apart, "mm", aim, apart <= 1e-6)
        asked = SolverSetting(segment, hull=hull)
        seconds = [[timed(partial(run, scene, asked, wall), 1)[0] for run in runs] for _ in range(PAIRS)]
        quick, slow = np.median(seconds, axis=0)
        yield Claim(f"{where}: time, times", float(slow / quick), "1")


def many_at_once() -> Iterator[Claim]:
    """256 variations of the circle of Willis, thirty depths each, in lock-step against one after the other."""
    found = many.compared(scenes.willis(MANY_SEED), MANY_SEED)
    name = "256 varied insertions at once, circle of Willis: "
    yield Claim(name + "as many a second, one core", found.one_core, "1", "3 aimed at, reported")
    yield Claim(name + "as many a second, two cores", found.two_cores, "1", "6 aimed at, reported")
    share = float(np.mean(found.apart > SAME_MM))
    yield Claim(name + "depths apart by more than 1e-9 mm", share, "1", "at most 0.01 (snaps)", share <= 0.01)


def compilation() -> Iterator[Claim]:
    """Compile everything of the solver in a fresh process that finds nothing compiled."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": folder}
        command = [sys.executable, "-c", COLD]
        found = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    wall, cpu = (float(word) for word in found.stdout.split())
    yield Claim("cold compilation of the solver", wall, "s", "at most 30 s", wall <= 30.0, timed=True)
    yield Claim("cold compilation of the solver, processor time", cpu, "s")


STUDIES: tuple[Callable[[], Iterator[Claim]], ...] = (
    step_time, against_closed_form, sub_steps, scene_b, orders, voxel_order, in_a_sheath, skips, many_at_once,
    compilation
)  # fmt: skip
"""Everything that the solver promises. A new promise is a function here."""


def measure_claims(
    out: Path, say: Callable[[str], None], studies: Sequence[Callable[[], Iterator[Claim]]] = STUDIES
) -> bool:
    """Say each claim as it is measured; False where a promise is broken, except of time: the machine may be busy.

    Leaves claims.csv, a row a claim, and orders.csv, a row for each point that an order was fitted to.
    """
    found = []
    say("promises of the solver, a line each: what is measured, beside its aim where one is set")
    for claim in chain.from_iterable(study() for study in studies):
        found.append(claim)
        verdict = {None: "", True: ": met", False: ": NOT MET"}[claim.met]
        unit = f" {claim.unit}" * (claim.unit != "1")
        say(f"{claim.claim}: {claim.value:.4g}{unit}" + f"; aim {claim.aim}{verdict}" * bool(claim.aim))
    table = pd.DataFrame([asdict(claim) for claim in found])
    table[list(CLAIMS.names)].to_csv(out / CLAIMS_CSV, index=False)
    points = table[table["sizes"].str.len() > 0].explode(["sizes", "errors"]).drop(columns="unit")
    names = {"sizes": "size", "errors": "error", "error_unit": "unit", "value": "order"}
    points = points.rename(columns=names)[list(ORDERS.names)]
    points.to_csv(out / ORDERS_CSV, index=False)
    return all(claim.met is not False or claim.timed for claim in found)
