"""Compiled functions that numba keeps on disk until a source behind them changes.

By itself numba looks at the file of a function alone: after an edit in ``newton`` it would go on running the old code
inside ``minimise``. Here the mark that it compares is a hash of every file of ours that the function's file imports,
directly or through others. ``solver`` and ``data_synthetic`` hold one copy each, since they share no imports.

And numba numbers the files of a function's machine code: of two processes that compiled it for other types at one time,
each might take the number 1, and what was kept for one's types was the other's code from then on.
"""

import functools
import hashlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core import caching

F = TypeVar("F", bound=Callable[..., Any])
PACKAGES = ("solver", "pipeline", "data_synthetic", "reports")
IMPORT = re.compile(r"^\s*(?:from\s+([\w.]+)\s+import\s+(\([^)]*\)|[^\n#]*)|import\s+([\w.]+))", re.MULTILINE)
NAME = re.compile(r"(?<!\bas )\b(?!as\b)\w+")


def _file_of(root: Path, module: str) -> Path | None:
    """The file of a dotted name below ``root``, where it is a module or a package."""
    path = root.joinpath(*module.split("."))
    return next((p for p in (path.with_suffix(".py"), path / "__init__.py") if p.is_file()), None)


@functools.cache
def _imported(file: Path) -> frozenset[Path]:
    """Files of ours that one file imports, wherever in it the import stands."""
    root = next(folder for folder in file.parents if not (folder / "__init__.py").exists())
    found: set[Path | None] = set()
    for package, names, module in IMPORT.findall(file.read_text(encoding="utf-8")):
        if (package or module).partition(".")[0] in PACKAGES:
            parts = [_file_of(root, f"{package}.{name}") for name in NAME.findall(names)]
            # a name that is no module comes from the package itself
            found |= {*parts, _file_of(root, package or module) if None in parts or not parts else None}
    return frozenset(path for path in found if path is not None)


@functools.cache
def sources_of(file: Path) -> tuple[Path, ...]:
    """A file and every file of ours that it imports, directly or through others."""
    seen, left = {file}, [file]
    while left:
        fresh = _imported(left.pop()) - seen
        seen |= fresh
        left += fresh
    return tuple(sorted(seen))


@functools.cache
def hash_of(file: Path) -> str:
    """SHA-256 of the contents of ``sources_of(file)``."""
    digest = hashlib.sha256()
    for path in sources_of(file):
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


_Numbered: Any = caching.IndexDataCacheFile


class _ByTypes(_Numbered):  # type: ignore[misc]
    """Files of machine code that are named by the types, and written before the index names them."""

    def __init__(self, numbered: Any, stamp: str) -> None:
        super().__init__(numbered._cache_path, numbered._index_name.removesuffix(".nbi"), stamp)
        # the version is compared before the index is unpickled, which fails where a class in it has moved since
        self._version: str = f"{numba.__version__} {stamp} by types"

    def save(self, key: tuple[Any, ...], data: Any) -> None:
        """Keep what was compiled for a key: types, processor, hashes of the function's own code."""
        types = hashlib.sha256(repr(key[:2]).encode()).digest()
        name = self._data_name(int.from_bytes(types[:5]))
        self._save_data(name, ((self._source_stamp, key), data))
        self._save_index(self._load_index() | {key: name})

    def load(self, key: tuple[Any, ...]) -> Any:
        """What was kept for a key; None where there is none, or that of another one, or of other sources behind it."""
        whose, data = super().load(key) or (None, None)
        return data if whose == (self._source_stamp, key) else None


def on_disk(**options: Any) -> Callable[[F], F]:
    """``numba.njit(**options)`` whose machine code is kept on disk for as long as no source behind it changes."""

    def decorate(function: F) -> F:
        compiled = numba.njit(cache=True, **options)(function)
        if hasattr(compiled, "_cache"):  # a plain function where NUMBA_DISABLE_JIT is set
            stamp = hash_of(Path(function.__code__.co_filename))
            compiled._cache._cache_file = _ByTypes(compiled._cache._cache_file, stamp)
        return cast(F, compiled)

    return decorate
