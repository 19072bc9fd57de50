"""House rules as programs: what a reviewer would otherwise have to look for by hand."""

from __future__ import annotations

import ast
import re
import shutil
import statistics
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("solver", "pipeline", "reports", "data_synthetic")
SOURCES = [p for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py")) if "out" not in p.parts]
MAX_FUNCTION_LINES = 75  # one screen and a half
MAX_KERNEL_LINES = 130  # compiled kernels hold the unrolled arithmetic of one step of an algorithm
TEXTS = [*SOURCES, *ROOT.glob("*.md"), ROOT / "pyproject.toml", ROOT / "requirements.lock", ROOT / "Makefile"]


def functions(path: Path) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield node


def code_lines(node: ast.AST) -> int:
    return (node.end_lineno or 0) - node.lineno + 1  # type: ignore[attr-defined]


def label(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("path", SOURCES, ids=label)
def test_every_module_says_what_it_is_for(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert not text.strip() or ast.get_docstring(ast.parse(text)), "a module starts with a docstring"


@pytest.mark.parametrize("path", SOURCES, ids=label)
def test_functions_stay_readable(path: Path) -> None:
    limit = MAX_KERNEL_LINES if "kernels" in str(path) else MAX_FUNCTION_LINES
    lengths = {node.name: code_lines(node) for node in functions(path)}
    long = [f"{name}: {count} lines" for name, count in lengths.items() if count > limit]
    assert not long, f"split these, or say in the issue why not: {long}"


def test_most_functions_are_small() -> None:
    lengths = sorted(code_lines(node) for path in SOURCES for node in functions(path))
    assert statistics.median(lengths) <= 16, "the median function (docstring included)"
    assert lengths[int(0.9 * len(lengths))] <= 45, "nine of ten functions"


def test_most_files_are_small() -> None:
    assert statistics.median(len(path.read_text(encoding="utf-8").splitlines()) for path in SOURCES) <= 150


@pytest.mark.parametrize("path", TEXTS, ids=label)
def test_texts_name_no_machine(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    found = re.findall(r"(?:/work/|/tmp/|/root/|/home/)\S*|(?<!emit-)index-url|pypi\.org/simple", text)
    assert not found, "paths of one machine and registry hosts do not belong into the project"


def test_help_imports_nothing_heavy() -> None:
    """`wireval --help` must be instant: the command line imports a command's modules inside the command."""
    code = "import sys, pipeline.cli; pipeline.cli._parser(); print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, encoding="utf-8", check=True, cwd=ROOT
    )
    assert not {"numpy", "SimpleITK", "numba", "matplotlib", "pandas"} & set(done.stdout.split())


@pytest.mark.skipif(
    shutil.which("lint-imports", path=str(Path(sys.executable).parent)) is None, reason="no import-linter"
)
def test_the_arrows_of_the_star() -> None:
    program = Path(sys.executable).parent / "lint-imports"
    done = subprocess.run([program], capture_output=True, encoding="utf-8", cwd=ROOT, check=False)
    assert done.returncode == 0, done.stdout
