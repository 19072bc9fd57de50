"""SHA-256 of files' contents, for cache keys: each file is read once per process, with several cores in parallel."""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from multiprocessing.context import ForkProcess
from pathlib import Path

from pipeline.load import parts_of
from pipeline.run.helpers import forked, nothing
from pipeline.study.sources import State, state_of

_hashes: dict[tuple[Path, State | None], str] = {}
"""Hashes by path and state of the file, since resume check, stages and sweep points ask for the same gigabyte.

The state only tells whether the file is still the same; the hash is of its content alone."""


def file_hash(path: Path) -> str:
    """SHA-256 of a file's content and of the files that hold its voxels; of a folder, of its files in order."""
    if path.is_dir():
        hasher = hashlib.sha256()
        for item in sorted(p for p in path.rglob("*") if p.is_file()):
            hasher.update(f"{item.relative_to(path)}\0{file_hash(item)}\0".encode())
        return hasher.hexdigest()
    hashes = [_content_hash(part) for part in (path, *parts_of(path))]
    return hashes[0] if len(hashes) == 1 else hashlib.sha256("".join(hashes).encode()).hexdigest()


def _content_hash(path: Path) -> str:
    """SHA-256 of one file."""
    same = path, state_of(path)
    if same not in _hashes:
        with path.open("rb") as handle:
            _hashes[same] = hashlib.file_digest(handle, "sha256").hexdigest()
    return _hashes[same]


@contextmanager
def hashing(paths: Sequence[Path], cores: int) -> Iterator[Callable[[], None]]:
    """Hash files, with several cores in other processes while this one goes on; yields a function that waits for them.

    A thread would need the interpreter lock for every quarter of a megabyte, and kernels hold it for tenths of seconds:
    0.75 s of hashing took 7 s, most of the time that there was to hide it in.
    """
    if cores == 1:
        _hash_all(paths)
        yield nothing
        return
    count = min(cores - 1, len(paths))
    others = [_begun(paths[i::count]) for i in range(count)]

    def wait() -> None:
        """Receive all hashes; files of a process that sent none are hashed here, which raises their errors."""
        while others:
            receiver, process = others.pop()
            with suppress(EOFError), receiver:
                _hashes.update(receiver.recv())
            process.join()
        _hash_all(paths)

    try:
        yield wait
    finally:
        for receiver, process in others:
            receiver.close()
            process.kill()
            process.join()


def _hash_all(paths: Sequence[Path]) -> None:
    for path in paths:
        file_hash(path)


def _begun(paths: Sequence[Path]) -> tuple[Connection, ForkProcess]:
    """The connection through which a new process sends the hashes of files, and the process."""
    receiver, sender = Pipe(duplex=False)
    with sender:
        return receiver, forked(lambda: _tell(paths, sender))


def _tell(paths: Sequence[Path], sender: Connection) -> None:
    _hash_all(paths)
    sender.send(_hashes)
