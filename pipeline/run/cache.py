"""Content-hash store of stage results: a stage whose inputs have not changed is not computed again.

Key = SHA-256 of stage name, the code that computes it, the stage's own settings and the contents of its inputs. Paths,
times and performance settings never enter it, so moving a study or changing -j recomputes nothing.
"""

from __future__ import annotations

import functools
import hashlib
import json
import os
from dataclasses import asdict, dataclass, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

PIPELINE = Path(__file__).parent.parent
STAGES = (PIPELINE,)
"""Packages whose code may decide what ``segment`` and ``trace`` return: a list of parts would be forgotten, too."""
WHOLE = (PIPELINE, PIPELINE.parent / "solver")
"""Packages whose code may decide what a case returns."""

Arrays = dict[str, NDArray[Any]]


def default_root() -> Path:
    """``$WIREVAL_CACHE``, else the user's cache folder."""
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(os.environ.get("WIREVAL_CACHE") or Path(home) / "wireval" / "stages")


@functools.cache
def code_of(packages: tuple[Path, ...]) -> str:
    """SHA-256 of the sources of some packages, read once a process (a few milliseconds)."""
    digest = hashlib.sha256()
    for package in packages:
        for item in sorted(package.rglob("*.py")):
            digest.update(f"{item.relative_to(package.parent)}\0".encode() + item.read_bytes())
    return digest.hexdigest()


def file_hash(path: Path) -> str:
    """SHA-256 of a file's content; of a folder, of its files' names and contents in order."""
    if path.is_dir():
        digest = hashlib.sha256()
        for item in sorted(p for p in path.rglob("*") if p.is_file()):
            digest.update(f"{item.relative_to(path)}\0{file_hash(item)}\0".encode())
        return digest.hexdigest()
    state = path.stat()
    return _content_hash(path, state.st_size, state.st_mtime_ns)


@functools.cache
def _content_hash(path: Path, _size: int, _mtime_ns: int) -> str:
    """Read a file once a process: the resume check, the stages and every point of a sweep ask for the same gigabyte.

    Size and time only say whether it is still the same file here; the key is its content alone.
    """
    with path.open("rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()


def _plain(value: Any) -> Any:
    if is_dataclass(value) and not isinstance(value, type):
        return _plain(asdict(value))
    if isinstance(value, dict):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    return value if isinstance(value, (str, int, float, bool, type(None))) else str(value)


def key_of(stage: str, *parts: Any) -> str:
    """Key of one stage result."""
    text = json.dumps([stage, code_of(STAGES), _plain(parts)], sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True)
class Store:
    """Results on disk, one file a key; ``root`` None switches the store off."""

    root: Path | None

    def _path(self, stage: str, key: str) -> Path | None:
        return None if self.root is None else self.root / stage / key[:2] / f"{key}.npz"

    def get(self, stage: str, key: str) -> tuple[Arrays, dict[str, Any]] | None:
        """The stored arrays and their JSON part, or None; a damaged entry counts as absent and is removed."""
        path = self._path(stage, key)
        if path is None or not path.exists():
            return None
        try:
            with np.load(path, allow_pickle=False) as data:
                arrays = {name: data[name] for name in data.files if name != "json"}
                return arrays, json.loads(str(data["json"]))
        except (OSError, ValueError, KeyError, EOFError):
            path.unlink(missing_ok=True)
            return None

    def put(self, stage: str, key: str, arrays: Arrays, meta: dict[str, Any]) -> None:
        """Store a result: written beside, then renamed, so that a reader never sees half of it."""
        path = self._path(stage, key)
        if path is None:
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{path.stem}.{os.getpid()}.npz")
        with temporary.open("wb") as handle:
            np.savez(handle, json=np.array(json.dumps(meta)), **arrays)  # type: ignore[arg-type]
        temporary.replace(path)

    def entries(self) -> list[Path]:
        """Every stored result."""
        return sorted(self.root.glob("*/??/*.npz")) if self.root and self.root.exists() else []

    def prune(self) -> tuple[int, int]:
        """Remove every result; returns how many and how many bytes."""
        found = self.entries()
        size = sum(p.stat().st_size for p in found)
        for path in found:
            path.unlink(missing_ok=True)
        return len(found), size
