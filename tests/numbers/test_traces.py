"""The kept numbers of ``tests.numbers.traces``: see there what to do about a difference.

Those of scenes that ``tests.pipeline.test_seeing`` looks at are compared there.
"""

from __future__ import annotations

import pytest

from tests.numbers.kept import different
from tests.numbers.parts import PARTS
from tests.numbers.traces import ALONE

SCENES, RELATIVE = PARTS["traces"]


@pytest.mark.parametrize("name", ALONE)
def test_the_numbers_are_what_they_were(name: str) -> None:
    lines = different("traces", name, SCENES[name](), RELATIVE)
    assert not lines, "\n".join([*lines, "was that meant? then `make numbers`, and say why: see tests/numbers"])
