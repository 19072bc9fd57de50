"""Which tests are behind a line that coverage does not see, a kernel's above all: those that execute what calls it.

Names are followed, not values: a definition is used where its name stands, in its own module or in one that imports it.
From a compiled function this leads through other compiled ones to lines of Python, whose tests coverage knows.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache

from tests.studies.executed import PACKAGES, ROOT, Executed

Name = tuple[str, str]
"""A module's file and the name of something that it defines."""
Place = tuple[str, int, int]
"""A file, and the first and last line of something in it."""


@dataclass
class Uses:
    """Where each name is used, as file and line, and which definition each line of a file belongs to."""

    lines: dict[Name, list[tuple[str, int]]] = field(default_factory=dict)
    definitions: dict[str, list[tuple[str, ast.stmt]]] = field(default_factory=dict)

    def around(self, file: str, line: int) -> tuple[str, ast.stmt] | None:
        """The definition of a module that a line belongs to, by its name."""
        for name, node in self.definitions.get(file, []):
            if node.lineno <= line <= (node.end_lineno or node.lineno):
                return name, node
        return None


def module_file(module: str) -> str:
    """The file of a module of ours; empty for other modules."""
    path = ROOT.joinpath(*module.split("."))
    found = next((p for p in (path.with_suffix(".py"), path / "__init__.py") if p.is_file()), None)
    return found.relative_to(ROOT).as_posix() if found and module.partition(".")[0] in PACKAGES else ""


def imported(tree: ast.Module) -> dict[str, Name]:
    """What each imported name of a module stands for; the name is empty where it is a module."""
    found = {}
    for node in (n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.module):
        for alias in node.names:
            inner = module_file(f"{node.module}.{alias.name}")
            found[alias.asname or alias.name] = (inner, "") if inner else (module_file(node.module or ""), alias.name)
    return {name: known for name, known in found.items() if known[0]}


def defined(tree: ast.Module) -> Iterator[tuple[str, ast.stmt]]:
    """What a module defines: functions, classes, constants."""
    for node in tree.body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            yield node.name, node
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            yield from ((t.id, node) for target in targets for t in ast.walk(target) if isinstance(t, ast.Name))


@cache
def uses() -> Uses:
    """Of all modules of the packages."""
    found = Uses()
    for path in (p for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py")) if "out" not in p.parts):
        file, tree = path.relative_to(ROOT).as_posix(), ast.parse(path.read_bytes())
        found.definitions[file] = list(defined(tree))
        known = {name: (file, name) for name, _ in found.definitions[file]} | imported(tree)
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
                target = known.get(node.value.id)
                if target and not target[1]:
                    found.lines.setdefault((target[0], node.attr), []).append((file, node.lineno))
            elif isinstance(node, ast.Name) and node.id in known:
                found.lines.setdefault(known[node.id], []).append((file, node.lineno))
    return found


def function_of(top: ast.stmt, line: int) -> ast.stmt:
    """The method that a line of a class belongs to; a function is its own."""
    inner = [n for n in getattr(top, "body", []) if isinstance(top, ast.ClassDef) and isinstance(n, ast.FunctionDef)]
    return next((n for n in inner if n.lineno <= line <= (n.end_lineno or n.lineno)), top)


def behind(file: str, line: int, known: Executed) -> list[str]:
    """Tests that execute a line's function, or else what uses it, through functions that coverage does not see."""
    found: dict[str, None] = {}
    left, seen = [(file, line)], set()
    while left:
        at = left.pop()
        around = uses().around(*at)
        if around is None:
            continue
        name, top = around
        node = function_of(top, at[1])
        if (at[0], node.lineno) in seen:
            continue
        # its own line is executed by the import
        body = range(node.lineno + 1, (node.end_lineno or node.lineno) + 1)
        tests = (known.of(*at) if at != (file, line) else []) or [t for n in body for t in known.of(at[0], n)]
        found.update(dict.fromkeys(tests))
        if not tests:
            seen.add((at[0], node.lineno))
            left += uses().lines.get((at[0], name), [])
    return spread(list(found), known)


def spread(tests: list[str], known: Executed) -> list[str]:
    """The quickest test of each file first, then the second of each, and so on: files look at different things."""
    rank: dict[str, int] = {}
    order = []
    for test in sorted(tests, key=known.seconds_of):
        file = test.partition("::")[0]
        rank[file] = rank.get(file, -1) + 1
        order.append((rank[file], known.seconds_of(test), test))
    return [test for *_, test in sorted(order)]
