"""Volumes in HDF5: ``study.h5#/frames`` is a dataset (z, y, x) or a sequence (frame, z, y, x).

The geometry stands in the dataset's attributes spacing_mm, origin_mm (default 0) and direction (default identity).
"""

from __future__ import annotations

from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from pipeline.load.geometry import Box, Header, LoadError, Source


def _dataset(file: h5py.File, source: Source) -> h5py.Dataset:
    node = file.get(source.dataset or "/volume")
    if not isinstance(node, h5py.Dataset) or node.ndim not in (3, 4):
        found: list[str] = []
        file.visititems(
            lambda name, item: (
                found.append(f"/{name} {item.shape}") if isinstance(item, h5py.Dataset) else None
            )
        )
        msg = (
            f"{source.path}: no 3-D or 4-D dataset {source.dataset or '/volume'!r}; the file holds "
            f"{', '.join(found) or 'none'}. Name one as FILE.h5#/dataset."
        )
        raise LoadError(msg)
    return node


def read_hdf5_header(source: Source) -> Header:
    """Geometry of a dataset from its attributes; spacing_mm must be there."""
    with h5py.File(source.path, "r") as file:
        data = _dataset(file, source)
        if "spacing_mm" not in data.attrs:
            msg = (
                f"{source}: the dataset lacks the attribute spacing_mm (three lengths in mm, x, y, z); found "
                f"{sorted(data.attrs)}. Add it, or give spacing_mm in the manifest."
            )
            raise LoadError(msg)
        nz, ny, nx = data.shape[-3:]
        return Header(
            source,
            (nx, ny, nz),
            np.array(data.attrs["spacing_mm"], float),
            np.array(data.attrs.get("origin_mm", np.zeros(3)), float),
            np.array(data.attrs.get("direction", np.eye(3)), float).reshape(3, 3),
            str(data.dtype),
            (source.path,),
            item_count=data.shape[0] if data.ndim == 4 else 1,
        )


def read_hdf5(header: Header, box: Box) -> NDArray[Any]:
    """Voxels of ``box`` alone, indexed x, y, z."""
    (x0, y0, z0), (x1, y1, z1) = box
    with h5py.File(header.source.path, "r") as file:
        data = _dataset(file, header.source)
        window = (slice(z0, z1), slice(y0, y1), slice(x0, x1))
        item = () if data.ndim == 3 else (header.source.item or 0,)
        return np.asarray(data[(*item, *window)]).T
