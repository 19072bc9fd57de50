"""Worker processes of this machine: each does one job at a time, within limits; if one dies, the others go on.

However this process ends, even without a chance to clean up, its workers end with it.
"""

import fcntl
import gc
import math
import multiprocessing
import os
import resource
import signal
import sys
import tempfile
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import connection, forkserver, resource_tracker
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

from pipeline import THREADS, one_thread
from pipeline.run.outcome import LOST, Outcome, guarded
from pipeline.streams import lasting

J = TypeVar("J")
R = TypeVar("R")
FIRST, PRELOADED = "pipeline.run.with_parent", "pipeline.run.case"
"""Imported once (1.5 s) by the server that workers are forked from."""
PATHS = "PYTHONSAFEPATH", "PYTHONPATH"
SOCKET_FOLDER = 70
"""Longest path, bytes, of a folder for a socket: with the names that are added a path has 107 at most."""
LONGEST_LOOK_S = 2.0
"""Between checks that lie further apart this process was suspended, and its workers with it: so much of it counts."""
LOOK_S = 0.1
"""Seconds between checks of a worker against its limits: for that long it may exceed them."""


class Limits(NamedTuple):
    """The most time and memory that a job may take."""

    seconds: float = math.inf
    memory_mib: float = math.inf

    @property
    def any(self) -> bool:
        """Whether there is a limit at all."""
        return min(self) < math.inf

    def broken(self, seconds: float, peak_mib: float) -> str:
        """A sentence on the limit that is exceeded; empty where none is."""
        if seconds > self.seconds:
            return (
                f"took longer than the {self.seconds:g} s of --case-timeout (peak memory {peak_mib:.0f} MiB); raise it"
            )
        if peak_mib > self.memory_mib:
            return (
                f"took {peak_mib:.0f} MiB of memory, more than the {self.memory_mib:g} MiB of --case-memory; raise it"
            )
        return ""


NO_LIMITS = Limits()


class Worker(Generic[J, R]):
    """A worker process and the job that it is doing."""

    def __init__(self, work: Callable[[J], R]) -> None:
        # one that was killed meanwhile multiprocessing would start again, with as many threads as there are cores
        _start_server()
        context = multiprocessing.get_context("forkserver")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=_serve, args=(theirs, work))
        with _without_main():
            self.process.start()
        theirs.close()
        self._job: list[J] = []
        self._taken_s, self._looked, self._peak_mib = 0.0, 0.0, 0.0

    def give(self, job: J) -> None:
        """Send a job to the process. Should that have died meanwhile, ``outcome`` tells."""
        self._job, self._taken_s, self._looked, self._peak_mib = [job], 0.0, time.monotonic(), 0.0
        with suppress(OSError):
            self.pipe.send(job)

    def outcome(self, ready: bool, limits: Limits) -> Outcome[J, R] | None:
        """The outcome of its job; None while it is still running. ready : the process has sent something, or died."""
        (job,) = self._job
        if ready:
            try:
                outcome: Outcome[J, R] = self.pipe.recv()
            except (EOFError, OSError):
                self.process.join()
                return Outcome(job, None, LOST, f"{LOST} ({_ended(self.process.exitcode)})", "worker_lost")
            return outcome
        self._peak_mib = max(self._peak_mib, resident_mib(self.process.pid))
        now = time.monotonic()
        self._taken_s, self._looked = self._taken_s + min(now - self._looked, LONGEST_LOOK_S), now
        broken = limits.broken(self._taken_s, self._peak_mib)
        if not broken:
            return None
        self.end()
        return Outcome(job, None, broken, broken, "over_limit")

    def end(self) -> None:
        """Kill the process at once. No result is left half written: files get their names when they are complete."""
        self.process.kill()
        self.process.join()
        self.pipe.close()


