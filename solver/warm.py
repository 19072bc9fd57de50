"""Compile everything once, so that no measurement and no user's first step pays for it."""

import gc
import inspect
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numba
import numpy as np

from solver._kernels import closed_form, newton_method
from solver._kernels.forces import contact_forces, push_force
from solver._kernels.forks import turned_aside
from solver._kernels.insertion import accept_or_revert, begin_step, collect
from solver._kernels.minimise import look_again
from solver._kernels.pace import next_target
from solver._kernels.septum import through_wall
from solver._kernels.spring_back import spring_back
from solver._kernels.start import extrapolate_start, lay_along
from solver.doors import instance
from solver.grid import Grid
from solver.insertion import Insertion
from solver.insertions import Insertions
from solver.relax import Settings, relax
from solver.wall import VesselWall
from solver.wire import GuideWire
from solver.workspace import Workspace

untyped: Any = numba
WIRE = GuideWire(0.5, 0.1, 1.0, rest_curvature_per_mm=0.2)


@contextmanager
def no_collection() -> Iterator[None]:
    """Switch the garbage collector off: scanning the compiler's millions of objects takes an eighth of the time."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def warm_up(*, beside: bool = False) -> None:
    """Compile every kernel. It takes minutes, once per installation; later calls read what was compiled from the disk.

    beside : compile what ``Insertions`` needs, which is more than half of it, in a second process at the same time.
    """
    instance("solver", "beside", beside, bool)
    with no_collection():
        if not beside or untyped.config.DISABLE_JIT:
            relax(WIRE, _wall(), depth_mm=1.0)
            compile_lanes()
            return
        with subprocess.Popen([sys.executable, "-c", "from solver import warm; warm.compile_lanes()"]):
            # each begins with half of what both need: what is not on disk when it is asked for is compiled twice
            _compile(turned_aside, through_wall, push_force, accept_or_revert, contact_forces, collect)
            _compile(newton_method.iterate, closed_form.iterate)
            relax(WIRE, _wall(), depth_mm=1.0)


def compile_lanes() -> None:
    """Compile the kernels of insertions that go in lock-step."""
    with no_collection():
        _compile(next_target, lay_along, begin_step, extrapolate_start, spring_back, look_again)
        wall = _wall()
        wires = [Insertion(WIRE, wall, [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]) for _ in range(2)]
        Insertions(wires, threads=1).to_depths([1.0])


def _compile(*kernels: Any) -> None:
    """Compile kernels for the argument types that go with their parameters' names."""
    work = Workspace(WIRE, None, "tip", Settings().limits)
    work.clamp(np.zeros(3), np.eye(3))
    known = {
        "field": work.field,
        "x": work.problem.state.x[0],
        "table": work.table,
        "introducer": work.introducer,
        "limits": work.limits,
        "at": work.place[0],
        "now": work.problem.scratch.descent[0],
        "report": work.report[0],
        "force": work.force,
        "weight": np.zeros(3),
        "handle": work.handle,
        "reached": (0.0, 0.0, 0.0),
        **dict.fromkeys(("slot", "k", "was", "outcome", "laid", "used"), 1),
        **dict.fromkeys(("depth", "roll", "to_depth", "to_roll"), 1.0),
        **dict.fromkeys(("first", "ahead", "tolerance", "margin", "share", "last", "other"), 1.0),
    }
    types = {"problem": untyped.typeof(work.handle).field_dict["problem"]}
    for kernel in kernels:
        names = inspect.signature(kernel.py_func).parameters
        kernel.compile(tuple(types.get(name) or untyped.typeof(known[name]) for name in names))


def _wall() -> VesselWall:
    """Make a wall and look a distance up in it, which compiles its kernels."""
    wall = VesselWall(Grid(np.full((4, 4, 4), -1.0)), 1.0)
    wall.look_up([[0.0, 0.0, 0.0]])
    return wall
