"""What is known of one frame; a stage that learns more returns a new record."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.compare import Comparison
from pipeline.model import Array, Curve, Simulated
from pipeline.register import Registration
from pipeline.status import FrameStatus, StageError


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame of a case.

    status : identifier (``ok``, a FrameStatus or a solver status).     stage, message : where and why it is not ok.
    expected_mm : depth that the manifest states.     depth_mm : depth that was simulated.
    projections : maximum-intensity projections of the scan along the array axes.
    """

    index: int
    status: str = FrameStatus.OK.identifier
    sentence: str = FrameStatus.OK.value
    stage: str = ""
    message: str = ""
    expected_mm: float = float("nan")
    depth_mm: float = float("nan")
    roll_deg: float = 0.0
    curve: Curve | None = None
    simulated: Simulated | None = None
    comparison: Comparison | None = None
    registration: Registration | None = None
    truth_mm: Array | None = None
    truth: dict[str, float] = field(default_factory=dict)
    nulls_rms_mm: dict[str, float] = field(default_factory=dict)
    projections: tuple[NDArray[np.uint8], ...] = ()

    @property
    def ok(self) -> bool:
        """Traced, simulated to its depth, converged and compared (or simulated, in a case without scans)."""
        return self.status in (FrameStatus.OK.identifier, FrameStatus.SIMULATED.identifier)

    @property
    def traced(self) -> bool:
        """There is a curve to compare with, whether or not it is to be trusted."""
        return self.curve is not None and len(self.curve.points_mm) > 1

    @property
    def trusted_curve(self) -> Curve | None:
        """The traced curve of a frame that loading and tracing found nothing wrong with."""
        return self.curve if self.traced and self.stage not in ("load", "trace") else None

    def failed(self, stage: str, why: FrameStatus | StageError, message: str = "") -> Frame:
        """The same frame with what went wrong; the first failure is kept, later ones are its consequences."""
        status = why.status if isinstance(why, StageError) else why
        text = str(why) if isinstance(why, StageError) else message
        return self.failed_with(stage, status.identifier, status.value, text)

    def failed_with(self, stage: str, identifier: str, sentence: str, message: str = "") -> Frame:
        """The same for a status that is not a FrameStatus (the solver's own)."""
        if not self.ok:
            return self
        return replace(self, status=identifier, sentence=sentence, stage=stage, message=message)
