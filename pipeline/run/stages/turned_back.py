"""Simulated wires that have turned round in the vessel and run back beside themselves."""

from collections.abc import Mapping

import numpy as np
from scipy.spatial import cKDTree

from pipeline.compare.ways import cheapest_ways
from pipeline.model import Array
from reports.case_files import counted, listed
from solver import Grid

BACK_RADII = 3.0
"""How far back a tip may come, in radii of the lumen's widest place: the loops of a wire in a sac come less far (a real
sac of 5.5 mm: 2.5 radii, where wires that ran back in the vessel before it came 3 to 10)."""


def turned_back(distance: Grid, entry_mm: Array, wires: Mapping[int, Array]) -> list[str]:
    """A warning where tips lie far nearer the entry, along the vessel, than the wire behind them reaches.

    distance : mm to the lumen's wall, negative inside.     wires : joints (n, 3) LPS mm by frame, the tip last.
    """
    lumen = distance.values < 0
    ways = (
        cheapest_ways(np.where(lumen, 1.0, np.inf), distance.spacing_mm, distance.to_index(entry_mm)) if wires else None
    )
    if ways is None:
        return []
    inside = cKDTree(distance.to_mm(ways.voxels.astype(float)))
    reached = {frame: ways.total[inside.query(joints)[1]] for frame, joints in wires.items()}
    back = {frame: float(way.max() - way[-1]) for frame, way in reached.items()}
    most = BACK_RADII * -float(distance.values.min())
    far = {frame: mm for frame, mm in back.items() if mm > most}
    if not far:
        return []
    worst = max(far, key=lambda frame: far[frame])
    return [
        f"{counted(len(far), 'frame')} ({listed([*map(str, far)])}): the simulated wire has turned round and runs back "
        f"in the vessel, in frame {worst} from {reached[worst].max():.0f} mm along it by {far[worst]:.0f} mm; see "
        "whether the real one would, and check roll_deg, rest_curvature_per_mm, entry and lumen"
    ]
