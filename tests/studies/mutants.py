"""Do the tests notice? Random small changes of product lines, each against the tests: ``make mutants``.

A change is drawn with a fixed seed: a comparison, a sum, a product, a condition, a truth value or a number of one line
becomes its neighbour. One run of the tests with coverage tells which of them execute the line: the quickest of these
run first, up to the first that fails. Kernels, which coverage does not see, have the tests that name them or what is
around them. A change that none of its tests fails on has survived, and is printed to be looked at.
"""

from __future__ import annotations

import argparse
import ast
import copy
import json
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("pipeline", "reports", "data_synthetic", "solver")
NEIGHBOUR: dict[type, type] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Add: ast.Sub, ast.Sub: ast.Add,
    ast.Mult: ast.Div, ast.Div: ast.Mult, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
LIMIT_S = 1800
FEW, MOST = 8, 200


@dataclass(frozen=True)
class Mutant:
    """One changed expression. start, end : its place in the file's text."""

    file: str
    line: int
    start: int
    end: int
    before: str
    after: str

    def apply(self, text: str) -> str:
        return text[: self.start] + self.after + text[self.end :]


def changed(node: ast.AST) -> ast.AST | None:
    """The node's neighbour; None for a kind of node that has none."""
    new = copy.deepcopy(node)
    if isinstance(new, ast.Compare) and type(new.ops[0]) in NEIGHBOUR:
        new.ops[0] = NEIGHBOUR[type(new.ops[0])]()
    elif isinstance(new, (ast.BinOp, ast.BoolOp)) and type(new.op) in NEIGHBOUR:
        new.op = NEIGHBOUR[type(new.op)]()
    elif isinstance(new, ast.UnaryOp) and isinstance(new.op, ast.Not):
        return new.operand
    elif isinstance(new, ast.Constant) and isinstance(new.value, bool):
        new.value = not new.value
    elif isinstance(new, ast.Constant) and isinstance(new.value, (int, float)):
        new.value += 1
    else:
        return None
    return new


def mutants_of(path: Path) -> Iterator[Mutant]:
    """Every change of a file's functions; types, decorators and defaults' annotations are no behaviour."""
    text = path.read_text(encoding="utf-8")
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    functions = [n for n in ast.walk(ast.parse(text)) if isinstance(n, (ast.FunctionDef, ast.AsyncFunctionDef))]
    seen = set()
    for node in (inner for function in functions for statement in function.body for inner in ast.walk(statement)):
        # columns count bytes: a file with other letters than ASCII's is left out
        new = changed(node) if isinstance(node, ast.expr) and text.isascii() else None
        if new is None or not isinstance(node, ast.expr) or (node.lineno, node.col_offset, type(node)) in seen:
            continue
        seen.add((node.lineno, node.col_offset, type(node)))
        start = starts[node.lineno - 1] + node.col_offset
        end = starts[(node.end_lineno or node.lineno) - 1] + (node.end_col_offset or 0)
        name = path.relative_to(ROOT).as_posix()
        yield Mutant(name, node.lineno, start, end, text[start:end], ast.unparse(new))


@dataclass(frozen=True)
class Executed:
    """Which tests execute a line, by file and line, and how long each takes, s."""

    tests: dict[str, dict[str, list[str]]]
    seconds: dict[str, float]

    def of(self, mutant: Mutant) -> list[str]:
        """The tests that execute a mutant's line, the quickest first."""
        found = self.tests.get(mutant.file, {}).get(str(mutant.line), [])
        return sorted(found, key=lambda test: self.seconds.get(test, 0.0))


def executed(site: str, tests: list[str], kept: Path) -> Executed:
    """From one run of the tests with coverage, which is kept."""
    if not kept.exists():
        with tempfile.TemporaryDirectory() as folder:
            pytest = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "tests.studies.covering"]
            env = os.environ | {"PYTHONPATH": site, "COVERING": f"{folder}/data", "COVERAGE_CORE": "ctrace"}
            words = [*pytest, f"--junit-xml={folder}/junit.xml", *tests]
            subprocess.run(words, cwd=ROOT, env=env, stdout=subprocess.DEVNULL, check=False)
            kept.parent.mkdir(parents=True, exist_ok=True)
            kept.write_text(json.dumps(read_run(Path(folder), site)), encoding="utf-8")
    return Executed(**json.loads(kept.read_text(encoding="utf-8")))


