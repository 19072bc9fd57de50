"""What is known of one frame once the stages have passed over it."""

from __future__ import annotations

from dataclasses import dataclass, field

from numpy.typing import NDArray

from pipeline.compare.metrics import Comparison, TruthErrors
from pipeline.model import Array, Curve, Simulated
from pipeline.register import Registration
from pipeline.status import FrameStatus, StageError


@dataclass
class Frame:
    """One frame on its way through the stages; the only mutable record of the pipeline.

    status : identifier (``ok``, a FrameStatus or a solver status).     stage, message : where and why it is not ok.
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
    truth: TruthErrors = field(default_factory=TruthErrors)
    nulls_rms_mm: dict[str, float] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    projections: tuple[NDArray, ...] = ()  # type: ignore[type-arg]

    @property
    def ok(self) -> bool:
        """Traced, simulated to its depth, converged and compared (or simulated, in a case without scans)."""
        return self.status in (FrameStatus.OK.identifier, FrameStatus.SIMULATED.identifier)

    def fail(self, stage: str, status: FrameStatus, message: str = "") -> None:
        """Record the first thing that went wrong; later ones are its consequences."""
        self.fail_with(stage, status.identifier, status.value, message)

    def fail_with(self, stage: str, identifier: str, sentence: str, message: str = "") -> None:
        """The same for a status that is not a FrameStatus (the solver's own)."""
        if self.ok:
            self.status, self.sentence, self.stage, self.message = identifier, sentence, stage, message

    def fail_from(self, stage: str, error: StageError) -> None:
        """The same from an exception."""
        self.fail(stage, error.status, str(error))
