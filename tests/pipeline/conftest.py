"""No test of this folder looks at a figure."""

from __future__ import annotations

from tests.unfitted import fitted_figures, unfitted_figures

__all__ = ["fitted_figures", "unfitted_figures"]
