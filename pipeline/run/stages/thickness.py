"""Whether the traced wire is as thick as the manifest's: a diameter is easily given for a radius, a rod for a wire."""

from collections.abc import Sequence

import numpy as np

from pipeline.model import Curve, Lumen
from pipeline.run.stages.known import Frame, trusted
from pipeline.status import FrameStatus
from pipeline.trace.saturated import LEVEL

LEAST_SHARE = 0.9
"""Ratio of the seen to the stated radius below which the latter is doubted. It is 1.15 to 2.1 in 17 scenes of the
catalogue (the fit is wider than a blurred disc); with twice the radius stated it is 0.57 to 1.05: 15 of them are
noticed."""
DIAMETER_SHARE = 0.8
"""The same below which a diameter is the likely cause; else it is named second: a right radius of 0.18 mm had 0.89."""
LEAST_VOXELS = 1.2
"""Least stated diameter, voxels, whose blur differs from a thin line's: at 0.84 voxels the ratio was 1.0."""
MOST_SHARE, MORE_VOXELS = 2.5, 0.75
"""The same ratio from which, and voxels by which, a line is thicker than any wire of the stated radius looks. The most
of right traces in the scenes of ``tests.studies.seeing`` is 1.9 and 0.6; rods of 1 to 1.2 mm, of 0.36 stated, have 3 to
4 and 1.4 to 2 in voxels of 0.3 mm."""
SHORTEST_VOXELS = 15.0
"""A shorter line hardly tells its blur: a right one of 10 voxels looked 0.81 voxels thicker than it was."""
SHARPEST_VOXELS = 0.8
"""No line is taken to be blurred less: where what surrounds the vessel was set to one grey (a rotational X-ray scan of
a head), its wall looks sharper (0.5) than a wire does, and each right trace there was refused."""


def too_thin(frames: Sequence[Frame], lumen: Lumen, radius_mm: float) -> list[str]:
    """A sentence where the blur of the traced wires leaves no room for the stated radius."""
    blurs = [curve.levels["blur_mm"] for curve in trusted(frames).values() if "blur_mm" in curve.levels]
    if not blurs or 2.0 * radius_mm < LEAST_VOXELS * float(np.max(lumen.distance.spacing_mm)):
        return []
    seen = _seen_radius_mm(float(np.median(blurs)), lumen, unsure=lumen.levels.get("blur_unsure", 0.0))
    if not 0.0 < seen < LEAST_SHARE * radius_mm:  # no line is sharper than the scanner: its blur is misjudged
        return []
    if seen < DIAMETER_SHARE * radius_mm:
        doubt = "is it the diameter? wall contact and stiffness hang on it"
    else:
        less = f"{100.0 * (1.0 - seen / radius_mm):.0f} % less"
        doubt = f"{less}; check the lumen, whose wall tells the scan's blur, and whether it is the diameter"
    return [
        f"the traced wire looks {2.0 * seen:.2f} mm thick at most, and radius_mm = {radius_mm:g} says "
        f"{2.0 * radius_mm:g} mm: {doubt}"
    ]


def not_too_thick(curve: Curve, lumen: Lumen, radius_mm: float) -> Curve:
    """The curve; ambiguous where its line is too thick for a wire of this radius: a rod, a catheter, another wire."""
    voxel = lumen.distance.voxel_mm
    seen = _seen_radius_mm(curve.levels.get("blur_mm", float("nan")), lumen, SHARPEST_VOXELS)
    most = max(MOST_SHARE * radius_mm, radius_mm + MORE_VOXELS * voxel)
    if curve.length_mm < SHORTEST_VOXELS * voxel:
        return curve
    if curve.refused or not seen > most or LEVEL in curve.levels:  # what is cut off looks wide
        return curve
    note = (
        f"trace: wire: got a line that looks {2.0 * seen:.2f} mm thick; expected {2.0 * most:.2f} mm at most of a wire "
        f"of radius_mm = {radius_mm:g}; look whether it is a catheter or a rod (state the catheter), or another wire "
        "(correct radius_mm)"
    )
    return curve.doubted(FrameStatus.TRACE_AMBIGUOUS, note)


def _seen_radius_mm(blur_mm: float, lumen: Lumen, least_voxels: float = 0.0, unsure: float = 0.0) -> float:
    """Radius that a line of this blur looks to have: a disc of radius r adds r^2 / 4 to the variance of the blur.

    least_voxels : of the scanner's own, that of the lumen's wall.  unsure : share by which that may be too large.  NaN
    where it is unknown, and in slices that are thicker than pixels, which have a blur of their own (a ratio of 0 was
    seen).
    """
    spacing_mm = lumen.distance.spacing_mm
    if not spacing_mm.max() < 1.2 * spacing_mm.min():
        return float("nan")
    walls = (1.0 - unsure) * lumen.levels.get("scanner_blur_mm", np.nan)
    scanner = np.maximum(walls, least_voxels * spacing_mm.min())
    return 2.0 * float(np.sqrt(np.maximum(0.0, blur_mm**2 - scanner**2)))
