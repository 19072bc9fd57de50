"""Is a part of the frame the reference itself? Where voxels were copied, no wire can be seen, and a line ends there."""

import numpy as np

from pipeline.model import Array

MOST_COPIED, LEAST_DARKER = 0.05, 0.05
"""Share of the lumen's voxels that are the reference's to the last bit, beyond those that noise makes, from which a
part was copied; and the share that is darker than the reference where there is noise: scans without are alike all over.
"""
BY_CHANCE = 1.5
"""The most that one difference of grey is more frequent than the next, by noise alone."""


def copied_share(grey: Array, still: Array) -> float:
    """Share of voxels (n,) of a frame that are the reference's, ``still``, to the last bit, beyond chance; else 0."""
    if not len(still):
        return 0.0
    inner = (still > np.min(still)) & (still < np.max(still))  # what is cut off is alike, too
    apart = grey[inner].astype(float) - still[inner]
    if not np.count_nonzero(apart < 0.0) > LEAST_DARKER * len(apart):
        return 0.0
    difference, count = np.unique(apart, return_counts=True)
    other = count[difference != 0.0].max(initial=0)
    share = float(np.sum(count[difference == 0.0]) - BY_CHANCE * other) / len(apart)
    return share if share > MOST_COPIED else 0.0
