"""Orders of convergence: in the segment length, free and in contact, and in the voxel size of the wall."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from pipeline.benchmark import scenes
from pipeline.benchmark.claim import Claim
from pipeline.benchmark.errors import resampled, shape_error
from pipeline.benchmark.insert import Setting, insert
from pipeline.benchmark.reference import Reference, reference
from pipeline.benchmark.scenes import BenchScene

SOFT = 0.1
"""Stiffness of the soft bend's wall, N/mm²."""
Errors = dict[float, tuple[float, float, float]]
SHAPE, TIP, ENERGY = range(3)
UNITS = ("mm", "mm", "1")
VOXELS_MM = (0.8, 0.4, 0.2, 0.1)
"""Sizes of the wall's voxels; the finest one is the limit."""
OFF_LATTICE = 0.37
"""Of a voxel: a node on the axis of the tube would be luck."""


def errors_of(scene: BenchScene, segment_mm: float, limit: Reference) -> tuple[float, float, float]:
    """RMS and tip error, mm, and relative energy error (inf where the depth is not reached)."""
    run = insert(scene, Setting(segment_mm))
    if not run.reached:
        return math.inf, math.inf, math.inf
    points = resampled(run.joints_mm, run.arcs_mm, limit.arcs_mm)
    return *shape_error(points, limit.points_mm), abs(run.energy_N_mm / limit.energy_N_mm - 1.0)


def orders() -> Iterator[Claim]:
    """Errors against segment length: free, in the soft bend, and with the tip in contact."""
    free = _errors(scenes.cantilever(), (10.0, 5.0, 2.5))
    yield _order("free cantilever, tip", free, TIP, lambda p: abs(p - 2) <= 0.05, "2.00 ± 0.05")
    soft = _errors(scenes.bend(100.0, SOFT), (5.0, 2.5, 1.25))
    yield _order("soft bend, energy", soft, ENERGY, lambda p: p >= 1.9, "at least 1.9")
    tip = soft[2.5][TIP]
    yield Claim("soft bend, tip error at 2.5 mm segments", tip, "mm", "at most 0.01", tip <= 0.01)
    hard = _errors(scenes.bend(60.0), (2.0, 1.0, 0.5))
    for name, which in (("shape", SHAPE), ("energy", ENERGY)):
        yield _order(f"scene B, {name}", hard, which, lambda p: p >= 1.8, "at least 1.8")


def _errors(scene: BenchScene, segments: Sequence[float]) -> Errors:
    limit = reference(scene)
    return {segment: errors_of(scene, segment, limit) for segment in segments}


def _order(name: str, errors: Errors, which: int, good: Callable[[float], bool], aim: str) -> Claim:
    segments, found = tuple(errors), tuple(error[which] for error in errors.values())
    order = fitted(segments, found)
    claim, against = f"order of the {name} over {segments} mm", f"{name}: segment length, mm"
    return Claim(claim, order, "1", aim, good(order), against, segments, found, UNITS[which])


def fitted(sizes: Sequence[float], errors: Sequence[float]) -> float:
    """Slope of a straight line through the logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(np.maximum(errors, 1e-300)), 1)[0])


def voxel_order() -> Iterator[Claim]:
    """Errors against the voxel size of scene B's wall, on grids off its lattice.

    The lumen's curvature jumps where the bend begins and ends, so the fourth order of cubic splines is not reached.
    """
    scene, shapes = scenes.bend(60.0), []
    low, high = scene.box or ((), ())
    for voxel in VOXELS_MM:
        shifted = tuple(float(a) - OFF_LATTICE * voxel for a in low)
        wall = scene.with_(box=(shifted, high), grids={}).wall(voxel_mm=voxel)
        shapes.append(insert(scene, Setting(0.5, tolerance=1e-13), wall).joints_mm)
    sizes = VOXELS_MM[:-1]
    found = tuple(shape_error(points, shapes[-1])[0] for points in shapes[:-1])
    name = "scene B, shape"
    claim, against = f"order of the {name} over voxels of {sizes} mm", f"{name}: voxel of the wall, mm"
    yield Claim(claim, fitted(sizes, found), "1", "none, reported", None, against, sizes, found, "mm")
