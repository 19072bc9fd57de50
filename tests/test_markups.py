"""3D Slicer's markups: the two readers, which share no code, take the same file for the same curve."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from data_synthetic.anatomy.centrelines import read_tree
from pipeline.load.curves import read_curve
from pipeline.load.lumens import read_markups_branches

POINTS = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [8.0, 8.0, 9.0]])


@pytest.mark.parametrize(
    ("said", "flip"),
    [({}, 1.0), ({"coordinateSystem": "LPS"}, 1.0), ({"coordinateSystem": "RAS"}, -1.0)],
    ids=["unsaid", "LPS", "RAS"],
)
def test_both_readers_agree_on_the_coordinate_system(tmp_path: Path, said: dict[str, Any], flip: float) -> None:
    """A file that does not say is LPS, as for 3D Slicer itself."""
    path = tmp_path / "curve.mrk.json"
    radius = {"name": "Radius", "controlPointValues": [1.0, 1.0, 1.0]}
    points = [{"position": p.tolist()} for p in POINTS]
    curve = {"type": "Curve", "controlPoints": points, "measurements": [radius]} | said
    path.write_text(json.dumps({"markups": [curve]}), encoding="utf-8")
    expected = POINTS * [flip, flip, 1.0]
    np.testing.assert_array_equal(read_curve(path).points_mm, expected)
    np.testing.assert_array_equal(read_markups_branches(path).start_mm, expected[:-1])
    np.testing.assert_array_equal(read_tree(path).points_mm, expected)
