"""Batches: whatever becomes of one job, the others end; every executor gives the same outcomes."""

from __future__ import annotations

import gc
import os
from asyncio import CancelledError
from collections.abc import Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from pipeline.run import batch
from pipeline.run.batch import LOST, run_all
from pipeline.run.launch import imports_set_aside


def work(folder: Path, job: int) -> None:
    """Job 2 raises, job 3 takes its worker with it, job 4 does so the first time."""
    if job == 2:
        msg = "burst pipe"
        raise RuntimeError(msg)
    first = not (folder / "died").exists()
    if job == 3 or (job == 4 and first):
        (folder / "died").touch(exist_ok=True) if job == 4 else None
        os._exit(9)
    (folder / f"done {job}").touch()


def check(outcomes: dict[int, batch.Outcome[int, None]], folder: Path) -> None:
    assert sorted(outcomes) == list(range(8))
    assert outcomes[2].error == "RuntimeError: burst pipe"
    assert "in work" in outcomes[2].log
    assert (outcomes[3].error, outcomes[3].status) == (LOST, "worker_lost")
    assert [job for job, outcome in sorted(outcomes.items()) if not outcome.error] == [0, 1, 4, 5, 6, 7]
    assert sorted(p.name for p in folder.glob("done *")) == [f"done {j}" for j in (0, 1, 4, 5, 6, 7)]


def test_a_worker_that_dies_costs_its_job_alone(tmp_path: Path) -> None:
    check({o.job: o for o in run_all(range(8), partial(work, tmp_path), workers=2)}, tmp_path)


class KilledWorker(Exception):
    """What dask raises for a job whose worker died, by its name."""


class Cluster(Executor):
    """A cluster as run_all sees it: jobs run at once, and a worker's death is an exception of the cluster's own."""

    status = "running"

    def submit(self, function: Any, /, *args: Any, pure: bool = True, **named: Any) -> Future[Any]:
        assert not pure, "dask would not run a job a second time"
        future: Future[Any] = Future()
        run, job = args
        folder = run.args[0]
        if job == 3 or (job == 4 and not (folder / "died").exists()):
            (folder / "died").touch(exist_ok=True) if job == 4 else None
            future.set_exception(KilledWorker(f"job {job} killed its worker"))
        else:
            future.set_result(function(*args, **named))
        return future


def test_a_worker_of_a_cluster_that_dies_costs_its_job_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def cluster(address: str) -> Iterator[Executor]:
        assert address == "tcp://scheduler:8786"
        yield Cluster()

    monkeypatch.setattr(batch, "_cluster", cluster)
    found = run_all(range(8), partial(work, tmp_path), address="tcp://scheduler:8786")
    check({o.job: o for o in found}, tmp_path)


def test_a_scheduler_that_goes_away_ends_what_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """What was handed out is cancelled; what is handed to a client that is closed never comes back."""

    class Gone(Cluster):
        def submit(self, function: Any, /, *args: Any, pure: bool = True, **named: Any) -> Future[Any]:
            future: Future[Any] = Future()
            future.set_exception(CancelledError()) if args[1] else future.set_result(function(*args, **named))
            return future

    monkeypatch.setattr(batch, "_cluster", lambda _: nullcontext(Gone()))
    found = {o.job: o for o in run_all(range(3), abs, address="tcp://scheduler:8786")}
    assert [found[job].status for job in range(3)] == ["ok", "scheduler_lost", "scheduler_lost"]
    monkeypatch.setattr(Gone, "status", "closed")
    assert {o.status for o in run_all(range(3), abs, address="tcp://scheduler:8786")} == {"scheduler_lost"}


def test_one_worker_runs_here_and_in_order(tmp_path: Path) -> None:
    seen: list[int] = []
    outcomes = list(run_all([3, 1, 2], seen.append))
    assert seen == [3, 1, 2]
    assert all(not outcome.error for outcome in outcomes)


def test_while_cases_run_the_collector_passes_over_what_was_imported_and_afterwards_no_more() -> None:
    gc.unfreeze()  # tests are frozen once they are collected
    assert gc.get_freeze_count() == 0
    with imports_set_aside():
        assert gc.get_freeze_count() > 10_000
    assert gc.get_freeze_count() == 0
