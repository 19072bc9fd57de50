"""The user's own curves instead of trace: .csv, .vtp, .mrk.json."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.load import LoadError
from pipeline.load.curves import read_csv_points, read_markups_curve, read_vtp_points
from pipeline.model import Curve

_READERS = {".csv": read_csv_points, ".vtp": read_vtp_points, ".mrk.json": read_markups_curve}


def read_curve(path: Path) -> Curve:
    """One curve, LPS mm, ordered from entry to tip; its uncertainty is unknown (NaN).

    Repeated points are dropped. Raises LoadError for another kind of file, fewer than two points or a NaN.
    """
    kind = next((k for k in _READERS if path.name.lower().endswith(k)), None)
    if kind is None:
        msg = f"{path}: got {path.suffix!r}; expected {', '.join(_READERS)}; export the curve in one of these"
        raise LoadError(msg)
    if not path.exists():
        msg = f"{path}: no such file; check traces in the manifest (relative to the manifest itself)"
        raise LoadError(msg)
    points = _READERS[kind](path)
    if len(points):
        keep = np.concatenate([[True], np.any(np.diff(points, axis=0) != 0, axis=1)])
        points = points[keep]
    if len(points) < 2 or not np.all(np.isfinite(points)):
        msg = f"{path}: got {len(points)} points; expected two or more, all finite; correct the file"
        raise LoadError(msg)
    return Curve(points, np.full(len(points), np.nan), note=f"given: {path.name}")
