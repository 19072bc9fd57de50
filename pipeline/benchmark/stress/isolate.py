"""Scenes in processes of their own: one that crashes or hangs costs itself alone."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from queue import SimpleQueue

from pipeline.benchmark.stress.plan import draw
from pipeline.benchmark.stress.scene_run import Outcome, run_scene

LIMIT_S = 60.0
"""Processor time beyond which a scene hangs: the work of a depth is limited, the slowest scene takes some 15 s."""
BUSY = 10.0
"""A busy machine gives a process a tenth of a core; one that is silent for longer waits for something."""
START_S = 1200.0
"""Room for compiling the kernels in a new process of a busy machine."""


def limit_processor_time(seconds: float) -> None:
    """Have this process killed after so much more processor time, where the system can; 0 takes that back."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_PROF, seconds)


def _serve(pipe: Connection, seed: int, limit_s: float) -> None:
    """Run scenes as their numbers come in; a warm-up first, so that compiling is on nobody's clock."""
    run_scene(seed, 0)
    pipe.send(None)
    while True:
        index = pipe.recv()
        if index is None:
            return
        limit_processor_time(limit_s)
        outcome = run_scene(seed, index)
        limit_processor_time(0.0)
        pipe.send(outcome)


class Worker:
    """One process, replaced when a scene kills it or runs over its time."""

    def __init__(self, seed: int, limit_s: float = LIMIT_S) -> None:
        self.seed, self.limit_s = seed, limit_s
        self.process: BaseProcess | None = None
        self.pipe: Connection | None = None

    def start(self) -> Connection:
        """The pipe to a running process, a new one where there is none."""
        if self.process is None or self.pipe is None:
            context = multiprocessing.get_context("spawn")
            self.pipe, theirs = context.Pipe()
            self.process = context.Process(target=_serve, args=(theirs, self.seed, self.limit_s), daemon=True)
            self.process.start()
            theirs.close()
            if not self.pipe.poll(START_S):
                msg = f"stress study: the first scene did not end within {START_S:g} s; try scene 0 alone"
                raise RuntimeError(msg)
            self.pipe.recv()
        return self.pipe

    def run(self, index: int) -> Outcome:
        """Run one scene; a crash or a hang is its outcome."""
        pipe = self.start()
        pipe.send(index)
        if not pipe.poll(BUSY * self.limit_s):
            self.stop()
            return _lost(self.seed, index, "hang", f"no answer within {BUSY * self.limit_s:g} s")
        try:
            return pipe.recv()  # type: ignore[no-any-return]
        except EOFError:
            code = self._exit_code()
            self.stop()
            if code is not None and code == -getattr(signal, "SIGPROF", 0):
                return _lost(self.seed, index, "hang", f"no end within {self.limit_s:g} s of processor time")
            return _lost(self.seed, index, "crash", f"the process died, exit code {code}")

    def _exit_code(self) -> int | None:
        """Of a process that closed its pipe: it may take a moment to be gone."""
        if self.process is None:
            return None
        self.process.join(10.0)
        return self.process.exitcode

    def stop(self) -> None:
        """End the process."""
        if self.process is not None:
            self.process.kill()
            self.process.join()
        self.process = self.pipe = None


def _lost(seed: int, index: int, fault: str, detail: str) -> Outcome:
    return Outcome(index, draw(seed, index).axes, fault, fault, detail)


def run_isolated(
    seed: int, indices: Iterable[int], jobs: int = 1, limit_s: float = LIMIT_S
) -> Iterator[Outcome]:
    """Outcomes in the order of the indices, from ``jobs`` processes."""
    free: SimpleQueue[Worker] = SimpleQueue()
    workers = [Worker(seed, limit_s) for _ in range(jobs)]
    for worker in workers:
        free.put(worker)

    def one(index: int) -> Outcome:
        worker = free.get()
        try:
            return worker.run(index)
        finally:
            free.put(worker)

    pool = ThreadPoolExecutor(jobs)
    try:
        # one compiles into the cache, the others read it
        workers[0].start()
        yield from pool.map(one, indices)
    finally:
        # a study that is broken off does not run on to its end
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in workers:
            worker.stop()
