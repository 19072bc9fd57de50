"""Many insertions at once: in lock-step on each core, and on all cores.

An insertion waits for its own last result most of the time. Eight of them, side by side in the processor's vectors,
take little longer than one; see ``_kernels.lanes``.
"""

import os
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from typing import Any

import numpy as np
from numpy.typing import NDArray

from solver import skips
from solver._kernels import data, records
from solver._kernels.lane_block import LANE, SHAPES, Block
from solver._kernels.lane_insertion import Plan, advance_together
from solver._kernels.lanes import WIDTH, room
from solver._kernels.minimise import NEWTON
from solver.doors import Found, instance, whole
from solver.errors import refuse
from solver.insertion import Insertion
from solver.solution import Solution, Status
from solver.workspace import SNAPS_KEPT, Workspace

LISTS = (list, tuple, np.ndarray)
MOST_THREADS = 4096
Goals = tuple[list[float], list[float]]
"""Depths, mm, and rolls, degrees."""


class Insertions:
    """Insertions that go their ways at the same time, each with its own wire, wall, clamp, depths and rolls.

    insertions : they may have gone some way already, and may go on by themselves afterwards. Wires whose walls are made
    from one another by ``VesselWall.like`` go in lock-step, WIDTH at a time; each comes to lie as by itself (to
    rounding: 1e-9 mm, away from snaps; straight wires 2e-8). With friction, a finite torsional stiffness, a sampled
    hull, a shaft, a weight, no wall or the closed form each goes by itself.
    threads : how many of them to use (default: one a core); Python's lock is not held.
    Raises ValueError where one insertion is given twice.
    """

    def __init__(self, insertions: Iterable[Insertion], *, threads: int | None = None) -> None:
        if not isinstance(insertions, Iterable):
            refuse("insertions", "insertions", insertions, "a list of Insertion", "make each of them first")
        self.insertions = tuple(instance("insertions", "insertions", one, Insertion) for one in insertions)
        if len(set(map(id, self.insertions))) < len(self.insertions):
            got = Found(f"{len(self.insertions)} of which {len(set(map(id, self.insertions)))} are different")
            refuse("insertions", "insertions", got, "each of them once", "make another Insertion of the same wire")
        cores = os.cpu_count() or 1
        self.threads = whole("insertions", "threads", cores if threads is None else threads, MOST_THREADS)

    def to_depths(
        self, depths_mm: Sequence[float] | Sequence[Sequence[float]], roll_deg: float | Sequence[Any] = 0.0
    ) -> list[list[Solution]]:
        """Push (or pull) every tip to its depths, as ``Insertion.to_depths`` does; a list of solutions for each.

        depths_mm : the same for all (d,), or a sequence for each.     roll_deg : one for all, or for each insertion
        what ``Insertion.to_depths`` takes.
        """
        count = len(self.insertions)
        given: Any = list(depths_mm) if isinstance(depths_mm, Iterator) else depths_mm
        own = isinstance(given, LISTS) and any(isinstance(depths, (*LISTS, range)) for depths in given)
        depths = _one_each("depths_mm", given, count) if own else [given] * count
        rolls = _one_each("roll_deg", roll_deg, count) if isinstance(roll_deg, LISTS) else [roll_deg] * count
        goals = [one._goals(d, r) for one, d, r in zip(self.insertions, depths, rolls, strict=True)]
        found: list[list[Solution]] = [[] for _ in range(count)]

        def work(team: list[int]) -> None:
            if len(team) == 1:
                found[team[0]] = list(self.insertions[team[0]].to_depths(*goals[team[0]]))
                return
            for index, solutions in zip(team, together([(self.insertions[i], goals[i]) for i in team]), strict=True):
                found[index] = solutions

        with ThreadPoolExecutor(self.threads) as pool:
            list(pool.map(work, self._teams(goals)))
        return found

    def _teams(self, goals: Sequence[Goals]) -> list[list[int]]:
        """Who goes with whom: like with like, up to WIDTH of them, those that go deepest first."""
        kinds: dict[Any, list[int]] = {}
        deepest = [max(depths, default=0.0) for depths, _ in goals]
        for index in sorted(range(len(goals)), key=lambda i: -deepest[i]):
            kinds.setdefault(kind_of(self.insertions[index], deepest[index]) or index, []).append(index)
        return [kind[i : i + WIDTH] for kind in kinds.values() for i in range(0, len(kind), WIDTH)]


def _one_each(name: str, values: Any, count: int) -> list[Any]:
    """One for each of ``count`` insertions, or a refusal."""
    if np.shape(values)[:1] != (count,) if isinstance(values, np.ndarray) else len(values) != count:
        refuse("insertions", name, values, f"{count} of them, as there are insertions", "give each its own")
    return list(values)


