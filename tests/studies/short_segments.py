"""What segments of 0.0625 mm say otherwise: the push in lumens with hardly any room, num_mm of stiff shafts.

``python -m tests.studies.short_segments`` prints both tables of the manual (some minutes).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from pipeline.simulate.resolution import AGREED_MM, FINEST_MM, lengths_mm, moved_mm, resolve
from solver import Grid, GuideWire, Insertion, Solution, VesselWall
from solver.grid import Array
from tests.solver.scenes import winding

RADIUS_MM = 0.18
ROOMS_MM = (0.25, 0.3, 0.4, 0.6)
RATIOS = (1.0, 10.0, 100.0, 1000.0)
OFF_MM = 0.03


def vessel(points: Array, lumen_mm: Array, voxel_mm: float, wall_N_mm2: float) -> VesselWall:
    """A wall about a line (n, 3), the lumen's radius (n,) along it."""
    low, high = points.min(axis=0) - 2.5, points.max(axis=0) + 2.5
    size = np.ceil((high - low) / voxel_mm).astype(int)
    nodes = low + voxel_mm * np.moveaxis(np.indices(size.tolist()), 0, -1)
    away, nearest = cKDTree(points).query(nodes)
    return VesselWall(Grid(away - lumen_mm[nearest], np.full(3, voxel_mm), low), wall_N_mm2)


def pushes(room_mm: float, segment_mm: float) -> list[float]:
    """Push, N, at eight depths of a winding vessel whose inlet is 0.6 mm wider than its lumen of ``room_mm``."""
    points = winding(np.random.default_rng([17, 13]), 24.0, 6.0, 1.2)
    arc = np.linspace(0.0, 0.25 * (len(points) - 1), len(points))
    wall = vessel(points, room_mm + 0.6 * np.clip(1.0 - arc / 4.0, 0.0, 1.0), 0.2, 27.0)
    wire = GuideWire(segment_mm, RADIUS_MM, [[0, 0.5], [6, 0.5], [14, 6.0]], [[0, 0.1], [6, 0.1], [6, 0.0]])
    insertion = Insertion(wire, wall, points[0], points[3] - points[0])
    return [s.push_force_N for s in insertion.to_depths([8.0, 12.0, 16.0, 19.0, 19.25, 19.5, 19.75, 20.0])]


def inserted(seed: int, ratio: float) -> Callable[..., list[Solution]]:
    """Insertions of a wire with a shaft ``ratio`` times as stiff as its tip, by the segments' length."""
    rng = np.random.default_rng([19, seed])
    points = winding(rng, 34.0, 6.0, 1.4)
    wall = vessel(points, np.full(len(points), rng.uniform(0.9, 1.8)), 0.3, 100.0)
    jump, tip, roll = rng.uniform(4.0, 10.0), 10.0 ** rng.uniform(-1.3, -0.6), rng.uniform(0.0, 360.0)
    stiffness = [[0, tip], [jump, tip], [jump + 1.0, tip * ratio]]
    rest = [[0, 0.06], [0.8 * jump, 0.06], [0.8 * jump, 0.0]]

    def insert(segment_mm: float, refined: bool = True) -> list[Solution]:
        wire = GuideWire(segment_mm, RADIUS_MM, stiffness, rest)
        finest_mm = 0.05 if refined else np.inf
        insertion = Insertion(wire, wall, points[0], points[3] - points[0], finest_mm=finest_mm)
        return list(insertion.to_depths(np.arange(12.0, 30.0, 2.0), roll))

    return insert


def covered(seed: int, ratio: float) -> list[tuple[float, float]]:
    """How far off, mm, and num_mm, at the depths that are sure of themselves, with segments as ``auto`` takes them."""
    insert = inserted(seed, ratio)
    found = resolve(insert, lengths_mm("auto", np.array([[0.0, 0.06], [10.0, 0.0]])))
    short = insert(min(FINEST_MM, 0.5 * found.segment_mm))
    return [
        (off, num)
        for a, num, b in zip(found.wires, found.num_mm, short, strict=True)
        if not (a.uncertain or b.uncertain or num > AGREED_MM) and np.isfinite((off := moved_mm(a, b)) + num)
    ]


def main(arguments: list[str]) -> int:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=30, help="vessels of the second table")
    count = parser.parse_args(arguments).scenes
    for room in ROOMS_MM:
        ranges = (np.array(pushes(room, segment)) for segment in (0.5, FINEST_MM))
        print(f"lumen {room} mm:", *(f"push {p.min():.3f} to {p.max():.3f} N;" for p in ranges))
    for ratio in RATIOS:
        off, num = np.array([row for seed in range(count) for row in covered(seed, ratio)]).T
        print(
            f"tip to shaft 1:{ratio:.0f}: num_mm covers {100 * np.mean(off <= num):.0f} % of {len(off)} depths; "
            f"{np.sum(off > OFF_MM)} over {OFF_MM} mm off, the worst {off.max():.3f} mm"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
