"""compare: how far the simulated wire is from the real one, and from what anybody would guess."""

from __future__ import annotations

from pipeline.compare.metrics import Comparison, TruthErrors, compare, compare_truth, point_to_curve, rms

__all__ = ["Comparison", "TruthErrors", "compare", "compare_truth", "point_to_curve", "rms"]
