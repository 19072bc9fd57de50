"""Single-file volumes (.mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .dcm) through SimpleITK.

The one place where SimpleITK's x, y, z meets numpy's z, y, x.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray

from pipeline.load.config import LoadConfig
from pipeline.load.geometry import Box, Header, LoadError, Source
from pipeline.load.raw import read_mha_box

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


def _reader(source: Source) -> sitk.ImageFileReader:
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(source.path))
    try:
        reader.ReadImageInformation()
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[-1]
        msg = (
            f"cannot read {source.path}: {reason}\n  allowed: .mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .dcm, .h5 "
            "or a folder with one DICOM series. Check that the file is complete."
        )
        raise LoadError(msg) from None
    return reader


def _geometry(reader: sitk.ImageFileReader, source: Source) -> tuple[Any, Any, Any]:
    dimension = reader.GetDimension()
    spacing = np.array(reader.GetSpacing()[:3])
    origin = np.array(reader.GetOrigin()[:3])
    direction = np.array(reader.GetDirection()).reshape(dimension, dimension)[:3, :3]
    if np.abs(direction.T @ direction - np.eye(3)).max() > ORTHONORMAL:
        msg = (
            f"{source.path}: the axes are sheared or scaled, direction {direction.round(5).tolist()}; "
            "allowed: an orthonormal matrix (a tilted gantry gives this). Resample the scan onto a regular grid first."
        )
        raise LoadError(msg)
    return spacing, origin, direction


def recognises(_path: Path) -> bool:
    """Any file: SimpleITK finds out."""
    return True


def detached(path: Path) -> tuple[Path, ...]:
    """The files that hold the voxels of a header that stands alone (.mhd, .nhdr); none for other files."""
    if path.suffix.lower() not in {".mhd", ".nhdr"}:
        return ()
    text = path.read_text(encoding="latin-1")
    found = re.search(r"^(?:ElementDataFile\s*=|data ?file:)[ \t]*(.*)$", text, re.IGNORECASE | re.MULTILINE)
    if found is None:
        return ()
    name = found.group(1).strip()
    # a list stands below; a pattern as slice_%03d.raw takes numbers
    names = text[found.end() :].split() if name.upper().startswith("LIST") else [name]
    pattern = re.sub(r"%\d*d.*", "*", name)
    matches = path.parent.glob(pattern) if "*" in pattern and not Path(pattern).is_absolute() else ()
    return tuple(sorted({p for p in (*(path.parent / n for n in names), *matches) if p.is_file()}))


def read_header(source: Source, _config: LoadConfig) -> Header:
    """Geometry of one file; a 4-D file is a sequence of volumes along its last axis."""
    reader = _reader(source)
    size = reader.GetSize()
    if len(size) not in (3, 4) or reader.GetNumberOfComponents() != 1 or min(size) < 1:
        msg = (
            f"{source.path}: got {len(size)} axes {tuple(size)} with {reader.GetNumberOfComponents()} component(s) per "
            "voxel; allowed: a 3-D grey-value volume, or a 4-D file that is a sequence of them."
        )
        raise LoadError(msg)
    spacing, origin, direction = _geometry(reader, source)
    return Header(
        source,
        (size[0], size[1], size[2]),
        spacing,
        origin,
        direction,
        sitk.GetPixelIDValueAsString(reader.GetPixelID()),
        (source.path, *detached(source.path)),
        item_count=size[3] if len(size) == 4 else 1,
    )


def read(header: Header, box: Box, _config: LoadConfig) -> NDArray[Any]:
    """Voxels of ``box`` alone, indexed x, y, z; only that region is read where the format can stream."""
    part = None if box == header.box else read_mha_box(header.source.path, box)
    if part is not None:
        return part
    reader = _reader(header.source)
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
        msg = f"{header.source}: the voxels cannot be read: {reason}\n  The file may be cut short; copy it again."
        raise LoadError(msg) from None
