"""Whether the scan that is named as the one without wire shows one: what is in both scans is subtracted away."""

from pipeline.model import Lumen, Volume
from pipeline.run.stages.known import Context
from pipeline.status import FrameStatus
from pipeline.trace import trace

LEAST_MM = 5.0
"""Shorter lines are calcifications and the like."""


def wire_in_reference(run: Context, reference: Volume | None, lumen: Lumen) -> list[str]:
    """A warning where a wire can be traced in the reference as in a frame; a case without a reference has none."""
    if reference is None or run.case.traces:
        return []
    case, aside = run.case, run.part()  # in a log of its own: what is counted is of the frames
    seen = aside.stored(
        "trace", trace, reference, lumen, case.entry_mm, case.entry_direction, reference=None, config=run.config.trace
    )
    if seen.status is not FrameStatus.OK or seen.length_mm < LEAST_MM:
        return []
    return [
        f"the reference shows a line of {seen.length_mm:.0f} mm from the entry, which is as a wire: it is no scan "
        "without wire, and what lies there in a frame, too, is not traced; name another reference, or none"
    ]
