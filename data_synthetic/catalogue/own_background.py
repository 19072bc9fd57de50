"""A scene in a real scan: real voxels, real vessel, a made-up wire whose shape is known."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk

from data_synthetic.anatomy.iso_wall import iso_wall
from data_synthetic.anatomy.tubes import Anatomy, Tube
from data_synthetic.anatomy.vessel_way import find_way, vessel_threshold
from data_synthetic.catalogue.own_anatomy import steered
from data_synthetic.catalogue.scene import NamedScene, Setup, spread
from data_synthetic.geometry import ScanGrid, Volume, world_axis_across
from data_synthetic.scanner import Greys, PsfScanner

VESSEL_GREY = 1000.0
"""Grey values are stretched so that the vessel lies here: room for a brighter wire, and for noise below zero."""

ENTRY_ARC_MM, CORRIDOR_MM = 1.0, 4.0
CROP_MARGIN_MM = 8.0
"""The wall is only made this far around the way."""


def background_scene(path: str | Path, voxel_mm: float | None = None) -> NamedScene:
    """A scene in a real scan, from its widest inlet past its widest place.

    path : anything SimpleITK reads.     voxel_mm : overrides the file's spacing, where that is a placeholder.
    """
    values, grid = read_scan(Path(path), voxel_mm)
    threshold = vessel_threshold(values)

    def painter(setup: Setup, _grid: ScanGrid) -> PsfScanner:
        """Real voxels are already blurred; what a wire displaces is read from them as they are."""
        stretched = values * np.float32(VESSEL_GREY / (2.0 * threshold))
        return PsfScanner(grid, setup.greys, stretched, stretched)

    return NamedScene(
        name=Path(path).name.split(".")[0],
        why=f"a made-up wire in the real voxels of {Path(path).name}",
        plan=lambda _rng, frames: _plan(values, grid, threshold, frames),
        frames=12,
        steer=lambda setup: steered(setup, 10.0, CORRIDOR_MM),
        scan=(grid, painter),
    )


def read_scan(path: Path, voxel_mm: float | None) -> tuple[Volume, ScanGrid]:
    """Grey values indexed x, y, z, and where they lie."""
    image: Any = sitk.ReadImage(str(path))
    values = np.ascontiguousarray(sitk.GetArrayFromImage(image).transpose(2, 1, 0), dtype=np.float32)
    spacing = np.array(image.GetSpacing()) if voxel_mm is None else np.full(3, voxel_mm)
    direction = np.array(image.GetDirection()).reshape(3, 3)
    return values, ScanGrid(values.shape, spacing, np.array(image.GetOrigin()), direction)


def _plan(values: Volume, grid: ScanGrid, threshold: float, frames: int) -> Setup:
    """Enter the vessel that is found, against the wall that the scan itself shows."""
    vessel, way = find_way(values, grid, threshold)
    box, part = _around(way, grid)
    setup = Setup(
        Anatomy((way,)),
        way,
        ENTRY_ARC_MM,
        spread(10.0, way.length_mm - ENTRY_ARC_MM, frames),
        (0.0,) * frames,
        grid.to_mm(0.5 * (np.array(grid.shape) - 1)),
        greys=Greys(noise=40.0 * (grid.voxel_mm / 0.3) ** 2, correlation_voxels=0.5),
        wall=iso_wall(np.where(vessel[box], values[box], 0.0).astype(np.float32), part, threshold),
    )
    return replace(setup, material_axis=world_axis_across(setup.direction))


def _around(way: Tube, grid: ScanGrid) -> tuple[tuple[slice, ...], ScanGrid]:
    """The box of voxels around a way, as slices and as a grid."""
    index = grid.to_index(way.points_mm)
    margin = CROP_MARGIN_MM / grid.spacing_mm
    low = np.maximum(np.floor(index.min(axis=0) - margin), 0).astype(int)
    high = np.minimum(np.ceil(index.max(axis=0) + margin) + 1, grid.shape).astype(int)
    box = tuple(slice(a, b) for a, b in zip(low.tolist(), high.tolist(), strict=True))
    return box, ScanGrid(tuple((high - low).tolist()), grid.spacing_mm, grid.to_mm(low), grid.direction)
