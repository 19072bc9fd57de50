"""The figures of every page by name, as sections.toml declares them; each gives None where its data is absent."""

import importlib
import tomllib
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from reports.figures import _any_backend  # noqa: F401 - first: it imports matplotlib

# isort: split
from reports.figures._drawing import Drawing
from reports.figures.run import RunFiles

__all__ = ["Drawing", "RunFiles", "declared", "figures_of"]


@cache
def declared(part: str) -> tuple[Mapping[str, str], ...]:
    """The entries of sections.toml for a page (case, run or bench) or for the cards of a case, in order."""
    text = (Path(__file__).parents[1] / "sections.toml").read_text(encoding="utf-8")
    return tuple(tomllib.loads(text)[part])


@cache
def figures_of(page: str) -> Mapping[str, Callable[[Any], Drawing | None]]:
    """The functions of a page's figures by name, in the order of sections.toml."""
    modules = {e["figure"]: importlib.import_module(f"{__name__}.{e['module']}") for e in declared(page)}
    return {figure: getattr(module, figure) for figure, module in modules.items()}
