"""Do the tests notice? Random small changes of product lines, each against the tests: ``make mutants``.

A change is drawn with a fixed seed: a comparison, a sum, a product, a condition, a truth value or a number of one line
becomes its neighbour. Two kinds that change nothing are not drawn: a bound that floats meet by accident alone (zero,
which they do meet, apart), and what ``strict`` of zip asserts.

One run of the tests with coverage tells which of them execute the line: the quickest of these run first, up to the
first that fails. Kernels, which coverage does not see, have the tests that execute what calls them (see ``callers``),
and those that name them. The solver's are first tried without a compiler, on the kept numbers of its scenes: that takes
seconds, compiling it minutes. A change that none of its tests fails on has survived, and is printed to be looked at.
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tests.studies.callers import behind, spread
from tests.studies.executed import PACKAGES, ROOT, Executed, executed

NEIGHBOUR: dict[type, type] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot, ast.IsNot: ast.Is, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Add: ast.Sub, ast.Sub: ast.Add,
    ast.Mult: ast.Div, ast.Div: ast.Mult, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
BOUNDS = ast.Lt, ast.LtE, ast.Gt, ast.GtE
UNITS = "_mm", "_mm2", "_mm3", "_deg", "_rad", "_n", "_n_mm", "_per_mm", "_s"
FEW, NEAREST, MOST = 8, 2, 200
ALL = "-m", "not peers"
"""Tests of every commit and those of `make study`."""
SOLVER, PLAIN = "solver/_kernels/", "tests/numbers/test_solver.py"
MEANT = b"was that meant?"
"""What the kept numbers say of a difference. An index beyond an array, which compiled code does not see, says more."""
LONG_S = 300.0
"""Tests are asked for so long, by what they take without a change; a kernel's take its compilation beside that."""
ENDLESS, ENOUGH_S = 20.0, 900.0
"""Times that, and a quarter of an hour to compile on a busy machine: a change that makes a test go on for ever is
noticed."""


@dataclass(frozen=True)
class Mutant:
    """One changed expression. start, end : its place in the file, bytes."""

    file: str
    line: int
    start: int
    end: int
    before: str
    after: str

    def apply(self, text: bytes) -> bytes:
        return text[: self.start] + self.after.encode() + text[self.end :]


def by_accident(compared: ast.Compare) -> bool:
    """Whether its two sides are floats, by how they are written: 0.5, a name that states its unit. Zero is met."""
    if any(isinstance(side, ast.Constant) and side.value == 0 for side in (compared.left, *compared.comparators)):
        return False
    nodes = [*ast.walk(compared)]
    names = [n.id if isinstance(n, ast.Name) else n.attr for n in nodes if isinstance(n, (ast.Name, ast.Attribute))]
    if {"len", "ndim", "shape", "size"} & {*names}:
        return False
    floats = any(isinstance(n, ast.Constant) and isinstance(n.value, float) for n in nodes)
    return floats or any(name.lower().endswith(UNITS) for name in names)


def changed(node: ast.AST) -> ast.AST | None:
    """The node's neighbour; None for a kind of node that has none."""
    new = copy.deepcopy(node)
    if isinstance(new, ast.Compare) and type(new.ops[0]) in NEIGHBOUR:
        if isinstance(new.ops[0], BOUNDS) and by_accident(new):
            return None
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
    text = path.read_bytes()  # columns count bytes
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    nodes = [*ast.walk(ast.parse(text))]
    functions = [n for n in nodes if isinstance(n, (ast.FunctionDef, ast.AsyncFunctionDef))]
    seen = {_place(n.value) for n in nodes if isinstance(n, ast.keyword) and n.arg == "strict"}
    for node in (inner for function in functions for statement in function.body for inner in ast.walk(statement)):
        new = changed(node) if isinstance(node, ast.expr) else None
        if new is None or not isinstance(node, ast.expr) or _place(node) in seen:
            continue
        seen.add(_place(node))
        start = starts[node.lineno - 1] + node.col_offset
        end = starts[(node.end_lineno or node.lineno) - 1] + (node.end_col_offset or 0)
        name = path.relative_to(ROOT).as_posix()
        yield Mutant(name, node.lineno, start, end, text[start:end].decode(), ast.unparse(new))


def _place(node: ast.expr) -> tuple[int, int, type]:
    return node.lineno, node.col_offset, type(node)


def tests_of(file: str) -> list[str]:
    """For a line that no coverage sees, a kernel's: files that name the module or what is around it, nearest first.

    A test names what its helpers name: those beside it that it imports. A file that is called as the module is comes
    first: of a dozen that share a helper it is the one that was written for it.
    """
    module = file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    found: list[str] = []
    texts = {
        p.relative_to(ROOT): p.read_text(encoding="utf-8")
        for p in sorted((ROOT / "tests").rglob("*.py"))
        if not {"studies", "bench"} & {*p.parts}
    }
    while "." in module:
        named = [*_naming(module, texts)]
        named += [p for helper in named for p in _naming(".".join(helper.with_suffix("").parts), texts)]
        tests = dict.fromkeys(str(p) for p in named if p.name.startswith("test_"))
        found += [name for name in tests if name not in found]
        module = module.rpartition(".")[0]
    own = [str(p) for p in texts if p.stem == f"test_{Path(file).stem}"]
    return [*own, *(name for name in found if name not in own)] or [f"tests/{module}"]


