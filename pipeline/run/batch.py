"""Many cases: sharding, an executor seam, and a worker's death costing one case.

Any ``concurrent.futures.Executor`` will do; locally a process pool, elsewhere ``dask.distributed``'s. A case writes
its own folder and nobody writes to a shared file, so shards on different machines merge with ``cp -r``.
"""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from pipeline.run import results
from pipeline.run.case import Job, run_case

THREADS = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "NUMBA_NUM_THREADS",
    "ITK_GLOBAL_DEFAULT_NUMBER_OF_THREADS",
)


def shard_of(ids: Sequence[str], index: int, count: int) -> list[str]:
    """Cases of shard ``index`` (1-based) of ``count``: every count-th of the sorted ids."""
    return sorted(ids)[index - 1 :: count]


def run_jobs(jobs: Sequence[Job], workers: int, address: str = "") -> None:
    """Run all jobs; with one worker in this process, else in a pool, or on a dask cluster at ``address``."""
    if address:
        _run_on_cluster(jobs, address)
    elif workers == 1 or len(jobs) < 2:
        for job in jobs:
            _guarded(job)
    else:
        _run_in_pool(jobs, workers)


def _guarded(job: Job) -> None:
    """A bug in one case must not take the batch along: it becomes that case's failure, with the traceback logged."""
    try:
        run_case(job)
    except Exception as error:
        record_crash(job, f"{type(error).__name__}: {error}", error)


def record_crash(job: Job, reason: str, error: BaseException | None = None) -> None:
    """Write the result of a case that could not be finished."""
    import traceback

    job.folder.mkdir(parents=True, exist_ok=True)
    with (job.folder / "log.txt").open("a", encoding="utf-8") as handle:
        handle.write("".join(traceback.format_exception(error)) if error else reason + "\n")
    status = "crashed"
    sentence = "the case ended in an unexpected error; its log has the traceback"
    row: dict[str, Any] = {
        "case": job.case.id,
        "group": job.case.group,
        "role": job.case.role,
        "status": status,
    }
    count = job.case.frame_count
    row |= {"frames": count, "frames_ok": 0, "frames_failed": count}
    failure = {"case": job.case.id, "status": status, "sentence": sentence, "message": reason}
    failure["log"] = f"cases/{job.case.id}/log.txt"
    result = {
        "schema": 1,
        "case": job.case.id,
        "status": status,
        "sentence": sentence,
        "frames": [],
        "summary": row,
    }
    results.write_json(job.folder / "result.json", result | {"failures": [failure], "key": ""})


def _single_thread() -> None:
    """Workers take one core each: N processes of N threads slow each other down."""
    for name in THREADS:
        os.environ[name] = "1"


def _pool(workers: int) -> ProcessPoolExecutor:
    context = multiprocessing.get_context("forkserver")
    return ProcessPoolExecutor(workers, mp_context=context, initializer=_single_thread)


def _run_in_pool(jobs: Sequence[Job], workers: int) -> None:
    """All jobs in one pool; when a worker dies the pool breaks, and what was left runs again, each job alone."""
    left = {job.case.id: job for job in jobs}
    with _pool(min(workers, len(jobs))) as pool:
        _collect(pool, _by_size(jobs), left)
    for job in list(left.values()):
        with _pool(1) as alone:
            _collect(alone, [job], left)
        if job.case.id in left:
            record_crash(job, "the worker process was killed (out of memory?); run this case alone with -j 1")


def _by_size(jobs: Sequence[Job]) -> list[Job]:
    """Longest first, so that no long case is left for the end."""
    return sorted(jobs, key=lambda job: -job.case.frame_count)


def _collect(pool: Executor, jobs: Sequence[Job], left: dict[str, Job]) -> None:
    futures: dict[Any, Job] = {}
    try:
        futures = {pool.submit(_guarded, job): job for job in jobs}
        for future in as_completed(futures):
            future.result()
            left.pop(futures[future].case.id, None)
    except BrokenProcessPool:
        return


def _run_on_cluster(jobs: Sequence[Job], address: str) -> None:
    from distributed import Client

    with Client(address) as client:
        left = {job.case.id: job for job in jobs}
        _collect(client.get_executor(), _by_size(jobs), left)
