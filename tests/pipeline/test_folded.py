"""A tip folded back beside the wire: cut at the bend it was 2.6 mm too short, and ok."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.status import FrameStatus
from tests.studies.seeing import render
from tests.studies.seeing.scenes import Draft, Scene, sideways
from tests.studies.seeing.table import seen

VOXEL = 0.4


def folded(seed: int, length_mm: float, beside_mm: float) -> Scene:
    """A wire whose last millimetres lie beside it."""
    draft = Draft(np.random.default_rng(seed), spacing=VOXEL, radius=2.4, room=0.9)
    back = sideways(draft.path, draft.rng, beside_mm)[-round(length_mm / 0.05) :][::-1]
    onward = draft.path[-1] - draft.path[-10]
    turn = 0.5 * (draft.path[-1] + back[0]) + 0.4 * onward / np.linalg.norm(onward)
    draft.path = render.even(np.concatenate([draft.path[:-8:20], turn[None], back[8::20], back[-1:]]), 0.05)
    draft.opacity = np.ones(len(draft.path))
    return draft.scan(12)


@pytest.mark.quick(2)
@pytest.mark.parametrize(
    ("seed", "length_mm", "beside_mm"), [(0, 2.0, 0.65), (1, 2.0, 0.65), (2, 2.0, 0.75), (1, 3.0, 0.65)]
)
def test_a_tip_beside_the_wire_is_not_left_out_in_silence(seed: int, length_mm: float, beside_mm: float) -> None:
    _, curve = seen(folded(seed, length_mm, beside_mm))
    assert curve.status is FrameStatus.TRACE_AMBIGUOUS
    assert "out of round" in curve.note
