"""What each skip of the solver saves, and that the wire is the same without it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from pipeline.benchmark import scenes
from pipeline.benchmark.claim import Claim
from pipeline.benchmark.insert import Setting, insert, timed
from pipeline.benchmark.scenes import BenchScene
from solver.relax import Settings

MANY_LOOK_UPS = "samples:16"
"""The hull with which skips of look-ups are measured; with one look-up a joint there is little to save."""
PAIRS = 9


def skips() -> Iterator[Claim]:
    """Every skip off in turn: the same wire, and what the skip saves."""
    on = Settings().switch
    for name in on._fields:
        hull = MANY_LOOK_UPS if name in ("clearance", "cheap") else "offset"
        # only in a long sheath does what the tip meets die out before it comes to the base
        scene, segment = (scenes.sheath(), 1.0) if name == "window" else (scenes.bend(), 0.5)
        wall, off = scene.wall(hull), on._replace(**{name: False})
        # wires are compared at a tolerance so tight that where an iteration stops does not show
        tight = Setting(segment, hull=hull, tolerance=1e-13)
        with_skip, without = (insert(scene, tight, wall, s).last.joints_mm for s in (on, off))
        apart = float(np.abs(with_skip - without).max())
        aim = "at most 1e-6 (algebraic skips 1e-12)"
        where = f"skip {name} off ({scene.name}, hull {hull})"
        yield Claim(f"{where}: wire apart", apart, "mm", aim, apart <= 1e-6)
        ratio = _slower(scene, Setting(segment, hull=hull), wall, on, off)
        yield Claim(f"{where}: time, times", ratio, "1")


def _slower(scene: BenchScene, setting: Setting, wall: Any, on: Any, off: Any) -> float:
    """Median time without over median time with a skip, in turns."""
    seconds = [
        [timed(partial(insert, scene, setting, wall, switch), 1)[0] for switch in (on, off)]
        for _ in range(PAIRS)
    ]
    with_skip, without = np.median(seconds, axis=0)
    return float(without / with_skip)
