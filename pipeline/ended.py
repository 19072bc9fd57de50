"""How a signal ends a command: as an exception, so that its workers are ended and what is finished is kept."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

AGAIN_S = 0.05
"""Seconds after which a signal that Python lost is raised again."""


class Terminated(KeyboardInterrupt):
    """SIGTERM, which a batch system sends before it kills; handled like Ctrl-C."""


@contextmanager
def ended_by_signal() -> Iterator[None]:
    """Let SIGTERM end a command as Ctrl-C does, and let neither be lost.

    Where a signal comes while Python cannot raise (in what it calls beside a fork, in a destructor) its exception is
    printed and forgotten: one in some hundred commands that were ended at a fork went on to their end.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(number: int, frame: object) -> None:
        raise Terminated

    lost: list[BaseException] = []

    def end_again(number: int, frame: object) -> None:
        raise lost[-1]

    def unraisable(what: "sys.UnraisableHookArgs") -> None:
        if not isinstance(what.exc_value, KeyboardInterrupt):
            hook(what)
            return
        lost.append(type(what.exc_value)())
        signal.setitimer(signal.ITIMER_REAL, AGAIN_S)

    hook, sys.unraisablehook = sys.unraisablehook, unraisable
    before = {
        number: signal.signal(number, act) for number, act in ((signal.SIGTERM, end), (signal.SIGALRM, end_again))
    }
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        for number, way in before.items():
            signal.signal(number, way)
        sys.unraisablehook = hook
