"""A crew: eight lanes that work for a pool of insertions from a queue; crews in other threads take from it as well."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver._kernels import data, records
from solver._kernels.lanes.block import LANE, SEAT, SHAPES, Block
from solver._kernels.lanes.decide import NEW
from solver._kernels.lanes.insertion import Plan, advance_together
from solver._kernels.lanes.relax import POOL
from solver._kernels.lanes.vectors import WIDTH, room
from solver.insertion import Insertion
from solver.solution import Solution, Status
from solver.workspace import SNAPS_KEPT, Workspace


class Job(NamedTuple):
    """An insertion, its depths, mm, and rolls, degrees, and what was found there."""

    insertion: Insertion
    depths: list[float]
    rolls: list[float]
    found: list[Solution]

    def nodes(self) -> list[int]:
        """Joints that a solution may have at each depth: a wire that gets stuck stays as long as it was."""
        longest = np.maximum.accumulate([self.insertion.depth_mm, *self.depths])
        return [self.insertion.wire.segments_at(d)[0] + 1 for d in longest[1:]]


def go_alone(queue: deque[Job]) -> None:
    """Do the one job of a queue, which nobody else can do at the same time, up to a depth at which it was taken out."""
    for job in list(queue):
        job.insertion._begin(job.depths, job.rolls)
        for depth, roll in zip(job.depths, job.rolls, strict=True):
            if queue:
                job.found.append(job.insertion._go(depth, roll))


def _next(queue: deque[Job]) -> Job | None:
    """The next job of a queue that several threads take from, None where none is left."""
    try:
        return queue.popleft()
    except IndexError:
        return None


class Crew:
    """Memory for eight wires in lanes, and for the results of a pool of wires. The caller holds the insertions' locks.

    share : about how many of the jobs this crew is to do.
    """

    def __init__(self, jobs: Sequence[Job], share: int) -> None:
        nodes = [job.nodes() for job in jobs]
        size = max(max(n, default=2) for n in nodes) - 1
        self.first = first_points(jobs[0].insertion._work, max(size, 1))
        # in pools of one size: a small one would leave lanes idle
        self.most = -(-share // -(-share // POOL))
        self.plan = _plan(self.most, max(map(len, nodes)), max(map(sum, nodes)))
        axes = {"k": max(size, 1), "n": max(size, 1) + 1, "p": int(self.first[-1])}
        block = Block(*(room(*(axes.get(axis) or int(axis) for axis in shape.split())) for shape in SHAPES))
        # one more: the lists are written one place beyond their last entry
        self.block = block._replace(asked=np.zeros((3, WIDTH * axes["p"] + 1 + WIDTH), np.int64))
        kinds = LANE, records.DESCENT, records.COUNTERS
        self.notes = tuple(np.zeros(POOL + 1, kind).view(np.recarray) for kind in kinds)
        self.seats = np.zeros(WIDTH, SEAT).view(np.recarray)
        self.wires = [jobs[0].insertion._work.handle] * POOL

    def lead(self, queue: deque[Job]) -> None:
        """Do jobs of a queue that others may take from as well until none is left."""
        while jobs := [job for job in (_next(queue) for _ in range(self.most)) if job is not None]:
            for w, job in enumerate(jobs):
                self._start(w, job)
            notes = (*self.notes, self.seats)
            advance_together(tuple(self.wires), self.plan, notes, self.block, self.first)
            for w, job in enumerate(jobs):
                job.found.extend(_solutions(self.plan, w, job.insertion._work))

    def _start(self, w: int, job: Job) -> None:
        """Put a wire into the pool."""
        job.insertion._begin(job.depths, job.rolls)
        self.wires[w] = job.insertion._work.handle
        for note in self.notes:
            note[w] = np.zeros((), note.dtype)
        self.notes[0]["phase"][w] = NEW
        count, nodes = len(job.depths), job.nodes()
        self.plan.count[w] = count
        self.plan.goal[w, :count] = np.column_stack([job.depths, job.rolls])
        self.plan.row[w, :count] = np.cumsum(nodes) - nodes


def first_points(work: Workspace, size: int) -> NDArray[np.int64]:
    """First look-up point (size + 2,) of each node of a wire of ``size`` segments, see ``chain.place_points``."""
    rule, behind = work.rule, np.arange(size)[::-1]
    counts = np.where(behind <= rule.zone, 2, 1) if rule.tip_at.size > 1 else np.ones(size, dtype=np.int64)
    counts[-1] = rule.tip_at.size
    return np.concatenate([[0, 0], np.cumsum(counts)])


def _plan(wires: int, most: int, rows: int) -> Plan:
    """Room for the results of ``wires`` wires, each at up to ``most`` depths with up to ``rows`` joints in all."""
    goal, row, count = np.zeros((wires, most, 2)), np.zeros((wires, most), np.int64), np.zeros(wires, np.int64)
    x, r, force = np.zeros((wires, rows, 3)), np.zeros((wires, rows, 3, 3)), np.zeros((wires, rows, 3))
    kinds = (records.PLACE, records.REPORT, records.ENERGIES, records.COUNTERS)
    place, report, energies, counters = (np.zeros((wires, most), kind).view(np.recarray) for kind in kinds)
    ended = np.zeros((wires, most, 3), np.int64)
    snaps, blank = np.zeros((wires, most, SNAPS_KEPT), records.SNAP), np.zeros(1, records.COUNTERS)
    return Plan(goal, count, row, x, r, force, ended, place, report, energies, counters, snaps, blank)


def _solutions(plan: Plan, w: int, work: Workspace) -> list[Solution]:
    """What a wire found at its depths."""
    names = "place", "report", "energies", "counters", "ended", "row"
    noted = zip(*(getattr(plan, name)[w, : plan.count[w]].tolist() for name in names), strict=True)
    found = []
    for n, (*notes, (outcome, iterations, k), row) in enumerate(noted):
        # none is a view: the next wire's results overwrite these
        depth, roll, *_ = notes[0]
        x, r, force = (a[w, row : row + k + 1] for a in (plan.x, plan.r, plan.force))
        arrays = [x + work.middle_mm, work.rolled(r, roll), force.copy()]
        ended = Status[data.OUTCOMES[outcome]], iterations, depth, roll, work.wire.radius_mm
        found.append(Solution.assembled(arrays, tuple(notes), plan.snaps[w, n], ended))
        if work.at_entry is not None:
            work.at_entry.add(found[-1])
        # the wire goes on from here alone
        work.k = k
    return found
