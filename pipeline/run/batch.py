"""Many jobs on one machine or on a cluster; whatever happens to one of them, the others go on.

Every executor gives the same outcomes. A job whose worker died is run once more, alone, after all the others; if its
worker dies again, the job is reported as lost. A dying worker of a cluster also loses jobs that it had received but not
begun, so that there only deaths count in which the job was alone.
"""

import logging
import sys
from asyncio import CancelledError
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from queue import SimpleQueue
from typing import Any, TypeVar

from pipeline.run.outcome import GONE, LOST, Outcome, guarded
from pipeline.run.workers import NO_LIMITS, Limits, in_processes
from pipeline.status import UsageError

J = TypeVar("J")
R = TypeVar("R")
Outcomes = Generator[Outcome[J, R], None, None]


def elsewhere(count: int, workers: int = 1, address: str = "", limits: Limits = NO_LIMITS) -> bool:
    """Whether so many jobs run in other processes than this one: on a cluster, within limits, or side by side."""
    return bool(address) or limits.any or (workers > 1 and count > 1)


def run_all(
    jobs: Sequence[J], work: Callable[[J], R], workers: int = 1, address: str = "", limits: Limits = NO_LIMITS
) -> Outcomes[J, R]:
    """Run ``work`` on every job, yielding outcomes as they come.

    The jobs run on the dask cluster at ``address`` where one is given; else in worker processes where there are limits,
    or several workers and jobs; else in this process.
    """
    if address:
        with _cluster(address) as client:

            def there(part: Sequence[J]) -> Outcomes[J, R]:
                return _on_cluster(client, part, work)

            yield from _again(jobs, there, lambda part: _again(part, there, there))
    elif elsewhere(len(jobs), workers, limits=limits):

        def here(part: Sequence[J]) -> Outcomes[J, R]:
            return in_processes(part, work, workers, limits)

        yield from _again(jobs, here, here)
    else:
        yield from (guarded(work, job) for job in jobs)


def _again(
    jobs: Sequence[J], run: Callable[[Sequence[J]], Outcomes[J, R]], alone: Callable[[Sequence[J]], Outcomes[J, R]]
) -> Outcomes[J, R]:
    """Run all jobs, then, each alone, those whose workers died; yields their outcomes."""
    lost = []
    with closing(run(jobs)) as outcomes:
        for outcome in outcomes:
            if outcome.lost:
                lost.append(outcome.job)
            else:
                yield outcome
    for job in lost:
        yield from alone([job])


def _on_cluster(client: Any, jobs: Sequence[J], work: Callable[[J], R]) -> Outcomes[J, R]:
    """Run jobs through a dask client.

    Its own executor is not taken: where a worker dies of one job with the result of another, it may never tell of that.
    """
    if client.status != "running":  # what is handed to it now would never come back
        yield from (Outcome[J, R](job, None, GONE, GONE, "scheduler_lost") for job in jobs)
        return
    # pure: dask would answer a repeated job with its earlier error instead of running it again
    futures = {client.submit(guarded, work, job, pure=False): job for job in jobs}
    done: SimpleQueue[Any] = SimpleQueue()
    for future in futures:
        future.add_done_callback(done.put)
    try:
        for _ in futures:
            future = done.get()
            yield _outcome(future, futures[future])
    finally:
        for future in futures:
            if not future.done():
                future.cancel()


def _outcome(future: Any, job: J) -> Outcome[J, R]:
    """What became of a job. ``guarded`` raises nothing: an exception here is dask's word on its worker or scheduler."""
    try:
        outcome: Outcome[J, R] = future.result()
    except CancelledError as error:
        return Outcome(job, None, GONE, f"{GONE} ({error})", "scheduler_lost")
    except Exception as error:
        return Outcome(job, None, LOST, f"{LOST} ({error!r})", "worker_lost")
    return outcome


def require_cluster(address: str) -> None:
    """Raise UsageError where no dask scheduler answers at an address, or dask is missing; empty: none is asked."""
    if address:
        _client(address).close()


def _client(address: str) -> Any:
    try:
        from distributed import Client

        return Client(address)
    except ImportError:
        raise UsageError([f"--executor {address}: needs dask; pip install wireval[cluster]"]) from None
    except (OSError, ValueError) as error:
        raise UsageError([f"--executor {address}: no dask scheduler answers there ({error})"]) from None


@contextmanager
def _cluster(address: str) -> Iterator[Any]:
    """A client of the dask scheduler at an address; raises UsageError where there is none."""
    with _client(address) as client:
        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # a lost scheduler is told of by each job
        if not client.scheduler_info()["workers"]:
            sys.stderr.write(f"{address}: the scheduler has no worker yet; waiting for one\n")
        yield client
