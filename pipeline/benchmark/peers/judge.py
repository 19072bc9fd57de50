"""Errors of an answer against one converged reference, and its row in the table."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.benchmark import scenes
from pipeline.benchmark.errors import resampled, shape_error
from pipeline.benchmark.peers.common import DEPTH_B_MM, EI, LENGTH_A_MM
from pipeline.benchmark.reference import Reference, reference

Array = NDArray[np.float64]


@cache
def limit_of(scene: str) -> Reference:
    """The reference of scene A or B."""
    return reference(scenes.cantilever() if scene == "cantilever" else scenes.bend(DEPTH_B_MM))


def bending_energy(points: Array) -> float:
    """Bending energy of a polyline, N mm, by the turn at its nodes: tells a folded wire from a bent one."""
    along = np.diff(points, axis=0)
    length = np.linalg.norm(along, axis=1)
    unit = along / length[:, None]
    turn = np.arctan2(
        np.linalg.norm(np.cross(unit[:-1], unit[1:]), axis=1), np.einsum("na,na->n", unit[:-1], unit[1:])
    )
    return float(0.5 * EI * np.sum(turn**2 / (0.5 * (length[:-1] + length[1:]))))


def row_of(answer: dict[str, Any], scene: str, n: int, per_mm: int) -> dict[str, Any]:
    """A row with the columns of the benchmark's table and what the peers' own table adds."""
    limit, length = limit_of(scene), LENGTH_A_MM if scene == "cantilever" else DEPTH_B_MM
    points, seconds = np.array(answer["points"]), np.array(answer["seconds"])
    shape, tip = shape_error(_sampled(points, limit.arcs_mm), limit.points_mm)
    return {
        "scene": scene,
        "method": answer["name"],
        "segment_mm": length / n,
        "hull": "offset",
        "tolerance": float("nan"),
        "ms_per_mm": 1e3 * float(seconds.sum()) / length,
        "tip_error_mm": tip,
        "shape_error_mm": shape,
        "iterations": float("nan"),
        "joints": n,
        "steps_per_mm": per_mm,
        "steps": len(seconds),
        "ms_per_step": 1e3 * float(seconds.mean()),
        "ms_last_step": 1e3 * float(seconds[-1]),
        "relative_tip_error": tip / length,
        "bending_uJ": 1e3 * bending_energy(points),
        "callback_share": float("nan") if answer["callback"] is None else answer["callback"],
        "status": answer["status"],
        "note": answer["note"],
        "reference_uncertainty_mm": limit.uncertainty_mm,
    }


def _sampled(points: Array, arcs: Array) -> Array:
    """A rival's polyline at arc lengths counted back from its tip: a node before the clamp falls away."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return resampled(points, along - along[-1] + arcs[-1], arcs)
