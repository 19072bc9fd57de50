"""The scenes of the benchmark: vessels with a closed form, sampled as the voxel wall that a scan would give."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial

import numpy as np
from scipy.ndimage import map_coordinates

from data_synthetic import catalogue
from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.anatomy.willis import WillisPlan, circle_of_willis
from data_synthetic.catalogue.scene import Setup
from pipeline.benchmark.vessels import BEND_INLET_MM, BEND_TURN_MM, SHEATH_MM, bend_distance, sheath_distance
from pipeline.model import Array
from solver import Grid, GuideWire, VesselWall

Distance = Callable[[Array], Array]
Vector = tuple[float, float, float]

VOXEL_MM = 0.3
"""Voxel size of the walls: that of a rotational X-ray scan, and of the figures in the literature."""
RADIUS_MM, STIFFNESS = 0.18, 10.0
WIRE = GuideWire(1.0, RADIUS_MM, STIFFNESS)
COARSE = 4
NEAR_MM = 2.0
"""Outside the wall no wire goes deeper than this; further out the distance only has to lead back in."""


@dataclass(frozen=True, eq=False)
class BenchScene:
    """A wire to be pushed to ``depth_mm`` in steps of ``step_mm`` through a wall, or bent by a dead tip load.

    guide_wire : the wire; ``wire`` gives it segments of a length.
    distance : signed distance (n,) of points (n, 3), None without a wall.     box : corners of the sampled box, LPS mm.
    ready : the wall's grid where there is one already (a user's case), in place of ``distance``.
    """

    name: str
    depth_mm: float
    step_mm: float = 1.0
    entry_mm: Vector = (0.0, 0.0, 0.0)
    direction: Vector = (0.0, 0.0, 1.0)
    material_axis: Vector | None = None
    roll_deg: float = 0.0
    guide_wire: GuideWire = WIRE
    wall_stiffness: float = 1.0
    friction: float = 0.0
    distance: Distance | None = None
    box: tuple[Vector, Vector] | None = None
    ready: Grid | None = None
    load_N: Vector = (0.0, 0.0, 0.0)

    def wall(self, hull: str = "offset", voxel_mm: float = VOXEL_MM) -> VesselWall | None:
        """The elastic wall, its distance sampled on voxels; None for a free wire."""
        grid = self.ready
        if grid is None and self.distance is not None and self.box is not None:
            grid = sampled(self.distance, self.box, voxel_mm)
        return None if grid is None else VesselWall(grid, self.wall_stiffness, self.friction, hull)

    def wire(self, segment_mm: float) -> GuideWire:
        """The wire in segments of this length."""
        return replace(self.guide_wire, segment_mm=segment_mm)

    def follows(self, segment_mm: float) -> bool:
        """Whether segments of this length can follow the wire's rest curvature."""
        try:
            self.wire(segment_mm)
        except ValueError:
            return False
        return True

    def depths(self) -> list[float]:
        """Depths in steps of step_mm, the last one depth_mm."""
        count = max(1, round(self.depth_mm / self.step_mm))
        return [float(d) for d in np.linspace(self.depth_mm / count, self.depth_mm, count)]


