"""Segments that are too long for a wire's rest curvature, told before anything is computed."""

import math
from collections.abc import Sequence

import numpy as np

from pipeline.budget.inputs import REST_CURVATURE
from pipeline.calibrate.unknowns import MOST_CURVED
from pipeline.simulate import altered
from pipeline.simulate.resolution import lengths_mm
from pipeline.study.manifest import Case
from pipeline.study.settings import Config

SIGMAS = 4.0
"""Standard deviations within which an ensemble's rest curvatures are expected."""


def too_coarse(cases: Sequence[Case], config: Config, *, calibrates: bool = False) -> list[str]:
    """Cases whose wire turns by more than a right angle within a segment at rest, a sentence each.

    calibrates : also the strongest curvature that a calibration tries has to fit.
    """
    return [f"case {case.id!r}: {text}" for case in cases if (text := _too_coarse(case, config, calibrates))]


def _too_coarse(case: Case, config: Config, calibrates: bool) -> str:
    rest = np.asarray(altered(case.wire, config.simulate).rest_curvature_per_mm, dtype=float)
    curvature = float(np.abs(np.atleast_2d(rest)[:, -1]).max())
    drawn = case.uncertainty.rest_curvature
    spread = (REST_CURVATURE if drawn is None else drawn) * SIGMAS if config.budget.members else 0.0
    room = MOST_CURVED if calibrates else 1.0 + spread
    length = lengths_mm(config.solver.segment_mm, curvature)[-1 if config.solver.segment_mm != "auto" else 0]
    if length * curvature * room <= math.pi / 2:
        return ""
    tried = f", and up to {room:.3g} times that in a {'calibration' if calibrates else 'budget'}" * (room > 1.0)
    what = f"segments of {length:g} mm cannot follow a rest curvature of {curvature:.3g} per mm{tried}: "
    what += "a segment turns by a right angle at most"
    if config.solver.segment_mm == "auto":
        most = math.pi / 2 / (length * room)
        keys = "uncertainty.rest_curvature" if spread > 1.0 else "simulate.rest_curvature_scale"
        return f"{what}; give the wire {most:.3g} per mm or less, or lower {keys}"
    most = math.floor(50 * math.pi / (curvature * room)) / 100
    return f"solver.segment_mm = {length:g}: {what}; allowed: up to {most:g} mm for this wire, or auto"
