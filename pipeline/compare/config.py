"""Settings of how curves are compared."""

from dataclasses import dataclass

from pipeline.ranges import Count, Step


@dataclass(frozen=True)
class CompareConfig:
    """How curves are compared."""

    sample_mm: Step = 0.5
    """Arc-length step at which both curves are sampled, so that segment lengths cannot flatter."""
    bootstrap: Count = 2000
    """Resamples behind the 95 % intervals; 0 leaves them out."""
