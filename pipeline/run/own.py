"""Metrics and predictors of a user's own where cases run in processes that this one did not fork."""

import importlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar

from pipeline.status import UsageError
from reports.case_files import listed, runs_in
from reports.schema import ERRORS

J = TypeVar("J")
R = TypeVar("R")
SCRIPTS = "__main__", "?"
DO = "register it at the top level of a module that workers can import, or run with one job (-j 1, no --executor)"


def registered() -> dict[str, str]:
    """The columns that were registered, each with the module that did."""
    return {column.name: column.module for column in ERRORS if column.module}


def not_loaded(out: Path, call: str) -> list[str]:
    """Columns of the runs into a folder that were registered where this process has not: tables would lose them.

    call : what to do where they are registered, in Python.
    """
    known = {name: module for run in runs_in(out) for name, module in run.get("own", {}).items()}
    return [
        f"{name} was registered by {module}, which is not loaded here: its columns would be lost; {_do(module, call)}"
        for name, module in known.items()
        if name not in registered()
    ]


def _do(module: str, call: str) -> str:
    """How to give a command where a module's columns are registered."""
    return f"call {call} at the end of that script" if module in SCRIPTS else f"in Python import it, then {call}"


def refuse_scripts(own: Mapping[str, str]) -> None:
    """Refuse, for workers, what a script or a notebook has registered: its column would be empty."""
    alone = [name for name, module in own.items() if module in SCRIPTS]
    if alone:
        raise UsageError([f"{listed(alone)}: registered in a script or a notebook, which workers do not run; {DO}"])


def with_own(own: Mapping[str, str], work: Callable[[J], R], job: J) -> R:
    """Do a job where ``own`` is registered; RuntimeError where importing its modules does not do that."""
    for module in dict.fromkeys(own.values()):
        importlib.import_module(module)
    if missing := own.keys() - registered().keys():
        raise RuntimeError(
            f"{listed(sorted(missing))}: not registered when {listed([*own.values()])} is imported; {DO}"
        )
    return work(job)
