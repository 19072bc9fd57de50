"""The stress study: seeded random scenes, each run in its own process, each outcome judged independently."""

from __future__ import annotations

from pipeline.benchmark.stress.axes import AXES
from pipeline.benchmark.stress.plan import Plan, draw
from pipeline.benchmark.stress.study import run_stress, stress_table

__all__ = ["AXES", "Plan", "draw", "run_stress", "stress_table"]
