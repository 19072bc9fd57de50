"""The errors of two runs as a ratio, and what may be concluded from it."""

from dataclasses import dataclass

import numpy as np

from pipeline.compare import intervals
from reports.case_files import counted


@dataclass(frozen=True)
class Ratio:
    """Pooled rms of one run over that of another, on the frames that count in both; note : see ``intervals.note``.

    back : the same of the distances from the traced to the simulated wires, with its interval; NaN without any.
    """

    value: float
    low: float
    high: float
    frames: int
    note: str
    back: tuple[float, float, float] = (float("nan"),) * 3

    @property
    def sentence(self) -> str:
        """One line for a reader."""
        known = intervals.in_words(self.low, self.high, self.note)
        return f"rms of the second run / the first, on {counted(self.frames, 'frame')}: {self.value:.3f} ({known})"

    def verdict(self, allowed: float = 1.0, caveat: str = "") -> str:
        """The sentence, and what may be concluded from it.

        allowed : the ratio up to which the second run is not called worse.     caveat : why nothing may be concluded.
        """
        if caveat:
            meaning = f"says nothing, since {caveat}"
        elif self.value == 1.0 and not self.low < self.high:
            meaning = "the error of no validation frame changed"
        elif not np.isfinite(self.low):
            meaning = "too few insertions to say whether another study would show the same"
        elif self.low <= 1.0 <= self.high:
            meaning = "no difference is shown"
        elif 1.0 < self.low <= allowed:
            more = "whether by more" if self.value > allowed else "by no more"
            meaning = f"the second's errors are larger, {more} than is allowed (ratio {allowed:g})"
            meaning += " is not shown" * (self.value > allowed)
        elif self.low > 1.0:
            meaning = "the second is worse"
        elif self.back[2] >= 1.0:
            back = f"back_rms_mm {self.back[0]:.3f} times as large, {intervals.in_words(*self.back[1:], self.note)}"
            meaning = (
                "the second is nearer by rms_mm, and not shown to be nearer the other way, from the traced wires "
                f"({back}): does it end early?"
            )
        else:
            meaning = "the second is better"
        return f"{self.sentence}: {meaning}"
