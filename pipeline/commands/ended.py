"""How a signal ends a command: as an exception, so that its workers are ended and what is finished is kept."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

AGAIN_S = 0.05
"""Seconds after which a signal that Python lost is raised again."""


class Terminated(KeyboardInterrupt):
    """SIGTERM, which a batch system sends before it kills; handled like Ctrl-C."""


@contextmanager
def ended_by_signal() -> Iterator[None]:
    """Let SIGTERM end a command as Ctrl-C does, and let neither be lost.

    A compiled module whose import it ends makes an ImportError of it: that would be exit code 1, to diff a regression.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    told: list[KeyboardInterrupt] = []

    def end(number: int, frame: object) -> None:
        told.append(Terminated() if number == signal.SIGTERM else KeyboardInterrupt())
        raise told[-1]

    # what a script starts in the background ignores Ctrl-C, and goes on to
    listens = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    before = {n: signal.signal(n, end) for n in (signal.SIGTERM, *[signal.SIGINT] * listens)}
    try:
        with _none_lost():
            yield
    except Exception:
        if not told:
            raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if told:
        raise told[-1]


@contextmanager
def _none_lost() -> Iterator[None]:
    """Raise an interruption again that comes while Python cannot raise: beside a fork, in a destructor.

    There its exception is printed and forgotten: one in some hundred commands that were ended at a fork went on to
    their end. A caller's own alarm is left alone where nothing was lost.
    """
    lost: list[BaseException] = []
    alarms: list[Any] = []

    def end_again(number: int, frame: object) -> None:
        raise lost[-1]

    def unraisable(what: "sys.UnraisableHookArgs") -> None:
        if not isinstance(what.exc_value, KeyboardInterrupt):
            hook(what)
            return
        lost.append(type(what.exc_value)())
        alarms.append(signal.signal(signal.SIGALRM, end_again))
        signal.setitimer(signal.ITIMER_REAL, AGAIN_S)

    hook, sys.unraisablehook = sys.unraisablehook, unraisable
    try:
        yield
    finally:
        sys.unraisablehook = hook
        if alarms:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, alarms[0])