def kind_of(insertion: Insertion, deepest_mm: float) -> tuple[int, int, int] | None:
    """What insertions must share to go in lock-step; None for those that cannot."""
    work, wall = insertion._work, insertion.wall
    plain = wall is not None and wall.friction == 0.0 and wall.samples == 0 and work.shaft.drag == 0.0
    plain = plain and not insertion.wire.twists and insertion.wire.weight_N_per_mm == 0.0
    reached = work.limits.method == NEWTON and work.skips == skips.ALL and insertion._reaches(deepest_mm)
    # there are no vectors where nothing is compiled
    possible = plain and reached and hasattr(advance_together, "py_func")
    return (id(work.field.coefficients), work.rule.zone, work.rule.tip_at.size) if possible else None


def together(team: Sequence[tuple[Insertion, Goals]]) -> list[list[Solution]]:
    """The solutions of up to WIDTH insertions that go in lock-step."""
    with ExitStack() as stack:
        for insertion, goals in team:
            insertion._hold()
            stack.callback(insertion._release)
            insertion._begin(*goals)
        return _in_lock_step(team)


def _in_lock_step(team: Sequence[tuple[Insertion, Goals]]) -> list[list[Solution]]:
    """The solutions of insertions that are held and ready."""
    plan = _plan(team)
    works = [insertion._work for insertion, _ in team]
    size = max(
        insertion.wire.segments_at(max(*depths, insertion.depth_mm))[0] for insertion, (depths, _) in team if depths
    )
    first = first_points(works[0], size)
    axes = {"k": size, "n": size + 1, "p": int(first[-1])}
    block = Block(*(room(*(axes.get(axis) or int(axis) for axis in shape.split())) for shape in SHAPES))
    wires = tuple(works[lane if lane < len(works) else 0].handle for lane in range(WIDTH))
    kinds = LANE, records.DESCENT, records.COUNTERS
    notes = tuple(np.zeros(WIDTH, kind).view(np.recarray) for kind in kinds)
    advance_together(wires, plan, notes, block, first)
    return [_solutions(plan, lane) for lane in range(len(team))]


def first_points(work: Workspace, size: int) -> NDArray[np.int64]:
    """First look-up point (size + 2,) of each node of a wire of ``size`` segments, see ``chain.place_points``."""
    rule, behind = work.rule, np.arange(size)[::-1]
    counts = np.where(behind <= rule.zone, 2, 1) if rule.tip_at.size > 1 else np.ones(size, dtype=np.int64)
    counts[-1] = rule.tip_at.size
    return np.concatenate([[0, 0], np.cumsum(counts)])


def _plan(team: Sequence[tuple[Insertion, Goals]]) -> Plan:
    """Where they go, with room for what they find."""
    most = max(len(depths) for _, (depths, _) in team)
    goal, row, count = np.zeros((WIDTH, most, 2)), np.zeros((WIDTH, most), np.int64), np.zeros(WIDTH, np.int64)
    rows = 0
    for lane, (insertion, (depths, rolls)) in enumerate(team):
        count[lane] = len(depths)
        goal[lane, : len(depths)] = np.column_stack([depths, rolls])
        # a wire that does not come out again stays as long as it was
        longest = np.maximum.accumulate([max(d, insertion.depth_mm) for d in depths])
        room_for = [insertion.wire.segments_at(d)[0] + 1 for d in longest]
        row[lane, : len(depths)] = np.cumsum(room_for) - room_for
        rows = max(rows, sum(room_for))
    x, r, force = np.zeros((WIDTH, rows, 3)), np.zeros((WIDTH, rows, 3, 3)), np.zeros((WIDTH, rows, 3))
    kinds = (records.PLACE, records.REPORT, records.ENERGIES, records.COUNTERS)
    place, report, energies, counters = (np.zeros((WIDTH, most), kind).view(np.recarray) for kind in kinds)
    ended = np.zeros((WIDTH, most, 3), np.int64)
    snaps, blank = np.zeros((WIDTH, most, SNAPS_KEPT), records.SNAP), np.zeros(1, records.COUNTERS)
    return Plan(goal, count, row, x, r, force, ended, place, report, energies, counters, snaps, blank)


def _solutions(plan: Plan, lane: int) -> list[Solution]:
    """What a lane found at its depths."""
    names = "place", "report", "energies", "counters", "ended", "row"
    noted = zip(*(getattr(plan, name)[lane, : plan.count[lane]].tolist() for name in names), strict=True)
    found = []
    for n, (*notes, (outcome, iterations, k), row) in enumerate(noted):
        arrays = [a[lane, row : row + k + 1] for a in (plan.x, plan.r, plan.force)]
        depth, roll, *_ = notes[0]
        ended = Status[data.OUTCOMES[outcome]], iterations, depth, roll
        found.append(Solution.assembled(arrays, tuple(notes), plan.snaps[lane, n], ended))
    return found
