"""A wire in the real voxels of a scan: in a vessel that the scan shows, or else in one that is painted into it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from scipy.ndimage import binary_dilation

from data_synthetic.anatomy.iso_wall import iso_wall
from data_synthetic.anatomy.tubes import Anatomy, Tube
from data_synthetic.anatomy.vessel_in_scan import Mask, find_vessel, find_way
from data_synthetic.catalogue.own_scenes import END_MM, steered
from data_synthetic.catalogue.painted_vessel import paint_vessel
from data_synthetic.catalogue.scene import NamedScene, Setup, name_after, spread
from data_synthetic.geometry import ScanGrid, Volume
from data_synthetic.rod.rod import Wall
from data_synthetic.scanner import Greys, PsfScanner

SMALLEST = 16
"""Voxels along an axis below which nothing can be found in a scan."""
UNEVEN = 0.05
"""Share of the distance of slices by which they may lie elsewhere than on a grid."""
VESSEL_GREY = 1000.0
"""Grey values are stretched so that the vessel lies here: room for a brighter wire, and for noise below zero."""
FIRST_MM, ENTRY_ARC_MM, CORRIDOR_MM = 10.0, 1.0, 4.0
CROP_MARGIN_MM = 8.0
"""The wall is only made this far around the way."""


def background_scene(path: str | Path, voxel_mm: float | None = None) -> NamedScene:
    """A scene in a real scan, along the longest of the vessels that it shows, or along one that is painted into it.

    path : anything SimpleITK reads.     voxel_mm : overrides the file's spacing, where that is a placeholder.
    Raises ValueError for what is no volume, and for one in which no vessel has room.
    """
    values, grid = read_scan(Path(path), voxel_mm)
    try:
        shown, way, wall = _ground(values, grid)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    what = " and a made-up vessel, since none was found," if wall is None else ""
    stretched = np.float32(VESSEL_GREY) * shown

    def plan(_rng: np.random.Generator, frames: int) -> Setup:
        return _plan(grid, way, wall, frames)

    return NamedScene(
        name=name_after(Path(path)),
        why=f"a made-up wire{what} in the real voxels of {Path(path).name}",
        plan=plan,
        frames=12,
        steer=lambda setup: steered(setup, FIRST_MM, CORRIDOR_MM),
        # real voxels are already blurred; what a wire displaces is read from them as they are
        scan=(grid, lambda setup, _: PsfScanner(grid, setup.greys, stretched, stretched)),
    )


def read_scan(path: Path, voxel_mm: float | None) -> tuple[Volume, ScanGrid]:
    """Grey values indexed x, y, z, and where they lie; ValueError for what is no volume of grey values."""
    try:
        image: Any = sitk.ReadImage(_only_series(path) if path.is_dir() else str(path))
    except RuntimeError:
        allowed = "a file that SimpleITK reads, or a folder with one DICOM series"
        raise ValueError(f"{path}: cannot be read as a volume; allowed: {allowed}; check the file") from None
    size, channels = image.GetSize(), image.GetNumberOfComponentsPerPixel()
    if len(size) != 3 or channels != 1 or min(size) < SMALLEST:
        found = f"{len(size)} axes of {size} with {channels} value(s) per voxel"
        raise ValueError(
            f"{path}: {found}; allowed: one volume of grey values, {SMALLEST} voxels or more along each axis"
        )
    values = np.ascontiguousarray(sitk.GetArrayFromImage(image).transpose(2, 1, 0), dtype=np.float32)
    spacing = np.array(image.GetSpacing()) if voxel_mm is None else np.full(3, voxel_mm)
    direction = np.array(image.GetDirection()).reshape(3, 3)
    if not np.all(np.isfinite(values)) or values.min() == values.max():
        raise ValueError(f"{path}: its grey values are NaN, infinite or all alike; allowed: a scan that shows a vessel")
    return values, ScanGrid(values.shape, spacing, np.array(image.GetOrigin()), direction)


def _only_series(folder: Path) -> Sequence[str]:
    """The slices of the one DICOM series in a folder, in order; ValueError for none or several, and for a stack that no
    grid fits.
    """
    found = sitk.ImageSeriesReader.GetGDCMSeriesIDs(str(folder))
    if len(found) != 1:
        below = [f"{path.name}/" for path in sorted(folder.iterdir()) if path.is_dir()][:3]
        look = f"; does one of its folders, as {', '.join(below)}, hold it?" if below and not found else ""
        raise ValueError(f"{folder}: holds {len(found) or 'no'} DICOM series; allowed: one in a folder by itself{look}")
    slices: Sequence[str] = sitk.ImageSeriesReader.GetGDCMSeriesFileNames(str(folder), found[0])
    _equally_far_apart(folder, slices)
    return slices


def _equally_far_apart(folder: Path, slices: Sequence[str]) -> None:
    """ValueError where slices lie unevenly or aside: a plain stack of them would stretch or shear what they show."""
    places, reader = [], sitk.ImageFileReader()
    for name in slices:
        reader.SetFileName(name)
        reader.ReadImageInformation()
        places.append(reader.GetOrigin())
    steps = np.diff(np.array(places), axis=0)
    if not len(steps):
        return
    normal = np.array(reader.GetDirection()).reshape(3, 3)[:, 2]
    along = np.abs(steps @ normal)
    aside = np.linalg.norm(steps - (steps @ normal)[:, None] * normal, axis=1)
    if np.ptp(along) > UNEVEN * np.median(along) or np.max(aside) > UNEVEN * np.median(along):
        raise ValueError(f"{folder}: its slices are not equally far apart, or lean; give it resampled, as one file")


def _ground(values: Volume, grid: ScanGrid) -> tuple[Volume, Tube, Wall | None]:
    """The scan with its vessel at 1 and what is around it at 0, the way through it, and its wall, or None where the
    vessel had to be painted: the way's tube is its wall, too. ValueError where there is no room for one.
    """
    try:
        vessel = find_vessel(values, grid)
        way = find_way(vessel.voxels, grid)
    except ValueError:
        return *paint_vessel(values, grid), None
    shown = (values - np.float32(vessel.background)) * np.float32(1.0 / (vessel.grey - vessel.background))
    return shown, way, _wall(shown, grid, vessel.voxels, way)


def _plan(grid: ScanGrid, way: Tube, wall: Wall | None, frames: int) -> Setup:
    """Enter the vessel at the way's beginning."""
    share = (grid.voxel_mm / 0.3) ** 2
    return Setup(
        Anatomy((way,)),
        way,
        ENTRY_ARC_MM,
        spread(FIRST_MM, way.length_mm - ENTRY_ARC_MM - END_MM, frames),
        (0.0,) * frames,
        grid.to_mm(0.5 * (np.array(grid.shape) - 1)),
        # a wire fills less of a larger voxel: it is made as much brighter, or it would drown in voxels of 0.5 mm
        greys=Greys(noise=40.0 * share, wire=Greys.wire * max(share, 1.0), correlation_voxels=0.5),
        wall=wall,
    )


def _wall(values: Volume, grid: ScanGrid, vessel: Mask, way: Tube) -> Wall:
    """The wall that the scan itself shows around a way: half-way from 0, its surroundings, to 1, the vessel."""
    box, part = _around(way, grid)
    near = binary_dilation(vessel[box], iterations=2)
    return iso_wall(np.where(near, values[box], 0.0).astype(np.float32), part, 0.5)


def _around(way: Tube, grid: ScanGrid) -> tuple[tuple[slice, ...], ScanGrid]:
    """The box of voxels around a way, as slices and as a grid."""
    index = grid.to_index(way.points_mm)
    margin = CROP_MARGIN_MM / grid.spacing_mm
    low = np.maximum(np.floor(index.min(axis=0) - margin), 0).astype(int)
    high = np.minimum(np.ceil(index.max(axis=0) + margin) + 1, grid.shape).astype(int)
    box = tuple(slice(a, b) for a, b in zip(low.tolist(), high.tolist(), strict=True))
    return box, ScanGrid(tuple((high - low).tolist()), grid.spacing_mm, grid.to_mm(low), grid.direction)
