"""Figures of runs whose figures nobody looks at: drawn, so that what fails while it is drawn is met, but not laid out.

Most of the time of a run of a small study is the drawing of its figures, and two thirds of that are matplotlib's
constrained layout, which measures each figure again and again to find room for its labels.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from matplotlib.figure import Figure

from reports.figures import _drawing


class _Unfitted(Figure):
    """A figure that is as ours are until it is drawn, and then keeps its panels where they are."""

    def draw(self, renderer: Any) -> None:
        self.set_layout_engine("none")
        super().draw(renderer)


@pytest.fixture(scope="module", autouse=True)
def unfitted_figures() -> Iterator[None]:
    """For the tests of a module that imports it, or of a folder whose conftest.py does, and for their fixtures.

    Processes that are started anew, as those of ``-j 2`` with two cases are, lay their figures out all the same.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_drawing, "Figure", _Unfitted)
        yield
