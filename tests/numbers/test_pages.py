"""The kept numbers of ``tests.numbers.pages``: see there what to do about a difference."""

from __future__ import annotations

import pytest

from tests.numbers.kept import different
from tests.numbers.parts import PARTS

SCENES, RELATIVE = PARTS["pages"]
pytestmark = pytest.mark.slow  # tests/reports looks at pages each time


@pytest.mark.parametrize("name", SCENES)
def test_the_numbers_are_what_they_were(name: str) -> None:
    lines = different("pages", name, SCENES[name](), RELATIVE)
    assert not lines, "\n".join([*lines, "was that meant? then `make numbers`, and say why: see tests/numbers"])
