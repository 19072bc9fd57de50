"""Figures of runs whose figures nobody looks at: drawn, so that what fails while it is drawn is met, but not laid out.

Most of the time of a run of a small study is the drawing of its figures, and two thirds of that are matplotlib's
constrained layout, which draws each figure several times to find room for its labels.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from matplotlib.figure import Figure

from reports.figures import _drawing


class _Unfitted(Figure):
    """A figure whose labels may lie over each other."""

    def __init__(self, *given: Any, layout: object = None, **named: Any) -> None:
        super().__init__(*given, **named)


@pytest.fixture(scope="package", autouse=True)
def unfitted_figures() -> Iterator[None]:
    """For a folder that imports it into its conftest.py: also for its module's fixtures, and for it alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_drawing, "Figure", _Unfitted)
        yield


@pytest.fixture
def fitted_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """For a test whose figures are compared with those of a process that was started anew, where nothing is patched."""
    monkeypatch.setattr(_drawing, "Figure", Figure)
