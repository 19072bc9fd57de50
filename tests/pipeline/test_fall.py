"""A tip that moved along itself while it was scanned is known as well as it moved; a sharp one as well as it was."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.status import FrameStatus
from tests.later import later
from tests.studies.seeing.scenes import Draft
from tests.studies.seeing.table import seen


@pytest.mark.parametrize("seed", [0, *later(1, 2, 3)])
def test_a_tip_that_was_drawn_along_itself_is_known_as_well_as_it_moved(seed: int) -> None:
    """Over 2 mm in six equal steps: 0.5 to 1.0 mm short, ok, and said to be known to 0.05 mm."""
    draft = Draft(np.random.default_rng(seed))
    sharp = draft.scan(16)
    draft.opacity = np.minimum(1.0, np.ceil(draft.from_tip / 0.4) / 6.0)
    moved = draft.scan(16)
    for scene in (sharp, moved):
        _, curve = seen(scene)
        known = np.linalg.norm(curve.points_mm[-1] - scene.wire[-1]) < 2.0 * curve.tip_sigma_mm
        assert known or (scene is moved and curve.status is FrameStatus.TRACE_AMBIGUOUS)
        assert curve.tip_sigma_mm < 0.05 or scene is moved, "a sharp end is known as well as before"
