"""Parameters of a test that say a fact again, at another value, seed or scene: ``make study`` runs them."""

from __future__ import annotations

from typing import Any

import pytest


def later(*rows: Any) -> list[Any]:
    """The rows, each a value or a tuple of values, behind the marker ``slow``."""
    return [pytest.param(*(row if isinstance(row, tuple) else (row,)), marks=pytest.mark.slow) for row in rows]
