"""One case on several cores: its parts are shared between this process and helpers, which are forked from it.

A fork inherits the lumen, the scan without wire and the compiled kernels, so that they need not be sent. Helpers only
save time: a part that they do not deliver, because one of them died or met an error, is done again in this process,
which then raises that error. Results do not depend on how many helpers there are.
"""

import multiprocessing
import os
import pickle
import signal
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from multiprocessing import connection
from multiprocessing.context import ForkProcess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Generic, TypeVar

import numpy as np

from pipeline.run.workers import end_with_parent

R = TypeVar("R")
Earlier = Callable[[int], R]
"""Returns the result of an earlier part by its number; waits for it where it is not there yet."""
Work = Callable[[int, Earlier[R]], R]
ERROR = "error"
"""The file in which a helper writes the exception that it met."""
LOOK_S = 0.002
"""Seconds between checks for a part that is waited for."""


class _LostError(Exception):
    """A helper has ended before its work was done."""


def nothing(*_: object) -> None:
    """Do nothing: the default of a callback, whatever it is called with."""


def forked(work: Callable[[], object]) -> ForkProcess:
    """Start a forked process that calls ``work`` and no more; it ends with this one."""

    def begin() -> None:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches every process; this one is ended by its parent
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        end_with_parent()
        work()

    process = multiprocessing.get_context("fork").Process(target=begin)
    with warnings.catch_warnings():  # Python 3.12 warns of forking beside threads; a helper takes none of their locks
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    return process


def said(text: str) -> None:
    """Write a line to stderr."""
    sys.stderr.write(text + "\n")


def shared(
    work: Work[R],
    count: int,
    cores: int,
    first: Callable[[], object] = nothing,
    inherited: Sequence[object] = (),
    told: Callable[[str], object] = said,
) -> list[R]:
    """``[work(i, earlier) for i in range(count)]``, parts begun in this order on several cores; no result may be None.

    A part may ask for the results of earlier ones. first : called by this process before it takes part, and only where
    there are helpers.     inherited : large objects that results refer to; every fork has them, so they are not sent.
    told : called with a sentence where helpers failed: why, and how many parts were done without them.
    """
    parts = _Parts(work, count, inherited)
    if min(cores, count) > 1:
        try:
            with TemporaryDirectory(prefix="wireval-") as folder:
                parts.folder = Path(folder)
                parts.share_out(cores - 1, first)
                parts.collect()
        except OSError as error:
            parts.hindrance = str(error)
    left = count - len(parts.own)
    done = parts.in_order()  # a part that failed in a helper is done again and raises its own error
    if parts.hindrance:
        told(f"{parts.hindrance}: {left} of {count} parts were done without help")
    return done


class _Packer(pickle.Pickler):
    """A pickler that writes a number in place of each inherited object, which the receiver has itself."""

    def __init__(self, file: IO[bytes], inherited: Sequence[object]) -> None:
        # only the newest protocol brings read-only arrays back as read-only
        super().__init__(file, protocol=pickle.HIGHEST_PROTOCOL)
        self.numbers = {id(item): number for number, item in enumerate(inherited)}

    def persistent_id(self, item: object) -> int | None:
        """The position of an inherited object in their list; None for all others, which are pickled."""
        return self.numbers.get(id(item))


class _Unpacker(pickle.Unpickler):
    """The unpickler for what ``_Packer`` wrote."""

    def __init__(self, file: IO[bytes], inherited: Sequence[object]) -> None:
        super().__init__(file)
        self.inherited = inherited

    def persistent_load(self, number: int) -> object:
        """This process's own object at that position of the list."""
        return self.inherited[number]


class _Parts(Generic[R]):
    """The parts of a job, each taken by one process; their results are kept here and as files in ``folder``."""

    folder: Path
    hindrance = ""

    def __init__(self, work: Work[R], count: int, inherited: Sequence[object]) -> None:
        self.work, self.count, self.inherited = work, count, inherited
        self.own: dict[int, R] = {}
        self.helpers: list[ForkProcess] = []

    def share_out(self, helpers: int, first: Callable[[], object]) -> None:
        """Do all parts with this many helpers; where a helper is lost, some parts stay undone."""
        # all processes read their next number from one open file, whose read position they share
        turns = os.memfd_create("turns")
        os.write(turns, np.arange(self.count, dtype=np.int32).tobytes())
        os.lseek(turns, 0, os.SEEK_SET)
        try:
            for _ in range(min(helpers, self.count)):
                self.helpers.append(forked(lambda: self._help(turns)))
            first()
            while taken := os.read(turns, 4):
                number = int.from_bytes(taken, sys.byteorder)
                self._keep(number, self.work(number, self.result))
            self._wait()
        except _LostError as error:
            self.hindrance = str(error)
        except Exception as error:
            # an error of a part itself: ``in_order`` repeats the parts in order and so raises the first one
            self.hindrance = f"a part ended with {error!r}"
        finally:
            os.close(turns)
            for helper in self.helpers:
                helper.kill()
                helper.join()

    def collect(self) -> None:
        """Read the results that helpers have written."""
        for number in range(self.count):
            self._known(number)

    def in_order(self) -> list[R]:
        """All results, in order; a part that is still missing is done now."""
        done: list[R] = []
        for number in range(self.count):
            known = self.own.get(number)
            done.append(self.work(number, done.__getitem__) if known is None else known)
        return done

    def result(self, number: int) -> R:
        """The result of a part, waited for; _LostError where a helper has failed meanwhile."""
        while (known := self._known(number)) is None:
            for helper in self.helpers:
                if helper.exitcode:
                    raise self._lost(helper.exitcode)
            time.sleep(LOOK_S)
        return known

    def _known(self, number: int) -> R | None:
        path = self.folder / str(number)
        if number not in self.own and path.exists():
            with path.open("rb") as file:
                self.own[number] = _Unpacker(file, self.inherited).load()
        return self.own.get(number)

    def _keep(self, number: int, result: R) -> None:
        self.own[number] = result
        temporary = self.folder / f".{number}"
        with temporary.open("wb") as file:
            _Packer(file, self.inherited).dump(result)
        temporary.rename(self.folder / str(number))

    def _help(self, turns: int) -> None:
        """Do parts in a helper process until none is left or one fails; its exception goes into the file ERROR."""
        self.helpers = []
        try:
            while taken := os.read(turns, 4):
                number = int.from_bytes(taken, sys.byteorder)
                self._keep(number, self.work(number, self.result))
        except Exception as error:
            (self.folder / ERROR).write_text(repr(error), encoding="utf-8", errors="replace")
            sys.exit(1)

    def _wait(self) -> None:
        """Wait for the helpers; _LostError as soon as one of them fails, since others may wait for its part."""
        waiting: dict[object, ForkProcess] = {helper.sentinel: helper for helper in self.helpers}
        while waiting:
            for sentinel in connection.wait([helper.sentinel for helper in waiting.values()]):
                helper = waiting.pop(sentinel)
                helper.join()
                if helper.exitcode:
                    raise self._lost(helper.exitcode)

    def _lost(self, code: int) -> _LostError:
        """The error that says in words what ended a helper, by its exit code."""
        if code < 0:
            return _LostError(f"a process that helped was ended by {signal.Signals(-code).name} (out of memory?)")
        error = self.folder / ERROR
        return _LostError(f"a process that helped met {error.read_text(encoding='utf-8') if error.exists() else code}")
