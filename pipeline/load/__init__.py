"""load: scans in. ``read_header`` reads the geometry of one scan, ``read_headers`` those of all scans of a case, and
compares them before any voxel is read; ``Crop.load`` reads the voxels of a box alone.

A format is a module with four functions: ``recognises`` a path, ``parts`` (other files that belong to it),
``read_header`` of a source, ``read`` voxels of a box.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.load import dicom, files, hdf5
from pipeline.load.common import on_common_box
from pipeline.load.common import told as told_of_crops
from pipeline.load.config import LoadConfig
from pipeline.load.geometry import Box, Header, LoadError, Source, judged, require_same_geometry, unusable
from pipeline.load.guard import is_folder, size_of, told
from pipeline.load.voxels import plain
from pipeline.model import Counters, Volume
from solver.grid import read_only

__all__ = [
    "SUFFIXES",
    "Box",
    "Crop",
    "Header",
    "LoadError",
    "Scans",
    "Source",
    "each_volume",
    "load",
    "read_header",
    "read_headers",
    "require_one",
    "require_same_geometry",
    "require_whole",
]


class Format(Protocol):
    """What a module must offer to read a format."""

    def recognises(self, path: Path, /) -> bool:
        """Whether the file or folder is of this format."""

    def parts(self, path: Path, /) -> tuple[Path, ...]:
        """Other files that belong to it, by its name or its head: a change of theirs is a change of the scan."""

    def read_header(self, source: Source, config: LoadConfig, /) -> Header:
        """Its geometry; raises LoadError where it cannot be used."""

    def read(self, header: Header, box: Box, config: LoadConfig, /) -> NDArray[Any]:
        """Voxels of a box, indexed x, y, z, in any order of memory."""


FORMATS: tuple[Format, ...] = (dicom, hdf5, files)
"""The first that recognises a path reads it; ``files`` recognises any, and refuses the rest."""
MOST_GREY = 1e9
"""No scan has greys beyond: of 1e20 in 27 voxels squares overflow, and all frames of the case were lost."""
SUFFIXES = (".mha", ".mhd", ".nrrd", ".nhdr", ".nii", ".nii.gz", ".hdr")
"""By these a file in a folder is taken for a scan where there is no manifest."""


def read_header(
    source: Source | str | Path, config: LoadConfig = LoadConfig(), spacing_mm: ArrayLike | None = None
) -> Header:
    """Geometry of a scan without its voxels.

    source : a file (.mha .mhd .nrrd .nhdr .nii .nii.gz .hdr .dcm .h5) or a folder with one DICOM series (an
    enhanced multi-frame .dcm counts as one).
    spacing_mm : (3,) overrides what the file says; the header then lists it as assumed.
    Raises LoadError: unreadable, not 3-D, sheared, tilted, missing slices, mixed series.
    """
    source = source if isinstance(source, Source) else Source(Path(source))
    if not is_folder(source.path):
        size_of(source.path)
    with told(source):
        header = _format_of(source.path).read_header(source, config)
    if spacing_mm is not None:
        spacing = np.asarray(spacing_mm, float)
        said = f", where the file has {header.spacing_mm.round(4).tolist()}"
        said *= not np.allclose(spacing, header.spacing_mm, rtol=1e-3)
        note = f"{source.path.name}: spacing {spacing.tolist()} mm taken from the manifest{said}"
        header = replace(header, spacing_mm=spacing, assumed=(*header.assumed, note))
    return judged(header)


def load(header: Header, box: Box | None = None, config: LoadConfig = LoadConfig()) -> Volume:
    """Voxels of a scan, indexed x, y, z, with its geometry; of ``box`` alone where one is given.

    x is fastest in memory, whatever the file has: stages go through voxels in the order of memory and take samples of
    them, and other samples make another sigma (0.0199 for 0.0207 mm).
    """
    start, stop = box or header.box
    with told(header.source):
        values = np.asfortranarray(plain(_read(header, (start, stop), config), header.source))
    wide = values.size and values.dtype.itemsize > 2
    if wide and not -MOST_GREY <= values.min() <= values.max() <= MOST_GREY:
        bad = int(np.size(values) - np.count_nonzero((values >= -MOST_GREY) & (values <= MOST_GREY)))
        why = f"{bad} voxels are NaN, infinite or beyond {MOST_GREY:.0e}; allowed: grey values up to that; replace them"
        raise unusable(header.source, why)
    made_of = Crop(header, (start, stop), config)
    origin = header.grid.to_mm(start)
    return Volume(read_only(values), header.spacing_mm, origin, header.direction, header.assumed, made_of)


def of_several_greys(volume: Volume, source: Source) -> Volume:
    """The voxels; LoadError where they have one grey only, as of a scan that was not written, which shows no wire."""
    least, most = volume.values.min(), volume.values.max()
    if least < most:
        return volume
    why = f"all {volume.values.size} voxels around the vessel have one grey, {least:g}; expected a scan of it"
    raise unusable(source, f"{why}; export it again")


def _read(header: Header, box: Box, config: LoadConfig) -> NDArray[Any]:
    """Voxels of a box as the file holds them; of a scan that is cut out of it, counted from where that begins."""
    whole = header.whole or header
    (a, b, c), (d, e, f), (x, y, z) = *box, header.first
    return _format_of(header.source.path).read(whole, ((a + x, b + y, c + z), (d + x, e + y, f + z)), config)


@dataclass(frozen=True)
class Crop:
    """A box of a scan that can be loaded: all that its voxels depend on, so that it stands for them in keys."""

    header: Header
    box: Box
    config: LoadConfig = LoadConfig()

    def load(self) -> Volume:
        """Read it."""
        return load(self.header, self.box, self.config)

    @property
    def counters(self) -> Counters:
        """What reading it counts: voxels of the scan, read, and left alone."""
        total = float(np.prod(self.header.shape))
        read = float(np.prod(np.subtract(self.box[1], self.box[0])))
        return {"voxels_total": total, "voxels_read": read, "voxels_skipped": total - read}


def _format_of(path: Path) -> Format:
    """The module that reads a path."""
    return next(kind for kind in FORMATS if kind.recognises(path))


def parts_of(path: Path) -> tuple[Path, ...]:
    """Other files that belong to a file, as any format says: asked of every path that goes into a key."""
    return tuple(part for kind in FORMATS for part in kind.parts(path))


@dataclass(frozen=True, eq=False)
class Scans:
    """Headers of a case's scans; all share one geometry."""

    reference: Header | None
    frames: tuple[Header, ...]

    @property
    def all(self) -> tuple[Header, ...]:
        """The reference, if there is one, and the frames."""
        return (*((self.reference,) if self.reference else ()), *self.frames)

    @property
    def first(self) -> Header | None:
        """The scan that the lumen comes from: the wire-free one, else the frame with the least wire in it."""
        return next(iter(self.all), None)

    @property
    def cut(self) -> "Scans":
        """The same, of the box that all scans show where they are crops of one grid."""
        cut = on_common_box(self.all)
        return Scans(cut[0] if self.reference else None, tuple(cut[1:] if self.reference else cut))

    @property
    def assumed(self) -> tuple[str, ...]:
        """What was assumed where the files lack something, each listed once."""
        each = (text for header in self.all for text in header.assumed)
        return (*dict.fromkeys(each), *told_of_crops(self.all))


