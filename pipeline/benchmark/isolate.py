"""Run work in a process of its own, so that a crash or a hang affects nothing else."""

import multiprocessing
import signal
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import TypeVar

Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Lost:
    """Work that gave no answer. fault : "crash" or "hang".     reason : in words."""

    fault: str
    reason: str


def alone(method: str, work: Callable[[], Answer], wall_s: float, processor_s: float = 0.0) -> Answer | Lost:
    """Call a function in a new process, which is killed after a limit; returns its answer, or Lost.

    method : "fork", which inherits all that is loaded here, or "spawn", which starts with nothing.
    wall_s : limit in seconds of wall-clock time.     processor_s : limit in seconds of processor time, kept by the
    system; 0 is no limit.
    """
    context = multiprocessing.get_context(method)
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(theirs, processor_s, work))  # type: ignore[attr-defined]
    process.start()
    theirs.close()
    try:
        if ours.poll(wall_s):
            return ours.recv()  # type: ignore[no-any-return]
        return Lost("hang", f"no answer within {wall_s:g} s")
    except EOFError:
        process.join()
        if process.exitcode == -signal.SIGPROF:
            return Lost("hang", f"no end within {processor_s:g} s of processor time")
        return Lost("crash", f"the process died, exit code {process.exitcode}")
    finally:
        process.kill()
        process.join()


def _answer(pipe: Connection, processor_s: float, work: Callable[[], object]) -> None:
    """Send what the work returns, or in words what it raises; Ctrl-C is left to the waiting process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.setitimer(signal.ITIMER_PROF, processor_s)
    try:
        pipe.send(work())
    except Exception as error:
        pipe.send(Lost("crash", f"{type(error).__name__}: {error}"))
