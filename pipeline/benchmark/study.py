"""Run time against error: scenes x settings, one row each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import pandas as pd

from pipeline.benchmark.clock import timed
from pipeline.benchmark.errors import resampled, shape_error
from pipeline.benchmark.insert import Run, Setting, insert
from pipeline.benchmark.reference import FINE_MM, Reference, reference
from pipeline.benchmark.scenes import BenchScene

SEGMENTS_MM = (5.0, 2.5, 2.0, 1.0, 0.5, 0.25, 0.1)
VARIANTS: tuple[dict[str, Any], ...] = (
    {},
    {"tolerance": 1e-4},
    {"tolerance": 1e-6},
    {"quadrature": "joints"},
    {"quadrature": "segments"},
    {"hull": "samples:4"},
    {"hull": "samples:16"},
)
CLOSED_FORM: dict[str, Any] = {
    "method": "closed_form",
    "quadrature": "joints",
    "tolerance": 1e-6,
    "max_iterations": 20_000,
}
CLOSED_FORM_SHORTEST_MM = 1.0
"""Sweeps grow with the square of the number of joints: below 1 mm one insertion takes minutes."""


def settings(segments_mm: Sequence[float] = SEGMENTS_MM, *, quick: bool = False) -> list[Setting]:
    """All settings of the study; ``quick`` leaves the default and the seed's method."""
    variants = VARIANTS[:1] if quick else VARIANTS
    chosen = [Setting(s, **v) for v in variants for s in segments_mm]
    shortest = 2 * CLOSED_FORM_SHORTEST_MM if quick else CLOSED_FORM_SHORTEST_MM
    return chosen + [Setting(s, **CLOSED_FORM) for s in segments_mm if s >= shortest]


def study(
    scenes: Iterable[BenchScene],
    chosen: Sequence[Setting],
    repeats: int = 3,
    fine_mm: float = FINE_MM,
    tick: Callable[[dict[str, Any]], None] = lambda _: None,
) -> pd.DataFrame:
    """One row per scene and setting; see ``row``."""
    rows = []
    for scene in scenes:
        for row in scene_rows(scene, chosen, repeats, fine_mm):
            rows.append(row)
            tick(row)
    return pd.DataFrame(rows)


def scene_rows(
    scene: BenchScene, chosen: Sequence[Setting], repeats: int = 3, fine_mm: float = FINE_MM
) -> Iterator[dict[str, Any]]:
    """Rows of one scene; its walls are made once, and every setting's kernels are compiled before they are timed."""
    limit = reference(scene, fine_mm)
    walls = {hull: scene.wall(hull) for hull in dict.fromkeys(s.hull for s in chosen)}
    warm = {(s.method, s.hull, s.quadrature): s for s in chosen}
    for setting in warm.values():
        short = scene.with_(depth_mm=min(scene.depth_mm, 3 * scene.step_mm)) if walls[setting.hull] else scene
        insert(short, setting, walls[setting.hull])
    for setting in chosen:
        wall = walls[setting.hull]
        seconds, run = timed(lambda s=setting, w=wall: insert(scene, s, w), repeats)  # type: ignore[misc]
        yield row(scene, setting, run, seconds, limit)


def row(scene: BenchScene, setting: Setting, run: Run, seconds: float, limit: Reference) -> dict[str, Any]:
    """Cost and error of one run; the errors of a run that did not reach the depth are NaN."""
    shape, tip = float("nan"), float("nan")
    if run.reached:
        points = resampled(run.joints_mm, run.arcs_mm, limit.arcs_mm)
        shape, tip = shape_error(points, limit.points_mm)
    looked = run.work.get("wall_look_ups", 0.0)
    spared = run.work.get("wall_look_ups_proven_unnecessary", 0.0) + run.work.get("wall_look_ups_cheap", 0.0)
    return {
        "scene": scene.name,
        "method": setting.method,
        "segment_mm": setting.segment_mm,
        "hull": setting.hull,
        "quadrature": setting.quadrature,
        "tolerance": setting.tolerance,
        "ms_per_mm": 1e3 * seconds / scene.depth_mm,
        "tip_error_mm": tip,
        "shape_error_mm": shape,
        "iterations": run.iterations / scene.depth_mm,
        "energy_error": run.energy_N_mm / limit.energy_N_mm - 1.0 if run.reached else float("nan"),
        "joints": len(run.joints_mm) - 1,
        "depth_mm": run.depth_mm,
        "status": run.status.identifier,
        "look_ups_per_mm": looked / scene.depth_mm,
        "look_ups_skipped": spared / (looked + spared) if looked + spared else float("nan"),
        "sweeps_per_mm": run.work.get("sweeps", 0.0) / scene.depth_mm,
        "reference_uncertainty_mm": limit.uncertainty_mm,
    }
