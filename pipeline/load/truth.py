"""The known wire of a synthetic study, read from truth.json; real studies have none."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from pipeline.load.geometry import LoadError
from pipeline.model import Array


def read_truth(path: Path, frame_count: int) -> list[Array]:
    """True wires, one (n, 3) LPS mm curve per frame from the entry to the tip."""
    try:
        frames = json.loads(path.read_text(encoding="utf-8"))["frames"]
        curves = [np.array(frame["points_mm"], dtype=np.float64) for frame in frames]
    except (OSError, ValueError, KeyError, TypeError) as error:
        msg = f'{path}: cannot be read as truth: {error!r}; expected {{"frames": [{{"points_mm": [[x, y, z], ...]}}]}}'
        raise LoadError(msg) from None
    if len(curves) != frame_count or any(c.ndim != 2 or c.shape[1] != 3 for c in curves):
        msg = f"{path}: holds {len(curves)} curves, expected {frame_count} of shape (n, 3), one per frame"
        raise LoadError(msg)
    return curves
