"""Whether the traced wire is as thick as the manifest's: a diameter is easily given for a radius."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.run.stages.known import Frame

LEAST_SHARE = 0.9
"""Ratio of the seen to the stated radius below which the latter is doubted. It is 1.15 to 2.1 in 17 scenes of the
catalogue (the fit is wider than a blurred disc); with twice the radius stated it is 0.57 to 1.05: 15 of them are
noticed."""
LEAST_VOXELS = 1.2
"""Least stated diameter, voxels, whose blur differs from a thin line's: at 0.84 voxels the ratio was 1.0."""


def too_thin(
    frames: Sequence[Frame], scanner_blur_mm: float, radius_mm: float, spacing_mm: NDArray[np.float64]
) -> list[str]:
    """A sentence where the blur of the traced wires leaves no room for the stated radius.

    A disc of radius r adds r^2 / 4 to the variance of the blur. scanner_blur_mm : of the lumen's wall; NaN where
    unknown. Slices that are thicker than pixels have a blur of their own (a ratio of 0 was seen), and nothing is said.
    """
    curves = [curve for frame in frames if (curve := frame.trusted_curve) is not None]
    blurs = [curve.levels["blur_mm"] for curve in curves if "blur_mm" in curve.levels]
    least, most = float(np.min(spacing_mm)), float(np.max(spacing_mm))
    known = bool(blurs) and np.isfinite(scanner_blur_mm) and most < 1.2 * least
    if not known or 2.0 * radius_mm < LEAST_VOXELS * most:
        return []
    seen = 2.0 * float(np.sqrt(max(0.0, float(np.median(blurs)) ** 2 - scanner_blur_mm**2)))
    if seen == 0.0 or seen >= LEAST_SHARE * radius_mm:  # no line is sharper than the scanner: its blur is misjudged
        return []
    return [
        f"the traced wire looks {2.0 * seen:.2f} mm thick at most, and radius_mm = {radius_mm:g} says "
        f"{2.0 * radius_mm:g} mm: is it the diameter? wall contact and stiffness hang on it"
    ]
