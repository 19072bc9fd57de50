"""The kept numbers of parts that need nothing but themselves: see ``tests.numbers`` what to do about a difference."""

from __future__ import annotations

import pytest

from tests.numbers.kept import different
from tests.numbers.parts import PARTS

PLAIN = ("benchmark", "fits", "imaging", "sentences", "synthetic")


@pytest.mark.parametrize(("part", "name"), [(part, name) for part in PLAIN for name in PARTS[part][0]])
def test_the_numbers_are_what_they_were(part: str, name: str) -> None:
    scenes, relative = PARTS[part]
    lines = different(part, name, scenes[name](), relative)
    assert not lines, "\n".join([*lines, "was that meant? then `make numbers`, and say why: see tests/numbers"])
