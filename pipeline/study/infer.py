"""A manifest for a folder of scans: what can be seen is inferred, what cannot is assumed and said."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import ndimage

from pipeline.load import SUFFIXES, LoadError, load, read_header
from pipeline.load.config import LoadConfig
from pipeline.model import Array, Volume
from pipeline.study.schema import natural_key

REFERENCE_NAMES = ("reference", "ref", "wire_free", "nowire", "empty")
DEFAULT_WIRE = """radius_mm = {radius}
bending_stiffness_N_mm2 = [[0.0, 0.5], [30.0, 5.0], [100.0, 40.0]]
rest_curvature_per_mm = [[0.0, 0.15], [10.0, 0.15], [10.0, 0.0]]"""


@dataclass(frozen=True)
class Inferred:
    """Text of the manifest and the sentences that say where each guess comes from."""

    text: str
    assumptions: tuple[str, ...]


def _is_scan(path: Path) -> bool:
    return path.name.lower().endswith(SUFFIXES) or (path.is_dir() and any(path.glob("*.dcm")))


def _scans_in(folder: Path) -> tuple[Path | None, list[Path]]:
    below = [p for p in folder.iterdir() if _is_scan(p)]
    if (folder / "frames").is_dir():
        below += [p for p in (folder / "frames").iterdir() if _is_scan(p)]
    below.sort(key=lambda p: natural_key(str(p.relative_to(folder))))
    reference = next((p for p in below if p.name.lower().split(".")[0] in REFERENCE_NAMES), None)
    return reference, [p for p in below if p != reference]


def _wire_voxels(frame: Volume, reference: Volume | None) -> Array:
    """Indices (n, 3) of the largest bright component: metal is brighter than anything else in a frame."""
    grey = frame.values.astype(np.float32)
    if reference is not None:
        grey -= reference.values
    peak = np.percentile(grey, 99.999)
    labels, count = ndimage.label(grey > 0.5 * peak, np.ones((3, 3, 3)))
    if count == 0:
        return np.zeros((0, 3))
    sizes = np.bincount(labels.ravel())[1:]
    return np.argwhere(labels == 1 + int(sizes.argmax())).astype(float)


def infer_entry(frame: Volume, reference: Volume | None) -> tuple[Array, Array]:
    """Entry (LPS mm) and direction: the wire's end nearest to the edge of the scan, and where it points from there.

    Raises LoadError where no bright, connected structure is found.
    """
    voxels = _wire_voxels(frame, reference)
    if len(voxels) < 5:
        msg = "no wire is visible in the first frame, so the entry cannot be inferred; give --entry and --direction"
        raise LoadError(msg)
    edge = np.minimum(voxels, np.array(frame.shape) - 1 - voxels).min(axis=1)
    points = frame.to_mm(voxels)
    entry = points[np.argmin(edge)]
    distance = np.linalg.norm(points - entry, axis=1)
    reach = 4.0 * float(frame.spacing_mm.max()) + 2.0
    near = points[distance < reach]
    axis = np.linalg.svd(near - near.mean(axis=0))[2][0]
    return entry, np.asarray(axis * np.sign((near.mean(axis=0) - entry) @ axis))


def infer_manifest(
    folder: Path, entry: Array | None, direction: Array | None, radius_mm: float | None, config: LoadConfig
) -> Inferred:
    """A manifest for one case from a folder of scans; raises LoadError where there is nothing to go by."""
    reference, frames = _scans_in(folder)
    if not frames:
        msg = f"{folder}: found no scans; allowed: files {', '.join(SUFFIXES)} or DICOM folders, here or in frames/"
        raise LoadError(msg)
    notes = [
        f"frames: {len(frames)} scans in natural order, {frames[0].name} to {frames[-1].name}",
        f"reference: {reference.name}" if reference else "reference: none found (a file named reference.*)",
    ]
    if entry is None or direction is None:
        first = load(read_header(frames[0], config), None, config)
        empty = load(read_header(reference, config), None, config) if reference else None
        found_entry, found_direction = infer_entry(first, empty)
        entry, direction = (found_entry, found_direction) if entry is None else (entry, found_direction)
        notes.append(
            "entry_mm and entry_direction: the end of the wire nearest to the edge of the first frame"
        )
    notes.append(f"wire: radius {radius_mm or 0.18} mm, stiffness and tip curve of a common 0.014 inch wire")
    notes.append("insertion_mm: not given, so the traced lengths are not checked against anything")
    return Inferred(_text(folder, reference, frames, entry, direction, radius_mm or 0.18), tuple(notes))


def _text(
    folder: Path, reference: Path | None, frames: list[Path], entry: Array, direction: Array, radius: float
) -> str:
    names = ", ".join(f'"{p.resolve()}"' for p in frames)
    lines = ["schema = 1", "", "[wires.assumed]", DEFAULT_WIRE.format(radius=radius), "", "[[case]]"]
    lines.append(f'id = "{"".join(c if c.isalnum() or c in "._-" else "_" for c in folder.resolve().name)}"')
    if reference:
        lines.append(f'reference = "{reference.resolve()}"')
    lines.append(f"frames = [{names}]")
    lines.append(f"entry_mm = {[round(float(x), 3) for x in entry]}")
    lines.append(f"entry_direction = {[round(float(x), 5) for x in direction]}")
    lines.append('wire = "assumed"')
    return "\n".join(lines) + "\n"
