"""Single-file volumes (.mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .dcm) through SimpleITK.

The one place where SimpleITK's x, y, z meets numpy's z, y, x. A box of an uncompressed MetaImage (.mha) is read
straight from the file, plane by plane: ITK reads a region row by row, which takes twice as long as reading the whole
file; here only the box's rows of every plane are read, in one go, and what is held is the box and one plane.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray

from pipeline.load.config import LoadConfig
from pipeline.load.geometry import Box, Header, LoadError, Source, unusable

LONGEST_HEADER = 65536
TYPES = {
    "MET_CHAR": "i1", "MET_UCHAR": "u1", "MET_SHORT": "i2", "MET_USHORT": "u2", "MET_INT": "i4", "MET_UINT": "u4",
    "MET_FLOAT": "f4", "MET_DOUBLE": "f8",
}  # fmt: skip


def _data(path: Path) -> tuple[int, np.dtype[Any], tuple[int, ...]] | None:
    """Where the voxels begin, their type and the axes' lengths; None where only ITK can tell."""
    with path.open("rb") as file:
        start = file.read(LONGEST_HEADER)
    end = start.find(b"\n", start.find(b"ElementDataFile"))
    lines = start[: max(end, 0)].decode("latin-1").splitlines()
    tags = {key.strip(): value.strip() for key, _, value in (line.partition("=") for line in lines)}
    plain = (
        tags.get("ElementDataFile") == "LOCAL"
        and tags.get("BinaryData") == "True"
        and tags.get("CompressedData", "False") == "False"
        and tags.get("ElementNumberOfChannels", "1") == "1"
        and tags.get("ElementType") in TYPES
        and "HeaderSize" not in tags
    )
    if not plain:
        return None
    swapped = "True" in (tags.get("BinaryDataByteOrderMSB"), tags.get("ElementByteOrderMSB"))
    kind = np.dtype((">" if swapped else "<") + TYPES[tags["ElementType"]])
    shape = tuple(int(n) for n in tags.get("DimSize", "").split())
    begin = end + 1
    if len(shape) != 3 or path.stat().st_size != begin + kind.itemsize * int(np.prod(shape)):
        return None
    return begin, kind, shape


def read_mha_box(path: Path, box: Box) -> NDArray[Any] | None:
    """Voxels of ``box`` indexed x, y, z (x fastest in memory), or None where the file is not a plain .mha."""
    found = _data(path) if path.suffix.lower() == ".mha" else None
    if found is None:
        return None
    begin, kind, (nx, ny, _) = found
    (x0, y0, z0), (x1, y1, z1) = box
    out = np.empty((z1 - z0, y1 - y0, x1 - x0), kind.newbyteorder("="))
    plane = np.empty((y1 - y0, nx), kind)
    with path.open("rb") as file:
        for z in range(z0, z1):
            file.seek(begin + ((z * ny) + y0) * nx * kind.itemsize)
            if file.readinto(plane.data.cast("B")) != plane.nbytes:
                return None
            out[z - z0] = plane[:, x0:x1]
    return out.T


ORTHONORMAL = 1e-3
"""Largest departure of a direction matrix from orthonormal: header rounding is below 1e-4, a shear far above."""


class _Pixels:
    """A SimpleITK image as numpy sees it; an array made from this keeps the image, whose memory it shares."""

    def __init__(self, image: sitk.Image) -> None:
        self.image = image
        self.__array_interface__ = sitk.GetArrayViewFromImage(image).__array_interface__


def to_xyz(image: sitk.Image) -> NDArray[Any]:
    """Voxels of a SimpleITK image indexed x, y, z (x fastest in memory, as in the file); read only.

    They stay in the image's own memory: a copy would hold every frame twice.
    """
    return np.asarray(_Pixels(image)).T