def each_volume(header: Header) -> Iterator[Header]:
    """A sequence in one file as one header per volume."""
    for item in range(header.item_count):
        source = header.source if header.item_count == 1 else replace(header.source, item=item)
        yield replace(header, source=source, item_count=1)


def require_whole(header: Header, config: LoadConfig) -> None:
    """LoadError where the file of a header is cut short, as far as its length shows that."""
    if _format_of(header.source.path) is files:
        files.head_of(header.source.path, config.most_gib)


def require_one(header: Header) -> None:
    """LoadError where a file that should hold one volume is a sequence."""
    if header.item_count > 1:
        what = f"holds {header.item_count} volumes; allowed: one for the reference"
        raise unusable(header.source, f"{what}. Name a file or dataset of the scan without wire alone.")


def read_headers(
    reference: Source | None, frames: Sequence[Source], config: LoadConfig, spacing_mm: ArrayLike | None = None
) -> Scans:
    """Headers of a case's scans, those of crops of one grid cut to the box that all show.

    Raises LoadError where one is unusable or its geometry differs from the first's.
    """
    empty = read_header(reference, config, spacing_mm) if reference else None
    if empty is not None:
        require_one(empty)
    headers = [read_header(source, config, spacing_mm) for source in frames]
    scans = Scans(empty, tuple(volume for header in headers for volume in each_volume(header))).cut
    for header in scans.frames:
        require_same_geometry(scans.all[0], header)
    return scans
