"""What segments of 0.0625 mm say otherwise: the push in lumens with hardly any room, wires with stiff shafts.

``python -m tests.studies.short_segments`` prints both tables of the manual (some minutes).
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
from scipy.spatial import cKDTree

from pipeline.simulate.resolution import AGREED_MM, FINEST_MM, Insert, lengths_mm, moved_mm, resolve
from solver import Grid, GuideWire, Insertion, Solution, VesselWall
from solver.grid import Array
from tests.solver.scenes import winding

RADIUS_MM = 0.18
ROOMS_MM = (0.25, 0.3, 0.4, 0.6)
RATIOS = (1.0, 10.0, 100.0, 1000.0)
OFF_MM = 0.03
LEAST_N = 1e-6


def vessel(points: Array, lumen_mm: Array, voxel_mm: float, wall_N_mm2: float) -> VesselWall:
    """A wall about a line (n, 3), the lumen's radius (n,) along it."""
    low, high = points.min(axis=0) - 2.5, points.max(axis=0) + 2.5
    size = np.ceil((high - low) / voxel_mm).astype(int)
    nodes = low + voxel_mm * np.moveaxis(np.indices(size.tolist()), 0, -1)
    away, nearest = cKDTree(points).query(nodes)
    return VesselWall(Grid(away - lumen_mm[nearest], np.full(3, voxel_mm), low), wall_N_mm2)


def in_little_room(room_mm: float) -> Insert:
    """Insertions into a winding vessel whose inlet is 0.6 mm wider than its lumen of ``room_mm``."""
    points = winding(np.random.default_rng([17, 13]), 24.0, 6.0, 1.2)
    arc = np.linspace(0.0, 0.25 * (len(points) - 1), len(points))
    wall = vessel(points, room_mm + 0.6 * np.clip(1.0 - arc / 4.0, 0.0, 1.0), 0.2, 27.0)

    def insert(segment_mm: float, refined: bool) -> list[Solution]:
        wire = GuideWire(segment_mm, RADIUS_MM, [[0, 0.5], [6, 0.5], [14, 6.0]], [[0, 0.1], [6, 0.1], [6, 0.0]])
        insertion = Insertion(wire, wall, points[0], points[3] - points[0], finest_mm=0.05 if refined else np.inf)
        return list(insertion.to_depths([8.0, 12.0, 16.0, 19.0, 19.25, 19.5, 19.75, 20.0]))

    return insert


def of_stiff_shaft(seed: int, ratio: float) -> Insert:
    """Insertions of a wire with a shaft ``ratio`` times as stiff as its tip."""
    rng = np.random.default_rng([19, seed])
    points = winding(rng, 34.0, 6.0, 1.4)
    wall = vessel(points, np.full(len(points), rng.uniform(0.9, 1.8)), 0.3, 100.0)
    jump, tip, roll = rng.uniform(4.0, 10.0), 10.0 ** rng.uniform(-1.3, -0.6), rng.uniform(0.0, 360.0)
    stiffness = [[0, tip], [jump, tip], [jump + 1.0, tip * ratio]]
    rest = [[0, 0.06], [0.8 * jump, 0.06], [0.8 * jump, 0.0]]

    def insert(segment_mm: float, refined: bool) -> list[Solution]:
        wire = GuideWire(segment_mm, RADIUS_MM, stiffness, rest)
        finest_mm = 0.05 if refined else np.inf
        insertion = Insertion(wire, wall, points[0], points[3] - points[0], finest_mm=finest_mm)
        return list(insertion.to_depths(np.arange(12.0, 30.0, 2.0), roll))

    return insert


def compared(insert: Insert, rest: list[list[float]]) -> Array:
    """Segments as ``auto`` takes them against short ones, at the depths that are sure of themselves.

    Columns: how far the wire is off, mm; num_mm; the push of both, N; num_push_N.
    """
    found = resolve(insert, lengths_mm("auto", rest))
    short = insert(min(FINEST_MM, 0.5 * found.segment_mm), True)
    both = list(zip(found.wires, short, strict=True))
    pushes = [(a.push_force_N, b.push_force_N) for a, b in both]
    rows = np.column_stack([[moved_mm(a, b) for a, b in both], found.num_mm, pushes, found.num_push_N])
    sure = ~np.array([a.uncertain or b.uncertain for a, b in both]) & ~(found.num_mm > AGREED_MM)
    return rows[sure & np.isfinite(rows).all(axis=1)]


def of_pushes(rows: Array) -> str:
    """How often num_push_N covers. Below LEAST_N a push is rounding."""
    covered = np.abs(rows[:, 2] - rows[:, 3]) <= np.maximum(rows[:, 4], LEAST_N)
    return f"num_push_N covers {100 * np.mean(covered):.0f} % of {len(rows)}"


def main(arguments: list[str]) -> int:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=30, help="vessels of the second table")
    count = parser.parse_args(arguments).scenes
    for room in ROOMS_MM:
        rows = compared(in_little_room(room), [[0.0, 0.1], [6.0, 0.1], [6.0, 0.0]])
        ranges = (f"push {p.min():.3f} to {p.max():.3f} N;" for p in (rows[:, 2], rows[:, 3]))
        print(
            f"lumen {room} mm:",
            *ranges,
            f"num_push_N {rows[:, 4].min():.3f} to {rows[:, 4].max():.3f} N;",
            of_pushes(rows),
        )
    for ratio in RATIOS:
        rows = np.concatenate(
            [compared(of_stiff_shaft(seed, ratio), [[0.0, 0.06], [10.0, 0.0]]) for seed in range(count)]
        )
        off, num = rows[:, 0], rows[:, 1]
        print(
            f"tip to shaft 1:{ratio:.0f}: num_mm covers {100 * np.mean(off <= num):.0f} % of {len(off)} depths; "
            f"{np.sum(off > OFF_MM)} over {OFF_MM} mm off, the worst {off.max():.3f} mm; {of_pushes(rows)}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
