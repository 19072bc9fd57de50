"""Settings of how curves are compared."""

from dataclasses import dataclass

from pipeline.ranges import Positive


@dataclass(frozen=True)
class CompareConfig:
    """How curves are compared."""

    sample_mm: Positive = 0.5
    """Arc-length step at which both curves are sampled, so that segment lengths cannot flatter."""
    simulated_nulls: bool = True
    """Whether simulators without the roll and without the tip's curve are among the predictors: 13 more insertions."""
