"""What a scan's header says, and whether two scans share one geometry."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.arrays.grids import corners_mm
from pipeline.status import FrameStatus, StageError
from solver.grid import Grid

SAME_VOXELS = 0.5
"""Anything less between two scans is rounding in a header (1e-8 in a direction is common), harmonised silently."""
LEAST_TURN_DEG = 0.05
"""Turn of the axes that is said: over 500 voxels it moves the last one by half a voxel."""
Box = tuple[tuple[int, int, int], tuple[int, int, int]]
"""First voxel (inclusive) and last voxel (exclusive) along x, y, z."""


class LoadError(StageError):
    """A scan that cannot be used as it is; the message says what, where, found, allowed and what to do."""

    def __init__(self, message: str) -> None:
        super().__init__(FrameStatus.LOAD_FAILED, message)


def unusable(what: object, why: str) -> LoadError:
    """The error for a file or a scan that cannot be used, and why."""
    return LoadError(f"{what}: {why}")


def refused(path: Path, got: str, allowed: str, do: str) -> LoadError:
    """The error for a file that holds something else than it should."""
    return unusable(path, f"got {got}; expected {allowed}; {do}")


@dataclass(frozen=True)
class Source:
    """Where one volume lives: a file, a DICOM folder, or one item of a sequence inside a file."""

    path: Path
    dataset: str = ""
    item: int | None = None

    def __str__(self) -> str:
        """The way a manifest writes it."""
        name = f"{self.path}#{self.dataset}" if self.dataset else str(self.path)
        return name if self.item is None else f"{name}[{self.item}]"


@dataclass(frozen=True)
class Mask(Source):
    """A lumen as voxels.  label : which of a label map, by number or by name.  level : the wall's, of a probability."""

    label: int | str | None = None
    level: float | None = None


@dataclass(frozen=True, eq=False)
class Header:
    """Geometry and type of a scan, read without its voxels.

    shape : voxels along x, y, z.     spacing_mm, origin_mm : (3,).     direction : (3, 3), columns are the axes.
    item_count : volumes in the file (> 1 for a sequence).     whole : of all that the file holds, where this is of a
    box of it alone, which begins at the voxel ``first`` there.
    """

    source: Source
    shape: tuple[int, int, int]
    spacing_mm: NDArray[np.float64]
    origin_mm: NDArray[np.float64]
    direction: NDArray[np.float64]
    pixel_type: str
    item_count: int = 1
    assumed: tuple[str, ...] = ()
    whole: "Header | None" = None
    first: tuple[int, int, int] = (0, 0, 0)

    @property
    def grid(self) -> Grid:
        """The geometry as a grid without values."""
        empty = np.broadcast_to(np.zeros((), np.uint8), self.shape)
        return Grid(empty, self.spacing_mm, self.origin_mm, self.direction)

    @property
    def box(self) -> Box:
        """All of the scan."""
        return (0, 0, 0), self.shape

    def box_of(self, points_mm: ArrayLike) -> Box:
        """The voxels of the scan around points (n, 3), clipped to it."""
        index = self.grid.to_index(points_mm)
        low = np.clip(np.floor(index.min(axis=0) + 1e-6), 0, np.array(self.shape) - 1).astype(int)
        high = np.clip(np.ceil(index.max(axis=0) - 1e-6) + 1, low + 1, self.shape).astype(int)
        return (int(low[0]), int(low[1]), int(low[2])), (int(high[0]), int(high[1]), int(high[2]))


ORTHONORMAL = 1e-3
"""Largest departure of a direction matrix from orthonormal: header rounding is below it, a shear far above."""
SPACING_MM, FARTHEST_MM = (1e-3, 100.0), 1e4
"""A voxel's edges, and the farthest that anything may reach from the origin: beyond these a unit is not mm."""


