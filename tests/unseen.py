"""Runs whose figures nobody looks at: they are made, with all that they show, but no pixel of them is drawn.

A third of the time of a scored study is matplotlib's drawing (cProfile of tests/pipeline/test_score.py). Figures are
drawn, and looked at, in tests/reports.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from matplotlib.figure import Figure

from reports.figures import _drawing


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


@pytest.fixture(scope="module", autouse=True)
def unseen_figures() -> Iterator[None]:
    """For the tests of a module that imports it, or of a folder whose conftest.py does, and for their fixtures.

    Processes that are started anew, as those of ``-j 2`` with two cases are, draw their figures all the same.
    """
    with undrawn():
        yield


@pytest.fixture
def unseen() -> Iterator[None]:
    """For one test, of a module that looks at figures in others."""
    with undrawn():
        yield
