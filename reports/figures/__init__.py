"""The figures of every page by name, as sections.toml declares them; each gives None where its data is absent."""

import importlib
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from reports.figures import _any_backend  # noqa: F401 - first: it imports matplotlib

# isort: split
from reports.figures._drawing import Drawing
from reports.figures.run import RunFiles
from reports.sections import declared

__all__ = ["Drawing", "RunFiles", "figures_of"]


@cache
def figures_of(page: str) -> Mapping[str, Callable[[Any], Drawing | None]]:
    """The functions of a page's figures by name, in the order of sections.toml."""
    modules = {e["figure"]: importlib.import_module(f"{__name__}.{e['module']}") for e in declared(page)}
    return {figure: getattr(module, figure) for figure, module in modules.items()}
