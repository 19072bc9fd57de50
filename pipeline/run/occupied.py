"""Two runs in one folder: a run locks the case that it works on; another run says who holds it, and waits."""

import fcntl
import os
import platform
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import TextIO

from reports.atomic import writing

FILE = ".at-work"


@contextmanager
def held(folder: Path, say: Callable[[str], None]) -> Iterator[None]:
    """Lock a case's folder for a block; where another run holds it, say so and wait until that lets go or has ended.

    The operating system releases the lock of a process that has died, however it died.
    """
    with writing(folder / FILE):
        folder.mkdir(parents=True, exist_ok=True)
        file = _locked(folder / FILE, say)
        file.truncate(0)
        file.write(f"process {os.getpid()} on {platform.node()}, since {datetime.now(UTC):%Y-%m-%d %H:%M:%S} UTC")
        file.flush()
    try:
        yield
    finally:
        with suppress(OSError):
            (folder / FILE).unlink(missing_ok=True)
        file.close()


def owner_of(folder: Path) -> str:
    """Who works on a case at the moment; empty where nobody does."""
    with suppress(OSError):
        file = _opened(folder / FILE, os.O_RDONLY)
        if file is not None:
            with file:
                return "" if _lock(file, fcntl.LOCK_NB) else file.read() or "another run"
    return ""


def _locked(path: Path, say: Callable[[str], None]) -> TextIO:
    """The locked file; tried again where the run that held it before has removed the file meanwhile."""
    while True:
        file = _own(path)
        if not _lock(file, fcntl.LOCK_NB):
            file.seek(0)
            say(f"{file.read() or 'another run'} is at work on this case; waiting for it")
            _lock(file, 0)
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file.fileno()), path.stat()):
                return file
        file.close()


def _own(path: Path) -> TextIO:
    """The file, open to be written; what else has its name (a link, a pipe, a user's file once more) loses it."""
    while True:
        if path.is_symlink():
            path.unlink(missing_ok=True)
        file = _opened(path, os.O_RDWR | os.O_CREAT | os.O_APPEND)
        if file is not None:
            return file
        path.unlink(missing_ok=True)


def _opened(path: Path, how: int) -> TextIO | None:
    """A regular file, open; None for anything else, and for one with another name, under which it is somebody's."""
    number = os.open(path, how | os.O_NONBLOCK | os.O_NOFOLLOW, 0o666)  # a pipe would block, a link leads anywhere
    found = os.fstat(number)
    if stat.S_ISREG(found.st_mode) and found.st_nlink <= 1:
        return os.fdopen(number, "a+" if how & os.O_RDWR else "r", encoding="utf-8", errors="replace")
    os.close(number)
    return None


def _lock(file: TextIO, how: int) -> bool:
    """Whether the lock was taken. True, too, on a disk without locks: files are always replaced whole anyway."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | how)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True
