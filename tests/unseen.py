"""Runs whose figures nobody looks at: they are made, with all that they show, but no pixel of them is drawn.

A third of the time of a scored study is matplotlib's drawing (cProfile of tests/pipeline/test_score.py). Figures are
drawn, and looked at, in tests/reports.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import pytest
from matplotlib.figure import Figure

from reports import page
from reports.figures import _drawing, figures_of


class _Unseen(Figure):
    """A figure that stays blank; its panels are where they would be without a layout."""

    def draw(self, renderer: Any) -> None:
        for axes in self.axes:
            axes.apply_aspect()


@contextmanager
def undrawn() -> Iterator[None]:
    """Within it no figure is drawn."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_drawing, "Figure", _Unseen)
        yield


FEW = {"case": {"scan_at_entry", "error_by_depth"}, "run": {"planned_within"}}
"""What stands for the figures of a page that no test looks at; tests/numbers makes all of real results."""


@contextmanager
def few(more: Collection[str] = ()) -> Iterator[None]:
    """Within it the pages of a run and of its cases have these figures and ``more``, the others no data."""

    def chosen(name: str) -> Mapping[str, Callable[[Any], Any]]:
        kept = FEW.get(name, set(figures_of(name)))
        return {f: draw if f in kept or f in more else lambda _: None for f, draw in figures_of(name).items()}

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "figures_of", chosen)
        yield


@pytest.fixture(scope="module", autouse=True)
def few_figures(request: pytest.FixtureRequest) -> Iterator[None]:
    """As ``unseen_figures``; a module that looks for further figures names them in ``FIGURES``."""
    with few(getattr(request.module, "FIGURES", ())):
        yield


@pytest.fixture(scope="module", autouse=True)
def unseen_figures() -> Iterator[None]:
    """For the tests of a module that imports it, or of a folder whose conftest.py does, and for their fixtures.

    Processes that are started anew, as those of ``-j 2`` with two cases are, draw their figures all the same.
    """
    with undrawn():
        yield


@pytest.fixture
def scarce() -> Iterator[None]:
    """For one test that looks at no figure: few are made, none is drawn."""
    with few(), undrawn():
        yield


@pytest.fixture
def unseen() -> Iterator[None]:
    """For one test, of a module that looks at figures in others."""
    with undrawn():
        yield
