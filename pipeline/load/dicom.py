"""DICOM series in a folder: sorted by position, refused by name where a stack is not a regular grid.

ITK's reader sorts and spaces slices by itself, but shears a tilted stack and silently respaces one that lacks a
slice (ITK issues 441 and 1607), so the positions are checked here, with tolerances relative to the spacing.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray
from scipy.ndimage import shift as shift_slice

from pipeline.load.config import LoadConfig
from pipeline.load.files import to_xyz
from pipeline.load.geometry import Box, Header, LoadError, Source
from pipeline.load.multiframe import Frames, frames_of

GAP_TOLERANCE = 0.01  # of the slice spacing; scanners write positions to 1e-3 mm
TILT_TOLERANCE = 0.1  # pixels of in-plane drift per slice
POSITION, ORIENTATION, PIXEL_SPACING = "0020|0032", "0020|0037", "0028|0030"


@dataclass(frozen=True, eq=False)
class Stack:
    """Slices of one series in order: files, positions (n, 3) in mm, in-plane axes (3, 2), pixel (2,) mm, size (2,).

    frames : which frame of the one file each slice is, where a multi-frame file holds them all.
    """

    files: tuple[Path, ...]
    positions: NDArray[np.float64]
    axes: NDArray[np.float64]
    pixel_mm: NDArray[np.float64]
    size: tuple[int, int]
    pixel_type: str
    frames: tuple[int, ...] = ()

    def name(self, i: int) -> str:
        """What a message calls a slice."""
        return f"frame {self.frames[i] + 1}" if self.frames else self.files[i].name

    @property
    def normal(self) -> NDArray[np.float64]:
        """Unit vector across the slices."""
        return np.cross(self.axes[:, 0], self.axes[:, 1])

    @property
    def heights(self) -> NDArray[np.float64]:
        """Position (n,) of every slice along the normal, mm."""
        return np.asarray(self.positions @ self.normal)

    @property
    def drift_px(self) -> NDArray[np.float64]:
        """In-plane displacement (n, 2) of every slice from the first, pixels."""
        return np.asarray((self.positions - self.positions[0]) @ self.axes / self.pixel_mm)

    @property
    def spacing_mm(self) -> float:
        """Usual distance between neighbours: the median gap."""
        return float(np.median(np.diff(self.heights)))


def _numbers(reader: sitk.ImageFileReader, key: str, count: int, path: Path) -> NDArray[np.float64]:
    text = reader.GetMetaData(key) if reader.HasMetaDataKey(key) else ""
    values = [float(v) for v in text.split("\\") if v.strip()]
    if len(values) != count:
        tag = key.replace("|", ",")
        msg = (
            f"{path}: DICOM tag ({tag}) holds {text!r}, expected {count} numbers; this slice has no position"
        )
        raise LoadError(msg)
    return np.array(values)


def _series_files(folder: Path, wanted: str) -> tuple[str, ...]:
    sitk.ProcessObject.SetGlobalWarningDisplay(
        False
    )  # GDCM prints its own lines about folders without a series
    ids = sitk.ImageSeriesReader.GetGDCMSeriesIDs(str(folder))
    sizes = {uid: sitk.ImageSeriesReader.GetGDCMSeriesFileNames(str(folder), uid) for uid in ids}
    images = {uid: files for uid, files in sizes.items() if files and _is_image(files[0])}
    if wanted:
        images = {uid: files for uid, files in images.items() if uid == wanted}
    if len(images) != 1:
        groups = "\n".join(f"    {uid}: {len(files)} files" for uid, files in images.items()) or "    none"
        below = [d.name for d in sorted(folder.iterdir()) if d.is_dir()]
        hint = f"  It has sub-folders: {', '.join(below[:5])}; name one of them.\n" if below else ""
        msg = (
            f"{folder}: found {len(images)} DICOM image series, expected one:\n{groups}\n{hint}"
            "  Keep one series a folder, or name one as FOLDER#SERIES_UID."
        )
        raise LoadError(msg)
    return next(iter(images.values()))


def _header_of(path: Path) -> sitk.ImageFileReader:
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(path))
    reader.ReadImageInformation()
    return reader


def _is_image(path: str) -> bool:
    try:
        reader = _header_of(Path(path))
    except RuntimeError:
        return False
    return bool(reader.HasMetaDataKey(POSITION)) or frames_of(Path(path)) is not None


def read_stack(source: Source) -> Stack:
    """Headers of the one series in a folder, or of one multi-frame file, sorted along the slice normal."""
    names = _series_files(source.path, source.dataset) if source.path.is_dir() else (str(source.path),)
    files = [Path(name) for name in names]
    headers = [_header_of(path) for path in files]
    several = frames_of(files[0]) if len(files) == 1 else None
    where = several or _slices(files, headers)
    if several is not None:
        files *= _frame_count(files[0], headers[0], several)
    _require_uniform(source, where, [header.GetSize()[:2] for header in headers])
    axes = where.orientations[0].reshape(2, 3).T
    order = np.argsort(where.positions @ np.cross(axes[:, 0], axes[:, 1]), kind="stable")
    width, height = headers[0].GetSize()[:2]
    return Stack(
        tuple(files[i] for i in order), where.positions[order], axes, where.pixels_mm[0][::-1], (width, height),
        sitk.GetPixelIDValueAsString(headers[-1].GetPixelID()), tuple(map(int, order)) if several else (),
    )  # fmt: skip


def _slices(files: list[Path], headers: list[sitk.ImageFileReader]) -> Frames:
    """Where the slices of a series lie, one file each."""
    tags = ((POSITION, 3), (ORIENTATION, 6), (PIXEL_SPACING, 2))
    each = [[_numbers(h, tag, n, path) for tag, n in tags] for path, h in zip(files, headers, strict=True)]
    positions, orientations, pixels = (np.array(values) for values in zip(*each, strict=True))
    return Frames(positions, orientations, pixels)


def _frame_count(path: Path, header: sitk.ImageFileReader, frames: Frames) -> int:
    """Frames of a multi-frame file, each of which must have a position."""
    size = header.GetSize()
    count = size[2] if len(size) > 2 else 1
    if count != len(frames.positions):
        msg = f"{path}: the file holds {count} frames and positions of {len(frames.positions)}; allowed: one for each."
        raise LoadError(msg + " Export the series again.")
    return int(count)


def _require_uniform(source: Source, where: Frames, sizes: list[Any]) -> None:
    pixels = where.pixels_mm[:, ::-1]  # DICOM writes row spacing (y) first
    for name, values in (("orientation", where.orientations), ("pixel spacing", pixels), ("size", sizes)):
        kinds = Counter(tuple(np.round(v, 5)) for v in values)
        if len(kinds) > 1:
            found = "; ".join(
                f"{count} slices with {list(map(float, kind))}" for kind, count in kinds.items()
            )
            msg = (
                f"{source.path}: slices of different {name}: {found}. Mixed series: keep one stack a folder."
            )
            raise LoadError(msg)


def irregularities(stack: Stack) -> list[str]:
    """Why a stack is not a regular grid: repeated positions, missing slices, irregular gaps, tilt. Empty if it is."""
    gaps = np.diff(stack.heights)
    if len(gaps) == 0:
        return ["single slice: one DICOM file is no volume"]
    problems = []
    if np.any(gaps < 1e-3):
        problems.append(f"repeated position: {int(np.sum(gaps < 1e-3))} slice(s) lie where another one lies")
    usual = stack.spacing_mm
    odd = np.flatnonzero(np.abs(gaps - usual) > GAP_TOLERANCE * usual)
    if len(odd) and usual > 1e-3:
        where = ", ".join(f"{gaps[i]:.3f} mm after {stack.name(i)}" for i in odd[:4])
        whole = np.allclose(gaps[odd] / usual, np.round(gaps[odd] / usual), atol=0.02) and np.all(
            gaps[odd] > usual
        )
        kind = "missing slices" if whole else "irregular slice gaps"
        problems.append(f"{kind}: {len(odd)} of {len(gaps)} gaps differ from {usual:.3f} mm ({where})")
    drift = np.abs(stack.drift_px[-1]).max() / len(gaps)
    if drift > TILT_TOLERANCE:
        angle = np.degrees(
            np.arctan2(np.linalg.norm(stack.drift_px[-1] * stack.pixel_mm), np.ptp(stack.heights))
        )
        problems.append(f"gantry tilt: the stack leans {angle:.1f} degrees from the slice normal")
    return problems


def recognises(path: Path) -> bool:
    """A folder of slices, or one enhanced multi-frame file."""
    if path.is_dir():
        return True
    return path.suffix.lower() in {".dcm", ".ima", ""} and frames_of(path) is not None


def read_header(source: Source, config: LoadConfig) -> Header:
    """Geometry of a series; tilt, gaps and repeats are refused, or resampled where the setting asks for it."""
    return _header(source, read_stack(source), config.resample)


def _header(source: Source, stack: Stack, resample: bool) -> Header:
    problems = irregularities(stack)
    fatal = [p for p in problems if p.startswith(("repeated", "single"))]
    if fatal or (problems and not resample):
        listing = "".join(f"\n    {p}" for p in problems)
        msg = (
            f"{source.path}: this series is not a regular grid:{listing}\n  A plain stack would shear or stretch the "
            "anatomy. Export it again without tilt, or ask for resampling with --set load.resample=true."
        )
        raise LoadError(msg)
    count = (
        len(stack.files)
        if not problems
        else int(np.floor(np.ptp(stack.heights) / stack.spacing_mm + 1e-6)) + 1
    )
    return Header(
        source,
        (stack.size[0], stack.size[1], count),
        np.array([*stack.pixel_mm, stack.spacing_mm]),
        stack.positions[0],
        np.column_stack([stack.axes, stack.normal]),
        stack.pixel_type,
        (source.path,),
        assumed=tuple(f"resampled onto a regular grid: {p}" for p in problems),
    )


def read(header: Header, box: Box, _config: LoadConfig) -> NDArray[Any]:
    """Voxels of ``box``: of a regular stack the needed slices alone, of an irregular one the resampled grid."""
    stack = read_stack(header.source)
    (x0, y0, z0), (x1, y1, z1) = box
    if any("resampled" in text for text in header.assumed):
        return _resampled(header, stack)[x0:x1, y0:y1, z0:z1]
    if stack.frames:
        whole = to_xyz(sitk.ReadImage(str(stack.files[0])))
        return np.asfortranarray(whole[x0:x1, y0:y1, list(stack.frames[z0:z1])])
    reader = sitk.ImageSeriesReader()
    reader.SetFileNames([str(f) for f in stack.files[z0:z1]])
    return to_xyz(reader.Execute())[x0:x1, y0:y1]


def _resampled(header: Header, stack: Stack) -> NDArray[np.float32]:
    """Linear between the two nearest slices, each first shifted in plane by its drift (undoes the tilt)."""
    heights = stack.heights - stack.heights[0]
    slices: dict[int, NDArray[np.float32]] = {}
    whole = to_xyz(sitk.ReadImage(str(stack.files[0]))) if stack.frames else None

    def straightened(i: int) -> NDArray[np.float32]:
        if i not in slices:
            if whole is None:
                plane = to_xyz(sitk.ReadImage(str(stack.files[i])))[:, :, 0].astype(np.float32)
            else:
                plane = whole[:, :, stack.frames[i]].astype(np.float32)
            slices[i] = shift_slice(
                plane, stack.drift_px[i], order=1, mode="constant", cval=float(plane.min())
            )
        return slices[i]

    out = np.empty(header.shape, np.float32)
    for k in range(header.shape[2]):
        z = min(k * header.spacing_mm[2], heights[-1])
        upper = int(np.clip(np.searchsorted(heights, z), 1, len(heights) - 1))
        weight = (z - heights[upper - 1]) / (heights[upper] - heights[upper - 1])
        out[:, :, k] = (1 - weight) * straightened(upper - 1) + weight * straightened(upper)
        slices = {i: s for i, s in slices.items() if i >= upper - 1}
    return out
