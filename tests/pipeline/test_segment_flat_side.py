"""Contrast medium that fills a vessel in part: the lumen is that part, with a flat side that faces up."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr

from pipeline.model import Volume
from pipeline.segment import segment
from pipeline.segment.flat_side import flat_side
from solver.grid import Grid
from tests.studies.seeing import render
from tests.studies.seeing.scenes import Draft


@pytest.mark.quick(2)
@pytest.mark.parametrize(("seed", "filled", "told"), [(0, 0.5, True), (1, 0.75, True), (2, 0.5, True), (1, 1.0, False)])
def test_a_vessel_filled_in_part_is_told(seed: int, filled: float, told: bool) -> None:
    """Half a lumen came without a word, and wires beside it as leaving the lumen."""
    rng = np.random.default_rng([seed, 11])
    draft = Draft(rng, bend=(0.0, 0.03, 0.06)[seed], radius=1.8)
    spread = np.linalg.svd(draft.axis - draft.axis.mean(axis=0), full_matrices=False)[2]
    up = spread[2]  # the vessel lies: gravity is across most of it
    height = (draft.lattice.centres() - draft.axis.mean(axis=0)) @ up
    level = 1.8 * (2.0 * filled - 1.0) if filled < 1.0 else np.inf
    pool = ndtr((level - height) / 0.25).reshape(draft.lattice.shape)
    grey = render.TISSUE + render.CONTRAST * pool * render.vessel(draft.lattice, draft.axis, draft.radius)
    scan = Volume(render.noisy(grey, 60, rng), draft.lattice.spacing, draft.lattice.origin)
    seeds = draft.axis[300:-300:100] - 1.0 * up
    lumen = segment(scan, seeds[[np.argmin(np.abs((draft.axis[300:-300:100] - draft.axis.mean(axis=0)) @ up))]])
    said = [text for text in lumen.warnings if "is flat and faces one way" in text]
    assert bool(said) == told, lumen.warnings
    for text in said:
        way = np.array(text[text.index("(") + 1 : text.index(")")].split(","), float)
        assert way @ up > 0.95


def test_a_channel_of_flat_walls_is_none_filled_in_part() -> None:
    """As much of it faces the other way."""
    y, z = np.meshgrid(*(0.3 * np.arange(-10.0, 11.0),) * 2, indexing="ij")
    square = np.broadcast_to(np.maximum(np.abs(y), np.abs(z)) - 1.5, (60, 21, 21)).astype(np.float32)
    assert flat_side(Grid(square, (0.3, 0.3, 0.3))) == ()
    half = np.maximum(square, z[None]).astype(np.float32)
    assert flat_side(Grid(half, (0.3, 0.3, 0.3))) == (), "a flat floor below a flat surface: nobody can tell"
    assert flat_side(Grid(np.full((9, 9, 9), 5.0, np.float32), (0.3, 0.3, 0.3))) == ()
