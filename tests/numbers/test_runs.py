"""The kept numbers of ``tests.numbers.runs``: see there what to do about a difference."""

from __future__ import annotations

import pytest

from tests.numbers.kept import different
from tests.numbers.parts import PARTS
from tests.unseen import unseen_figures as unseen_figures  # looked at before they are drawn

SCENES, RELATIVE = PARTS["runs"]
pytestmark = pytest.mark.slow  # what a run says is looked at in tests/pipeline each time


@pytest.mark.parametrize("name", SCENES)
def test_the_numbers_are_what_they_were(name: str) -> None:
    lines = different("runs", name, SCENES[name](), RELATIVE)
    assert not lines, "\n".join([*lines, "was that meant? then `make numbers`, and say why: see tests/numbers"])