@lru_cache(maxsize=4)
def sampled(distance: Distance, box: tuple[Vector, Vector], voxel_mm: float) -> Grid:
    """A signed distance on voxels between two corners, float32; beyond NEAR_MM outside it is interpolated."""
    low, high = np.array(box, dtype=np.float64)
    shape = np.ceil((high - low) / voxel_mm).astype(int) + 1
    axes = [low[a] + voxel_mm * COARSE * np.arange(-(-shape[a] // COARSE) + 1) for a in range(3)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    coarse = distance(nodes.reshape(-1, 3)).reshape(nodes.shape[:3])
    values = np.empty(shape, dtype=np.float32)
    for i in range(shape[0]):
        index = np.stack(np.meshgrid([i], *(np.arange(n) for n in shape[1:]), indexing="ij"), axis=-1)
        plane = map_coordinates(coarse, index.reshape(-1, 3).T / COARSE, order=1)
        near = plane < NEAR_MM
        plane[near] = distance(low + voxel_mm * index.reshape(-1, 3)[near])
        values[i] = plane.reshape(shape[1:])
    return Grid(values, np.full(3, voxel_mm), low)


@cache
def bend(depth_mm: float = 60.0, wall_stiffness: float = 1.0) -> BenchScene:
    """Scene B: 30 mm straight, tangent to a quarter torus of 30 mm; 60 mm deep the wire has turned by a radian.

    One side of the bend is touched: bending, wall and the tip's contact decide alone.
    """
    reach = 6.0 + max(depth_mm - 75.0, 0.0)
    box = ((-4.5, -4.5, -4.5), (BEND_TURN_MM + reach, 4.5, BEND_INLET_MM + BEND_TURN_MM + 4.5))
    return BenchScene("bend", depth_mm, wall_stiffness=wall_stiffness, distance=bend_distance, box=box)


@cache
def sheath(bore_mm: float = 0.25, wall_stiffness: float = 1.0) -> BenchScene:
    """400 mm of straight sheath with little room in it, then scene B: 60 mm deep beyond its mouth.

    What the tip meets dies out along the sheath; a wire that is pushed hard buckles in it.
    """
    box = ((-4.0, -3.0, -SHEATH_MM - 3.0), (BEND_TURN_MM + 4.0, 3.0, BEND_INLET_MM + BEND_TURN_MM + 6.0))
    entry, distance = (0.0, 0.0, -SHEATH_MM), partial(sheath_distance, bore_mm=bore_mm)
    return BenchScene(
        "sheath", SHEATH_MM + 60.0, entry_mm=entry, wall_stiffness=wall_stiffness, distance=distance, box=box
    )


@cache
def cantilever() -> BenchScene:
    """Scene A: 200 mm, no wall, dead tip load with P L² / EI = 5: the elastica, whose closed form is known."""
    length = 200.0
    return BenchScene("cantilever", length, step_mm=length, load_N=(5.0 * STIFFNESS / length**2, 0.0, 0.0))


@cache
def siphon() -> BenchScene:
    """70 mm up the carotid of the synthetic catalogue, without its branches: two tight turns in different planes.

    The wire touches on alternate sides.
    """
    whole = circle_of_willis(np.random.default_rng(0), WillisPlan(aneurysm="none", jitter_mm=0.0))
    carotid = Anatomy((whole.tube("right.ICA"),))
    return _of_catalogue("siphon", 70.0, replace(_willis_setup(0), anatomy=carotid))


@cache
def willis(seed: int = 0) -> BenchScene:
    """80 mm into the catalogue's circle of Willis: through the siphon and past the branching of the carotid.

    There are branches to slip into, radii that taper, and a curved tip.
    """
    return _of_catalogue("circle-of-willis", 80.0, _willis_setup(seed))


def _willis_setup(seed: int) -> Setup:
    return catalogue.describe("circle-of-willis").setup(np.random.default_rng(seed), 1)


REACH_MM = np.array([[12.0, 34.0, 8.0], [24.0, 10.0, 62.0]])
"""The box around the entry of the carotid, downwards and upwards along each axis: what 80 mm of wire can see."""


def of_setup(name: str, setup: Setup) -> BenchScene:
    """A scene of the synthetic catalogue to its largest depth: its vessels as they are, not as they are scanned."""
    everything = np.full((2, 3), np.inf)
    return replace(_of_catalogue(name, max(setup.depths_mm), setup, everything), friction=setup.friction)


def _of_catalogue(name: str, depth_mm: float, setup: Setup, reach_mm: Array = REACH_MM) -> BenchScene:
    """A scene of the synthetic catalogue, its wall sampled in a box about what the wire can reach."""
    entry, wire = setup.entry_mm, setup.wire
    points = np.concatenate([t.points_mm for t in setup.anatomy.tubes])
    near = points[np.linalg.norm(points - entry, axis=1) < depth_mm + 2.0]
    low = np.maximum(near.min(axis=0) - 6.0, entry - reach_mm[0])
    high = np.minimum(near.max(axis=0) + 6.0, entry + reach_mm[1])
    bending, rest = np.array(wire.bending_N_mm2), np.array(wire.rest_curvature_per_mm)
    return BenchScene(
        name,
        depth_mm,
        entry_mm=tuple(entry.tolist()),
        direction=tuple(setup.direction.tolist()),
        material_axis=tuple(setup.material_axis.tolist()),
        roll_deg=setup.rolls_deg[-1],
        guide_wire=GuideWire(WIRE.segment_mm, wire.radius_mm, bending, rest),
        wall_stiffness=setup.stiffness_N_mm2,
        distance=setup.anatomy.distance,
        box=(tuple(low.tolist()), tuple(high.tolist())),
    )
