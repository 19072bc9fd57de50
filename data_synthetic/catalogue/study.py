"""From a scene to a study: truth computed, phantom voxelised, manifest made as inexact as a real one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from data_synthetic.catalogue.scene import Scanner, Scene, Setup, Study, Wires
from data_synthetic.geometry.scan_grid import ScanGrid, centred_grid
from data_synthetic.rod.replay import Insertion, TrueFrame, halving_moves, normal_to, rotate
from data_synthetic.rod.truth_cache import cached_replay
from data_synthetic.scanner import PsfScanner

Array = NDArray[np.float64]
ScannerFactory = Callable[[Setup, ScanGrid], Scanner]

ENTRY_ERROR_VOXELS = 0.5
"""How far the manifest's entry is from the true one: what pointing at a scan achieves."""

DIRECTION_ERROR_DEG = 2.0
"""How far the manifest's entry direction is from the true one."""

LONGEST_ADVANCE_MM = 0.4
"""Insertion between two equilibria: a tip cannot pass a wall of 1 mm unseen, and smaller steps change nothing."""

TRUTH_STEP_MM, MOST_HALVINGS, CONVERGED_MM = 0.2, 2, 0.01
"""The true wire's first node spacing, how often it is halved at most, and the move of a frame at which it is not."""

TRIED = 7
"""Frames of a study on which halving is tried."""

DEPTH_NOISE_MM = 0.2
"""sd of the manifest's insertion depths: reading a scale on the wire's shaft."""


def psf_scanner(setup: Setup, grid: ScanGrid) -> Scanner:
    """The default scanner."""
    return PsfScanner.of(setup.anatomy, setup.bone, setup.bone_gap_mm, grid, setup.greys)


def conebeam_scanner(setup: Setup, grid: ScanGrid) -> Scanner:
    """3D rotational X-ray; needs the extra [conebeam]."""
    from data_synthetic.scanner.conebeam import ConeBeamScanner

    return ConeBeamScanner.of(setup.anatomy, setup.bone, setup.bone_gap_mm, grid, greys=setup.greys)


def make_study(
    scene: Scene,
    *,
    frames: int | None = None,
    size: int | None = None,
    voxel_mm: float | None = None,
    seed: int = 0,
    truth_step_mm: float | None = None,
    scanner: ScannerFactory = psf_scanner,
) -> Study:
    """Build a scene: sizes default to the scene's own; voxel_mm to its field of view over ``size``."""
    frames, size = frames or scene.frames, size or scene.size
    voxel = voxel_mm or scene.fov_mm / size
    setup = scene.setup(np.random.default_rng([seed, 1]), frames)
    ratio = np.array(setup.spacing_ratio)
    nx, ny, nz = (max(2, round(size / r)) for r in ratio)
    grid = centred_grid(setup.centre_mm, (nx, ny, nz), voxel * ratio, setup.axes)
    truth, quality = converged_truth(setup, truth_step_mm)
    machine = _Machine(setup, grid, scanner, seed)
    return Study(
        name=scene.name,
        why=scene.why,
        grid=grid,
        reference=machine.at(np.zeros(3)).scan((), (seed, 2)),
        truth=truth,
        expected=scene.expected_statuses(frames),
        manifest=describe_case(scene.name, setup, grid, np.random.default_rng([seed, 4])),
        quality=quality,
        setup=setup,
        make_frame=lambda i: machine.frame(i, truth[i]),
    )


def converged_truth(
    setup: Setup, step_mm: float | None = None
) -> tuple[tuple[TrueFrame, ...], dict[str, float]]:
    """The true wire at every depth, and its quality; nodes are put closer until halving them moves nothing.

    step_mm : a node spacing that is taken as it is, for tests that need no converged truth.
    """
    step, left = step_mm or TRUTH_STEP_MM, 0 if step_mm else MOST_HALVINGS
    while True:
        # the shortest wire still gets a dozen nodes
        insertion = planned_insertion(setup, min(step, min(setup.depths_mm) / 8.0))
        truth = cached_replay(insertion, setup.depths_mm, setup.rolls_deg)
        quality = truth_quality(insertion, truth)
        if quality["halving_moves_mm"] <= CONVERGED_MM or not left:
            return truth, quality
        step, left = 0.5 * step, left - 1


