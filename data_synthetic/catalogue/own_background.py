"""A made-up wire in a real scan: real voxels, real vessel, a wire whose shape is known."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray

from data_synthetic.anatomy.iso_wall import iso_wall
from data_synthetic.anatomy.tubes import Anatomy, Tube
from data_synthetic.anatomy.vessel_way import find_way, vessel_threshold
from data_synthetic.catalogue.scene import Setup, Study, enter, spread
from data_synthetic.catalogue.study import converged_truth, describe_case, planned_insertion
from data_synthetic.geometry.scan_grid import ScanGrid
from data_synthetic.rod.steer import steer
from data_synthetic.rod.wire import TrueWire
from data_synthetic.scanner import Greys, PsfScanner

Array = NDArray[np.float64]

VESSEL_GREY = 1000.0
"""Grey values are stretched so that the vessel lies here: room for a brighter wire, and for noise below zero."""

ENTRY_ARC_MM = 1.0
CROP_MARGIN_MM = 8.0
"""The wall is only made this far around the way."""


def background_study(
    path: str | Path,
    *,
    frames: int | None = None,
    voxel_mm: float | None = None,
    seed: int = 0,
    truth_step_mm: float | None = None,
) -> Study:
    """A study in a real scan: from its widest inlet past its widest place.

    path : anything SimpleITK reads.     voxel_mm : overrides the file's spacing, where that is a placeholder.
    """
    values, grid = read_scan(Path(path), voxel_mm)
    threshold = vessel_threshold(values)
    setup = background_setup(values, grid, threshold, frames or 12)
    truth, quality = converged_truth(setup, truth_step_mm)
    scanner = _painter(values, grid, threshold, setup.greys)
    name = Path(path).name.split(".")[0]
    wires = [(f.points_mm, setup.wire.radius_mm) for f in truth]
    return Study(
        name=name,
        why=f"a made-up wire in the real voxels of {Path(path).name}",
        grid=grid,
        reference=scanner.scan((), (seed, 2)),
        truth=truth,
        expected=("ok",) * len(truth),
        manifest=describe_case(name, setup, grid, np.random.default_rng([seed, 4])),
        quality=quality,
        setup=setup,
        make_frame=lambda i: scanner.scan([wires[i]], (seed, 3, i)),
    )


def read_scan(path: Path, voxel_mm: float | None) -> tuple[NDArray[np.float32], ScanGrid]:
    """Grey values indexed x, y, z, and where they lie."""
    image: Any = sitk.ReadImage(str(path))
    values = np.ascontiguousarray(sitk.GetArrayFromImage(image).transpose(2, 1, 0), dtype=np.float32)
    spacing = np.array(image.GetSpacing()) if voxel_mm is None else np.full(3, voxel_mm)
    shape = (values.shape[0], values.shape[1], values.shape[2])
    direction = np.array(image.GetDirection()).reshape(3, 3)
    return values, ScanGrid(shape, spacing, np.array(image.GetOrigin()), direction)


def background_setup(values: NDArray[np.float32], grid: ScanGrid, threshold: float, frames: int) -> Setup:
    """Where the wire enters and how it is rolled, tried out against the scan's own wall."""
    found = find_way(values, grid, threshold)
    way = found.way
    box, part = _around(way, grid)
    vessel = np.where(found.vessel[box], values[box], 0.0).astype(np.float32)
    entry, direction = enter(way, ENTRY_ARC_MM)
    axis = np.asarray(np.eye(3)[int(np.argmin(np.abs(direction)))])
    setup = Setup(
        Anatomy((way,)),
        entry,
        direction,
        (10.0,),
        (0.0,),
        grid.to_mm(0.5 * (np.array(grid.shape) - 1)),
        material_axis=axis,
        wire=TrueWire(),
        greys=Greys(noise=40.0 * (grid.voxel_mm / 0.3) ** 2, correlation_voxels=0.5),
        wall=iso_wall(vessel, part, threshold),
    )
    ahead = way.points_mm[round(ENTRY_ARC_MM / way.step_mm) :]
    depths = tuple(np.arange(10.0, way.length_mm - ENTRY_ARC_MM, 2.0).tolist())
    roll, reached = steer(planned_insertion(setup, 0.2), ahead, depths, 4.0)
    return replace(setup, depths_mm=spread(10.0, max(reached, 14.0), frames), rolls_deg=(roll,) * frames)


def _around(way: Tube, grid: ScanGrid) -> tuple[tuple[slice, ...], ScanGrid]:
    """The box of voxels around a way, as slices and as a grid."""
    index = grid.to_index(way.points_mm)
    margin = CROP_MARGIN_MM / grid.spacing_mm
    low = np.maximum(np.floor(index.min(axis=0) - margin), 0).astype(int)
    high = np.minimum(np.ceil(index.max(axis=0) + margin) + 1, grid.shape).astype(int)
    nx, ny, nz = (high - low).tolist()
    return tuple(slice(a, b) for a, b in zip(low.tolist(), high.tolist(), strict=True)), ScanGrid(
        (nx, ny, nz), grid.spacing_mm, grid.to_mm(low), grid.direction
    )


def _painter(values: NDArray[np.float32], grid: ScanGrid, threshold: float, greys: Greys) -> PsfScanner:
    """Real voxels are already blurred; what a wire displaces is read from them as they are."""
    stretched = values * np.float32(VESSEL_GREY / (2.0 * threshold))
    return PsfScanner(grid, greys, stretched, stretched)
