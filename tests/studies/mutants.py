"""Do the tests notice? Random small changes of product lines, each against the tests: ``make mutants``.

A change is drawn with a fixed seed: a comparison, a sum, a product, a condition, a truth value or a number of one line
becomes its neighbour. The tests that name the changed module run first, then those of its package; a change that
none of them fails on has survived, and is printed to be looked at.
"""

from __future__ import annotations

import argparse
import ast
import copy
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("pipeline", "reports", "data_synthetic", "solver")
NEIGHBOUR: dict[type, type] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Add: ast.Sub, ast.Sub: ast.Add,
    ast.Mult: ast.Div, ast.Div: ast.Mult, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
LIMIT_S = 1800


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


def tests_of(file: str) -> list[list[str]]:
    """Which tests to ask, the nearest first: files that name the module, then the package's."""
    module = file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    package, _, name = module.rpartition(".")
    wanted = re.compile(rf"{re.escape(module)}\b|from {re.escape(package)} import .*\b{name}\b")
    near = [p for p in sorted((ROOT / "tests").rglob("test_*.py")) if not {"studies", "bench"} & {*p.parts}]
    named = [p for p in near if wanted.search(p.read_text(encoding="utf-8"))]
    return [[str(p.relative_to(ROOT)) for p in named]] * bool(named) + [[f"tests/{file.partition('/')[0]}"]]


def killed(mutant: Mutant, tree: Path) -> bool:
    """Whether a test fails on it."""
    path = tree / mutant.file
    text = path.read_text(encoding="utf-8")
    path.write_text(mutant.apply(text), encoding="utf-8")
    try:
        for files in tests_of(mutant.file):
            words = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *files]
            done = subprocess.run(words, cwd=tree, capture_output=True, check=False, timeout=LIMIT_S)
            if done.returncode != 0:
                return True
        return False
    except subprocess.TimeoutExpired:
        return True
    finally:
        path.write_text(text, encoding="utf-8")


def main() -> int:
    """Print a line a mutant and the share that was noticed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=101)
    parser.add_argument("--below", default="", help="only files whose path begins so")
    given = parser.parse_args()
    files = [p for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py")) if "out" not in p.parts]
    found = [m for p in files if p.relative_to(ROOT).as_posix().startswith(given.below) for m in mutants_of(p)]
    drawn = random.Random(given.seed).sample(found, min(given.count, len(found)))
    noticed = 0
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(".git", ".venv", "out", ".*_cache"))
        for mutant in drawn:
            fine = killed(mutant, tree)
            noticed += fine
            verdict = "noticed " if fine else "SURVIVED"
            print(f"{verdict}  {mutant.file}:{mutant.line}  {mutant.before}  ->  {mutant.after}", flush=True)
    print(f"{noticed} of {len(drawn)} noticed (seed {given.seed}, of {len(found)} possible changes)")
    return 0 if noticed >= 0.85 * len(drawn) else 1


if __name__ == "__main__":
    sys.exit(main())