def planned_insertion(setup: Setup, step_mm: float) -> Insertion:
    """What the true wire goes through in a set-up."""
    return Insertion(
        setup.wire,
        setup.anatomy if setup.wall is None else setup.wall,
        setup.stiffness_N_mm2,
        setup.entry_mm,
        setup.direction,
        setup.material_axis,
        step_mm,
        max(step_mm, LONGEST_ADVANCE_MM),
        setup.friction,
    )


def truth_quality(insertion: Insertion, truth: tuple[TrueFrame, ...]) -> dict[str, float]:
    """Figures that tell how far the truth can be trusted; halving is tried on a few frames, the last among them."""
    tried = {round(i) for i in np.linspace(0, len(truth) - 1, min(len(truth), TRIED))}
    return {
        "node_spacing_mm": insertion.step_mm,
        "largest_residual_N": max(f.residual_N for f in truth),
        "halving_moves_mm": max(halving_moves(insertion, truth[i]) for i in tried),
        "largest_tip_jump_mm": max(f.jump_mm for f in truth),
        "largest_contact_N": max(float(np.linalg.norm(f.contact_N, axis=1).max()) for f in truth),
        "newton_iterations": float(sum(f.iterations for f in truth)),
    }


class _Machine:
    """The scanner at each place of the phantom; voxelising is done once per place, the last one kept."""

    def __init__(self, setup: Setup, grid: ScanGrid, factory: ScannerFactory, seed: int) -> None:
        self.setup, self.seed = setup, seed
        moved = lru_cache(maxsize=1)(
            lambda shift: factory(setup, replace(grid, origin_mm=grid.origin_mm - np.array(shift)))
        )
        self.at: Callable[[Array], Scanner] = lambda shift: moved(tuple(float(s) for s in shift))

    def frame(self, number: int, truth: TrueFrame) -> NDArray[np.int16]:
        """Moving the phantom by +shift is moving the grid by -shift."""
        setup = self.setup
        shift = np.zeros(3) if setup.motion_mm is None else setup.motion_mm[number]
        shown = setup.visible is None or setup.visible[number]
        wires: Wires = [(truth.points_mm, setup.wire.radius_mm)] if shown else []
        return self.at(shift).scan([*wires, *setup.others], (self.seed, 3, number))


def describe_case(name: str, setup: Setup, grid: ScanGrid, rng: np.random.Generator) -> dict[str, Any]:
    """The case as its user would write it down: entry, direction and depths not quite right."""
    offset = rng.normal(size=3)
    offset *= ENTRY_ERROR_VOXELS * grid.voxel_mm / np.linalg.norm(offset)
    axis = normal_to(rng.normal(size=3), setup.direction)
    direction = rotate(
        setup.direction / np.linalg.norm(setup.direction), axis, np.radians(DIRECTION_ERROR_DEG)
    )
    depths = np.array(setup.depths_mm) + rng.normal(0.0, DEPTH_NOISE_MM, len(setup.depths_mm))
    wire = setup.wire
    return {
        "wires": {
            "wire": {
                "radius_mm": wire.radius_mm,
                "bending_stiffness_N_mm2": [list(k) for k in wire.bending_N_mm2],
                "rest_curvature_per_mm": [list(k) for k in wire.rest_curvature_per_mm],
                "torsional_stiffness_N_mm2": wire.torsional_N_mm2,
            }
        },
        "case": {
            "id": name,
            "role": "validation",
            "entry_mm": (setup.entry_mm + offset).round(4).tolist(),
            "entry_direction": direction.round(6).tolist(),
            "material_axis": normal_to(setup.material_axis, direction).round(6).tolist(),
            "wire": "wire",
            "insertion_mm": depths.round(3).tolist(),
            "roll_deg": list(setup.rolls_deg) if len(set(setup.rolls_deg)) > 1 else setup.rolls_deg[0],
            "wall": {"stiffness_N_mm2": setup.stiffness_N_mm2, "friction": setup.friction},
        },
    }