def reader_of(path: Path) -> sitk.ImageFileReader:
    """A reader that has read the header of a file; LoadError where it cannot."""
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(path))
    try:
        reader.ReadImageInformation()
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[-1]
        raise LoadError(
            f"cannot read {path}: {reason}\n  allowed: .mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .dcm, .h5 "
            "or a folder with one DICOM series. Check that the file is complete."
        ) from None
    return reader


def recognises(_path: Path) -> bool:
    """Any file: SimpleITK finds out."""
    return True


def parts(path: Path) -> tuple[Path, ...]:
    """Other files that hold the voxels of a header: those that a MetaImage or NRRD names, and Analyze's other half.

    Asked of every path that goes into a key: a change of theirs is a change of the scan.
    """
    if path.suffix.lower() in {".hdr", ".img"}:
        return tuple(p for p in (path.with_suffix(".img"), path.with_suffix(".hdr")) if p != path and p.is_file())
    if path.suffix.lower() not in {".mhd", ".mha", ".nhdr", ".nrrd"}:
        return ()
    with path.open("rb") as file:
        text = file.read(LONGEST_HEADER).decode("latin-1")
    found = re.search(r"^(?:ElementDataFile\s*=|data ?file:)[ \t]*(.*)$", text, re.IGNORECASE | re.MULTILINE)
    if found is None or found[1].strip().upper() == "LOCAL":
        return ()
    name = found.group(1).strip()
    # a list stands below; a pattern as slice_%03d.raw takes numbers
    names = text[found.end() :].split() if name.upper().split()[:1] == ["LIST"] else [name]
    pattern = re.sub(r"%\d*d.*", "*", name)
    matches = path.parent.glob(pattern) if "*" in pattern and not Path(pattern).is_absolute() else ()
    return tuple(sorted({p for p in (*(path.parent / n for n in names), *matches) if p.is_file() and p != path}))


def read_header(source: Source, _config: LoadConfig) -> Header:
    """Geometry of one file; a 4-D file is a sequence of volumes along its last axis."""
    reader = reader_of(source.path)
    size = reader.GetSize()
    if len(size) not in (3, 4) or reader.GetNumberOfComponents() != 1 or min(size) < 1:
        why = (
            f"got {len(size)} axes {tuple(size)} with {reader.GetNumberOfComponents()} component(s) per voxel; "
            "allowed: a 3-D grey-value volume, or a 4-D file that is a sequence of them."
        )
        raise unusable(source.path, why)
    direction = np.array(reader.GetDirection()).reshape(len(size), len(size))[:3, :3]
    if np.abs(direction.T @ direction - np.eye(3)).max() > ORTHONORMAL:
        why = (
            f"the axes are sheared or scaled, direction {direction.round(5).tolist()}; allowed: an orthonormal matrix "
            "(a tilted gantry gives this). Resample the scan onto a regular grid first."
        )
        raise unusable(source.path, why)
    return Header(
        source,
        (size[0], size[1], size[2]),
        np.array(reader.GetSpacing()[:3]),
        np.array(reader.GetOrigin()[:3]),
        direction,
        sitk.GetPixelIDValueAsString(reader.GetPixelID()),
        item_count=size[3] if len(size) == 4 else 1,
    )


def read(header: Header, box: Box, _config: LoadConfig) -> NDArray[Any]:
    """Voxels of ``box`` alone, indexed x, y, z; only that region is read where the format can stream."""
    part = None if box == header.box else read_mha_box(header.source.path, box)
    if part is not None:
        return part
    reader = reader_of(header.source.path)
    (start, stop) = box
    index = list(start)
    size = [b - a for a, b in zip(start, stop, strict=True)]
    if reader.GetDimension() == 4:
        index.append(header.source.item or 0)
        size.append(0)  # zero extent collapses the axis: a 3-D image comes back
    reader.SetExtractIndex(index)
    reader.SetExtractSize(size)
    try:
        return to_xyz(reader.Execute())
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[-1]
        why = f"the voxels cannot be read: {reason}\n  The file may be cut short; copy it again."
        raise unusable(header.source, why) from None
