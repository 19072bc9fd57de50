"""Projections of a scan, small enough to keep one of each frame."""

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Volume


def projections(volume: Volume, window: tuple[float, float]) -> tuple[NDArray[np.uint8], ...]:
    """Maximum-intensity projections along the three array axes, 8 bit within the grey-value ``window``."""
    low, high = window
    scale = 255.0 / max(high - low, 1e-9)
    peaks = (volume.values.max(axis=axis).astype(np.float32) for axis in range(3))
    return tuple(np.clip((peak - low) * scale, 0, 255).astype(np.uint8) for peak in peaks)


def grey_window(volume: Volume) -> tuple[float, float]:
    """Grey values from the darkest projection pixels to the wire's: 1st and 99.9th percentile of a projection."""
    peak = volume.values.max(axis=2)
    low, high = np.percentile(peak, (1.0, 99.9))
    return float(low), float(high)
