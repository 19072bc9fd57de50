"""Do shorter steps lead elsewhere? Random insertions in the default's steps, compared with steps of 0.05 mm."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from pipeline.benchmark.claims import Claim
from pipeline.benchmark.insert import timed
from pipeline.benchmark.stress.axes import moderate
from pipeline.benchmark.stress.plan import ScenePlan, entry
from pipeline.benchmark.stress.scene_run import build
from solver import GuideWire, Insertion, Solution, VesselWall

SHORT_MM, EQUAL_MM = 0.05, 0.01
"""Step of the reference, mm, and how far, mm, a joint may lie from its place there."""
SCENES, QUICK_SCENES = 200, 40
ROUNDS = 3
Scene = tuple[ScenePlan, GuideWire, VesselWall | None]


def study_of_steps(seed: int, *, quick: bool = False) -> Callable[[], Iterator[Claim]]:
    """The whole study, to be called later."""
    return partial(against_short_steps, seed, QUICK_SCENES if quick else SCENES)


def against_short_steps(seed: int, count: int, first: int = 0) -> Iterator[Claim]:
    """``count`` scenes of the stress study before anything in them is made extreme, every millimetre of depth."""
    apart, flagged, plain_apart, seconds = [], [], [], []
    for index in range(first, first + count):
        plan = moderate(np.random.default_rng([seed, index]), seed, index)
        scene = (plan, *build(plan))
        short = _pushed(scene, step_mm=SHORT_MM)
        default, plain = _pushed(scene), _pushed(scene, finest_mm=np.inf)
        for mine, before, true in zip(default, plain, short, strict=True):
            if mine.converged and true.converged:
                apart.append(apart_mm(mine, true))
                flagged.append(mine.uncertain)
                plain_apart.append(apart_mm(before, true))
        ways = (partial(_pushed, scene), partial(_pushed, scene, finest_mm=np.inf))
        seconds.append(np.min([[timed(way, 1)[0] for way in ways] for _ in range(ROUNDS)], axis=0))
    yield from _claims(np.array(apart), np.array(flagged), np.array(plain_apart), np.array(seconds))


def _claims(apart: np.ndarray, flagged: np.ndarray, before: np.ndarray, seconds: np.ndarray) -> Iterator[Claim]:
    """seconds : (scenes, 2), with rough steps repeated in shorter ones, and without."""
    name = f"{len(seconds)} random scenes, {len(apart)} depths: "
    silent, share = float(np.sum((apart > EQUAL_MM) & ~flagged)), float(np.mean(flagged))
    yield Claim(name + f"{EQUAL_MM:g} mm from steps of {SHORT_MM:g} mm, and not flagged", silent, "1", "0", silent == 0)
    # a scene whose wire is uncertain has all of its depths flagged: the share among 40 scenes says little
    judged = share <= 0.05 if len(seconds) >= SCENES else None
    yield Claim(name + "flagged as uncertain", share, "1", f"at most 0.05 of {SCENES} scenes", judged)
    yield Claim(name + "off with rough steps taken again", float(np.sum(apart > EQUAL_MM)), "1")
    yield Claim(name + "off without", float(np.sum(before > EQUAL_MM)), "1")
    each, total = float(np.mean(seconds[:, 0] / seconds[:, 1])), float(np.divide(*seconds.sum(axis=0)))
    yield Claim(name + "time over that without, mean over scenes", each, "1", "at most 1.3", each <= 1.3, timed=True)
    yield Claim(name + "time of all over that without", total, "1")


def _pushed(scene: Scene, step_mm: float = 1.0, finest_mm: float = SHORT_MM) -> list[Solution]:
    """The wire at every millimetre."""
    plan, wire, wall = scene
    at, direction, axis = entry(plan)
    insertion = Insertion(
        wire, wall, at, direction, initial=plan.initial, material_axis=axis, step_mm=step_mm, finest_mm=finest_mm,
        quadrature=plan.quadrature,
    )  # fmt: skip
    return list(insertion.to_depths(np.arange(1.0, int(plan.length_mm) + 1), roll_deg=plan.rolls[0]))


def apart_mm(one: Solution, other: Solution) -> float:
    """Largest distance of a joint, mm; inf at another depth."""
    if one.joints_mm.shape != other.joints_mm.shape:
        return np.inf
    return float(np.linalg.norm(one.joints_mm - other.joints_mm, axis=1).max())
