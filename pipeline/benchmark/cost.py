"""Run time against error: scenes x settings, one row each."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import pandas as pd

from pipeline.benchmark.insert import Run, SolverSetting, insert, timed
from pipeline.benchmark.reference import FINE_MM, Reference, reference
from pipeline.benchmark.scenes import BenchScene
from reports.bench import TARGETS_MM, recommended

SOLVER_CSV = "solver.csv"
SEGMENTS_MM = (5.0, 2.5, 2.0, 1.0, 0.5, 0.25, 0.1)
QUICK_SEGMENTS_MM = (5.0, 2.0, 1.0, 0.5)
VARIANTS = (
    SolverSetting(1.0),
    SolverSetting(1.0, tolerance=1e-4),
    SolverSetting(1.0, tolerance=1e-6),
    SolverSetting(1.0, quadrature="joints"),
    SolverSetting(1.0, quadrature="segments"),
    SolverSetting(1.0, hull="samples:4"),
    SolverSetting(1.0, hull="samples:16"),
)
"""Each is tried with every segment length; the default comes first."""
CLOSED_FORM = SolverSetting(1.0, "closed_form", quadrature="joints", tolerance=1e-6, max_iterations=20_000)
ASKED = ("method", "segment_mm", "hull", "quadrature", "tolerance")
"""The columns in which a row tells its setting."""
SHOWN = (
    ("scene", "scene", "<18", ""), ("method", "method", "<12", ""), ("segment, mm", "segment_mm", ">11", "g"),
    ("hull", "hull", "<11", ""), ("quadrature", "quadrature", "<10", ""), ("tolerance", "tolerance", ">9", "g"),
    ("ms per mm", "ms_per_mm", ">9", ".4f"), ("shape off, mm", "shape_error_mm", ">13", ".5f"),
    ("tip off, mm", "tip_error_mm", ">11", ".5f"), ("iterations per mm", "iterations", ">17", ".2f"),
    ("outcome", "status", "<1", ""),
)  # fmt: skip
"""What the terminal shows of a row: heading, column, width and form."""
CLOSED_FORM_SHORTEST_MM = 1.0
"""Sweeps grow with the square of the number of joints: below 1 mm one insertion takes minutes."""


def settings(*, quick: bool = False) -> list[SolverSetting]:
    """All settings of the study; ``quick`` leaves the default and the paper's method, at fewer segment lengths."""
    segments = QUICK_SEGMENTS_MM if quick else SEGMENTS_MM
    variants = VARIANTS[:1] if quick else VARIANTS
    shortest = CLOSED_FORM_SHORTEST_MM * (2 if quick else 1)
    asked = [replace(variant, segment_mm=s) for variant in variants for s in segments]
    return asked + [replace(CLOSED_FORM, segment_mm=s) for s in segments if s >= shortest]


def costs(
    scenes: Iterable[BenchScene], chosen: Sequence[SolverSetting], repeats: int = 3, fine_mm: float = FINE_MM
) -> Iterator[dict[str, Any]]:
    """One row per scene and setting whose segments can follow the wire; see ``_row``.

    The walls of a scene are made once. Every kernel is compiled before it is timed: the reference runs them all.
    """
    for scene in scenes:
        limit = reference(scene, fine_mm)
        walls = {hull: scene.wall(hull) for hull in dict.fromkeys(s.hull for s in chosen)}
        for setting in (one for one in chosen if scene.follows(one.segment_mm)):
            seconds, run = timed(partial(insert, scene, setting, walls[setting.hull]), repeats)
            yield _row(scene, setting, run, seconds, limit)


def _row(scene: BenchScene, setting: SolverSetting, run: Run, seconds: float, limit: Reference) -> dict[str, Any]:
    """Cost and error of one run; the errors of a run that did not reach the depth are NaN."""
    shape, tip, energy = limit.errors_of(run)
    looked = run.work.get("wall_look_ups", 0.0)
    spared = run.work.get("wall_look_ups_proven_unnecessary", 0.0) + run.work.get("wall_look_ups_cheap", 0.0)
    return {
        "scene": scene.name,
        **{name: getattr(setting, name) for name in ASKED},
        "ms_per_mm": 1e3 * seconds / scene.depth_mm,
        "tip_error_mm": tip,
        "shape_error_mm": shape,
        "iterations": run.iterations / scene.depth_mm,
        "energy_error": energy,
        "joints": len(run.last.joints_mm) - 1,
        "depth_mm": run.last.depth_mm,
        "status": run.last.status.identifier,
        "look_ups_per_mm": looked / scene.depth_mm,
        "look_ups_skipped": spared / (looked + spared) if looked + spared else float("nan"),
        "sweeps_per_mm": run.work.get("sweeps", 0.0) / scene.depth_mm,
        "reference_uncertainty_mm": limit.uncertainty_mm,
    }


def measure_cost(scenes: Sequence[BenchScene], out: Path, say: Callable[[str], None], *, quick: bool) -> None:
    """Run time against error: a line and a row for each scene and setting, then the settings to use."""
    rows, chosen = [], settings(quick=quick)
    say("run time of a mm of insertion, and what the wire is off in the end, a line for each scene and setting:")
    for scene in scenes:
        long = [s for s in dict.fromkeys(setting.segment_mm for setting in chosen) if not scene.follows(s)]
        if long:
            lengths = ", ".join(f"{s:g}" for s in long)
            say(f"{scene.name}: left out: segments of {lengths} mm cannot follow the wire's rest curvature")
    say("  ".join(f"{heading:{width}}" for heading, _, width, _ in SHOWN))
    for row in costs(scenes, chosen, 1 if quick else 3):
        rows.append(row)
        say("  ".join(f"{row[column]:{width}{form}}" for _, column, width, form in SHOWN))
    table = pd.DataFrame(rows)
    table.to_csv(out / SOLVER_CSV, index=False)
    for line in advice(table):
        say(line)


def advice(rows: pd.DataFrame) -> Iterator[str]:
    """The fastest setting of each scene within each target error, a line each."""
    best = {(row["scene"], row["target_mm"]): row for row in recommended(rows).to_dict("records")}
    for target, scene in product(TARGETS_MM, dict.fromkeys(rows["scene"])):
        if (scene, target) not in best:
            yield f"{scene}: no setting reaches {target:g} mm"
            continue
        row = best[scene, target]
        yield (
            f"{scene}: for {target:g} mm use {row['method']}, segment {row['segment_mm']:g} mm, "
            f"hull {row['hull']}, quadrature {row['quadrature']}, tolerance {row['tolerance']:g}: "
            f"{row['ms_per_mm']:.3g} ms per mm, {row['shape_error_mm']:.2g} mm"
        )
