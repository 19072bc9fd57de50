"""The kept numbers of ``tests.numbers.solver``: see there what to do about a difference."""

from __future__ import annotations

import os

import pytest

from tests.numbers.kept import different
from tests.numbers.parts import PARTS

SCENES, RELATIVE = PARTS["solver"]
LONG = ("snapping",)


@pytest.mark.parametrize("name", SCENES)
def test_the_numbers_are_what_they_were(name: str) -> None:
    if name in LONG and os.environ.get("NUMBA_DISABLE_JIT") == "1":
        pytest.skip("minutes where nothing is compiled")
    moved = different("solver", name, SCENES[name](), RELATIVE)
    assert not moved, moved
