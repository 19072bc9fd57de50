"""Whether the wire is brighter than the scan's greys go: what is cut off there ends later than it seems.

A wire's end is where its brightness has fallen to half. With its crest cut off, half of what is left lies farther out:
up to 1.7 voxels where a wire is several times as bright as the largest grey, 0.05 where its crest alone is cut off.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pipeline.arrays.polyline import resample
from pipeline.model import Curve, Volume
from reports.case_files import frames_named

CUT_OFF, TOGETHER = 0.25, 5
"""Share of a wire with so many voxels of the scan's greatest grey around it (of 27) from which on it is cut off. Noise
has that grey once; a line along an axis without noise in 3 voxels, and is not cut off."""
TIP_VOXELS = 1.0
"""What is not known of such a wire's tip, added to its standard deviation."""
LEVEL = "saturated_share"
AROUND = np.stack(np.meshgrid(*[(-1, 0, 1)] * 3), -1).reshape(-1, 1, 3)


def saturated(curve: Curve, volume: Volume) -> Curve:
    """The curve; where its wire is brighter than the scan's greys go, its tip is less sure, and its levels say so."""
    if len(curve.points_mm) < 2:
        return curve
    spacing = volume.spacing_mm
    index = np.rint(volume.to_index(resample(curve.points_mm, 0.5 * volume.voxel_mm))).astype(int)
    near = np.clip(index + AROUND, 0, np.array(volume.shape) - 1)
    top = volume.values[tuple(np.moveaxis(near, -1, 0))] == volume.values.max()
    share = float(np.mean(top.sum(axis=0) >= TOGETHER))
    if share < CUT_OFF:
        return curve
    sigma = float(np.hypot(np.nan_to_num(curve.tip_sigma_mm), TIP_VOXELS * spacing.max()))
    return replace(curve, tip_sigma_mm=sigma, levels={**curve.levels, LEVEL: share})


def cut_off(curves: Mapping[int, Curve]) -> list[str]:
    """A warning that names the frames whose wire is brighter than their scans' greys go. curves : by frame."""
    found = {n: curve.levels[LEVEL] for n, curve in curves.items() if LEVEL in curve.levels}
    if not found:
        return []
    return [
        f"{frames_named([*found])}: up to {100 * max(found.values()):.0f} % of the wire have the greatest grey of the "
        "scan: what is brighter is cut off, and the tip may seem up to 1.7 voxels too deep (its standard deviation is "
        "a voxel more); export the scans with a wider window, or more bits"
    ]
