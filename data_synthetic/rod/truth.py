"""The true wire of a study, on nodes so close that halving their spacing moves nothing, and how far to trust it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from data_synthetic.rod.replay import TrueFrame, TrueInsertion, halving_moves
from data_synthetic.rod.truth_cache import cached_replay

LONGEST_ADVANCE_MM = 0.4
"""Insertion between two equilibria: a tip cannot pass a wall of 1 mm unseen, and smaller steps change nothing."""

TRUTH_STEP_MM, MOST_HALVINGS, CONVERGED_MM = 0.2, 2, 0.01
"""The true wire's first node spacing, how often it is halved at most, and the move of a frame at which it is not."""

TRIED = 7
"""Frames of a study on which halving is tried."""


def at_step(insertion: TrueInsertion, step_mm: float) -> TrueInsertion:
    """The insertion computed with that node spacing."""
    return replace(insertion, step_mm=step_mm, advance_mm=max(step_mm, LONGEST_ADVANCE_MM))


def converged_truth(
    insertion: TrueInsertion,
    depths_mm: Sequence[float],
    rolls_deg: Sequence[float],
    step_mm: float | None = None,
) -> tuple[tuple[TrueFrame, ...], dict[str, float]]:
    """The true wire at every depth, and its quality; nodes are put closer until halving them moves nothing.

    step_mm : a node spacing that is taken as it is, for tests that need no converged truth.
    """
    step, left = step_mm or TRUTH_STEP_MM, 0 if step_mm else MOST_HALVINGS
    while True:
        # the shortest wire still gets a dozen nodes
        fine = at_step(insertion, min(step, min(depths_mm) / 8.0))
        truth = cached_replay(fine, depths_mm, rolls_deg)
        quality = truth_quality(fine, truth)
        if quality["halving_moves_mm"] <= CONVERGED_MM or not left:
            return truth, quality
        step, left = 0.5 * step, left - 1


def truth_quality(insertion: TrueInsertion, truth: tuple[TrueFrame, ...]) -> dict[str, float]:
    """Figures that tell how far the truth can be trusted; halving is tried on a few frames, the last among them."""
    tried = {round(i) for i in np.linspace(0, len(truth) - 1, min(len(truth), TRIED))}
    return {
        "node_spacing_mm": insertion.step_mm,
        "largest_residual_N": max(f.residual_N for f in truth),
        "halving_moves_mm": max(halving_moves(insertion, truth[i]) for i in tried),
        "largest_tip_jump_mm": max(f.jump_mm for f in truth),
        "largest_contact_N": max(float(np.linalg.norm(f.contact_N, axis=1).max()) for f in truth),
        "newton_iterations": float(sum(f.iterations for f in truth)),
    }
