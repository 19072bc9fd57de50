"""The kept numbers of all but the solver: see ``tests.numbers`` what to do about a difference."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from tests.numbers.kept import different
from tests.numbers.parts import PARTS
from tests.numbers.traces import ALONE

LONG = (
    "contrast-that-has-settled",
    "wire-out-of-the-round-field-of-view",
    "a-piece-of-wire-in-the-reference--where-the-wire-ends",
)
"""Traces of which one takes as long as five others: by `make study`, as pages and runs, which others look at too."""


def rows() -> Iterator[Any]:
    for part, (scenes, _) in PARTS.items():
        if part != "solver":
            for name in ALONE if part == "traces" else scenes:
                yield pytest.param(part, name, marks=[pytest.mark.slow] * (part in ("pages", "runs") or name in LONG))


@pytest.mark.parametrize(("part", "name"), [*rows()])
def test_the_numbers_are_what_they_were(part: str, name: str) -> None:
    scenes, relative = PARTS[part]
    moved = different(part, name, scenes[name](), relative)
    assert not moved, moved
