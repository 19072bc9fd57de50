"""Do shorter steps lead elsewhere at a neck? ``python -m tests.studies.necks --seed 101 --scenes 100``.

Random winding vessels with sacs at their sides; a soft wire whose tip is 14 mm ahead of a stiff catheter's, or with
``--ahead inf`` no catheter, every millimetre of depth: the default's steps against steps of 0.05 mm.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from pipeline.benchmark.snaps import EQUAL_MM, SHORT_MM, apart_mm
from solver import Catheter, Grid, GuideWire, Insertion, Solution, VesselWall
from tests.solver.scenes import winding

AHEAD_MM = 14.0


def vessel(rng: np.random.Generator) -> VesselWall:
    """A vessel of random width with one to four sacs."""
    points, sacs = winding(rng, 60.0, 5.0, 1.4)[: 33 + 260], []
    wide = np.clip(rng.uniform(0.9, 2.2) * (1 + 0.3 * gaussian_filter1d(rng.normal(size=len(points)), 12)), 0.5, 3)
    for _ in range(rng.integers(1, 5)):
        i = rng.integers(53, len(points) - 20)
        along = points[i + 1] - points[i - 1]
        side = np.cross(along / np.linalg.norm(along), rng.normal(size=3))
        radius = rng.uniform(1.2, 2.5) * wide[i]
        sacs.append((points[i] + side / np.linalg.norm(side) * (wide[i] + radius * rng.uniform(0.2, 0.95)), radius))
    low, voxel = points.min(axis=0) - 7, rng.uniform(0.35, 0.6)
    axes = [np.arange(a, b, voxel) for a, b in zip(low, points.max(axis=0) + 7, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    near, which = cKDTree(points).query(nodes, k=6)
    distance = (near - wide[which]).min(axis=-1)
    for centre, radius in sacs:
        distance = np.minimum(distance, np.linalg.norm(nodes - centre, axis=-1) - radius)
    return VesselWall(Grid(distance.astype("float32"), np.full(3, voxel), low), 10 ** rng.uniform(-0.5, 2))


def pushed(
    seed: int, index: int, to_mm: float = 50.0, step_mm: float = 1.0, ahead_mm: float = AHEAD_MM
) -> list[Solution]:
    """The wire of a scene at every millimetre; its tip is ``ahead_mm`` ahead of the catheter's, inf for none."""
    rng = np.random.default_rng([seed, index])
    wall, tip = vessel(rng), 10 ** rng.uniform(-0.5, 0.7)
    knee, shaft = rng.uniform(8, 15), tip * 10 ** rng.uniform(0.3, 1.2)
    segment, curve = [0.5, 0.7, 1.0, 1.3][rng.choice(4)], rng.choice([0.0, 1.0]) * rng.uniform(0.03, 0.2)
    bending = [[0, tip], [knee, tip], [knee + rng.choice([0, 15]), shaft]]
    wire = GuideWire(segment, 0.18, bending, [[0, curve], [6, curve], [6, 0]])
    catheter, roll = Catheter(tip * 10 ** rng.uniform(1.3, 2.0), 0.45), float(rng.uniform(0, 360))
    insertion = Insertion(
        wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0], step_mm=step_mm, catheter=catheter,
        quadrature=str(rng.choice(["tip", "joints"])),
    )  # fmt: skip
    depths = np.arange(1.0, to_mm + 0.5)
    return list(insertion.to_depths(depths, roll, np.maximum(depths - ahead_mm, 0.0).tolist()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=101)
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--ahead", type=float, default=AHEAD_MM)
    given = parser.parse_args()
    rest, iterations = [], 0
    for index in range(given.scenes):
        found, short = (pushed(given.seed, index, step_mm=step, ahead_mm=given.ahead) for step in (1.0, SHORT_MM))
        iterations += sum(s.iterations for s in found)
        pairs = zip(found, short, strict=True)
        rest += [(one.uncertain, apart_mm(one, other)) for one, other in pairs if one.converged and other.converged]
    silent = [mm for uncertain, mm in rest if mm > EQUAL_MM and not uncertain]
    worst, flagged = max(silent, default=0.0), 100 * np.mean([flag for flag, _ in rest])
    print(
        f"{len(silent)} of {len(rest)} depths are off and not uncertain, by up to {worst:.2f} mm; "
        f"uncertain {flagged:.2f} %; {iterations} iterations"
    )


if __name__ == "__main__":
    main()