def _naming(module: str, texts: Mapping[Path, str]) -> Iterator[Path]:
    """The files whose text names a module."""
    package, _, name = module.rpartition(".")
    wanted = re.compile(
        rf"{re.escape(module)}\b|from {re.escape(package)} import (?:[^\n(]*|\([^)]*)\b{re.escape(name)}\b"
    )
    yield from (path for path, text in texts.items() if wanted.search(text))


def steps_of(mutant: Mutant, known: Executed) -> list[list[str]]:
    """Its tests, those first that are likely to notice it soon."""
    own = known.of(mutant.file, mutant.line)
    if not own:
        found, first = behind(mutant.file, mutant.line, known), [PLAIN] if mutant.file.startswith(SOLVER) else []
        named = [[name] for name in tests_of(mutant.file)]
        # what names the module is written for it; the others only come by, and may take all of the time
        return [first, *named[:NEAREST], found[:MOST], found[MOST:], *named[NEAREST:]]
    # first the few quickest, then all that execute the line, then all in their files: these may share a fixture
    first = spread(own, known)[:FEW]
    return [first, [test for test in own if test not in first][:MOST], known.files(own)]


def killed(mutant: Mutant, known: Executed) -> str:
    """The test that noticed it; empty where none did."""
    with tempfile.TemporaryDirectory() as folder:
        # a tree of its own, machine code included: what a change compiles stays out of the next one's way
        tree = Path(folder) / "tree"
        shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(".git", ".venv", "out", ".*_cache"))
        (tree / "wireval").symlink_to(tree / "pipeline/wireval")
        path = tree / mutant.file
        path.write_bytes(mutant.apply(path.read_bytes()))
        if mutant.file.startswith(SOLVER) and (by := fails([PLAIN], tree, LONG_S, compiled=False)):
            return f"{by} (not compiled)"
        left_s = LONG_S
        for step in steps_of(mutant, known):
            asked = within(step, left_s, known)
            taken_s = sum(map(known.seconds_of, asked))
            left_s -= taken_s
            if asked and (by := fails(asked, tree, taken_s)):
                return by
    return ""


def within(tests: list[str], seconds: float, known: Executed) -> list[str]:
    """As many of these tests, in their order, as take so long."""
    found = []
    for test in tests:
        seconds -= known.seconds_of(test)
        if seconds > 0.0:
            found.append(test)
    return found


def fails(tests: list[str], tree: Path, seconds: float, compiled: bool = True) -> str:
    """The first of these tests that fails, or takes for ever; empty for none. No test to be found is no failure."""
    words = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *ALL, *tests]
    env = os.environ | {"PYTHONPATH": str(tree)} | ({} if compiled else {"NUMBA_DISABLE_JIT": "1"})
    with subprocess.Popen(words, cwd=tree, env=env, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as done:
        # by the clock: under a limit of processor time that time goes on in ticks, and tests that measure it fail
        try:
            text, _ = done.communicate(timeout=ENOUGH_S + ENDLESS * seconds)
        except subprocess.TimeoutExpired:
            done.kill()
            return f"{tests[0]} (endless)" if compiled else ""
    # a file that cannot even be imported any more is a failure, too
    if done.returncode == 4 and b"ERROR tests" not in text:
        raise SystemExit(f"{tests[:3]}: {text.decode()[-500:]}")
    # 5: all of a file's tests are skipped or belong to slow studies
    if done.returncode in (0, 5) or not (compiled or MEANT in text):
        return ""
    named = re.search(r"^(?:FAILED|ERROR) (\S+)", text.decode(errors="replace"), re.MULTILINE)
    return named[1] if named else tests[0]


def drawn(count: int, seed: int, below: str) -> tuple[list[Mutant], int]:
    """So many changes below a path, and how many there are to draw from."""
    files = [p for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py")) if "out" not in p.parts]
    found = [m for p in files if p.relative_to(ROOT).as_posix().startswith(below) for m in mutants_of(p)]
    return random.Random(seed).sample(found, min(count, len(found))), len(found)


def main() -> int:
    """Print a line a mutant and the share that was noticed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=101)
    parser.add_argument("--below", default="", help="only files whose path begins so")
    parser.add_argument("--site", default="", help="where the package coverage is installed")
    parser.add_argument("--first", type=int, default=0, help="leave out so many of the drawn ones")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("words", nargs="*", default=["tests"], help="arguments of pytest for the coverage")
    given = parser.parse_args()
    chosen, possible = drawn(given.count, given.seed, given.below)
    chosen = chosen[given.first :]
    known, noticed = executed(given.site, [*ALL, *given.words]), 0
    with ThreadPoolExecutor(given.jobs) as pool:
        for mutant, by in zip(chosen, pool.map(partial(killed, known=known), chosen), strict=True):
            noticed += bool(by)
            unseen = not (known.of(mutant.file, mutant.line) or behind(mutant.file, mutant.line, known))
            verdict = "noticed " if by else "SURVIVED" + ", executed by no test that coverage sees" * unseen
            print(f"{verdict}  {mutant.file}:{mutant.line}  {mutant.before}  ->  {mutant.after}  {by}", flush=True)
    print(f"{noticed} of {len(chosen)} noticed (seed {given.seed}, of {possible} possible changes)")
    return 0 if noticed >= 0.85 * len(chosen) else 1


if __name__ == "__main__":
    sys.exit(main())
