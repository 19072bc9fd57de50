"""What rms_mm misses: tips that lie apart, or a part of the traced wires that no simulated one is near."""

from collections.abc import Mapping
from typing import Any

from reports._content import number, value_of

TIPS_OFF_RATIO, TIPS_OFF_MM = 3.0, 0.5
"""From which tip_median_mm on, over rms_mm and in mm, the tips contradict it. The 27 scenes of the catalogue, replayed
to the traced length, have ratios up to 2.4."""
NEAR_MM, LEAST_COVERED = 1.0, 0.95
"""Where the simulated wires lie so near the traced ones and less than this share of these has one as near, a part of
them is missing: of wires that fold back in a third of the frames the median tip is right."""
BACK_RATIO, BACK_MM = 2.0, 0.2
"""From which back_rms_mm on, over rms_mm and in mm, a part is missing. Of 1237 cases 90 % have ratios up to 1.05, and
none that was not made to end early above 1.9; those that end 2 mm early in half of their frames have 2.6 to 3.7."""


def tips_off(statistics: Mapping[str, Any]) -> str:
    """That the tips lie apart, which rms_mm misses: its distances go from the simulated wire to the traced one."""
    tip, rms, along = (value_of(statistics.get(key)) for key in ("tip_median_mm", "rms_mm", "tip_along_median_mm"))
    unseen = "rms_mm does not see that, judge by tip_median_mm and back_rms_mm."
    if not tip > max(TIPS_OFF_MM, TIPS_OFF_RATIO * rms):
        covered, most = value_of(statistics.get("coverage")), value_of(statistics.get("p95_mm"))
        if covered < LEAST_COVERED and most <= NEAR_MM:
            return f"{100 * (1 - covered):.0f} % of the traced wires have no simulated one near: {unseen}"
        back = value_of(statistics.get("back_rms_mm"))
        farther = (
            f"The traced wires lie {number(back)} mm from the simulated ones, which in some frames do not reach all of "
            f"them: {unseen}"
        )
        return farther if back > max(BACK_MM, BACK_RATIO * rms) else ""
    if along > 0.5 * tip:  # what lies beyond the trace counts with its distance from the trace's end
        return f"The wire's tip lies {number(along)} mm farther along the vessel (median): judge by tip_median_mm."
    where = f"{number(-along)} mm short along the vessel" if -along > 0.5 * tip else f"{number(tip)} mm off"
    return f"The wire's tip lies {where} (median): {unseen}"
