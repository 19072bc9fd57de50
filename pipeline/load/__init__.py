"""Stage 1: scans in. ``read_header`` reads geometry alone, ``load`` reads the voxels of a box alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from pipeline.load.config import LoadConfig
from pipeline.load.dicom import read_dicom, read_dicom_header
from pipeline.load.files import read_file, read_file_header
from pipeline.load.geometry import Box, Header, LoadError, Source, require_same_geometry
from pipeline.load.hdf5 import read_hdf5, read_hdf5_header
from pipeline.load.multiframe import frames_of
from pipeline.model import Volume

__all__ = ["Box", "Header", "LoadError", "Source", "load", "read_header", "require_same_geometry"]


def _is_hdf5(path: Path) -> bool:
    return path.suffix.lower() in {".h5", ".hdf5"}


def _is_dicom_stack(path: Path) -> bool:
    """A folder of slices, or one enhanced multi-frame file."""
    if path.is_dir():
        return True
    return path.suffix.lower() in {".dcm", ".ima", ""} and frames_of(path) is not None


def read_header(
    source: Source | str | Path, config: LoadConfig = LoadConfig(), spacing_mm: ArrayLike | None = None
) -> Header:
    """Geometry of a scan without its voxels.

    source : a file (.mha .mhd .nrrd .nhdr .nii .nii.gz .dcm .h5) or a folder with one DICOM series (an
    enhanced multi-frame .dcm counts as one).
    spacing_mm : (3,) overrides what the file says; the header then lists it as assumed.
    Raises LoadError: unreadable, not 3-D, sheared, tilted, missing slices, mixed series.
    """
    source = source if isinstance(source, Source) else Source(Path(source))
    if not source.path.exists():
        msg = f"{source.path}: no such file or folder; check the path in the manifest (relative to the manifest itself)"
        raise LoadError(msg)
    if _is_dicom_stack(source.path):
        header, _ = read_dicom_header(source, config.resample)
    elif _is_hdf5(source.path):
        header = read_hdf5_header(source)
    else:
        header = read_file_header(source)
    if spacing_mm is None:
        return header
    note = (
        f"{source.path.name}: spacing {list(map(float, np.asarray(spacing_mm)))} mm taken from the manifest"
    )
    return replace(header, spacing_mm=np.asarray(spacing_mm, float), assumed=(*header.assumed, note))


def load(header: Header, box: Box | None = None, config: LoadConfig = LoadConfig()) -> Volume:
    """Voxels of a scan, indexed x, y, z, with its geometry; of ``box`` alone where one is given."""
    start, stop = box or header.box
    if _is_dicom_stack(header.source.path):
        _, stack = read_dicom_header(header.source, config.resample)
        values = read_dicom(header, stack, (start, stop))
    elif _is_hdf5(header.source.path):
        values = read_hdf5(header, (start, stop))
    else:
        values = read_file(header, (start, stop))
    if values.dtype.kind == "f" and not np.all(np.isfinite(values)):
        bad = int(np.size(values) - np.isfinite(values).sum())
        msg = f"{header.source}: {bad} voxels are NaN or infinite; allowed: finite grey values. Replace them first."
        raise LoadError(msg)
    return Volume(
        values, header.spacing_mm, header.grid.to_mm(start), header.direction, assumed=header.assumed
    )
