"""House rules as programs: what a reviewer would otherwise have to look for by hand."""

from __future__ import annotations

import ast
import graphlib
import re
import shutil
import statistics
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("solver", "pipeline", "reports", "data_synthetic")
SOURCES = [p for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py")) if "out" not in p.parts]
MAX_LINES, MAX_ARGUMENTS = 40, 7
LONG = {"solver/_kernels/newton.py:sweep": "parted, the compiler fuses other operations: the last bit differs"}
MANY_ARGUMENTS = {
    "solver/relax.py:relax": "public contract",
    "solver/insertion.py:__init__": "public contract",
    "pipeline/trace/__init__.py:trace": "public contract",
}
"""Functions beyond the limits, each with its reason; an entry that is not needed any more is an error."""
TEXTS = [*SOURCES, *ROOT.glob("*.md"), ROOT / "pyproject.toml", ROOT / "requirements.lock", ROOT / "Makefile"]


def functions(path: Path) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield node


def code_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    return (node.end_lineno or 0) - node.lineno + 1


def argument_count(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    return sum(argument.arg not in {"self", "cls"} for argument in given)


def beyond(paths: Sequence[Path], measure: Callable[[ast.FunctionDef], int], limit: int) -> dict[str, int]:
    found = {f"{label(path)}:{node.name}": measure(node) for path in paths for node in functions(path)}
    return {name: count for name, count in found.items() if count > limit}


def label(path: Path) -> str:
    return str(path.relative_to(ROOT) if path.is_relative_to(ROOT) else path)


def test_every_module_says_what_it_is_for() -> None:
    texts = {label(path): path.read_text(encoding="utf-8") for path in SOURCES}
    silent = [name for name, text in texts.items() if text.strip() and not ast.get_docstring(ast.parse(text))]
    assert not silent, "a module starts with a docstring"


def test_functions_stay_readable() -> None:
    assert set(beyond(SOURCES, code_lines, MAX_LINES)) == set(LONG), "split these, or say in LONG why not"
    assert set(beyond(SOURCES, argument_count, MAX_ARGUMENTS)) == set(MANY_ARGUMENTS), "named tuples, as the kernels do"


def test_the_limits_bite(tmp_path: Path) -> None:
    path = tmp_path / "grown.py"
    path.write_text("def grown(a, b, c, d, e, f, g, *, h):\n" + "    a += 1\n" * MAX_LINES, encoding="utf-8")
    assert list(beyond([path], code_lines, MAX_LINES).values()) == [MAX_LINES + 1]
    assert list(beyond([path], argument_count, MAX_ARGUMENTS).values()) == [MAX_ARGUMENTS + 1]
    path.write_text("def small(a, b, c, d, e, f, g):\n" + "    a += 1\n" * (MAX_LINES - 1), encoding="utf-8")
    assert not beyond([path], code_lines, MAX_LINES) | beyond([path], argument_count, MAX_ARGUMENTS)


def test_most_functions_are_small() -> None:
    lengths = sorted(code_lines(node) for path in SOURCES for node in functions(path))
    assert statistics.median(lengths) <= 13, "the median function (docstring included)"
    assert lengths[int(0.9 * len(lengths))] <= 30, "nine of ten functions"


def test_most_files_are_small() -> None:
    lengths = {label(path): len(path.read_text(encoding="utf-8").splitlines()) for path in SOURCES}
    assert statistics.median(lengths.values()) <= 150
    assert max(lengths.values()) <= 300, max(lengths, key=lambda name: lengths[name])


def test_texts_name_no_machine() -> None:
    machine = re.compile(r"(?:/work/|/tmp/|/root/|/home/)\S*|(?<!emit-)index-url|pypi\.org/simple")
    found = {label(path): machine.findall(path.read_text(encoding="utf-8")) for path in TEXTS}
    named = {name: words for name, words in found.items() if words}
    assert not named, "paths of one machine and registry hosts do not belong into the project"


def test_a_stated_bound_is_the_bound() -> None:
    """numpy adds 1e-7 of the value to ``atol`` unless told otherwise: 6e-6 mm of a wire beside a bound of 1e-9."""
    wrong = []
    for path in sorted((ROOT / "tests").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and "assert_allclose" in ast.unparse(node.func):
                given = {keyword.arg for keyword in node.keywords}
                if "atol" in given and "rtol" not in given and len(node.args) < 3:
                    wrong.append(f"{path.relative_to(ROOT)}:{node.lineno}")
    assert not wrong, "say rtol, too"


@pytest.mark.parametrize("words", [["--help"], ["--version"]])
def test_help_and_version_import_nothing_heavy(words: list[str]) -> None:
    """They must be instant: the command line imports a command's modules inside the command."""
    last = "atexit.register(lambda: print(*sys.modules))"
    code = f"import atexit, sys; {last}; from pipeline.cli import main; main({words})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True, cwd=ROOT)
    assert not {"numpy", "SimpleITK", "numba", "matplotlib", "pandas"} & set(done.stdout.split())


def test_no_module_imports_itself_through_others() -> None:
    """Imports inside functions count, too."""
    graph = grimp.build_graph(*PACKAGES, cache_dir=None)
    order = graphlib.TopologicalSorter({m: graph.find_modules_directly_imported_by(m) for m in graph.modules})
    assert list(order.static_order()), "CycleError names the circle"


@pytest.mark.skipif(
    shutil.which("lint-imports", path=str(Path(sys.executable).parent)) is None, reason="no import-linter"
)
def test_the_arrows_of_the_star() -> None:
    program = Path(sys.executable).parent / "lint-imports"
    done = subprocess.run([program], capture_output=True, encoding="utf-8", cwd=ROOT, check=False)
    assert done.returncode == 0, done.stdout
