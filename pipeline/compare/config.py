"""Settings of how curves are compared."""

from dataclasses import dataclass

from pipeline.ranges import Positive


@dataclass(frozen=True)
class CompareConfig:
    """How curves are compared."""

    sample_mm: Positive = 0.5
    """Arc-length step at which both curves are sampled, so that segment lengths cannot flatter."""
