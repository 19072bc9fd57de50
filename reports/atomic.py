"""Every file is written to a temporary name beside its place, then renamed: nobody reads half a file."""

import os
import platform
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

HOST = re.sub(r"\W+", "_", platform.node())[:30]


class WriteError(OSError):
    """A file cannot be written: the disk is full, a quota used up, the folder read-only. Its text says which."""


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """What the system says about writing ``path`` becomes a WriteError that names it and says what to do."""
    try:
        yield
    except WriteError:
        raise
    except OSError as error:
        reason = error.strerror or str(error)
        do = "remove this folder, or give it another name" if path.is_dir() else "make room or allow writing there"
        do = "its folder is gone: leave it in its place" if isinstance(error, FileNotFoundError) else do
        what = f"{path}: cannot be written: {reason}; {do}"
        raise WriteError(f"{what}, then give the same command again: what is finished is kept") from error


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder with the same suffixes; rename it to ``path`` on success.

    The folder is made if needed. On an exception the temporary file is removed and ``path`` is as it was. Raises
    WriteError where the system refuses.
    """
    # the number of a process is not enough: in two containers that share a disk, both runs may be process 1
    temporary = path.with_name(f".tmp-{HOST}-{os.getpid()}-{secrets.token_hex(4)}-{path.name[-80:]}")
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            yield temporary
            temporary.replace(path)
        finally:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)


def remove_files(*paths: Path) -> None:
    """Remove files that are there; WriteError where the system refuses, and of a folder."""
    for path in paths:
        with writing(path):
            path.unlink(missing_ok=True)


def remove_leftovers(folder: Path) -> None:
    """Remove temporary files that processes of this machine which are no more have left in a folder."""
    for path in folder.glob(f".tmp-{HOST}-*"):
        owner = path.name.removeprefix(f".tmp-{HOST}-").partition("-")[0]
        if owner.isdigit() and not _alive(int(owner)):
            with suppress(OSError):
                path.unlink(missing_ok=True)


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:  # somebody else's
        return True
    return True


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text with unix line ends."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write the bytes of a whole file."""
    with replacing(path) as temporary:
        temporary.write_bytes(content)
