"""The promises of friction: the same push and loss at any step, work that is accounted for, capstan and torque."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from pipeline.benchmark import scenes
from pipeline.benchmark.claims import Claim
from pipeline.benchmark.scenes import RADIUS_MM, BenchScene
from pipeline.benchmark.vessels import BEND_LUMEN_MM, BEND_TURN_MM, lumen_distance
from pipeline.benchmark.whip import whip
from pipeline.model import Array
from solver import GuideWire, Insertion, Solution

COEFFICIENT = 0.2
STEPS_MM = (0.1, 0.05, 0.02, 0.01)
"""The longest is that of the solver with friction, whatever is asked for."""
QUARTER_MM = 0.25
PULL_N = 0.05


def friction() -> Iterator[Claim]:
    """Everything that friction promises."""
    yield from any_step()
    yield from work_and_loss()
    yield capstan()
    yield torque()
    yield whip()


def _inserted(scene: BenchScene, depths: Array, step_mm: float = 1.0, **more: object) -> list[Solution]:
    """The wire of a scene at these depths, pushed by steps of at most ``step_mm``."""
    wire, wall = scene.wire(1.0), scene.wall()
    insertion = Insertion(wire, wall, scene.entry_mm, scene.direction, step_mm=step_mm, **more)  # type: ignore[arg-type]
    return list(insertion.to_depths(depths))


def any_step() -> Iterator[Claim]:
    """Push and loss over 75 mm of the bend, in steps of 0.1 to 0.01 mm."""
    scene = replace(scenes.bend(75.0), friction=COEFFICIENT)
    runs = [_inserted(scene, np.arange(1.0, 76.0), step) for step in STEPS_MM]
    push = np.array([run[-1].push_force_N for run in runs])
    lost = np.array([sum(s.friction_energy_N_mm for s in run) for run in runs])
    for name, found in (("push", push), ("loss", lost)):
        apart = float(np.ptp(found) / found[-1])
        name = f"friction {COEFFICIENT:g}, bend, steps of 0.1 to 0.01 mm: {name} apart"
        yield Claim(name, apart, "1", "at most 0.02", apart <= 0.02)


def work_and_loss() -> Iterator[Claim]:
    """75 mm in and 30 mm out in steps of 0.25 mm; of 0.05 mm in the millimetre in which the push turns into a pull."""
    there = QUARTER_MM * np.arange(1, 301)
    back = there[-1] - np.concatenate([0.05 * np.arange(1, 20), QUARTER_MM * np.arange(4, 121)])
    run = _inserted(replace(scenes.bend(75.0), friction=COEFFICIENT), np.concatenate([there, back]))
    push, energy = (np.array([0.0, *(getattr(s, n) for s in run)]) for n in ("push_force_N", "energy_N_mm"))
    work = 0.5 * (push[1:] + push[:-1]) * np.diff(np.concatenate([[0.0], there, back]))
    gap = work - np.diff(energy) - [s.friction_energy_N_mm for s in run]
    for name, part in (("in", slice(0, 300)), ("out", slice(300, None))):
        share = float(abs(gap[part].sum()) / abs(work[part]).sum())
        name = f"friction {COEFFICIENT:g}, bend, {name}: work less change of energy and loss, over work"
        yield Claim(name, share, "1", "at most 0.005", share <= 0.005)


def capstan() -> Claim:
    """A limp wire pulled back through the bend: ln of the tensions' ratio over μ and the angle between them."""
    scene = replace(scenes.bend(95.0, 5.0), friction=COEFFICIENT, guide_wire=GuideWire(1.0, RADIUS_MM, 0.5))
    depths = np.concatenate([np.arange(1.0, 96.0), [94.0, 93.0, 92.0, 91.0]])
    *_, wire = _inserted(scene, depths, tip_load_N=(PULL_N, 0.0, 0.0), max_iterations=500)
    along = np.diff(wire.joints_mm, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    forces = wire.contact_force_N.copy()
    forces[-1, 0] += PULL_N
    ahead = np.cumsum(forces[::-1], axis=0)[::-1][1:]
    low, high = 40, 62
    tension = np.einsum("na,na->n", ahead, along)
    found = math.log(tension[low] / tension[high]) / math.acos(float(along[low] @ along[high])) / COEFFICIENT
    name = f"capstan: exponent over friction {COEFFICIENT:g} times the angle (on the inside of the bend, 0.994)"
    return Claim(name, found, "1", "1.00 ± 0.01", abs(found - 1.0) <= 0.01)


def torque() -> Claim:
    """A straight wire pressed on the wall of a straight tube, rolled by a whole turn."""
    tube = partial(lumen_distance, "tube", radius=BEND_LUMEN_MM)
    box = ((-4.0, -4.0, -4.0), (4.0, 4.0, BEND_TURN_MM + 20.0))
    scene = BenchScene("tube", 40.0, wall_stiffness=20.0, friction=COEFFICIENT, distance=tube, box=box)
    wire = replace(scene.wire(1.0), torsional_stiffness_N_mm2=5.0)
    entry = (0.0, BEND_LUMEN_MM - RADIUS_MM, 0.0)
    insertion = Insertion(wire, scene.wall(), entry, scene.direction, tip_load_N=(0.0, PULL_N, 0.0))
    depths, rolls = [*range(1, 41), *[40] * 24], [*[0.0] * 40, *(15.0 * (i + 1) for i in range(24))]
    *_, rolled = insertion.to_depths(depths, rolls)
    pressed = float(np.linalg.norm(rolled.contact_force_N, axis=1).sum()) / math.hypot(1.0, COEFFICIENT)
    found = rolled.reaction_torque_N_mm / (COEFFICIENT * pressed * RADIUS_MM)
    name = f"straight wire in a straight tube, friction {COEFFICIENT:g}: torque over μ N r"
    return Claim(name, found, "1", "1.00 ± 0.01", abs(found - 1.0) <= 0.01)
