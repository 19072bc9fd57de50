"""compare: how far the simulated wire is from the real one, and from what anybody would guess."""

from __future__ import annotations

from pipeline.compare.curves import Comparison, compare, compare_truth
from pipeline.compare.distance import point_to_curve
from pipeline.compare.metrics import rms

__all__ = ["Comparison", "compare", "compare_truth", "point_to_curve", "rms"]
