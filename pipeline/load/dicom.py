"""DICOM series in a folder or a multi-frame file: sorted by position, refused, and why, where it is no regular grid.

ITK's reader shears a tilted stack and silently respaces one that lacks a slice (ITK issues 441 and 1607), so the
positions are judged here: tilt by what it amounts to over the whole stack, gaps by a regular grid through all slices.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import shift as shift_slice

from pipeline.load import foreign
from pipeline.load.config import LoadConfig
from pipeline.load.files import held_in
from pipeline.load.geometry import Box, Header, LoadError, Source, unusable
from pipeline.load.guard import is_folder, require_room
from pipeline.load.order import in_order
from pipeline.load.slices import Plane, dataset, grey, is_dicom, is_image, off_unit, planes_of
from pipeline.load.voxels import scaled

GAP_TOLERANCE, OFF_GRID = 0.01, 0.05
"""Of the slice spacing: how far a gap may be off, or each slice from a regular grid (positions of few digits)."""
TILT_PIXELS = 0.5
"""Largest in-plane drift, in pixels, over the whole stack."""
SAME_PIXELS = 0.25
"""Most that a difference of orientation or pixel spacing may amount to at the image's edge, in pixels."""
MOST_FILES = 20_000


@dataclass(frozen=True, eq=False)
class Stack:
    """Planes of one series in order; axes (3, 2) in the plane, pixel (2,) mm."""

    planes: tuple[Plane, ...]
    axes: NDArray[np.float64]
    pixel_mm: NDArray[np.float64]

    def name(self, i: int) -> str:
        """What a message calls a slice."""
        plane = self.planes[i]
        return f"frame {plane.frame + 1}" if plane.several else plane.path.name

    @property
    def positions(self) -> NDArray[np.float64]:
        """Of every slice (n, 3), LPS mm."""
        return np.array([plane.position for plane in self.planes])

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
    def median_gap_mm(self) -> float:
        """Usual distance between neighbours."""
        return float(np.median(np.diff(self.heights)))

    @property
    def mean_gap_mm(self) -> float:
        """Distance between neighbours of a regular stack: rounding in its positions averages out."""
        return float(np.ptp(self.heights) / (len(self.planes) - 1))


Series = dict[str, list[tuple[Path, Any]]]
"""Files with their elements, by the UID of their series."""


def series_in(folder: Path) -> tuple[Series, list[str]]:
    """The image series of a folder's files, and the names of files that cannot be read."""
    entries = in_order(folder.iterdir(), lambda p: p.name)
    if len(entries) > MOST_FILES:
        raise unusable(folder, f"{len(entries)} entries; allowed: {MOST_FILES} files; keep one series a folder")
    lost: list[str] = []
    series: Series = {}
    for path in (p for p in entries if p.is_file() and p.name != "DICOMDIR" and not p.name.startswith("._")):
        try:
            if not is_dicom(path):
                continue
            data = dataset(path)
            kind = is_image(data)
        except LoadError:
            kind = None
        if kind is None:
            lost.append(path.name)
        elif kind:
            series.setdefault(str(data.get("SeriesInstanceUID", "")), []).append((path, data))
    return dict(in_order(series.items(), lambda one: _called(*one))), lost


def _called(uid: str, files: list[tuple[Path, Any]]) -> str:
    """A series as a person knows it, its description, and its UID."""
    described = str(files[0][1].get("SeriesDescription", "") or "").strip()
    return f"{described} ({uid})" if described else uid


def _planes_in(folder: Path, wanted: str) -> list[Plane]:
    """The planes of the one image series in a folder."""
    series, lost = series_in(folder)
    if lost:
        which = f"{len(lost)} of its files cannot be read as DICOM: {', '.join(lost[:5])}. "
        raise unusable(folder, which + "They may be cut short: copy them again, or take them out of the folder.")
    images = {uid: files for uid, files in series.items() if not wanted or uid == wanted}
    if len(images) != 1:
        groups = "".join(f"\n    {_called(*one)}: {len(one[1])} files" for one in series.items())
        found = f"found {len(images)} DICOM image series, expected one{':' * bool(groups)}{groups or '.'}"
        raise unusable(
            folder, f"{found}\n  {held_in(folder)}  Keep one series a folder, or name one as FOLDER#SERIES_UID."
        )
    return [plane for path, data in next(iter(images.values())) for plane in planes_of(path, data)]


