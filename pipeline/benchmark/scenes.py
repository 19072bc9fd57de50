"""The scenes of the benchmark: vessels with a closed form, sampled as the voxel wall that a scan would give."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from data_synthetic import catalogue
from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.anatomy.willis import WillisPlan, circle_of_willis
from solver import Grid, GuideWire, VesselWall

Array = NDArray[np.float64]
Distance = Callable[[Array], Array]

VOXEL_MM = 0.3
"""Of the walls: the voxel of a rotational X-ray scan, and that of the figures in the literature."""
BEND_TURN_MM, BEND_INLET_MM, BEND_LUMEN_MM = 30.0, 30.0, 2.0
RADIUS_MM, STIFFNESS = 0.18, 10.0
COARSE = 4
NEAR_MM = 2.0
"""Outside the wall no wire goes deeper than this; further out the distance only has to lead back in."""


@dataclass(frozen=True, eq=False)
class BenchScene:
    """A wire to be pushed to ``depth_mm`` in steps of ``step_mm`` through a wall, or bent by a dead tip load.

    distance : signed distance (n,) of points (n, 3), None without a wall.     box : its two corners, LPS mm.
    ready : a wall's grid that exists already (a user's case) in place of ``distance``.
    stiffness, rest : as GuideWire takes them.
    """

    name: str
    why: str
    depth_mm: float
    step_mm: float = 1.0
    entry_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)
    material_axis: tuple[float, float, float] | None = None
    roll_deg: float = 0.0
    radius_mm: float = RADIUS_MM
    stiffness: Any = STIFFNESS
    rest: Any = 0.0
    torsion: float = float("inf")
    wall_stiffness: float = 1.0
    friction: float = 0.0
    distance: Distance | None = None
    box: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    ready: Grid | None = None
    load_N: tuple[float, float, float] = (0.0, 0.0, 0.0)
    grids: dict[float, Grid] = field(default_factory=dict, repr=False)

    def grid(self, voxel_mm: float = VOXEL_MM) -> Grid | None:
        """The wall's signed distance as float32 on voxels; kept once made."""
        if self.ready is not None or self.distance is None or self.box is None:
            return self.ready
        if voxel_mm not in self.grids:
            self.grids[voxel_mm] = sampled(self.distance, self.box, voxel_mm)
        return self.grids[voxel_mm]

    def wall(self, hull: str = "offset", voxel_mm: float = VOXEL_MM) -> VesselWall | None:
        """The elastic wall, None for a free wire."""
        grid = self.grid(voxel_mm)
        return None if grid is None else VesselWall(grid, self.wall_stiffness, self.friction, hull)

    def wire(self, segment_mm: float) -> GuideWire:
        """The wire in segments of this length."""
        return GuideWire(segment_mm, self.radius_mm, self.stiffness, self.rest, self.torsion)

    def depths(self) -> list[float]:
        """Depths in steps of step_mm, the last one depth_mm."""
        count = max(1, round(self.depth_mm / self.step_mm))
        return [float(d) for d in np.linspace(self.depth_mm / count, self.depth_mm, count)]

    def with_(self, **changes: Any) -> BenchScene:
        """The same scene with something else in it (walls are sampled anew where they differ)."""
        return replace(self, **changes)


