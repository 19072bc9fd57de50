"""The kept numbers of ``tests.numbers.traces``: see there what to do about a difference.

Those of scenes that ``tests.pipeline.test_seeing`` looks at are compared there.
"""

from __future__ import annotations

import pytest

from tests.numbers.kept import different
from tests.numbers.parts import PARTS
from tests.numbers.traces import ALONE

SCENES, RELATIVE = PARTS["traces"]
LONG = (
    "contrast-that-has-settled",
    "wire-out-of-the-round-field-of-view",
    "a-piece-of-wire-in-the-reference--where-the-wire-ends",
)
"""Of which one takes as long as five others: by `make study`."""


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] * (n in LONG)) for n in ALONE])
def test_the_numbers_are_what_they_were(name: str) -> None:
    lines = different("traces", name, SCENES[name](), RELATIVE)
    assert not lines, "\n".join([*lines, "was that meant? then `make numbers`, and say why: see tests/numbers"])
