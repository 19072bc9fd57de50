"""Volumes in HDF5: ``study.h5#/frames`` is one dataset, a 4-D dataset (a sequence), or a group of 3-D datasets.

A dataset's attributes give spacing_mm (needed), origin_mm (default 0), direction (default identity) and axes: "z,y,x"
(the default: x fastest, as in other formats) or "x,y,z". A 4-D dataset has the volume's number as its first axis.
"""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from pipeline.load.config import LoadConfig
from pipeline.load.geometry import Box, Header, Source, unusable

AXES = ("z,y,x", "x,y,z")


def _volumes(file: h5py.File, source: Source) -> list[h5py.Dataset]:
    """The dataset named, or the 3-D datasets of the group named, by name."""
    node = file.get(source.dataset or "/volume")
    if isinstance(node, h5py.Group):
        inside = [node[name] for name in sorted(node)]
        found = [item for item in inside if isinstance(item, h5py.Dataset) and item.ndim == 3]
        if found:
            return found
    if isinstance(node, h5py.Dataset) and node.ndim in (3, 4):
        return [node]
    held: list[str] = []
    file.visititems(lambda name, item: held.append(f"/{name} {item.shape}") if isinstance(item, h5py.Dataset) else None)
    none = f"no volume {source.dataset or '/volume'!r}; the file holds {', '.join(held) or 'none'}. "
    raise unusable(source.path, none + "Name a 3-D or 4-D dataset, or a group of 3-D ones, as FILE.h5#/name.")


def _is_xyz(data: h5py.Dataset, source: Source) -> bool:
    axes = str(data.attrs.get("axes", AXES[0]))
    if axes not in AXES:
        raise unusable(source, f"attribute axes is {axes!r}; allowed: {' or '.join(map(repr, AXES))}")
    return axes == AXES[1]


def recognises(path: Path) -> bool:
    """By the suffix."""
    return path.suffix.lower() in {".h5", ".hdf5"}


def parts(_path: Path) -> tuple[Path, ...]:
    """A file or a folder is all there is."""
    return ()


def read_header(source: Source, _config: LoadConfig) -> Header:
    """Geometry of a dataset from its attributes; spacing_mm must be there."""
    try:
        return _header(source)
    except (OSError, ValueError) as error:
        why = f"{error}. Check that the file is complete, spacing_mm and origin_mm three numbers, direction nine"
        raise unusable(source, why) from None


def _header(source: Source) -> Header:
    with h5py.File(source.path, "r") as file:
        volumes = _volumes(file, source)
        data = volumes[0]
        if "spacing_mm" not in data.attrs:
            lacks = f"{data.name} lacks the attribute spacing_mm (three lengths in mm, x, y, z); "
            raise unusable(source, f"{lacks}found {sorted(data.attrs)}. Add it to every dataset.")
        a, b, c = data.shape[-3:]
        return Header(
            source,
            (a, b, c) if _is_xyz(data, source) else (c, b, a),
            np.array(data.attrs["spacing_mm"], float).reshape(3),
            np.array(data.attrs.get("origin_mm", np.zeros(3)), float).reshape(3),
            np.array(data.attrs.get("direction", np.eye(3)), float).reshape(3, 3),
            str(data.dtype),
            item_count=data.shape[0] if data.ndim == 4 else len(volumes),
        )


def read(header: Header, box: Box, _config: LoadConfig) -> NDArray[Any]:
    """Voxels of ``box`` alone, indexed x, y, z."""
    window = tuple(slice(a, b) for a, b in zip(*box, strict=True))
    item = header.source.item or 0
    with h5py.File(header.source.path, "r") as file:
        volumes = _volumes(file, header.source)
        sequence = volumes[0].ndim == 4
        data = volumes[0] if sequence else volumes[item]
        leading = (item,) if sequence else ()
        if _is_xyz(data, header.source):
            return np.asarray(data[(*leading, *window)])
        return np.asarray(data[(*leading, *window[::-1])]).T