def in_processes(
    jobs: Sequence[J], work: Callable[[J], R], count: int, limits: Limits = NO_LIMITS
) -> Generator[Outcome[J, R], None, None]:
    """Run jobs in ``count`` processes; yields outcomes as they come, ``worker_lost`` for a job whose worker died.

    The workers are ended however the generator is left.
    """
    waiting, idle, busy = deque(jobs), list[Worker[J, R]](), list[Worker[J, R]]()
    try:
        while waiting or busy:
            while waiting and len(busy) < count:
                try:
                    busy.append(idle.pop() if idle else Worker(work))
                except (EOFError, ConnectionError):
                    why = f"{LOST} (the server that starts workers was killed)"
                    yield Outcome(waiting.popleft(), None, LOST, why, "worker_lost")
                    time.sleep(LOOK_S)  # until it has ended: only then another one is started
                    continue
                busy[-1].give(waiting.popleft())
            ready = connection.wait([worker.pipe for worker in busy], LOOK_S if limits.any or not busy else None)
            for worker in tuple(busy):
                outcome = worker.outcome(worker.pipe in ready, limits)
                if outcome is None:
                    continue
                busy.remove(worker)
                if worker.process.is_alive():
                    idle.append(worker)
                yield outcome
    finally:
        for worker in (*idle, *busy):
            worker.end()


def resident_mib(process: int | None) -> float:
    """Resident memory of a process, MiB; 0 where the process has ended."""
    try:
        pages = Path(f"/proc/{process}/statm").read_text(encoding="ascii").split()[1]
    except (OSError, IndexError):
        return 0.0
    return int(pages) * resource.getpagesize() / 2**20


def _start_server() -> None:
    """Start the server that workers are forked from, unless it runs, with one thread each.

    N times N threads slow each other down.
    """
    before = {name: os.environ.get(name) for name in (*THREADS, *PATHS)}
    one_thread()
    # Python would look in the working folder first, where a user's own pipeline.py may lie
    os.environ.update(
        PYTHONSAFEPATH="1", PYTHONPATH=os.pathsep.join(path for path in sys.path if isinstance(path, str) and path)
    )
    try:
        multiprocessing.get_context("forkserver").set_forkserver_preload([FIRST, PRELOADED])
        resource_tracker.ensure_running()  # it lets signals through again
        with _interrupts_wait(), _short_paths():
            forkserver.ensure_running()
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value


@contextmanager
def _short_paths() -> Iterator[None]:
    """Let the server's socket lie in /tmp where the folder for temporary files has a path too long for a socket's."""
    before = tempfile.gettempdir()
    if len(os.fsencode(before)) > SOCKET_FOLDER:
        tempfile.tempdir = "/tmp"
    try:
        yield
    finally:
        tempfile.tempdir = before


@contextmanager
def _without_main() -> Iterator[None]:
    """Hide the caller's script from a process that is started: it would run that anew, and so call what called it.

    A worker needs nothing that is defined there; multiprocessing asks every script for a guard instead.
    """
    main = sys.modules["__main__"]
    own = dict(vars(main))
    main.__spec__ = None  # multiprocessing asks for it, and for the file where there is none
    vars(main).pop("__file__", None)
    try:
        yield
    finally:
        vars(main).update({name: own[name] for name in ("__spec__", "__file__") if name in own})


@contextmanager
def _interrupts_wait() -> Iterator[None]:
    """Let Ctrl-C wait until the end of a block; processes that are begun in it never hear of it.

    It reaches every process of a terminal, and the server would ignore it only once it has imported everything.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _serve(pipe: Any, work: Callable[[J], R]) -> None:
    """Do one job after the other, until the pipe is closed."""
    # Ctrl-C reaches every process of a terminal; this one is ended by its parent
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    end_with_parent()
    gc.freeze()  # what is imported never becomes garbage: the collector need not go over it in every round
    with lasting(), suppress(EOFError, OSError):
        while True:
            pipe.send(guarded(work, pipe.recv()))


def end_with_parent() -> None:
    """Let the operating system end this process as soon as its parent has ended.

    A watching thread would have to wait for the interpreter lock, which a kernel or a reader may hold for seconds.
    """
    parent = multiprocessing.parent_process()
    assert parent is not None
    signal.signal(signal.SIGIO, signal.SIG_DFL)  # ends the process
    fcntl.fcntl(parent.sentinel, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(parent.sentinel, fcntl.F_SETFL, fcntl.fcntl(parent.sentinel, fcntl.F_GETFL) | os.O_ASYNC)
    if connection.wait([parent.sentinel], 0):
        os._exit(1)


def _ended(code: int | None) -> str:
    return f"signal {-code}, {signal.Signals(-code).name}" if code is not None and code < 0 else f"exit code {code}"
