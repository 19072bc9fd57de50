"""Lumen and Curve to arrays and back, for the stage store."""

from __future__ import annotations

from typing import Any

import numpy as np

from pipeline.model import Curve, Lumen
from pipeline.run.cache import Arrays
from pipeline.status import FrameStatus
from solver.grid import Grid


def pack_lumen(lumen: Lumen) -> tuple[Arrays, dict[str, Any]]:
    """Arrays and JSON part of a lumen."""
    grid = lumen.distance
    arrays = {
        "distance": grid.values,
        "mask": np.packbits(np.asarray(lumen.mask.values, bool)),
        "spacing": grid.spacing_mm,
        "origin": grid.origin_mm,
        "direction": grid.direction,
    }
    meta = {
        "wall_level": lumen.wall_level,
        "warnings": lumen.warnings,
        "counters": dict(lumen.counters),
        "levels": dict(lumen.levels),
    }
    return arrays, meta


def unpack_lumen(arrays: Arrays, meta: dict[str, Any]) -> Lumen:
    """The inverse of :func:`pack_lumen`."""
    distance = Grid(arrays["distance"], arrays["spacing"], arrays["origin"], arrays["direction"])
    mask = np.unpackbits(arrays["mask"], count=distance.values.size).reshape(distance.shape)
    return Lumen(
        distance,
        distance.with_values(mask),
        meta["wall_level"],
        tuple(meta["warnings"]),
        meta["counters"],
        meta["levels"],
    )


def pack_curve(curve: Curve) -> tuple[Arrays, dict[str, Any]]:
    """Arrays and JSON part of a traced curve."""
    none = np.zeros(0, bool)
    arrays = {
        "points": curve.points_mm,
        "sigma": curve.sigma_mm,
        "flagged": none if curve.flagged is None else curve.flagged,
        "in_plane": none if curve.in_plane is None else curve.in_plane,
    }
    meta = {
        "tip_sigma_mm": curve.tip_sigma_mm,
        "status": curve.status.name,
        "note": curve.note,
        "counters": dict(curve.counters),
        "levels": dict(curve.levels),
    }
    return arrays, meta


def unpack_curve(arrays: Arrays, meta: dict[str, Any]) -> Curve:
    """The inverse of :func:`pack_curve`."""
    return Curve(
        arrays["points"],
        arrays["sigma"],
        meta["tip_sigma_mm"],
        arrays["flagged"],
        FrameStatus[meta["status"]],
        meta["note"],
        meta["counters"],
        arrays["in_plane"],
        meta["levels"],
    )