def read_stack(source: Source) -> Stack:
    """Headers of the one series in a folder, or of one multi-frame file, sorted along the slice normal."""
    names = sorted(source.path.iterdir())[:MOST_FILES] if is_folder(source.path) else [source.path]
    # whoever puts back a file's time cannot put back that of its entry
    stamps = tuple((p.name, s.st_size, s.st_mtime_ns, s.st_ctime_ns) for p in names if p.is_file() for s in [p.stat()])
    return _stack(source.path, source.dataset, stamps)


@lru_cache(maxsize=64)  # asked for twice a frame: for its header, and for its voxels
def _stack(path: Path, series: str, _stamps: tuple[tuple[str, int, int, int], ...]) -> Stack:
    planes = _planes_in(path, series) if is_folder(path) else _planes_in_file(path)
    _require_uniform(path, planes)
    axes = np.mean([plane.orientation for plane in planes], axis=0).reshape(2, 3).T
    axes = axes / np.maximum(np.linalg.norm(axes, axis=0), 1e-12)
    pixel = np.mean([plane.pixel_mm for plane in planes], axis=0)
    heights = [float(plane.position @ np.cross(axes[:, 0], axes[:, 1])) for plane in planes]
    order = np.argsort(heights, kind="stable")
    return Stack(tuple(planes[i] for i in order), axes, pixel)


def _planes_in_file(path: Path) -> list[Plane]:
    data = dataset(path)
    if not is_image(data):
        raise unusable(path, "cannot read it as a DICOM image. Check that the file is complete: copy it again.")
    return planes_of(path, data)


def _require_uniform(path: Path, planes: list[Plane]) -> None:
    """LoadError where slices differ in size, or in orientation and spacing by more than rounding."""
    edge = max(planes[0].pixels.rows, planes[0].pixels.columns)
    for name, values, tolerance in (
        ("orientation", np.array([p.orientation for p in planes]), SAME_PIXELS / edge),
        ("pixel spacing", np.array([p.pixel_mm for p in planes]), SAME_PIXELS / edge * planes[0].pixel_mm.min()),
        ("size", np.array([[p.pixels.columns, p.pixels.rows] for p in planes], float), 0.5),
        ("inversion", np.array([[p.pixels.inverted] for p in planes], float), 0.5),
    ):
        kinds, counts = np.unique(values.round(5), axis=0, return_counts=True)
        if np.ptp(values, axis=0).max() > abs(tolerance):
            several = zip(kinds[:4], counts, strict=False)
            found = "; ".join(f"{count} slices with {kind.tolist()}" for kind, count in several)
            why = f"slices of different {name}: {found}. Mixed series: keep one stack a folder."
            raise unusable(path, why)


def irregularities(stack: Stack) -> list[str]:
    """Why a stack is not a regular grid: repeated positions, missing slices, irregular gaps, tilt. Empty if it is."""
    gaps = np.diff(stack.heights)
    if len(gaps) == 0:
        return ["single slice: one DICOM file is no volume"]
    problems = []
    if np.any(gaps < 1e-3):
        problems.append(f"repeated position: {int(np.sum(gaps < 1e-3))} slice(s) lie where another one lies")
    usual = stack.median_gap_mm
    odd = np.flatnonzero(np.abs(gaps - usual) > GAP_TOLERANCE * usual)
    off = stack.heights - stack.heights[0] - stack.mean_gap_mm * np.arange(len(stack.planes))
    if len(odd) and usual > 1e-3 and np.abs(off).max() > OFF_GRID * usual:
        where = ", ".join(f"{gaps[i]:.3f} mm after {stack.name(i)}" for i in odd[:4])
        whole = np.allclose(gaps[odd] / usual, np.round(gaps[odd] / usual), atol=0.02) and np.all(gaps[odd] > usual)
        kind = "missing slices" if whole else "irregular slice gaps"
        problems.append(f"{kind}: {len(odd)} of {len(gaps)} gaps differ from {usual:.3f} mm ({where})")
    far = int(np.argmax(np.linalg.norm(stack.drift_px, axis=1)))
    if np.abs(stack.drift_px[far]).max() > TILT_PIXELS:
        reach = max(float(stack.heights[far] - stack.heights[0]), 1e-9)
        angle = np.degrees(np.arctan2(np.linalg.norm(stack.drift_px[far] * stack.pixel_mm), reach))
        pixels = f"{np.abs(stack.drift_px[far]).max():.1f} pixels over its height"
        problems.append(f"gantry tilt: the stack leans {angle:.1f} degrees from the slice normal, {pixels}")
    return problems


