"""Settings of how curves are compared."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from pipeline.ranges import Millimetres, Number, Truth


@dataclass(frozen=True)
class CompareConfig:
    """How curves are compared."""

    sample_mm: Annotated[float, Field(ge=0.01, le=5, allow_inf_nan=False), Number] = 0.5
    """Arc-length step at which both curves are sampled, so that segment lengths cannot flatter."""
    skip_mm: Millimetres = 10.0
    """Length of wire behind the entry that no score counts, since the clamp was fitted there."""
    simulated_nulls: Truth = True
    """Whether simulators without the roll and without the tip's curve are among the predictors, traces may speak for
    another curve of the tip, and entries.csv is written. That takes 20 more insertions, of a straight wire 4."""
