"""What each skip of the solver saves, and that the wire is the same without it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from pipeline.benchmark import scenes
from pipeline.benchmark.claim import Claim
from pipeline.benchmark.clock import timed
from pipeline.benchmark.insert import Setting, insert
from pipeline.benchmark.scenes import BenchScene
from solver.skips import Skips, off

MANY_LOOK_UPS = "samples:16"
"""The hull with which skips of look-ups are measured; with one look-up a joint there is little to save."""
PAIRS = 9


def skips() -> Iterator[Claim]:
    """Every skip off in turn: the same wire, and what the skip saves."""
    for name in Skips._fields:
        hull = MANY_LOOK_UPS if name in ("clearance", "cheap") else "offset"
        # only in a long sheath does what the tip meets die out before it comes to the base
        scene, segment = (scenes.sheath(), 1.0) if name == "window" else (scenes.bend(60.0), 0.5)
        wall = scene.wall(hull)
        # wires are compared at a tolerance so tight that where an iteration stops does not show
        tight = Setting(segment, hull=hull, tolerance=1e-13)
        with_skip = insert(scene, tight, wall).joints_mm
        with off(name):
            without = insert(scene, tight, wall).joints_mm
        apart = float(np.abs(with_skip - without).max())
        aim = "at most 1e-6 (algebraic skips 1e-12)"
        where = f"skip {name} off ({scene.name}, hull {hull})"
        yield Claim(f"{where}: wire apart", apart, "mm", aim, apart <= 1e-6)
        ratio = _slower(scene, Setting(segment, hull=hull), wall, name)
        yield Claim(f"{where}: time, times", ratio, "1")


def _slower(scene: BenchScene, setting: Setting, wall: Any, name: str) -> float:
    """Median time without over median time with a skip, in turns."""
    seconds = []
    for _ in range(PAIRS):
        with_it = timed(lambda: insert(scene, setting, wall), 1)[0]
        with off(name):
            seconds.append((with_it, timed(lambda: insert(scene, setting, wall), 1)[0]))
    with_skip, without = np.median(seconds, axis=0)
    return float(without / with_skip)
