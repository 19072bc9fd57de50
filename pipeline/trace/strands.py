"""Do two strands of one wire lie on one crest? Together they are brighter than one, and not round."""

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Array

DOUBLE = 1.6
"""Share of the usual crest grey above which two strands lie on one crest."""
MOST_DOUBLE = 2.6
"""Share of the usual crest grey from which it is not two strands but a brighter wire."""
IN_CONTACT = 0.035
"""How far out of round (second harmonic over peak) two strands in contact are at the least; a round wire, with the wall
beside it, is below 0.03."""
ALONE = 0.15
"""Least share of a line in which one strand lies alone: 5 mm of 35."""
OBLONG = 0.12
"""How far out of round a line of any brightness is that is no single wire; two that are two voxels apart have 0.2."""
STRANDS_VOXELS = 2.2
"""Two strands of one curve nearer than this share their crest."""


def of_one_strand(share: Array, seen: NDArray[np.bool_]) -> float:
    """Height of one strand over that of most of the line: below 1 where two strands lie together nearly all along."""
    height = float(np.quantile(share[seen], ALONE)) if seen.any() else 1.0
    return min(1.0, height) if height > 0.0 else 1.0


def doubled(share: Array, oblong: Array, bright: Array, noise: float) -> NDArray[np.bool_]:
    """Points (n,) where two strands may lie on one crest: not round, or too bright where noise hides the shape.

    The closer two strands are, the brighter and the rounder is their crest; one that is over MOST_DOUBLE times as
    bright is no two strands but a coil of platinum.
    """
    own = noise / np.maximum(share, 1.0)
    least = np.where(share < MOST_DOUBLE, np.interp(share, [1.0, DOUBLE], [OBLONG, IN_CONTACT]), OBLONG)
    hidden = (share > bright) & (share < MOST_DOUBLE) & (own > 0.25 * IN_CONTACT)
    # in a line as bright as two, one standard deviation is enough: two in contact have 0.06, which three would hide
    sure = np.where(share < MOST_DOUBLE, np.interp(share, [1.0, DOUBLE], [3.0, 1.0]), 3.0)
    return np.asarray(hidden | (oblong > least + sure * own))
