"""Are the segments that a study chooses short enough, and does num_mm tell? Compared with much shorter ones."""

import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path
from time import process_time

import numpy as np

from data_synthetic import catalogue
from pipeline.benchmark.claims import Claim
from pipeline.benchmark.scenes import BenchScene, of_setup
from pipeline.benchmark.stress.axes import moderate
from pipeline.benchmark.stress.plan import entry, lumen_grid
from pipeline.model import Array
from pipeline.simulate.config import SolverConfig
from pipeline.simulate.resolution import AGREED_MM, FINEST_MM, lengths_mm, moved_mm, resolve
from solver import GuideWire, Insertion, Solution, warm_up

LARGEST_MM, COVERED = 0.03, 0.95
COST = 1.6
EVERY_MM = 2.0
FINEST_STEP_MM = SolverConfig().finest_mm
RANDOM, QUICK_SCENES = 100, 8
TREES = ("brava_swc/BG*.swc", "aorta_to_cranial/Centrelines_comb/*RCCA.mrk.json")
"""Real anatomies, where ``$WIREVAL_DATA`` is."""
NAMES = ("scenes of the catalogue", "real anatomies", "random vessels")


def study_of_resolution(seed: int, *, quick: bool = False) -> Callable[[], Iterator[Claim]]:
    """The whole study, to be called later: the catalogue, real anatomies, random vessels."""
    return partial(against_short_segments, seed, QUICK_SCENES if quick else None)


def against_short_segments(seed: int, count: int | None = None) -> Iterator[Claim]:
    """Claims about insertions with segments as a study chooses them. count : of each kind of scenes, None for all."""
    warm_up()
    for name, kind in zip(NAMES, (_catalogue(seed), _anatomies(), _random(seed)), strict=True):
        found = [_measured(scene) for scene in islice(kind, count)]
        if found:
            yield from _claims(f"{len(found)} {name}", found)


def _claims(name: str, found: list[tuple[Array, Array]]) -> Iterator[Claim]:
    """found : what ``_measured`` returns for each scene."""
    depths = np.concatenate([rows for rows, _ in found])
    known = depths[~np.isnan(depths[:, :2]).any(axis=1) & (depths[:, 2] == 0)]
    name = f"{name}, {len(known)} of {len(depths)} depths: "
    off, num, _, finest = known.T
    covered, long = float(np.mean(off <= num)), float(np.sum((off > LARGEST_MM) & (finest == 0)))
    yield Claim(name + f"over {LARGEST_MM:g} mm from segments of {FINEST_MM:g} mm", long, "1", "0", long == 0)
    yield Claim(name + f"largest distance from {FINEST_MM:g} mm, or from half of it", float(off.max()), "mm")
    yield Claim(name + "share that num_mm covers", covered, "1", f"at least {COVERED:g}", covered >= COVERED)
    last, pair, everything = np.array([seconds for _, seconds in found]).sum(axis=0)
    cheap = pair <= COST * last
    yield Claim(name + "time of two lengths over one", pair / last, "1", f"at most {COST:g}", cheap, timed=True)
    yield Claim(name + "time of all lengths tried over one", everything / last, "1")


def _measured(scene: BenchScene) -> tuple[Array, Array]:
    """What one scene shows: rows (depths, 4) and seconds (3,).

    Rows: distance from segments of FINEST_MM, mm; num_mm; 1 where uncertain; 1 where FINEST_MM itself was chosen (there
    the distance is from segments of half of that). Seconds: of the last length tried, of the last two, of all.
    """
    wall, seconds = scene.wall(), {}

    def insert(segment_mm: float, refined: bool = True) -> list[Solution]:
        clock, finest_mm = process_time(), FINEST_STEP_MM if refined else np.inf
        insertion = Insertion(
            scene.wire(segment_mm), wall, scene.entry_mm, scene.direction, material_axis=scene.material_axis,
            finest_mm=finest_mm,
        )  # fmt: skip
        found = list(insertion.to_depths(scene.depths(), roll_deg=scene.roll_deg))
        seconds[segment_mm] = process_time() - clock
        return found

    wire = scene.guide_wire.profile
    resolved = resolve(insert, lengths_mm("auto", np.stack([wire.rest_at, wire.rest], axis=1)))
    spent = list(seconds.values())
    limit = insert(min(FINEST_MM, 0.5 * resolved.segment_mm))
    both = list(zip(resolved.wires, limit, strict=True))
    off = [moved_mm(*pair) for pair in both]
    near = (resolved.num_mm > AGREED_MM) | [a.uncertain or b.uncertain for a, b in both]
    finest = np.full(len(both), resolved.segment_mm <= FINEST_MM)
    return np.transpose([off, resolved.num_mm, near, finest]), np.array([spent[-1], sum(spent[-2:]), sum(spent)])


def _catalogue(seed: int) -> Iterator[BenchScene]:
    for name in catalogue.names():
        yield _coarser(of_setup(name, catalogue.describe(name).setup(np.random.default_rng([seed, 1]), 6)))


def _anatomies() -> Iterator[BenchScene]:
    data = os.environ.get("WIREVAL_DATA", "")
    for path in sorted(path for tree in TREES for path in (Path(data).glob(tree) if data else ())):
        yield _coarser(of_setup(path.stem, catalogue.from_anatomy(path).plan(np.random.default_rng(0), 6)))


def _coarser(scene: BenchScene) -> BenchScene:
    """The scene with a depth every 2 mm."""
    return replace(scene, step_mm=EVERY_MM)


def _random(seed: int) -> Iterator[BenchScene]:
    """Scenes of the stress study before anything in them is made extreme."""
    for index in range(RANDOM):
        plan = moderate(np.random.default_rng([seed, index]), seed, index)
        (at, direction, axis), depth = entry(plan), max(EVERY_MM, plan.length_mm)
        wire = GuideWire(plan.segment_mm, plan.radius_mm, plan.stiffness, plan.rest, plan.torsion)
        yield BenchScene(
            str(index), depth, EVERY_MM, tuple(at), tuple(direction), tuple(axis), plan.rolls[0], wire,
            plan.wall_stiffness, ready=lumen_grid(plan),
        )  # fmt: skip