def sampled(distance: Distance, box: tuple[Any, Any], voxel_mm: float) -> Grid:
    """A signed distance on voxels between two corners, float32; beyond NEAR_MM outside it is interpolated."""
    low, high = (np.asarray(c, dtype=np.float64) for c in box)
    shape = np.ceil((high - low) / voxel_mm).astype(int) + 1
    coarse = distance(_nodes(low, voxel_mm * COARSE, -(-shape // COARSE) + 1).reshape(-1, 3))
    coarse = coarse.reshape(-(-shape // COARSE) + 1)
    values = np.empty(shape, dtype=np.float32)
    for i in range(shape[0]):
        index = np.stack(np.meshgrid([i], *(np.arange(n) for n in shape[1:]), indexing="ij"), axis=-1)
        plane = map_coordinates(coarse, index.reshape(-1, 3).T / COARSE, order=1)
        near = plane < NEAR_MM
        plane[near] = distance(low + voxel_mm * index.reshape(-1, 3)[near])
        values[i] = plane.reshape(shape[1:])
    return Grid(values, np.full(3, voxel_mm), low)


def _nodes(low: Array, step_mm: float, shape: NDArray[np.int64]) -> Array:
    axes = [low[a] + step_mm * np.arange(shape[a]) for a in range(3)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def bend_distance(points: Array) -> Array:
    """A straight inlet along +z, a quarter torus towards +x tangent to it, and straight on."""
    x, y, z = points[..., 0], points[..., 1], points[..., 2] - BEND_INLET_MM
    ring = np.hypot(np.hypot(BEND_TURN_MM - x, z) - BEND_TURN_MM, y)
    outlet = np.hypot(z - BEND_TURN_MM, y)
    line = np.hypot(x, y)
    return np.asarray(np.where(z < 0, line, np.where(x > BEND_TURN_MM, outlet, ring)) - BEND_LUMEN_MM)


@cache
def bend(depth_mm: float = 60.0, wall_stiffness: float = 1.0) -> BenchScene:
    """Scene B: 30 mm straight, tangent to a quarter torus of 30 mm; 60 mm deep the wire has turned by a radian."""
    reach = 6.0 + max(depth_mm - 75.0, 0.0)
    box = ((-4.5, -4.5, -4.5), (BEND_TURN_MM + reach, 4.5, BEND_INLET_MM + BEND_TURN_MM + 4.5))
    why = "one bend, one side of it touched: bending, wall and the tip's contact decide alone"
    return BenchScene("bend", why, depth_mm, wall_stiffness=wall_stiffness, distance=bend_distance, box=box)


SHEATH_MM, MOUTH_MM = 400.0, 4.0
"""Length of the sheath, and over how much of its end it opens into the vessel."""


@cache
def sheath(bore_mm: float = 0.25, wall_stiffness: float = 1.0) -> BenchScene:
    """400 mm of straight sheath with little room in it, then scene B: 60 mm deep beyond its mouth."""

    def distance(points: Array) -> Array:
        z = points[..., 2]
        t = np.clip((z + 0.5 * MOUTH_MM) / MOUTH_MM, 0.0, 1.0)
        bore = bore_mm + (BEND_LUMEN_MM - bore_mm) * t * t * (3.0 - 2.0 * t)
        tube = np.hypot(points[..., 0], points[..., 1]) - bore
        return np.asarray(np.where(z < MOUTH_MM, tube, bend_distance(points)))

    why = "a wire in a long sheath: what the tip meets dies out along it, and pushed hard the wire buckles in it"
    box = ((-4.0, -3.0, -SHEATH_MM - 3.0), (BEND_TURN_MM + 4.0, 3.0, BEND_INLET_MM + BEND_TURN_MM + 6.0))
    return BenchScene(
        "sheath",
        why,
        SHEATH_MM + 60.0,
        entry_mm=(0.0, 0.0, -SHEATH_MM),
        wall_stiffness=wall_stiffness,
        distance=distance,
        box=box,
    )


@cache
def cantilever(segments_load: float = 5.0) -> BenchScene:
    """Scene A: 200 mm, dead tip load with P L² / EI = 5: a closed form exists."""
    length = 200.0
    force = segments_load * STIFFNESS / length**2
    why = "no wall: the order of the discretisation against the elastica"
    return BenchScene("cantilever", why, length, step_mm=length, load_N=(force, 0.0, 0.0))


REACH_MM = np.array([[12.0, 34.0, 8.0], [24.0, 10.0, 62.0]])
"""Of the box about the entry of the carotid, downwards and upwards along each axis: what 80 mm of wire can see."""


def _of_anatomy(name: str, why: str, anatomy: Anatomy, depth_mm: float, setup: Any) -> BenchScene:
    entry, direction = setup.entry_mm, setup.direction
    points = np.concatenate([t.points_mm for t in anatomy.tubes])
    near = points[np.linalg.norm(points - entry, axis=1) < depth_mm + 2.0]
    low, high = near.min(axis=0) - 6.0, near.max(axis=0) + 6.0
    low, high = np.maximum(low, entry - REACH_MM[0]), np.minimum(high, entry + REACH_MM[1])
    wire = setup.wire
    return BenchScene(
        name,
        why,
        depth_mm,
        entry_mm=tuple(entry.tolist()),
        direction=tuple(direction.tolist()),
        material_axis=tuple(setup.material_axis.tolist()),
        roll_deg=setup.rolls_deg[-1],
        radius_mm=wire.radius_mm,
        stiffness=np.array(wire.bending_N_mm2),
        rest=np.array(wire.rest_curvature_per_mm),
        wall_stiffness=setup.stiffness_N_mm2,
        distance=anatomy.distance,
        box=(tuple(low), tuple(high)),
    )


@cache
def siphon(depth_mm: float = 70.0) -> BenchScene:
    """The carotid of the synthetic catalogue alone, without its branches: two tight turns in different planes."""
    whole = circle_of_willis(np.random.default_rng(0), WillisPlan(aneurysm="none", jitter_mm=0.0))
    why = "two tight turns in different planes, the wire touching on alternate sides"
    return _of_anatomy("siphon", why, Anatomy((whole.tube("right.ICA"),)), depth_mm, _willis_setup(0))


@cache
def willis(depth_mm: float = 80.0, seed: int = 0) -> BenchScene:
    """The catalogue's circle of Willis: through the siphon and past the branching of the carotid."""
    setup = _willis_setup(seed)
    why = "a whole anatomy: branches to slip into, radii that taper, a curved tip"
    return _of_anatomy("circle-of-willis", why, setup.anatomy, depth_mm, setup)


@cache
def _willis_setup(seed: int) -> Any:
    return catalogue.describe("circle-of-willis").setup(np.random.default_rng(seed), 1)
