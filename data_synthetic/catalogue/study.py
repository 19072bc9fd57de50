"""From a scene to a study: truth computed, phantom voxelised, manifest made as inexact as a real one."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from data_synthetic.catalogue.limits import Wanted
from data_synthetic.catalogue.scene import NamedScene, Scanner, ScannerFactory, Setup
from data_synthetic.geometry import ScanGrid, normal_to, rotate, unit
from data_synthetic.rod.replay import TrueFrame
from data_synthetic.rod.truth import converged_truth
from data_synthetic.scanner.phantom import Scan, Wires

ENTRY_ERROR_VOXELS = 0.5
"""How far the manifest's entry is from the true one: what pointing at a scan achieves."""
DIRECTION_ERROR_DEG = 2.0
"""How far the manifest's entry direction is from the true one."""
ANEW_DEG, ANEW_MM = 45.0, 0.5
"""How far roll and depths of a further insertion are from those of the first, either way: its aim is the same."""
DEPTH_NOISE_MM = 0.2
"""sd of the manifest's insertion depths: reading a scale on the wire's shaft."""


@dataclass(frozen=True, eq=False)
class Study:
    """Scans with truth, in memory. ``frame(i)`` makes one volume, the same every time; ``reference`` has no wire.

    manifest : the [[case]] table, [wires] and [case.wall] as nested dicts.     truth : one TrueFrame per frame,
    in the phantom as the reference shows it (a moved phantom carries its wire along).
    """

    name: str
    why: str
    grid: ScanGrid
    reference: Scan
    truth: tuple[TrueFrame, ...]
    expected: tuple[str, ...]
    manifest: Mapping[str, Any]
    quality: Mapping[str, float]
    setup: Setup
    frame: Callable[[int], Scan] = field(repr=False)

    def frames(self) -> Iterator[Scan]:
        """All frames, one at a time."""
        return (self.frame(i) for i in range(len(self.truth)))


class Plan(NamedTuple):
    """What all insertions into a phantom share. at : the phantom shifted by mm, voxelised."""

    scene: NamedScene
    setup: Setup
    grid: ScanGrid
    seed: int
    truth_step_mm: float | None
    at: Callable[[tuple[float, ...]], Scanner]
    reference: Scan


def prepare(scene: NamedScene, scanner: ScannerFactory, wanted: Wanted, truth_step_mm: float | None = None) -> Plan:
    """The phantom of a scene; one in a real scan brings its own voxels and scanner.

    truth_step_mm : as in converged_truth.
    """
    seed, (frames, size, voxel_mm) = wanted.seed, wanted.of(scene)
    setup = scene.setup(np.random.default_rng([seed, 1]), frames)
    grid, scanner = scene.scan or (scan_grid(setup, size, voxel_mm), scanner)
    # voxelising is done once per place of the phantom, the last one kept; moving it by +shift moves the grid by -shift
    at = lru_cache(maxsize=1)(lambda shift: scanner(setup, replace(grid, origin_mm=grid.origin_mm - np.array(shift))))
    return Plan(scene, setup, grid, seed, truth_step_mm, at, at((0.0, 0.0, 0.0)).scan((), (seed, 2)))


def insertion_into(plan: Plan, number: int) -> Study:
    """An insertion into a phantom by its number; all but the first roll the wire anew."""
    scene, seed, more = plan.scene, plan.seed, (number,) * bool(number)
    setup = rolled_anew(plan.setup, np.random.default_rng([seed, 5, *more])) if number else plan.setup
    truth, quality = converged_truth(setup.insertion(), setup.depths_mm, setup.rolls_deg, plan.truth_step_mm)

    def frame(index: int) -> Scan:
        shift = np.zeros(3) if setup.motion_mm is None else setup.motion_mm[index]
        shown = setup.visible is None or setup.visible[index]
        wires: Wires = [(truth[index].points_mm, setup.wire.radius_mm)] if shown else []
        return plan.at(tuple(shift.tolist())).scan([*wires, *setup.others], (seed, 3, index, *more))

    name = f"{scene.name}-{number + 1}" if number else scene.name
    return Study(
        name=name,
        why=scene.why,
        grid=plan.grid,
        reference=plan.reference,
        truth=truth,
        expected=scene.expected_statuses(len(truth)),
        manifest=describe_case(name, setup, plan.grid, np.random.default_rng([seed, 4, *more])),
        quality=quality,
        setup=setup,
        frame=frame,
    )


def rolled_anew(setup: Setup, rng: np.random.Generator) -> Setup:
    """The same insertion repeated, the wire gripped anew: another roll, depths a little off."""
    turn, moved = rng.uniform(-ANEW_DEG, ANEW_DEG), rng.uniform(-ANEW_MM, ANEW_MM)
    depths = tuple(depth + moved for depth in setup.depths_mm)
    return replace(setup, depths_mm=depths, rolls_deg=tuple(roll + turn for roll in setup.rolls_deg))


def scan_grid(setup: Setup, size: int, voxel_mm: float) -> ScanGrid:
    """Voxels of the set-up's proportions about its middle, ``size`` voxels of ``voxel_mm`` along each axis."""
    ratio = np.array(setup.spacing_ratio)
    shape, spacing = tuple(max(2, round(size / r)) for r in ratio), voxel_mm * ratio
    axes = np.eye(3) if setup.axes is None else setup.axes
    half = axes @ (0.5 * (np.array(shape) - 1) * spacing)
    return ScanGrid(shape, spacing, setup.centre_mm - half, axes)


def describe_case(name: str, setup: Setup, grid: ScanGrid, rng: np.random.Generator) -> dict[str, Any]:
    """The case as its user would write it down: entry, direction and depths not quite right."""
    offset = rng.normal(size=3)
    offset *= ENTRY_ERROR_VOXELS * grid.voxel_mm / np.linalg.norm(offset)
    axis = normal_to(rng.normal(size=3), setup.direction)
    direction = rotate(unit(setup.direction), axis, np.radians(DIRECTION_ERROR_DEG))
    depths = np.array(setup.depths_mm) + rng.normal(0.0, DEPTH_NOISE_MM, len(setup.depths_mm))
    wire = {
        "radius_mm": setup.wire.radius_mm,
        "bending_stiffness_N_mm2": [list(k) for k in setup.wire.bending_N_mm2],
        "rest_curvature_per_mm": [list(k) for k in setup.wire.rest_curvature_per_mm],
        "torsional_stiffness_N_mm2": setup.wire.torsional_N_mm2,
    }
    case = {
        "id": name,
        "role": "validation",
        "entry_mm": (setup.entry_mm + offset).round(4).tolist(),
        "entry_direction": direction.round(6).tolist(),
        "material_axis": normal_to(setup.material_axis, direction).round(6).tolist(),
        "wire": "wire",
        "insertion_mm": depths.round(3).tolist(),
        "roll_deg": list(setup.rolls_deg) if len(set(setup.rolls_deg)) > 1 else setup.rolls_deg[0],
        "wall": {"stiffness_N_mm2": setup.stiffness_N_mm2, "friction": setup.friction},
    }
    return {"wires": {"wire": wire}, "case": case}
