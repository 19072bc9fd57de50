"""The files of a case for 3D Slicer and ParaView, in its folder ``view``; LPS mm.

The lumen, closed, as surface and label map; every frame's wires as lines with arrays and as curves; collections over
the frames, and a scene that opens everything.
"""

import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from multiprocessing.context import ForkProcess
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from skimage.measure import marching_cubes

from pipeline.load.geometry import Header
from pipeline.model import Array, Lumen, arc_length
from pipeline.run.helpers import forked, nothing, shared
from pipeline.run.stages import Known
from pipeline.run.stages.known import Frame
from reports import colours, export
from solver import Grid

_LEAST = 1e-3
"""Least distance, in voxels, from the padding voxels' centres to the surface: no triangle has zero area."""


class LumenFiles:
    """Writes the files of a lumen in a process of its own, while the case goes on: to fit a clamp keeps one core busy.

    It only saves time: what that process does not write is written with the others.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._begun: tuple[Lumen, ForkProcess] | None = None

    def begin(self, lumen: Lumen) -> None:
        """Begin to write the files of a lumen."""

        def write() -> None:
            with suppress(Exception):
                _write_lumen(self.folder, lumen)
                return
            sys.exit(1)  # without words: the case writes them itself, and says why it cannot

        self._begun = lumen, forked(write)

    def there(self, lumen: Lumen | None) -> bool:
        """Whether the files of this very lumen are written; waits for them."""
        self.end()
        return self._begun is not None and self._begun[0] is lumen and self._begun[1].exitcode == 0

    def end(self) -> None:
        """Wait for the process, so that nothing is written later."""
        if self._begun is not None:
            self._begun[1].join()


def write_view(
    folder: Path,
    known: Known,
    cores: int = 1,
    beside: Callable[[], object] = nothing,
    lumen_there: Callable[[Lumen | None], bool] = lambda _: False,
    first: Callable[[], object] = nothing,
) -> None:
    """Write the lumen and every frame's wires, each into a file; then the collections and the scene that open them.

    beside : writes other files, as one more part that shares the cores.     lumen_there : whether the lumen's files
    are written already.     first : called by this process while helpers, if there are any, begin to write.
    """

    def one(number: int, _earlier: object) -> bool:
        if number > 1:
            _write_wires(folder, known.frames[number - 2])
        elif number == 1:
            beside()
        elif known.lumen is not None and not written:
            _write_lumen(folder, known.lumen)
        return True

    written = lumen_there(known.lumen)
    shared(one, 2 + len(known.frames), cores, first)
    for kind in colours.WIRES:
        export.write_collection(folder, f"wire_{kind}")
    with_wire = [frame.index for frame in known.frames if frame.simulated is not None]
    shown = max(with_wire, default=0)
    statuses = {frame.index: frame.status for frame in known.frames}
    export.write_scene(folder, shown, *_scans_of(known, shown), statuses)


_SLICER = (".mha", ".mhd", ".nrrd", ".nhdr", ".nii", ".nii.gz")


def _scans_of(known: Known, shown: int) -> tuple[dict[str, Path], str]:
    """Paths of the reference and of the shown frame, by name, where 3D Slicer reads them as they were read here.

    Also why others are left out. Not all frames: a scene is opened whole, and a hundred scans take more memory than a
    computer has.
    """
    frame = {f"frame {shown}": header for header in known.scans.frames[shown : shown + 1]}
    headers = ({"reference": known.scans.reference} if known.scans.reference else {}) | frame
    why = {name: _unlike(header) for name, header in headers.items()}
    found = {name: header.source.path for name, header in headers.items() if not why[name]}
    said = [f"{name} is not opened, since {reason}" for name, reason in why.items() if reason]
    more = len(known.scans.frames) - len(frame)
    said += ["other frames' scans are opened by hand: all lie in the same place (LPS)"] * (more > 0)
    moved = "after a move write the new folder into fileName in scene.mrml"
    said += [f"scans are found where they lay when the case was run: {moved}"] * bool(found)
    return found, "; ".join(said)


def _unlike(header: Header) -> str:
    """Why 3D Slicer would not show a scan as it was read here; empty where it would."""
    source = header.source
    if source.dataset or source.item is not None or header.item_count > 1:
        return f"it is a part of {source.path.name}"
    if not source.path.name.lower().endswith(_SLICER):
        return f"{source.path.name} needs an import (DICOM: by the module of that name)"
    return f"its header was completed here ({header.assumed[0]})" if header.assumed else ""


def contact_at(frame: Frame, arc_mm: Array) -> NDArray[np.float64]:
    """Magnitude (n,) of the contact force of the joints that are nearest to each arc length (n,), N.

    Forces of joints are added up, so that their sum does not depend on the length of the segments.
    """
    if frame.solved is None:
        return np.full(len(arc_mm), np.nan)
    arc = arc_length(frame.solved.joints_mm)
    # joints before the first arc length, in the clamp's reach, are left out
    there = arc > arc_mm[0] - 0.5 * (arc_mm[1] - arc_mm[0]) if len(arc_mm) > 1 else np.ones(len(arc), bool)
    force = np.zeros((len(arc_mm), 3))
    nearest = np.abs(arc_mm[None, :] - arc[there, None]).argmin(axis=1)
    np.add.at(force, nearest, frame.solved.contact_force_N[there])
    return np.asarray(np.linalg.norm(force, axis=1))


def closed_surface(grid: Grid) -> tuple[Array, NDArray[np.int64]]:
    """Vertices (n, 3), LPS mm, and triangles (t, 3) of the surface where a distance is 0, closed at the grid's edge.

    The grid is padded by one voxel, outside by as much as the edge is inside: a cut vessel ends on the outer faces of
    its last voxels.
    """
    step = grid.voxel_mm
    values = np.pad(np.asarray(grid.values, dtype=np.float32), 1, mode="edge")
    inner = tuple(slice(1, -1) for _ in range(3))
    outer = np.maximum(np.abs(values), _LEAST * step)
    outer[inner] = values[inner]
    # normals point outward, where the distance grows; a left-handed grid turns them over
    way: Literal["descent", "ascent"] = "descent" if np.linalg.det(grid.direction) > 0 else "ascent"
    vertices, triangles, _, _ = marching_cubes(outer, 0.0, gradient_direction=way)
    return grid.to_mm(vertices - 1.0), np.asarray(triangles, dtype=np.int64)


def _write_lumen(folder: Path, lumen: Lumen) -> None:
    grid = lumen.distance
    inside = (grid.values < 0).astype(np.uint8)
    geometry = grid.spacing_mm, grid.origin_mm, grid.direction
    export.write_segmentation_nrrd(folder / "lumen.seg.nrrd", inside, *geometry)
    if inside.any():
        surface = closed_surface(grid)
        export.write_surface_vtp(folder / "lumen.vtp", *surface)
        export.write_surface_stl(folder / "lumen.stl", *surface)


def _write_wires(folder: Path, frame: Frame) -> None:
    if frame.curve is not None and frame.traced:
        points = frame.curve.points_mm
        arrays = {"arc_mm": arc_length(points)}
        if len(frame.curve.sigma_mm) == len(points):
            arrays["trace_sigma_mm"] = frame.curve.sigma_mm
        _write_wire(folder, "traced", frame, points, arrays)
    if frame.truth_mm is not None and len(frame.truth_mm):
        _write_wire(folder, "true", frame, frame.truth_mm, {"arc_mm": arc_length(frame.truth_mm)})
    if frame.simulated is not None:
        joints = frame.simulated.joints_mm
        plain = {"arc_mm": arc_length(joints)}
        plain |= {} if frame.solved is None else {"contact_force_N": frame.solved.contact_force_N}
        in_space = frame.comparison is not None and frame.view is None
        points, arrays = _compared(frame) if in_space else (joints, plain)
        _write_wire(folder, "simulated", frame, points, arrays, joints)


def _compared(frame: Frame) -> tuple[Array, dict[str, Any]]:
    """Points and arrays of a compared wire: joints in the clamp's reach, then the compared samples with their errors.

    trace_sigma_mm : standard deviation of the trace at the nearest points.     u_val_mm : where there is a budget, the
    uncertainty of each error in its direction, as in points.csv.gz: an error is held against this one.
    """
    errors, joints = frame.comparison, frame.simulated.joints_mm if frame.simulated is not None else np.zeros((0, 3))
    assert errors is not None
    assert frame.curve is not None
    along = arc_length(joints)
    reach = along[along < errors.arc_mm[0] - 1e-9]
    arc = np.concatenate([reach, errors.arc_mm])
    nothing = np.full(len(reach), np.nan)
    arrays = {"error_mm": np.concatenate([nothing, errors.error_mm]), "arc_mm": arc}
    arrays |= {} if frame.solved is None else {"contact_force_N": contact_at(frame, arc)}
    traced = arc_length(frame.curve.points_mm)
    if len(frame.curve.sigma_mm) == len(traced):
        sigma_mm = np.interp(errors.foot_arc_mm, traced, frame.curve.sigma_mm)
        arrays["trace_sigma_mm"] = np.concatenate([nothing, sigma_mm])
    if frame.budget is not None and frame.budget.u_mm is not None:
        arrays["u_val_mm"] = np.concatenate([nothing, frame.budget.u_mm])
    return np.concatenate([joints[: len(reach)], errors.sample_mm]), arrays


def _write_wire(
    folder: Path, kind: str, frame: Frame, points: Array, arrays: Mapping[str, Any], curve: Array | None = None
) -> None:
    """Write a wire as a line with arrays and as a curve of 3D Slicer with numbers; curve : its points, if others."""
    name = f"wire_{kind}_{frame.index:03d}"
    export.write_polyline_vtp(folder / f"{name}.vtp", points, arrays)
    known = {"rms_mm": "rms distance to the traced wire", "tip_mm": "distance of the tips"}
    numbers = {} if kind != "simulated" or frame.comparison is None else frame.comparison.values
    said = {text: float(numbers[column]) for column, text in known.items() if column in numbers}
    path, label = folder / f"{name}.mrk.json", export.wire_name(kind, frame.index, frame.status)
    export.write_markups_curve(path, points if curve is None else curve, label, colours.WIRES[kind], said)
