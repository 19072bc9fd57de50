"""DICOM series in a folder or a multi-frame file: sorted by position, refused by name where a stack is no regular grid.

ITK's reader sorts and spaces slices by itself, but shears a tilted stack and silently respaces one that lacks a
slice (ITK issues 441 and 1607), so the positions are checked here, with tolerances relative to the spacing.

Of an enhanced multi-frame file (CT, MR, XA and others since DICOM supplement 49) GDCM takes spacing and direction from
the first frames alone: with a frame missing it says 1 mm, it hides a tilt, and turns a stack written downwards into one
with the wrong direction. So the functional groups are read here.
"""

import struct
from collections import Counter
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray
from scipy.ndimage import shift as shift_slice

from pipeline.load.config import LoadConfig
from pipeline.load.files import reader_of, to_xyz
from pipeline.load.geometry import Box, Header, LoadError, Source, unusable

SUFFIXES = {".dcm", ".ima"}
GAP_TOLERANCE = 0.01  # of the slice spacing; scanners write positions to 1e-3 mm
TILT_TOLERANCE = 0.1  # pixels of in-plane drift per slice
POSITION, ORIENTATION, PIXEL_SPACING = "0020|0032", "0020|0037", "0028|0030"
KEYWORDS = ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing")


@dataclass(frozen=True, eq=False)
class Frames:
    """positions (n, 3) mm and orientation (n, 6) of the frames in the file's order, pixel_mm (n, 2): row, column."""

    positions: NDArray[np.float64]
    orientations: NDArray[np.float64]
    pixels_mm: NDArray[np.float64]


def frames_of(path: Path) -> Frames | None:
    """Where the frames lie, or None for a file that is no enhanced multi-frame DICOM."""
    with path.open("rb") as file:
        if file.read(132)[128:] != b"DICM":
            return None
    from pydicom import dcmread  # a third of a second, for those who have DICOM

    try:
        data = dcmread(path, stop_before_pixels=True)
        groups = data.PerFrameFunctionalGroupsSequence
        common = data.get("SharedFunctionalGroupsSequence", ())
        found = [[_first(name, group, *common) for group in groups] for name in KEYWORDS]
        places, axes, pixels = (np.array(values, float) for values in found)
    except (AttributeError, KeyError, ValueError, TypeError, EOFError, struct.error):
        return None
    good = places.shape[1:] == (3,) and axes.shape[1:] == (6,) and pixels.shape[1:] == (2,)
    return Frames(places, axes, pixels) if good else None


def _first(keyword: str, *groups: Any) -> Any:
    """The value of an element in the first group that has it, however deep; raises KeyError where none has."""
    for group in groups:
        for element in group.iterall():
            if element.keyword == keyword:
                return element.value
    raise KeyError(keyword)


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
        found = f"DICOM tag ({key.replace('|', ',')}) holds {text!r}"
        raise unusable(path, f"{found}, expected {count} numbers; this slice has no position")
    return np.array(values)


def _series_files(folder: Path, wanted: str) -> list[Path]:
    # GDCM prints its own lines about folders without a series
    sitk.ProcessObject.SetGlobalWarningDisplay(False)
    ids = sitk.ImageSeriesReader.GetGDCMSeriesIDs(str(folder))
    sizes = {uid: sitk.ImageSeriesReader.GetGDCMSeriesFileNames(str(folder), uid) for uid in ids}
    known = {Path(name).name for files in sizes.values() for name in files}
    others = [p for p in sorted(folder.iterdir()) if p.suffix.lower() in SUFFIXES and p.name not in known]
    lost = [p.name for p in others if _may_be_a_slice(p)]
    if lost:
        which = f"{len(lost)} of its files cannot be read as DICOM: {', '.join(lost[:5])}. "
        raise unusable(folder, which + "They may be cut short: copy them again, or take them out of the folder.")
    series = {wanted: sizes.get(wanted, ())} if wanted else sizes
    images = {uid: files for uid, files in series.items() if files and _is_image(Path(files[0]))}
    if len(images) != 1:
        groups = "\n".join(f"    {uid}: {len(files)} files" for uid, files in images.items()) or "    none"
        below = [d.name for d in sorted(folder.iterdir()) if d.is_dir()]
        hint = f"  It has sub-folders: {', '.join(below[:5])}; name one of them.\n" if below else ""
        found = f"found {len(images)} DICOM image series, expected one:\n{groups}\n{hint}"
        raise unusable(folder, f"{found}  Keep one series a folder, or name one as FOLDER#SERIES_UID.")
    return [Path(name) for name in next(iter(images.values()))]


def _may_be_a_slice(path: Path) -> bool:
    """Whether a file in no series may be a damaged slice; contours, plans and reports lie beside the slices, too."""
    import pydicom

    try:
        kind = pydicom.dcmread(path, stop_before_pixels=True).SOPClassUID
    except (pydicom.errors.InvalidDicomError, AttributeError, ValueError, TypeError, EOFError, struct.error):
        return True
    return kind.is_private or "Image Storage" in kind.name


