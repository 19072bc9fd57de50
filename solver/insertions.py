"""Many insertions at once: in lock-step on each core, and on all cores.

An insertion waits for its own last result most of the time. Eight of them, side by side in the processor's vectors,
take little longer than one; see ``_kernels.lanes``.
"""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import ExitStack
from functools import partial
from typing import Any

from solver import skips
from solver._kernels.lanes.insertion import advance_together
from solver._kernels.lanes.vectors import WIDTH
from solver._kernels.minimise import NEWTON
from solver.crew import Crew, Job, go_alone
from solver.doors import Found, instance, listed, whole
from solver.errors import refuse
from solver.insertion import Insertion
from solver.solution import Solution

MOST_THREADS = 4096


class Insertions:
    """Many insertions computed at the same time, each with its own wire, wall, clamp, depths and rolls.

    insertions : each may be at some depth already, and may be used alone afterwards.     threads : how many to use, by
    default one per core; they run without Python's global lock.

    Wires whose walls are made from one another by ``VesselWall.like`` advance in lock-step, WIDTH of them at a time in
    the processor's vector lanes, taken from a pool of POOL. Insertions with friction, a finite torsional stiffness, a
    sampled hull, a shaft with friction, a weight, no wall or the closed form are computed one by one.

    Results are those of ``Insertion.to_depths``, up to rounding (1e-9 mm, away from snaps). There are two exceptions:
    for a wire that is straight at rest, 1 % of depths agree only to the tolerance of a relaxation (1e-5 mm), and where
    two ways are equally good, once in 10,000 depths, the other one may be taken.
    Raises ValueError where one insertion is given twice, or one has a catheter.
    """

    def __init__(self, insertions: Iterable[Insertion], *, threads: int | None = None) -> None:
        if not isinstance(insertions, Iterable):
            refuse("insertions", "insertions", insertions, "a list of Insertion", "make each of them first")
        self.insertions = tuple(instance("insertions", "insertions", one, Insertion) for one in insertions)
        if len(set(map(id, self.insertions))) < len(self.insertions):
            got = Found(f"{len(self.insertions)} of which {len(set(map(id, self.insertions)))} are different")
            refuse("insertions", "insertions", got, "each of them once", "make another Insertion of the same wire")
        if any(one._work.catheter is not None for one in self.insertions):
            refuse("insertions", "insertions", Found("one with a catheter"), "wires without", "use Insertion.to_depths")
        cores = os.cpu_count() or 1
        self.threads = whole("insertions", "threads", cores if threads is None else threads, MOST_THREADS)

    def to_depths(
        self, depths_mm: Sequence[float] | Sequence[Sequence[float]], roll_deg: float | Sequence[Any] = 0.0
    ) -> list[list[Solution]]:
        """Push (or pull) every tip to its depths; one list per insertion of what ``Insertion.to_depths`` yields.

        depths_mm : one sequence (d,) for all insertions, or one sequence per insertion.     roll_deg : one number for
        all, or per insertion what ``Insertion.to_depths`` takes.
        """
        count = len(self.insertions)
        given: Any = list(depths_mm) if isinstance(depths_mm, Iterator) else depths_mm
        own = listed(given) and any(listed(depths) for depths in given)
        depths = _one_each("depths_mm", given, count) if own else [given] * count
        rolls = _one_each("roll_deg", roll_deg, count) if listed(roll_deg) else [roll_deg] * count
        goals = [one._goals(d, r) for one, d, r in zip(self.insertions, depths, rolls, strict=True)]
        jobs = [Job(one, *goal[:2], []) for one, goal in zip(self.insertions, goals, strict=True)]
        kinds: dict[Any, deque[Job]] = {}
        # those that go deepest first, so that none of them is left over when all others are done
        for job in sorted(jobs, key=lambda job: -max(job.depths, default=0.0)):
            kinds.setdefault(kind_of(job) or id(job), deque()).append(job)
        with ExitStack() as stack:
            for job in jobs:
                job.insertion._hold()
                stack.callback(job.insertion._release)
            tasks = [task for kind in kinds.values() for task in _tasks(kind, self.threads)]
            with ThreadPoolExecutor(self.threads) as pool:
                _outlast([pool.submit(task) for task in tasks], kinds.values())
        return [job.found for job in jobs]


def _outlast(running: list[Future[None]], waiting: Iterable[deque[Job]]) -> None:
    """Wait for threads to end, however often Ctrl-C is pressed: they would still move a wire that is released earlier.

    After the first Ctrl-C they take no more jobs; of those begun, wires in lanes are finished, one alone goes no
    further than to its next depth. Then KeyboardInterrupt is raised.
    """
    pressed = None
    while not all(task.done() for task in running):
        try:
            wait(running)
        except KeyboardInterrupt as interrupt:
            pressed = interrupt
            for queue in waiting:
                queue.clear()
    for task in running:
        task.result()
    if pressed is not None:
        raise pressed


def _tasks(kind: deque[Job], threads: int) -> list[Callable[[], None]]:
    """The calls, each for a thread of its own, that do all jobs of one kind."""
    if len(kind) == 1:
        return [partial(go_alone, kind)]
    crews = min(threads, -(-len(kind) // WIDTH))
    teams = [Crew(kind, -(-len(kind) // crews)) for _ in range(crews)]
    return [partial(crew.lead, kind) for crew in teams]


def _one_each(name: str, values: Iterable[Any], count: int) -> list[Any]:
    """One for each of ``count`` insertions, or a refusal."""
    each = list(values)
    if len(each) != count:
        refuse("insertions", name, each, f"{count} of them, as there are insertions", "give each its own")
    return each


def kind_of(job: Job) -> tuple[int, int, int] | None:
    """What insertions must share to go in lock-step; None for those that cannot."""
    insertion, wall, work = job.insertion, job.insertion.wall, job.insertion._work
    plain = wall is not None and wall.friction == 0.0 and wall.samples == 0 and work.shaft.drag == 0.0
    plain = plain and not insertion.wire.twists and insertion.wire.weight_N_per_mm == 0.0
    reached = insertion._reaches(max(job.depths, default=0.0))
    # there are no vectors where nothing is compiled
    possible = work.limits.method == NEWTON and work.skips == skips.ALL and hasattr(advance_together, "py_func")
    return (id(work.field), work.rule.zone, work.rule.tip_at.size) if plain and reached and possible else None
