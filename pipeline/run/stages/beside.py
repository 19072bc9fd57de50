"""The user's own curves beside the wires that the scans show: one of another frame, or moved, is not passed over."""

from collections.abc import Sequence

import numpy as np

from pipeline.compare.metrics import point_to_curve
from pipeline.model import Curve
from pipeline.run.stages.known import Frame
from pipeline.status import FrameStatus
from pipeline.trace.config import TraceConfig
from reports.case_files import listed

OFF_VOXELS, OFF_SIGMAS = 0.75, 3.0
"""Median distance from a traced wire, in voxels and in its own standard deviations, above which a curve is not its."""
MOST_NAMED = 6


def beside_what_is_seen(
    frames: Sequence[Frame], seen: Sequence[Curve | None], config: TraceConfig, voxel_mm: float
) -> list[str]:
    """A warning where own curves lie off the wires that are seen, or have other lengths; says nothing of the others.

    seen : of each frame the wire that its scan shows; None where the curve of the frame is that very one.
    """
    said = {}
    for frame, wire in zip(frames, seen, strict=True):
        if wire is None or wire.status is not FrameStatus.OK or frame.curve is None or not frame.traced:
            continue
        away = point_to_curve(wire.points_mm, frame.curve.points_mm)[0]
        off, longer = float(np.median(away)), frame.curve.length_mm - wire.length_mm
        if off > max(OFF_VOXELS * voxel_mm, OFF_SIGMAS * float(np.median(wire.sigma_mm))):
            said[frame.index] = f"{off:.2f} mm off"
        elif abs(longer) > config.length_tolerance_mm:
            said[frame.index] = f"{abs(longer):.1f} mm {'longer' if longer > 0 else 'shorter'}"
    if not said:
        return []
    each = listed([f"frame {index}: {what}" for index, what in said.items()], MOST_NAMED)
    return [
        f"the manifest's own curves are not where the scans show the wire ({each}): check which curve belongs to "
        "which frame, its units and LPS; without the key traces the scans are traced"
    ]