def _is_image(path: Path) -> bool:
    try:
        return bool(reader_of(path).HasMetaDataKey(POSITION)) or frames_of(path) is not None
    except LoadError:
        return False


def read_stack(source: Source) -> Stack:
    """Headers of the one series in a folder, or of one multi-frame file, sorted along the slice normal."""
    files = _series_files(source.path, source.dataset) if source.path.is_dir() else [source.path]
    headers = [reader_of(path) for path in files]
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
        found = f"the file holds {count} frames and positions of {len(frames.positions)}"
        raise unusable(path, f"{found}; allowed: one for each. Export the series again.")
    return int(count)


def _require_uniform(source: Source, where: Frames, sizes: list[Any]) -> None:
    pixels = where.pixels_mm[:, ::-1]  # DICOM writes row spacing (y) first
    for name, values in (("orientation", where.orientations), ("pixel spacing", pixels), ("size", sizes)):
        kinds = Counter(tuple(np.round(v, 5)) for v in values)
        if len(kinds) > 1:
            found = "; ".join(f"{count} slices with {list(map(float, kind))}" for kind, count in kinds.items())
            why = f"slices of different {name}: {found}. Mixed series: keep one stack a folder."
            raise unusable(source.path, why)


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
        whole = np.allclose(gaps[odd] / usual, np.round(gaps[odd] / usual), atol=0.02) and np.all(gaps[odd] > usual)
        kind = "missing slices" if whole else "irregular slice gaps"
        problems.append(f"{kind}: {len(odd)} of {len(gaps)} gaps differ from {usual:.3f} mm ({where})")
    drift = np.abs(stack.drift_px[-1]).max() / len(gaps)
    if drift > TILT_TOLERANCE:
        angle = np.degrees(np.arctan2(np.linalg.norm(stack.drift_px[-1] * stack.pixel_mm), np.ptp(stack.heights)))
        problems.append(f"gantry tilt: the stack leans {angle:.1f} degrees from the slice normal")
    return problems


def recognises(path: Path) -> bool:
    """A folder of slices, or one enhanced multi-frame file."""
    if path.is_dir():
        return True
    return path.suffix.lower() in {*SUFFIXES, ""} and frames_of(path) is not None


def parts(_path: Path) -> tuple[Path, ...]:
    """A file or a folder is all there is."""
    return ()


def read_header(source: Source, config: LoadConfig) -> Header:
    """Geometry of a series; tilt, gaps and repeats are refused, or resampled where the setting asks for it."""
    stack = read_stack(source)
    problems = irregularities(stack)
    fatal = [p for p in problems if p.startswith(("repeated", "single"))]
    if fatal or (problems and not config.resample):
        listing = "".join(f"\n    {p}" for p in problems)
        why = (
            f"this series is not a regular grid:{listing}\n  A plain stack would shear or stretch the "
            "anatomy. Export it again without tilt, or ask for resampling with --set load.resample=true."
        )
        raise unusable(source.path, why)
    count = len(stack.files)
    if problems:
        count = int(np.floor(np.ptp(stack.heights) / stack.spacing_mm + 1e-6)) + 1
    return Header(
        source,
        (stack.size[0], stack.size[1], count),
        np.array([*stack.pixel_mm, stack.spacing_mm]),
        stack.positions[0],
        np.column_stack([stack.axes, stack.normal]),
        stack.pixel_type,
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
    return to_xyz(sitk.ReadImage([str(f) for f in stack.files[z0:z1]]))[x0:x1, y0:y1]


def _resampled(header: Header, stack: Stack) -> NDArray[np.float32]:
    """Linear between the two nearest slices, each first shifted in plane by its drift (undoes the tilt)."""
    heights = stack.heights - stack.heights[0]
    whole = to_xyz(sitk.ReadImage(str(stack.files[0]))) if stack.frames else None

    @lru_cache(maxsize=2)  # the two neighbours move on together, so that each slice is read once
    def straightened(i: int) -> NDArray[np.float32]:
        voxels = to_xyz(sitk.ReadImage(str(stack.files[i]))) if whole is None else whole
        plane = voxels[:, :, stack.frames[i] if stack.frames else 0].astype(np.float32)
        return shift_slice(plane, stack.drift_px[i], order=1, mode="constant", cval=float(plane.min()))

    out = np.empty(header.shape, np.float32)
    for k in range(header.shape[2]):
        z = min(k * header.spacing_mm[2], heights[-1])
        upper = int(np.clip(np.searchsorted(heights, z), 1, len(heights) - 1))
        weight = (z - heights[upper - 1]) / (heights[upper] - heights[upper - 1])
        out[:, :, k] = (1 - weight) * straightened(upper - 1) + weight * straightened(upper)
    return out
