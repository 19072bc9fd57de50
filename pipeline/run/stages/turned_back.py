"""Simulated wires that have turned round in the vessel and run back beside themselves."""

from collections.abc import Mapping

import numpy as np
from scipy.spatial import cKDTree

from pipeline.compare.ways import cheapest_ways
from pipeline.model import Array
from pipeline.run.stages.covered import room_mm
from reports.case_files import frames_named
from solver import VesselWall

BACK_RADII = 3.0
"""How far back a wire may come, in radii of the widest place where it does: the loops of a wire in a sac come less far
(a real sac of 5.5 mm: 2.5 radii, where wires that ran back in the vessel before it came 3 to 10)."""


def turned_back(wall: VesselWall, entry_mm: Array, wires: Mapping[int, Array]) -> list[str]:
    """A warning where a wire, anywhere along it, lies far nearer the entry along the vessel than what is behind it.

    wires : joints (n, 3) LPS mm by frame, the tip last.
    """
    distance = wall.distance
    lumen = distance.values < 0
    ways = (
        cheapest_ways(np.where(lumen, 1.0, np.inf), distance.spacing_mm, distance.to_index(entry_mm)) if wires else None
    )
    if ways is None:
        return []
    known = np.isfinite(ways.total)  # a piece of lumen that no way leads to tells nothing
    inside, far = cKDTree(distance.to_mm(ways.voxels[known].astype(float))), {}
    for frame, joints in wires.items():
        way = ways.total[known][inside.query(joints)[1]]
        back = np.maximum.accumulate(way) - way
        last = int(np.argmax(back))
        turns = int(np.argmax(way[: last + 1]))
        widest = room_mm(wall, joints[turns : last + 1], -0.5 * float(distance.values.min())).max()
        if back[last] > BACK_RADII * widest:
            far[frame] = float(way[turns]), float(back[last])
    if not far:
        return []
    worst = max(far, key=lambda frame: far[frame][1])
    return [
        f"{frames_named([*far])}: the simulated wire has turned round and runs back in the vessel, in frame {worst} "
        f"from {far[worst][0]:.0f} mm along it by {far[worst][1]:.0f} mm; see whether the real one would, and check "
        "roll_deg, rest_curvature_per_mm, entry and lumen"
    ]
