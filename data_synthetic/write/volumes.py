"""Volumes on disk, one class per kind of container; every array is indexed x, y, z until SimpleITK takes it."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Protocol

import h5py
import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray

from data_synthetic.geometry.scan_grid import ScanGrid

Scan = NDArray[np.int16]
SINGLE_FILES = ("mha", "nrrd", "nii.gz")
FORMATS = (*SINGLE_FILES, "dicom", "h5")


class VolumeWriter(Protocol):
    """Writes the scans of a study and knows how the manifest names them."""

    @property
    def reference_name(self) -> str:
        """The manifest's ``reference``."""
        ...

    @property
    def frames_name(self) -> str | list[str]:
        """The manifest's ``frames``."""
        ...

    def reference(self, scan: Scan) -> None:
        """Write the scan without wire."""
        ...

    def frame(self, number: int, scan: Scan) -> None:
        """Write one frame."""
        ...


def volume_writer(folder: Path, format: str, grid: ScanGrid) -> VolumeWriter:
    """The writer for one of FORMATS."""
    if format == "h5":
        return _Hdf5(folder, grid)
    if format == "dicom":
        return _Dicom(folder, grid)
    return _SingleFiles(folder, format, grid)


def to_image(scan: NDArray[Any], grid: ScanGrid) -> Any:
    """A SimpleITK image of an array indexed x, y, z."""
    image: Any = sitk.GetImageFromArray(np.ascontiguousarray(scan.transpose(2, 1, 0)))
    image.SetSpacing([float(s) for s in grid.spacing_mm])
    image.SetOrigin([float(o) for o in grid.origin_mm])
    image.SetDirection([float(d) for d in grid.direction.ravel()])
    return image


class _SingleFiles:
    """One file per scan: .mha, .nrrd or .nii.gz."""

    def __init__(self, folder: Path, suffix: str, grid: ScanGrid) -> None:
        self.folder, self.suffix, self.grid = folder, suffix, grid
        (folder / "frames").mkdir(exist_ok=True)
        self.reference_name = f"reference.{suffix}"
        self.frames_name: str | list[str] = f"frames/*.{suffix}"

    def reference(self, scan: Scan) -> None:
        self._write(scan, self.folder / self.reference_name)

    def frame(self, number: int, scan: Scan) -> None:
        self._write(scan, self.folder / "frames" / f"frame_{number:03d}.{self.suffix}")

    def _write(self, scan: Scan, path: Path) -> None:
        sitk.WriteImage(to_image(scan, self.grid), str(path), useCompression=False)


class _Dicom:
    """One folder of slices per scan."""

    def __init__(self, folder: Path, grid: ScanGrid) -> None:
        self.folder, self.grid = folder, grid
        self.reference_name = "reference"
        self.frames_name: str | list[str] = []

    def reference(self, scan: Scan) -> None:
        self._write(scan, self.folder / "reference", 1)

    def frame(self, number: int, scan: Scan) -> None:
        name = f"frames/frame_{number:03d}"
        self._write(scan, self.folder / name, number + 2)
        assert isinstance(self.frames_name, list)
        self.frames_name.append(name)

    def _write(self, scan: Scan, folder: Path, series: int) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        image = to_image(scan, self.grid)
        writer: Any = sitk.ImageFileWriter()
        writer.KeepOriginalImageUIDOn()
        for k in range(image.GetDepth()):
            sheet = image[:, :, k]
            for tag, value in self._tags(series, k).items():
                sheet.SetMetaData(tag, value)
            writer.SetFileName(str(folder / f"{k:04d}.dcm"))
            writer.Execute(sheet)

    def _tags(self, series: int, k: int) -> dict[str, str]:
        root = "1.2.826.0.1.3680043.10.1338"  # a private root for made-up objects
        grid = self.grid
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


class _Hdf5:
    """One file, a data set per scan, indexed x, y, z, its geometry as attributes of each."""

    reference_name = "study.h5#/reference"
    frames_name: str | list[str] = "study.h5#/frames"

    def __init__(self, folder: Path, grid: ScanGrid) -> None:
        self.path, self.grid = folder / "study.h5", grid
        with h5py.File(self.path, "w") as file:
            file.create_group("frames")

    def reference(self, scan: Scan) -> None:
        self._write("reference", scan)

    def frame(self, number: int, scan: Scan) -> None:
        self._write(f"frames/{number:03d}", scan)

    def _write(self, name: str, scan: Scan) -> None:
        with h5py.File(self.path, "a") as file:
            data = file.create_dataset(name, data=scan)
            data.attrs["axes"] = "x,y,z"
            data.attrs["spacing_mm"] = self.grid.spacing_mm
            data.attrs["origin_mm"] = self.grid.origin_mm
            data.attrs["direction"] = self.grid.direction
