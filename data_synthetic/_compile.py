"""Compiled functions that numba keeps on disk until a source behind them changes.

By itself numba looks at the file of a function alone: after an edit in ``newton`` it would go on running the old code
inside ``minimise``. Here the mark that it compares is a hash of every file of ours that the function's file imports,
directly or through others. ``solver`` and ``data_synthetic`` hold one copy each, since they share no imports.

And numba numbers the files of a function's machine code: of two processes that compiled it for other types at one time,
each might take the number 1, and what was kept for one's types was the other's code from then on.

A function that only compiled code calls is optimised and turned into machine code where it is called from Python in
the end (``part_of_callers``), not once more at every step of the way, which took a third of the time of compiling.
"""

import functools
import hashlib
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn, TypeVar, cast

import numba
from llvmlite import binding
from numba.core import caching, codegen, compiler, types

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
        # without docstrings (-OO) numba's key is another one: each would take the other's file, and compile it anew
        types = hashlib.sha256(repr((key[:2], sys.flags.optimize)).encode()).digest()
        name = self._data_name(int.from_bytes(types[:5]))
        self._save_data(name, ((self._source_stamp, key), data))
        self._save_index(self._load_index() | {key: name})

    def load(self, key: tuple[Any, ...]) -> Any:
        """What was kept for a key; None where there is none, or that of another one, or of other sources behind it."""
        whose, data = super().load(key) or (None, None)
        return data if whose == (self._source_stamp, key) else None


_Code: Any = codegen.JITCodeLibrary
_Compiler: Any = compiler.Compiler
_types: Any = types


class _Part(_Code):  # type: ignore[misc]
    """Code of a function that only compiled code calls: callers take it in as it stands and optimise it with their own.

    By itself numba optimises it and makes machine code of it, and does both again in every caller of it and in theirs,
    up to the one that Python calls: the only machine code that ever runs.
    """

    def _optimize_final_module(self) -> None:
        self._finalized = True  # enough so for callers
        code = self._get_module_for_linking()
        # numba puts a function's environment where machine code has it
        text = "\n".join(str(v) for v in code.global_variables if v.name.startswith("_ZN08NumbaEnv"))
        self._final_module = binding.parse_assembly(text)
        self._final_module.name = self.name


class _PartCompiler(_Compiler):  # type: ignore[misc]
    """Compile a function as a ``_Part``."""

    def _compile_bytecode(self) -> Any:
        state = self.state
        state.library = _Part(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return super()._compile_bytecode()


def on_disk(**options: Any) -> Callable[[F], F]:
    """``numba.njit(**options)`` whose machine code is kept on disk for as long as no source behind it changes."""

    def decorate(function: F) -> F:
        compiled = numba.njit(cache=True, **options)(function)
        if hasattr(compiled, "_cache"):  # a plain function where NUMBA_DISABLE_JIT is set
            stamp = hash_of(Path(function.__code__.co_filename))
            compiled._cache._cache_file = _ByTypes(compiled._cache._cache_file, stamp)
        return cast(F, compiled)

    return decorate


def part_of_callers(how: Callable[..., Any] = numba.njit, **options: Any) -> Callable[[F], F]:
    """``numba.njit(**options)`` for a function that only compiled code calls; ``how`` may be ``on_disk``.

    It becomes machine code in its callers alone, without what Python would call it by: unpacking forty arrays takes
    as long to compile as what is done with them.
    """
    options = dict(options, no_cpython_wrapper=True, no_cfunc_wrapper=True, pipeline_class=_PartCompiler)

    def decorate(function: F) -> F:
        compiled: Any = how(**options)(function)
        if compiled is function:  # NUMBA_DISABLE_JIT is set
            return function
        template = compiled.get_call_template

        def add(overload: Any) -> None:
            compiled.overloads[tuple(overload.signature.args)] = overload

        def refuse(*_: object, **__: object) -> NoReturn:
            message = f"{function.__name__} is for compiled code: call an entry point, or write one in a test"
            raise TypeError(message)

        def unliteral(args: tuple[Any, ...], kws: Any) -> Any:
            return template(tuple(_types.unliteral(arg) for arg in args), kws)

        # numba would list the overload for Python all the same, and a call from there would end the process
        compiled.add_overload, compiled._compile_for_args = add, refuse
        # a literal argument is a type of its own to numba, and would compile the function once more
        compiled.get_call_template = unliteral
        return cast(F, compiled)

    return decorate
