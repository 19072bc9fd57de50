"""The store of stage results on disk: one file per result, checked by its hash; the least recently used go first.

Where it cannot be read or written, there is a warning and results are computed again; no case fails.
"""

import hashlib
import io
import json
import os
import re
import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from pipeline.model import Curve, Doubt, Lumen
from pipeline.status import FrameStatus
from reports.atomic import replacing, write_text
from solver.grid import Grid, read_only

DEFAULT_LIMIT = 20 * 2**30
"""Bytes: the lumens of about a thousand scans of 256^3 voxels."""
ABANDONED_S = 86400.0
"""Age in seconds from which a temporary file is taken to be left over from a run that was killed."""
OURS = re.compile(r"[0-9a-f]{64}\.result|\.tmp-.*\.result")
"""Names of files of the store."""
NOT_A_RESULT = (ValueError, KeyError, TypeError, EOFError, BadZipFile)

_lumen: dict[Path, Lumen] = {}
"""The lumen that this process read last, by its file: the next point of a sweep asks for it and for its wall, whose
splines and hash are kept with this very object. With 256^3 voxels that saves two seconds a point."""


def forget_lumen() -> None:
    """Drop the lumen in memory: a run does not trust what an earlier run in the same process has read."""
    _lumen.clear()


def default_root() -> Path:
    """``$WIREVAL_CACHE``, else the user's cache folder."""
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(os.environ.get("WIREVAL_CACHE") or Path(home) / "wireval" / "stages")


@dataclass
class Store:
    """Results on disk by key; ``root`` None switches the store off. warn : called with a sentence for the reader."""

    root: Path | None
    warn: Callable[[str], None] = lambda text: None
    _writable: bool = True

    def get(self, stage: str, key: str) -> Lumen | Curve | None:
        """The stored result, or None; one that was cut or altered counts as absent and is removed."""
        if self.root is None:
            return None
        path = self._path(self.root, stage, key)
        if path in _lumen:
            return _lumen[path]
        try:
            result = decoded(stage, key, _content(path))
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            if self._writable:  # else it is said already that the cache is of no use
                self.warn(f"the stored result {path} cannot be read ({error.strerror}): computed again")
            return None
        except NOT_A_RESULT as error:
            self.warn(f"the stored result {path} is not as it was written ({error}): computed again")
            _remove(path)
            return None
        _touch(path)
        if isinstance(result, Lumen):
            forget_lumen()
            _lumen[path] = result
        return result

    def put(self, stage: str, key: str, result: Lumen | Curve) -> None:
        """Store a result. Once one could not be written, no more are stored."""
        if self.root is None or not self._writable:
            return
        try:
            with replacing(self._path(self.root, stage, key)) as temporary:
                temporary.write_bytes(encoded(key, result))
        except OSError as error:
            self._writable = False
            reason = getattr(error.__cause__, "strerror", None) or error
            what = f"{self.root} cannot be written: {reason}; make room or allow writing there"
            self.warn(f"the cache keeps nothing from here on: {what}")

    @staticmethod
    def _path(root: Path, stage: str, key: str) -> Path:
        return root / stage / key[:2] / f"{key}.result"

    def entries(self) -> list[tuple[Path, int, float]]:
        """Path, size in bytes and time of last use of every result and of every temporary file; no other files.

        Files of the user's own in the same folder are thus never removed.
        """
        found = []
        for path in sorted(self.root.glob("*/??/*")) if self.root else ():
            if not OURS.fullmatch(path.name):
                continue
            try:
                known = path.stat()
            except OSError:  # another run has just removed it
                continue
            found.append((path, known.st_size, known.st_mtime))
        return found

    @property
    def limit(self) -> int:
        """Bytes that the store may take."""
        try:
            return int((self.root or Path()).joinpath("limit").read_text(encoding="ascii"))
        except (OSError, ValueError):
            return DEFAULT_LIMIT

    def set_limit(self, size: int) -> None:
        """Remember how many bytes the store may take."""
        if self.root is not None:
            write_text(self.root / "limit", f"{size}\n")

    def trim(self, limit: int | None = None) -> tuple[int, int]:
        """Remove abandoned temporary files and the least recently used results until the rest fits.

        Returns how many files and how many bytes were removed.
        """
        limit = self.limit if limit is None else limit
        entries = sorted(self.entries(), key=lambda entry: entry[2])
        abandoned = time.time() - ABANDONED_S
        excess, removed = sum(size for _, size, _ in entries) - limit, [0, 0]
        for path, size, used in entries:
            temporary = path.name.startswith(".")
            if (excess > 0 and not temporary) or (temporary and used < abandoned):
                _remove(path)
                excess, removed = excess - size, [removed[0] + 1, removed[1] + size]
        return removed[0], removed[1]

    def check(self) -> tuple[int, list[Path]]:
        """Read every result; returns how many are whole, and which are not: they are removed."""
        whole, damaged = 0, []
        for path, _, _ in self.entries():
            if path.name.startswith(".") or path.suffix != ".result":
                continue
            try:
                decoded(path.parent.parent.name, path.stem, _content(path))
                whole += 1
            except (OSError, *NOT_A_RESULT):
                damaged.append(path)
                _remove(path)
        return whole, damaged


def encoded(key: str, result: Lumen | Curve) -> bytes:
    """A result as bytes, preceded by a hash of key and content, so that a change of either is noticed."""
    named = vars(result.distance) if isinstance(result, Lumen) else vars(result)
    arrays: dict[str, Any] = {name: value for name, value in named.items() if isinstance(value, np.ndarray)}
    rest = {name: value for name, value in vars(result).items() if name not in (*arrays, "distance")}
    text = json.dumps(rest, default=lambda part: vars(part) if isinstance(part, Doubt) else part.name)
    file = io.BytesIO()
    np.savez(file, json=np.array(text), **arrays)
    return _seal(key, file.getvalue()) + file.getvalue()


def decoded(stage: str, key: str, content: bytes) -> Lumen | Curve:
    """A result from its bytes; raises one of NOT_A_RESULT where they are not what was written under this key."""
    seal, body = content[:32], content[32:]
    if seal != _seal(key, body):
        raise ValueError("its hash does not fit")
    with np.load(io.BytesIO(body), allow_pickle=False) as data:
        arrays: dict[str, Any] = {name: read_only(data[name]) for name in data.files if name != "json"}
        rest = json.loads(str(data["json"]))
    if stage == "segment":
        return Lumen(Grid(**arrays), **rest | {"warnings": tuple(rest["warnings"])})
    doubts = tuple(Doubt(**doubt | {"status": FrameStatus[doubt["status"]]}) for doubt in rest["doubts"])
    return Curve(**arrays, **rest | {"doubts": doubts})


def _seal(key: str, body: bytes) -> bytes:
    return hashlib.sha256(key.encode() + body).digest()


def _content(path: Path) -> bytes:
    """The bytes of a stored result; ValueError where a folder or a pipe stands in its place."""
    if path.exists() and not path.is_file():
        raise ValueError("it is no regular file")
    return path.read_bytes()


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    with suppress(OSError):
        path.unlink(missing_ok=True)


def _touch(path: Path) -> None:
    """Note that a result was used; its key does not depend on times."""
    with suppress(OSError):
        os.utime(path)
