"""The spread of values most of which are noise."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

MAD = 1.4826
"""Standard deviation of normal noise over its median absolute deviation."""


def spread(values: NDArray[Any]) -> float:
    """Standard deviation (of normal noise) from the median absolute deviation: what stands out of it has no say."""
    return MAD * float(np.median(np.abs(values - np.median(values))))
