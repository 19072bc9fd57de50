"""Compile everything once, so that no measurement and no user's first step pays for it."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from solver.grid import Grid
from solver.insertion import Insertion
from solver.relax import METHODS
from solver.wall import VesselWall
from solver.wire import GuideWire


@contextmanager
def no_collection() -> Iterator[None]:
    """Without the garbage collector: the compiler makes millions of objects, and looking through them is an eighth."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def warm_up() -> None:
    """Compile every kernel (about half a minute, once per installation; later calls read the cache)."""
    with no_collection():
        _call_every_door()


def _call_every_door() -> None:
    axis = np.arange(-2.0, 2.5, 0.5)
    x, y, _ = np.meshgrid(axis, axis, np.arange(-1.0, 4.0, 0.5), indexing="ij")
    grid = Grid(
        (np.hypot(x - 0.1, y) - 0.5).astype(np.float32), np.full(3, 0.5), np.array([-2.0, -2.0, -1.0])
    )
    wire = GuideWire(0.5, 0.1, 1.0, rest_curvature_per_mm=0.2)
    for method in METHODS:
        wall = VesselWall(grid, 1.0, friction=0.1)
        for _ in Insertion(wire, wall, [0, 0, 0], [0, 0, 1], method=method).to_depths([2.0, 1.0]):
            pass
