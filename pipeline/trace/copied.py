"""Is a part of the frame the reference itself? Where voxels were copied, no wire can be seen, and a line ends there."""

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Array

MOST_COPIED, LEAST_DARKER = 0.05, 0.05
"""Share of the lumen's voxels in pieces that are the reference's to the last bit, beyond what noise makes, from which a
part was copied; and the share of voxels darker than the reference where there is noise: scans without are alike all
over."""
PIECE, BY_CHANCE = 8, 3.0
"""Voxels in a row that are looked at together, and times that pieces may be alike more often than by chance: of scans
in coarse steps of grey half of the voxels are alike, but hardly any eight in a row."""


def copied_share(grey: Array, still: Array, runs: NDArray[np.int64]) -> float:
    """Share of the voxels in pieces that are the reference's, ``still`` (n,), to the last bit, beyond chance; else 0.

    grey : (n,) of the frame.     runs : (m, 4) of these voxels, i, j, first k, stop k. Pieces with a voxel at either
    end of a scan's grey say nothing: where negative grey is cut off at 0, half of all tissue is alike.
    """
    lengths = runs[:, 3] - runs[:, 2]
    pieces = lengths // PIECE
    begun = np.cumsum(lengths) - lengths - PIECE * (np.cumsum(pieces) - pieces)
    first = np.repeat(begun, pieces) + PIECE * np.arange(pieces.sum())
    if not len(first) or np.count_nonzero(grey < still) < LEAST_DARKER * len(still):
        return 0.0
    at = first[:, None] + np.arange(PIECE)
    same = np.count_nonzero((grey == still)[at[~_at_an_end(grey, still)[at].any(axis=1)]], axis=1)
    if not len(same):
        return 0.0
    whole = same == PIECE
    share = float(np.mean(whole))
    alike = float(np.mean(same[~whole])) / PIECE if not whole.all() else 1.0
    return share if share > MOST_COPIED + BY_CHANCE * alike**PIECE else 0.0


def _at_an_end(grey: Array, still: Array) -> NDArray[np.bool_]:
    """Which voxels have the least grey of either scan (n,), or the most."""
    return np.asarray(np.any([one == end for one in (grey, still) for end in (one.min(), one.max())], axis=0))
