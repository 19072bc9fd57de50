"""Volumes on disk in the containers that scanners and their software use; arrays are indexed x, y, z."""

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray

from data_synthetic.geometry import ScanGrid

FORMATS = ("mha", "nrrd", "nii.gz", "dicom", "h5")
HDF5_FILE = "study.h5"


def volume_names(format: str, frames: int) -> list[str]:
    """The reference and the frames of a study: files, folders of DICOM slices, or data sets of one HDF5 file."""
    if format == "h5":
        return ["reference", *(f"frames/{i:03d}" for i in range(frames))]
    ending = "" if format == "dicom" else f".{format}"
    return [f"reference{ending}", *(f"frames/frame_{i:03d}{ending}" for i in range(frames))]


def manifest_names(format: str, frames: int) -> dict[str, str | list[str]]:
    """``reference`` and ``frames`` of the manifest."""
    if format == "h5":
        return {"reference": f"{HDF5_FILE}#/reference", "frames": f"{HDF5_FILE}#/frames"}
    reference, *names = volume_names(format, frames)
    return {"reference": reference, "frames": names if format == "dicom" else f"frames/*.{format}"}


def write_volume(folder: Path, format: str, number: int, scan: NDArray[np.int16], grid: ScanGrid) -> None:
    """Write volume ``number`` of a study: 0 is the reference, which comes first, 1 the first frame."""
    name = volume_names(format, number)[number]
    with _refused_by_the_system(folder, name):
        if format == "h5":
            _write_data_set(folder / HDF5_FILE, name, scan, grid)
        elif format == "dicom":
            _write_slices(folder / name, to_image(scan, grid), number + 1, grid)
        else:
            (folder / name).parent.mkdir(exist_ok=True)
            sitk.WriteImage(to_image(scan, grid), str(folder / name), useCompression=False)


@contextmanager
def _refused_by_the_system(folder: Path, name: str) -> Iterator[None]:
    """What ITK, GDCM or HDF5 say in their own words of a file that they cannot write is the system's error again."""
    try:
        yield
    except (RuntimeError, OSError) as error:
        # GDCM does not say why: on a full disk no slice finds a megabyte
        full = os.strerror(errno.ENOSPC) in str(error) or shutil.disk_usage(folder).free < 2**20
        number = errno.ENOSPC if full else getattr(error, "errno", None) or errno.EIO
        raise OSError(number, os.strerror(number), str(folder / name)) from error


def to_image(scan: NDArray[Any], grid: ScanGrid) -> Any:
    """A SimpleITK image of an array indexed x, y, z."""
    image: Any = sitk.GetImageFromArray(np.ascontiguousarray(scan.transpose(2, 1, 0)))
    image.SetSpacing([float(s) for s in grid.spacing_mm])
    image.SetOrigin([float(o) for o in grid.origin_mm])
    image.SetDirection([float(d) for d in grid.direction.ravel()])
    return image


def _write_slices(folder: Path, image: Any, series: int, grid: ScanGrid) -> None:
    """One DICOM file per slice."""
    folder.mkdir(parents=True, exist_ok=True)
    writer: Any = sitk.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    for k in range(image.GetDepth()):
        sheet = image[:, :, k]
        for tag, value in _tags(series, k, grid).items():
            sheet.SetMetaData(tag, value)
        writer.SetFileName(str(folder / f"{k:04d}.dcm"))
        writer.Execute(sheet)


def _tags(series: int, k: int, grid: ScanGrid) -> dict[str, str]:
    """What DICOM has to know of slice k of a series."""
    root = "1.2.826.0.1.3680043.10.1338"  # a private root for made-up objects
    position = grid.to_mm(np.array([0, 0, k]))
    along = [*grid.direction[:, 0], *grid.direction[:, 1]]
    return {
        "0008|0008": "DERIVED\\SECONDARY\\AXIAL",
        "0008|0016": "1.2.840.10008.5.1.4.1.1.2",
        "0008|0018": f"{root}.{series}.{k + 1}",
        "0008|0060": "CT",
        "0010|0010": "SYNTHETIC^WIREVAL",
        "0010|0020": "wireval",
        "0018|0050": f"{grid.spacing_mm[2]:.9g}",
        "0018|0088": f"{grid.spacing_mm[2]:.9g}",
        "0020|000d": f"{root}.0",
        "0020|000e": f"{root}.{series}",
        "0020|0011": str(series),
        "0020|0013": str(k + 1),
        "0020|0032": "\\".join(f"{v:.9g}" for v in position),
        "0020|0037": "\\".join(f"{v:.9g}" for v in along),
        "0020|0052": f"{root}.9",
        "0028|0030": f"{grid.spacing_mm[1]:.9g}\\{grid.spacing_mm[0]:.9g}",
        "0028|1052": "0",
        "0028|1053": "1",
    }


def _write_data_set(path: Path, name: str, scan: NDArray[np.int16], grid: ScanGrid) -> None:
    """A data set of an HDF5 file, indexed x, y, z, its geometry as attributes; the reference begins a new file."""
    if name == "reference":
        with h5py.File(path, "w") as file:
            file.create_group("frames")
    with h5py.File(path, "a") as file:
        data = file.create_dataset(name, data=scan)
        data.attrs["axes"] = "x,y,z"
        for geometry in ("spacing_mm", "origin_mm", "direction"):
            data.attrs[geometry] = getattr(grid, geometry)
