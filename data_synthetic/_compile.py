"""Compiled functions that numba keeps on disk until a source behind them changes.

By itself numba looks at the file of a function alone: after an edit in ``newton`` it would go on running the old code
inside ``minimise``. Here the mark that it compares is a hash of every file of ours that the function's file imports,
directly or through others. ``solver`` and ``data_synthetic`` hold one copy each, since they share no imports.
"""

import functools
import hashlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

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


def on_disk(**options: Any) -> Callable[[F], F]:
    """``numba.njit(**options)`` whose machine code is kept on disk for as long as no source behind it changes."""

    def decorate(function: F) -> F:
        compiled = numba.njit(cache=True, **options)(function)
        if hasattr(compiled, "_cache"):  # a plain function where NUMBA_DISABLE_JIT is set
            index, stamp = compiled._cache._cache_file, hash_of(Path(function.__code__.co_filename))
            # the version is compared before the index is unpickled, which fails where a class in it has moved since
            index._version, index._source_stamp = f"{index._version} {stamp}", stamp
        return cast(F, compiled)

    return decorate