def read_run(folder: Path, site: str) -> dict[str, Any]:
    """What a run with coverage left in a folder, as ``Executed`` has it."""
    sys.path.append(site)
    import coverage

    (path,) = folder.glob("data*")
    data = coverage.CoverageData(str(path))
    data.read()
    found: dict[str, dict[str, list[str]]] = {}
    for file in data.measured_files():
        lines = {str(line): [c for c in contexts if c] for line, contexts in data.contexts_by_lineno(file).items()}
        found[Path(file).relative_to(ROOT).as_posix()] = lines
    cases = ET.parse(folder / "junit.xml").getroot().iter("testcase")
    return {"tests": found, "seconds": {name_of(case): float(case.get("time", "0")) for case in cases}}


def name_of(case: ET.Element) -> str:
    """The node of a test in a JUnit file."""
    return f"{case.get('classname', '').replace('.', '/')}.py::{case.get('name')}"


def tests_of(file: str) -> list[str]:
    """For a line that no coverage sees, a kernel's: files that name the module or what is around it, nearest first."""
    module = file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    found: list[str] = []
    near = [p for p in sorted((ROOT / "tests").rglob("test_*.py")) if not {"studies", "bench"} & {*p.parts}]
    while "." in module:
        package, _, name = module.rpartition(".")
        wanted = re.compile(rf"{re.escape(module)}\b|from {re.escape(package)} import .*\b{name}\b")
        named = (str(p.relative_to(ROOT)) for p in near if wanted.search(p.read_text(encoding="utf-8")))
        found += [name for name in named if name not in found]
        module = package
    return found or [f"tests/{module}"]


def killed(mutant: Mutant, tree: Path, known: Executed) -> str:
    """The tests that noticed it, by how they were found; empty where none did."""
    path = tree / mutant.file
    text = path.read_text(encoding="utf-8")
    path.write_text(mutant.apply(text), encoding="utf-8")
    own = known.of(mutant)
    # first the few quickest, then all that execute the line, then all in their files: these may share a fixture
    files = list(dict.fromkeys(test.partition("::")[0] for test in own))
    steps = [own[:FEW], own[FEW:MOST], files] if own else [tests_of(mutant.file)]
    try:
        return next((step[0] for step in steps if step and fails(step, tree)), "")
    finally:
        path.write_text(text, encoding="utf-8")


def fails(tests: list[str], tree: Path) -> bool:
    """Whether one of these tests fails, or takes for ever. No test to be found is no failure."""
    words = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests]
    try:
        done = subprocess.run(words, cwd=tree, capture_output=True, check=False, timeout=LIMIT_S)
    except subprocess.TimeoutExpired:
        return True
    # a file that cannot even be imported any more is a failure, too
    if done.returncode == 5 or (done.returncode == 4 and b"ERROR tests" not in done.stdout):
        raise SystemExit(f"{tests[:3]}: {done.stdout.decode()[-500:]}")
    return done.returncode != 0


def main() -> int:
    """Print a line a mutant and the share that was noticed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=101)
    parser.add_argument("--below", default="", help="only files whose path begins so")
    parser.add_argument("--site", default="", help="where the package coverage is installed")
    parser.add_argument("--map", type=Path, default=ROOT / "reports/out/mutants.json", help="what the coverage says")
    parser.add_argument("--first", type=int, default=0, help="leave out so many of the drawn ones")
    parser.add_argument("tests", nargs="*", default=["tests"], help="that the coverage is measured with")
    given = parser.parse_args()
    files = [p for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py")) if "out" not in p.parts]
    found = [m for p in files if p.relative_to(ROOT).as_posix().startswith(given.below) for m in mutants_of(p)]
    drawn = random.Random(given.seed).sample(found, min(given.count, len(found)))
    known, noticed = executed(given.site, given.tests, given.map), 0
    drawn = drawn[given.first :]
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(".git", ".venv", "out", ".*_cache"))
        for mutant in drawn:
            by = killed(mutant, tree, known)
            noticed += bool(by)
            verdict = "noticed " if by else "SURVIVED" if known.of(mutant) else "SURVIVED, executed by no test"
            print(f"{verdict}  {mutant.file}:{mutant.line}  {mutant.before}  ->  {mutant.after}  {by}", flush=True)
    print(f"{noticed} of {len(drawn)} noticed (seed {given.seed}, of {len(found)} possible changes)")
    return 0 if noticed >= 0.85 * len(drawn) else 1


if __name__ == "__main__":
    sys.exit(main())