def judged(header: Header) -> Header:
    """The header with exactly orthonormal axes; LoadError where its geometry cannot be used."""
    spacing, origin, direction = (np.asarray(v, float) for v in (header.spacing_mm, header.origin_mm, header.direction))
    low, high = SPACING_MM
    if not np.all((spacing >= low) & (spacing <= high)):
        why = f"spacing {spacing.tolist()} mm; allowed: {low:g} to {high:g} along every axis"
        raise unusable(header.source, f"{why}; is it in mm? Correct the header, or give spacing_mm in the manifest.")
    reach = np.abs(origin).max() + float(np.dot(spacing, header.shape))
    if not reach <= FARTHEST_MM:
        why = f"origin {origin.tolist()} mm, {list(header.shape)} voxels of {spacing.tolist()} mm"
        raise unusable(header.source, f"{why}; allowed: all of it within {FARTHEST_MM:g} mm; correct the header")
    if not np.all(np.isfinite(direction)) or np.abs(direction.T @ direction - np.eye(3)).max() > ORTHONORMAL:
        found = f"the axes are sheared or scaled, direction {direction.round(5).tolist()}"
        why = f"{found}; allowed: an orthonormal matrix (a tilted gantry gives this)"
        raise unusable(header.source, f"{why}. Resample the scan onto a regular grid first.")
    if min(header.shape) < 2:
        why = f"{list(header.shape)} voxels: one slice is no volume; allowed: 2 voxels or more along every axis"
        raise unusable(header.source, why)
    left, _, right = np.linalg.svd(direction)
    turn = direction if np.allclose(direction.T @ direction, np.eye(3), atol=1e-6) else left @ right
    return replace(header, spacing_mm=spacing, origin_mm=origin, direction=turn)


def describe(header: Header) -> str:
    """One line with the whole geometry, for messages."""
    said = {"shape": header.shape, "spacing": header.spacing_mm, "origin": header.origin_mm}
    numbers = ", ".join(
        f"{name} {np.array2string(np.asarray(value), precision=6, separator=', ').replace(chr(10), '')}"
        for name, value in {**said, "direction": header.direction}.items()
    )
    return f"{header.source}: {numbers}"


def voxel_of(one: Header, other: Header, at: ArrayLike) -> NDArray[np.float64]:
    """The place (3,) in voxels of one scan of a voxel ``at`` (3,) of another."""
    return np.asarray(one.grid.to_index(other.grid.to_mm(np.asarray(at, float))))


def require_same_geometry(reference: Header, other: Header, name: str = "") -> None:
    """Refuse a scan whose corners lie more than SAME_VOXELS from the reference's. name : of it, for the message."""
    if reference.shape == other.shape:
        apart = np.linalg.norm(corners_mm(reference.grid) - corners_mm(other.grid), axis=1)
        shift = float(apart.max() / reference.spacing_mm.min())
        found = f"their corners lie {shift:.2f} voxels apart, allowed {SAME_VOXELS}"
        if shift <= SAME_VOXELS:
            return
    else:
        shapes = f"{list(reference.shape)} and {list(other.shape)} voxels"
        found = f"the shapes differ, {shapes}, {_otherwise(reference, other)}"
    raise LoadError(
        f"geometry differs between scans of one case: {found}.\n"
        f"  {describe(reference)}\n  {name + ' of ' if name else ''}{describe(other)}\n"
        f"{_lost(reference, other)}"
        "  Bring them onto one grid: sitk.Resample(scan, other) of SimpleITK, or Resample Image (BRAINS) of 3D Slicer, "
        "brings a scan onto the grid of another one."
    )


def _lost(one: Header, other: Header) -> str:
    """What to do where only the place of two scans differs, and a header does not state it: resampled, all is lost."""
    if one.shape != other.shape or not np.allclose(one.spacing_mm, other.spacing_mm, rtol=1e-3):
        return ""
    at_zero = [header for header in (one, other) if header.assumed or not header.origin_mm.any()]
    if len(at_zero) != 1:
        return ""
    return (
        f"  {at_zero[0].source} lies at the origin, as where a conversion lost the place: if both were scanned in one "
        "place, copy the other's header onto it (CopyInformation of SimpleITK); else:\n"
    )


def _otherwise(one: Header, other: Header) -> str:
    """In what two scans of different shapes differ besides, in words."""
    if not np.allclose(one.spacing_mm, other.spacing_mm, rtol=1e-3):
        return f"and so do the spacings, {one.spacing_mm.round(4).tolist()} and {other.spacing_mm.round(4).tolist()} mm"
    turn_deg = float(np.degrees(np.arccos(np.clip(0.5 * (np.trace(one.direction.T @ other.direction) - 1.0), -1, 1))))
    if turn_deg > LEAST_TURN_DEG:
        return f"and the axes are turned by {turn_deg:.2g} degrees or mirrored"
    at = voxel_of(one, other, np.zeros(3)).round(2).tolist()
    return f"the second begins at voxel {at} of the first; crops are read where that is whole and they share most"
