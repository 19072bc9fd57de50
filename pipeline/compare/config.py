"""Settings of how curves are compared."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class CompareConfig:
    """How curves are compared."""

    sample_mm: float = 0.5
    """Arc-length step at which both curves are sampled, so that segment lengths cannot flatter."""
    bootstrap: int = 2000
    """Resamples behind the 95 % intervals; 0 leaves them out."""