def recognises(path: Path) -> bool:
    """A folder of slices, or one file that is DICOM by its mark or suffix."""
    return is_folder(path) or is_dicom(path)


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
    pixels, count = stack.planes[0].pixels, len(stack.planes)
    require_room(source.path, pixels.frame_bytes * count, 0, "", config.most_gib)
    gap = stack.mean_gap_mm
    if problems:
        gap = stack.median_gap_mm
        count = int(np.floor(np.ptp(stack.heights) / gap + 1e-6)) + 1
    notes = [f"resampled onto a regular grid: {p}" for p in problems]
    notes += [f"{source.path.name}: MONOCHROME1: grey values turned round, so that white is high"] * pixels.inverted
    if any(off_unit(plane.orientation) for plane in stack.planes):
        why = "has vectors that are off the length 1, as their decimals explain"
        notes.append(f"{source.path.name}: ImageOrientationPatient {why}: divided by their lengths")
    return Header(
        source, (pixels.columns, pixels.rows, count), np.array([*stack.pixel_mm, gap]), stack.planes[0].position,
        np.column_stack([stack.axes, stack.normal]), str(np.dtype(pixels.kind).newbyteorder("=")),
        assumed=tuple(notes),
    )  # fmt: skip


def read(header: Header, box: Box, _config: LoadConfig) -> NDArray[Any]:
    """Voxels of ``box``: of a regular stack the needed slices alone, of an irregular one the resampled grid."""
    stack = read_stack(header.source)
    (x0, y0, z0), (x1, y1, z1) = box
    if any("resampled" in text for text in header.assumed):
        return _resampled(header, stack)[x0:x1, y0:y1, z0:z1]
    return _planes(stack.planes[z0:z1])[x0:x1, y0:y1]


def _planes(planes: tuple[Plane, ...]) -> NDArray[Any]:
    """Whole planes as grey values, indexed x, y, z; packed ones are unpacked to stored values first, and read alike."""
    kinds = {np.dtype(plane.pixels.kind).newbyteorder("=") for plane in planes}
    one = len({(plane.slope, plane.intercept) for plane in planes}) == 1
    rows, columns = planes[0].pixels.rows, planes[0].pixels.columns
    out = np.empty((len(planes), rows, columns), kinds.pop() if one and len(kinds) == 1 else np.float32)
    with foreign.unpacked([plane for plane in planes if plane.pixels.offset < 0]) as at:
        for target, plane in zip(out, planes, strict=True):
            p = plane.pixels
            place = max(p.offset, 0) + plane.frame * p.frame_bytes
            found = np.fromfile(at.get(plane.path, plane.path), p.kind, rows * columns, offset=place)
            stored = grey(plane, found.reshape(rows, columns))
            target[:] = stored if one else stored * np.float64(plane.slope) + plane.intercept
    return scaled(out, planes[0].slope, planes[0].intercept).T if one else out.T


def _resampled(header: Header, stack: Stack) -> NDArray[np.float32]:
    """Linear between the two nearest slices, each first shifted in plane by its drift (undoes the tilt)."""
    heights = stack.heights - stack.heights[0]
    packed = stack.planes[0].pixels.offset < 0
    whole = _planes(stack.planes) if packed else None

    @lru_cache(maxsize=2)  # the two neighbours move on together, so that each slice is read once
    def straightened(i: int) -> NDArray[np.float32]:
        plane = (_planes(stack.planes[i : i + 1])[:, :, 0] if whole is None else whole[:, :, i]).astype(np.float32)
        return shift_slice(plane, stack.drift_px[i], order=1, mode="constant", cval=float(plane.min()))

    out = np.empty(header.shape, np.float32)
    for k in range(header.shape[2]):
        z = min(k * header.spacing_mm[2], heights[-1])
        upper = int(np.clip(np.searchsorted(heights, z), 1, len(heights) - 1))
        weight = (z - heights[upper - 1]) / (heights[upper] - heights[upper - 1])
        out[:, :, k] = (1 - weight) * straightened(upper - 1) + weight * straightened(upper)
    return out
