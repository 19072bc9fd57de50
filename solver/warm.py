"""Compile everything once, so that no measurement and no user's first step pays for it."""

from __future__ import annotations

import gc
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, cast

import numba
import numpy as np

from solver._kernels.closed_form import minimise_closed_form
from solver._kernels.follow import follow
from solver._kernels.forces import contact_forces, push_force
from solver._kernels.insertion import lay_along
from solver._kernels.minimise import minimise
from solver.grid import Grid
from solver.insertion import Insertion
from solver.relax import Settings, buffers_for
from solver.wall import VesselWall
from solver.wire import GuideWire

untyped: Any = numba
typeof = untyped.typeof
WHOLE, REAL = numba.int64, numba.float64
REPORT, FORCES = typeof(np.zeros(1)), typeof(np.zeros((1, 3)))


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


def warm_up(*, beside: bool = False) -> None:
    """Compile every kernel (about half a minute, once per installation; later calls read the cache).

    beside : all but the minimiser and the way to a depth is compiled by a process of its own, at the same time.
    """
    with no_collection():
        if not beside or untyped.config.DISABLE_JIT:
            _insert()
            _lesser_doors()
            return
        with subprocess.Popen([sys.executable, "-c", "from solver import warm; warm.compile_the_rest()"]):
            insertion = Insertion(_wire(), None, [0, 0, 0], [0, 0, 1])
            problem = typeof(insertion.buffers.problem)
            # while the other process makes what ``advance`` needs besides
            cast(Any, minimise).compile((problem, WHOLE, WHOLE, REAL, WHOLE, REPORT))
            _insert()


def compile_the_rest() -> None:
    """Kernels that are kept on disk and can wait there for ``advance``, then the lesser doors."""
    with no_collection():
        insertion = Insertion(_wire(), None, [0, 0, 0], [0, 0, 1])
        problem, cut, base = (
            typeof(part) for part in (insertion.buffers.problem, insertion.buffers.cut, insertion.base)
        )
        for part, types in (
            (minimise_closed_form, (problem, WHOLE, WHOLE, REAL, WHOLE, REPORT)),
            (lay_along, (problem, cut, base, WHOLE, WHOLE, REAL, REAL)),
            (contact_forces, (problem, WHOLE, FORCES)),
            (push_force, (problem, cut, WHOLE, REPORT)),
        ):
            cast(Any, part).compile(types)
        _lesser_doors()


def _wire() -> GuideWire:
    return GuideWire(0.5, 0.1, 1.0, rest_curvature_per_mm=0.2)


def _insert() -> None:
    """The way to a depth; a wall has no types of its own."""
    for _ in Insertion(_wire(), None, [0, 0, 0], [0, 0, 1]).to_depths([1.0]):
        pass


def _lesser_doors() -> None:
    """Make a wall and ask it, and lay a wire along a curve."""
    axis = np.arange(-2.0, 2.5, 0.5)
    x, y, _ = np.meshgrid(axis, axis, np.arange(-1.0, 4.0, 0.5), indexing="ij")
    grid = Grid(
        (np.hypot(x - 0.1, y) - 0.5).astype(np.float32), np.full(3, 0.5), np.array([-2.0, -2.0, -1.0])
    )
    wall = VesselWall(grid, 1.0, friction=0.1)
    wall.look_up([[0.0, 0.0, 0.0]])
    buffers = buffers_for(_wire(), wall, Settings())
    buffers.lay_out(1.0)
    state = buffers.state
    follow(np.eye(3)[1:], 2, buffers.chain, state.u[0], state.x[0], state.r[0], buffers.k)
