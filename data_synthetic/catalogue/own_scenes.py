"""Scenes from a user's own file: a wire in the vessels of an anatomy, and a wire in the real voxels of a scan."""

from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk

from data_synthetic.anatomy.centrelines import read_tree
from data_synthetic.anatomy.from_tree import way_through
from data_synthetic.anatomy.real_scan import find_way, iso_wall, vessel_threshold
from data_synthetic.anatomy.tubes import Anatomy, Tube
from data_synthetic.catalogue.scene import NamedScene, Setup, spread
from data_synthetic.geometry import Array, ScanGrid, Volume, arc_lengths, world_axis_across
from data_synthetic.rod.replay import TrueFrame, TrueInsertion, replay
from data_synthetic.scanner import Greys, PsfScanner

ROLLS_DEG = (0.0, 90.0, 180.0, 270.0, 30.0, 120.0, 210.0, 300.0, 60.0, 150.0, 240.0, 330.0)
COARSE_MM = 0.8
"""Node spacing of the trials."""
LARGEST_JUMP_MM = 2.0
"""A tip that springs further than this in one step has left the quiet part of the insertion."""
DEEPEST_MM = 0.25
"""A trial in which the wire is pressed further into the wall than this is stuck: it is not pushed on."""


def _on_the_way(insertion: TrueInsertion, frame: TrueFrame, way_mm: Array, corridor_mm: float) -> bool:
    """Near the way, about as far along it as the wire is long (it may bulge, so 0.7), not stuck, no wild snap."""
    away = np.linalg.norm(way_mm - frame.points_mm[-1], axis=1)
    foot = int(np.argmin(away))
    short = arc_lengths(way_mm)[foot] < 0.7 * frame.depth_mm - corridor_mm
    if away[foot] > corridor_mm or short or frame.jump_mm > LARGEST_JUMP_MM:
        return False
    phi = insertion.wall.distance_and_gradient(frame.points_mm)[0]
    return bool(np.max(phi + insertion.wire.radius_mm) < DEEPEST_MM)


ENTRY_ARC_MM, END_MM = 3.0, 4.0
"""How far inside the way's beginning the wire enters, and how far before its end it stops at the latest."""
MARGIN_MM = 6.0
"""Tissue around the way in the field of view."""
VOXELS_ACROSS = 2.5
"""Real vessels taper along the way: trees of cerebral arteries are segmented and traced with this many."""
SHORTEST_TRIAL_MM, TRIAL_STEP_MM, LEAST_PUSH_MM = 10.0, 2.0, 4.0
"""First depth and advance of a trial with some roll, and how far frames reach beyond the first even if all fail."""


def from_anatomy(path: str | Path) -> NamedScene:
    """A scene along the widest way through the vessels of an .swc tree or of a Slicer .mrk.json curve with radii."""
    path = Path(path)
    anatomy = way_through(read_tree(path))
    tube = anatomy.tubes[0]
    low, high = tube.points_mm.min(axis=0), tube.points_mm.max(axis=0)
    widest = float(tube.radii_mm.max())

    def plan(_rng: np.random.Generator, frames: int) -> Setup:
        depths = spread(8.0, tube.length_mm - ENTRY_ARC_MM - END_MM, frames)
        return Setup(anatomy, tube, ENTRY_ARC_MM, depths, (0.0,) * frames, 0.5 * (low + high))

    return NamedScene(
        name=path.name.split(".")[0].replace(" ", "-").replace("(", "").replace(")", "").lower(),
        why=f"vessels of {path.name}: {tube.length_mm:.0f} mm of its widest way, {len(anatomy.tubes)} tubes near it",
        plan=plan,
        fov_mm=float(np.max(high - low)) + 2 * (MARGIN_MM + widest),
        size=192,
        frames=12,
        voxels_across=VOXELS_ACROSS,
        steer=lambda setup: steered(setup, 8.0, widest + 1.0),
    )


def steered(setup: Setup, first_mm: float, corridor_mm: float) -> Setup:
    """The roll that leads furthest along the way from the entry, and depths from ``first_mm`` to where it led.

    corridor_mm : how far the tip may be from the way and still be on it.
    """
    setup = replace(setup, material_axis=world_axis_across(setup.direction))
    trial = replace(setup.insertion(), step_mm=COARSE_MM, advance_mm=COARSE_MM)
    way, furthest, best_roll = setup.tube.points_mm[setup.ahead], 0.0, 0.0
    depths = np.arange(SHORTEST_TRIAL_MM, setup.depths_mm[-1], TRIAL_STEP_MM).tolist()
    for roll in ROLLS_DEG:
        on_the_way = takewhile(lambda frame: _on_the_way(trial, frame, way, corridor_mm), replay(trial, depths, roll))
        reached = max((frame.depth_mm for frame in on_the_way), default=0.0)
        if reached > furthest:
            furthest, best_roll = reached, roll
        if furthest >= depths[-1]:
            break
    frames = len(setup.depths_mm)
    last = max(furthest, first_mm + LEAST_PUSH_MM)
    return replace(setup, depths_mm=spread(first_mm, last, frames), rolls_deg=(best_roll,) * frames)


SMALLEST = 16
"""Voxels along an axis below which nothing can be found in a scan."""
VESSEL_GREY = 1000.0
"""Grey values are stretched so that the vessel lies here: room for a brighter wire, and for noise below zero."""
BACKGROUND_ENTRY_ARC_MM, CORRIDOR_MM = 1.0, 4.0
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
    """Grey values indexed x, y, z, and where they lie; ValueError for what is no volume of grey values."""
    series = sitk.ImageSeriesReader.GetGDCMSeriesFileNames(str(path)) if path.is_dir() else str(path)
    try:
        image: Any = sitk.ReadImage(series)
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


def _plan(values: Volume, grid: ScanGrid, threshold: float, frames: int) -> Setup:
    """Enter the vessel that is found, against the wall that the scan itself shows."""
    try:
        vessel, way = find_way(values, grid, threshold)
    except (ValueError, IndexError):
        why = "no vessel with an inlet and a way through it is found among the bright voxels"
        raise ValueError(f"{why}; allowed: a contrast-filled vessel brighter than all around it; crop to it") from None
    box, part = _around(way, grid)
    share = (grid.voxel_mm / 0.3) ** 2
    return Setup(
        Anatomy((way,)),
        way,
        BACKGROUND_ENTRY_ARC_MM,
        spread(10.0, way.length_mm - BACKGROUND_ENTRY_ARC_MM, frames),
        (0.0,) * frames,
        grid.to_mm(0.5 * (np.array(grid.shape) - 1)),
        # a wire fills less of a larger voxel: it is made as much brighter, or it would drown in voxels of 0.5 mm
        greys=Greys(noise=40.0 * share, wire=Greys.wire * max(share, 1.0), correlation_voxels=0.5),
        wall=iso_wall(np.where(vessel[box], values[box], 0.0).astype(np.float32), part, threshold),
    )


def _around(way: Tube, grid: ScanGrid) -> tuple[tuple[slice, ...], ScanGrid]:
    """The box of voxels around a way, as slices and as a grid."""
    index = grid.to_index(way.points_mm)
    margin = CROP_MARGIN_MM / grid.spacing_mm
    low = np.maximum(np.floor(index.min(axis=0) - margin), 0).astype(int)
    high = np.minimum(np.ceil(index.max(axis=0) + margin) + 1, grid.shape).astype(int)
    box = tuple(slice(a, b) for a, b in zip(low.tolist(), high.tolist(), strict=True))
    return box, ScanGrid(tuple((high - low).tolist()), grid.spacing_mm, grid.to_mm(low), grid.direction)
