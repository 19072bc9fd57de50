"""Many jobs on one machine or on a cluster; whatever becomes of one of them, the others go on.

Every executor gives the same outcomes. A job that took its worker with it is run once more after all the others, alone;
a second death names it.
"""

import multiprocessing
import os
import threading
import traceback
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

J = TypeVar("J")
R = TypeVar("R")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS", "ITK_GLOBAL_DEFAULT_NUMBER_OF_THREADS")
LOST = "the worker process was killed (out of memory?); run this case alone with -j 1"


@dataclass(frozen=True)
class Outcome(Generic[J, R]):
    """What became of a job: a result, or an error (its traceback in ``log``), or lost with its worker."""

    job: J
    result: R | None = None
    error: str = ""
    log: str = ""


def run_all(jobs: Sequence[J], work: Callable[[J], R], workers: int = 1, address: str = "") -> Iterator[Outcome[J, R]]:
    """Run ``work`` on every job, yielding outcomes as they come.

    With one worker in this process, else in as many processes, or on the dask cluster at ``address``.
    """
    if not address and (workers == 1 or len(jobs) < 2):
        yield from (guarded(work, job) for job in jobs)
        return
    with _cluster(address) if address else OneEach(min(workers, len(jobs))) as executor:
        lost = yield from _collected(executor, jobs, work)
        for job in lost:
            again = yield from _collected(executor, [job], work)
            yield from (Outcome(each, None, LOST, LOST) for each in again)


def guarded(work: Callable[[J], R], job: J) -> Outcome[J, R]:
    """Run one job; an error becomes its outcome, since it must not take the batch along."""
    try:
        return Outcome(job, work(job))
    except Exception as error:
        return Outcome(job, None, f"{type(error).__name__}: {error}", traceback.format_exc())


def _collected(
    executor: Executor, jobs: Sequence[J], work: Callable[[J], R]
) -> Generator[Outcome[J, R], None, list[J]]:
    """Yield the outcomes of jobs and return those whose worker died."""
    futures: dict[Future[Outcome[J, R]], J] = {executor.submit(guarded, work, job): job for job in jobs}
    lost: list[J] = []
    for future in as_completed(futures):
        # ``guarded`` raises nothing: what comes here is the end of a worker, under the name that its executor gives it
        if future.exception() is None:
            yield future.result()
        else:
            lost.append(futures[future])
    return lost


class OneEach(Executor):
    """Worker processes that die alone: each is a pool of one, which is replaced when its process has died."""

    def __init__(self, workers: int) -> None:
        self._lanes = ThreadPoolExecutor(workers)
        self._own = threading.local()
        self._pools: list[ProcessPoolExecutor] = []

    def submit(self, work: Callable[..., Any], /, *args: Any, **named: Any) -> Future[Any]:
        """As of any executor; a future raises BrokenProcessPool where its worker has died."""
        return self._lanes.submit(self._in_process, work, *args, **named)

    def _in_process(self, work: Callable[..., Any], *args: Any, **named: Any) -> Any:
        pool: ProcessPoolExecutor | None = getattr(self._own, "pool", None)
        if pool is None:
            context = multiprocessing.get_context("forkserver")
            pool = self._own.pool = ProcessPoolExecutor(1, context, initializer=_single_thread)
            self._pools.append(pool)
        try:
            return pool.submit(work, *args, **named).result()
        except BrokenProcessPool:
            self._own.pool = None
            raise

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers; jobs that have not begun are dropped where asked."""
        self._lanes.shutdown(wait, cancel_futures=cancel_futures)
        for pool in self._pools:
            pool.shutdown(wait, cancel_futures=cancel_futures)

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """After an error or an interruption what has not begun is dropped."""
        self.shutdown(cancel_futures=kind is not None)


def _single_thread() -> None:
    """Workers take one core each: N processes of N threads slow each other down."""
    for name in THREADS:
        os.environ[name] = "1"


@contextmanager
def _cluster(address: str) -> Iterator[Executor]:
    """The executor of the dask scheduler at an address."""
    from distributed import Client

    with Client(address) as client:
        yield client.get_executor()
