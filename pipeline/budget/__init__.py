"""budget: how much of an error the uncertainty of inputs, trace and segments explains, and how much is the model's.

After ASME V&V 20: the insertion is replayed by an ensemble whose inputs are drawn from their uncertainties. Its spread,
the trace's and the segments' make u_val; an error within 2 u_val says nothing of the model, one beyond it does.
"""

from pipeline.budget.ensemble import Scene, replayed
from pipeline.budget.frame import Budget, FrameSample, frame_budget
from pipeline.budget.inputs import SOURCES, Nominal, Sigmas, alone, drawn, exact, sigmas_of
from pipeline.budget.joint import coefficients, rank_of_ends
from pipeline.budget.shapes import releases

__all__ = [
    "SOURCES",
    "Budget",
    "FrameSample",
    "Nominal",
    "Scene",
    "Sigmas",
    "alone",
    "coefficients",
    "drawn",
    "exact",
    "frame_budget",
    "rank_of_ends",
    "releases",
    "replayed",
    "sigmas_of",
]
