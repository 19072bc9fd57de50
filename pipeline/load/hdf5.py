"""Volumes in HDF5: ``study.h5#/frames`` is one dataset, a 4-D dataset (a sequence), or a group of 3-D datasets.

A dataset's attributes give spacing_mm (needed), origin_mm (default 0), direction (default identity) and axes: "z,y,x"
(the default: x fastest, as in other formats) or "x,y,z". A 4-D dataset has the volume's number as its first axis.
The datasets of a group come in natural order, and each one's geometry is compared with that of the first.
"""

import re
from dataclasses import replace
from itertools import permutations, product
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.polyline import UNITS_MM
from pipeline.load.config import LoadConfig
from pipeline.load.geometry import Box, Header, Source, judged, require_same_geometry, unusable
from pipeline.load.guard import require_room
from pipeline.load.order import in_order
from pipeline.load.voxels import LONGEST_AXIS

AXES = ("z,y,x", "x,y,z")
MOST_NAMES = 20
ATTRIBUTES = {"coordinates": "space", "space": "space", "length_unit": "unit", "units": "unit", "unit": "unit"}
"""By which a file, a group or a dataset in it states space and unit of length."""
_CODES = {"".join(code) for axes in product("rl", "ap", "si") for code in permutations(axes)} - {"lps"}
_NO_LENGTH = re.compile(r"(?:vox|pix)els?(?: ind(?:ex|ices))?")
_OTHER_WAY = re.compile(r"(?:right|left)[ _-]*anterior|right[ _-]*posterior|inferior")


def _volumes(file: h5py.File, source: Source) -> list[h5py.Dataset]:
    """The dataset named, or the 3-D datasets of the group named, in natural order."""
    node = inside(file, source.dataset or "/volume", source)
    if isinstance(node, h5py.Group):
        members = [inside(node, name, source) for name in in_order(node)]
        _require_volumes(node, members, source)
        found = [item for item in members if isinstance(item, h5py.Dataset) and item.ndim == 3]
        if found:
            return found
    if isinstance(node, h5py.Dataset) and node.ndim in (3, 4):
        return [node]
    held: list[str] = []
    file.visititems(lambda name, item: held.append(f"/{name} {item.shape}") if isinstance(item, h5py.Dataset) else None)
    none = f"no volume {source.dataset or '/volume'!r}; the file holds {', '.join(held[:MOST_NAMES]) or 'none'}. "
    raise unusable(source.path, none + "Name a 3-D or 4-D dataset, or a group of 3-D ones, as FILE.h5#/name.")


def _require_volumes(group: h5py.Group, members: list[Any], source: Source) -> None:
    """LoadError where a member that may be meant for a volume is none: those beside it would be taken for all frames.

    Numbers, datasets of one axis, as of depths, and groups of such may stand beside volumes.
    """
    for name, item in zip(in_order(group), members, strict=True):
        what = _unlike_a_volume(item)
        if what:
            where = f"{group.name.rstrip('/')}/{name}"
            raise unusable(source, f"{where} is {what}; allowed: 3-D datasets, one a frame; remove or mend it")


def _unlike_a_volume(item: Any) -> str:
    """What a member is that may be meant for a volume and is none; empty for a volume, and for what is no scan."""
    if item is None:
        return "a link to nothing"
    if isinstance(item, h5py.Group):
        deeper: list[str] = []
        item.visititems(lambda name, one: deeper.append(name) if len(getattr(one, "shape", None) or ()) > 1 else None)
        return f"a group, of {', '.join(deeper[:MOST_NAMES])}" if deeper else ""
    if isinstance(item, h5py.Dataset) and item.shape is None:
        return "an empty dataset"
    plain = not isinstance(item, h5py.Dataset) or item.ndim in (0, 1, 3)
    return "" if plain else f"a dataset of the shape {item.shape}"


def inside(group: h5py.Group, name: str, source: Source) -> Any:
    """A member of a group, None where there is none; LoadError where its data lie in another file."""
    parts = [part for part in name.split("/") if part]
    for depth in range(1, len(parts) + 1):
        link = group.get("/".join(parts[:depth]), getlink=True)
        if isinstance(link, h5py.ExternalLink):
            raise unusable(source, "a link into another file; allowed: data in this file; copy them into it")
    node = group.get(name)
    if node is not None and Path(node.file.filename) != Path(group.file.filename):  # through a soft link
        raise unusable(source, "a link into another file; allowed: data in this file; copy them into it")
    if isinstance(node, h5py.Dataset) and (node.external or node.is_virtual):
        raise unusable(source, "its data lie in other files; allowed: data in this file; copy them into it")
    return node


def require_usual(what: object, *stating: h5py.HLObject) -> None:
    """LoadError where the file, or something in it, states another space or unit of length than LPS mm.

    What states neither, as the unit of greys or netCDF's names of coordinates, is passed over.
    """
    for held, (name, of) in product(stating, ATTRIBUTES.items()):
        said = _in_words(held.attrs.get(name, ""))
        if (_is_other_unit if of == "unit" else _is_other_space)(said.lower()):
            where = f"{held.name}: attribute {name} is {said!r}"
            raise unusable(what, f"{where}; allowed in HDF5: LPS mm; convert the numbers, and the attribute")


def _in_words(attribute: Any) -> str:
    """An attribute's text; of an array with one value for each axis, ``cm`` three times or R, A and S, that of all."""
    each = [text_of(value) for value in np.ravel(attribute)]
    return ("" if all(len(one) == 1 for one in each) else " ").join(dict.fromkeys(each))


def _is_other_unit(said: str) -> bool:
    name = said.strip("[]() ")
    return UNITS_MM.get(name, 1.0) != 1.0 or bool(_NO_LENGTH.fullmatch(name))


def _is_other_space(said: str) -> bool:
    words = re.findall("[a-z]+", said)
    grid = words in (["index"], ["indices"]) or {"ijk", "voxel", "voxels", "pixel", "pixels"} & {*words}
    other = grid or _CODES & {*words} or _OTHER_WAY.search(said)
    return bool(other) and words[:1] != ["lps"]


def _with_parents(data: h5py.Dataset) -> list[h5py.HLObject]:
    """A dataset, the groups that it lies in, and the file's root."""
    return [data, *(_with_parents(data.parent) if data.name != "/" else [])]


def _attribute(source: Source, data: h5py.Dataset, name: str, default: Any, allowed: str) -> Any:
    """An attribute's value, the default where there is none; LoadError for one without a value."""
    found = data.attrs.get(name, default)
    if isinstance(found, h5py.Empty):
        why = f"{data.name} has an empty attribute {name}"
        raise unusable(source, f"{why}; allowed: {allowed}. Write its value, or take the attribute out.")
    return found


def _is_xyz(data: h5py.Dataset, source: Source) -> bool:
    allowed = " or ".join(map(repr, AXES))
    axes = text_of(_attribute(source, data, "axes", AXES[0], allowed))
    if axes not in AXES:
        raise unusable(source, f"attribute axes is {axes!r}; allowed: {allowed}")
    return axes == AXES[1]


def text_of(attribute: Any) -> str:
    """An attribute's text: C and MATLAB write bytes, padded, or an array of one."""
    found = np.ravel(attribute)
    one = found[0] if len(found) == 1 else found
    return (one.decode("utf-8", "replace") if isinstance(one, bytes) else str(one)).strip()


def recognises(path: Path) -> bool:
    """By the suffix."""
    return path.suffix.lower() in {".h5", ".hdf5"}


def parts(_path: Path) -> tuple[Path, ...]:
    """A file or a folder is all there is."""
    return ()


def read_header(source: Source, config: LoadConfig) -> Header:
    """Geometry of a dataset from its attributes; spacing_mm must be there."""
    try:
        file = h5py.File(source.path, "r")
    except OSError as error:
        kind = "it is truncated" if "truncated" in str(error) else "it is no HDF5 file, or damaged"
        raise unusable(source, f"{kind}. Check that the file is complete: copy it again.") from None
    with file:
        volumes = _volumes(file, source)
        require_usual(source, *volumes[1:], *_with_parents(volumes[0]))
        headers = [_header(source, data, config) for data in volumes]
        for header, data in zip(headers, volumes, strict=True):
            if len(headers) > 1:
                require_same_geometry(judged(headers[0]), judged(header), str(data.name))
        count = volumes[0].shape[0] if volumes[0].ndim == 4 else len(volumes)
    notes = dict.fromkeys(note for header in headers for note in header.assumed)
    return replace(headers[0], item_count=int(count), assumed=tuple(notes))


def _header(source: Source, data: h5py.Dataset, config: LoadConfig) -> Header:
    """What one dataset says."""
    if data.dtype.kind not in "iufb":
        raise unusable(source, f"{data.name} holds {data.dtype}; allowed: whole or decimal numbers")
    if min(data.shape) < 1 or max(data.shape) > LONGEST_AXIS:
        raise unusable(source, f"{data.name} has the shape {data.shape}; allowed: 1 to {LONGEST_AXIS} along every axis")
    if "spacing_mm" not in data.attrs:
        lacks = f"{data.name} lacks the attribute spacing_mm (three lengths in mm, x, y, z); "
        raise unusable(source, f"{lacks}found {sorted(data.attrs)[:MOST_NAMES]}. Add it to every dataset.")
    a, b, c = data.shape[-3:]
    volume_bytes, stored = a * b * c * data.dtype.itemsize, int(data.id.get_storage_size())
    total = int(np.prod([int(n) for n in data.shape], dtype=object)) * data.dtype.itemsize
    require_room(source, volume_bytes, 0, "", config.most_gib)
    require_written(source, data)
    if data.chunks is not None:
        require_room(source, total, stored, "deflate", config.most_gib)
    defaults = {"origin_mm": "0, 0, 0", "direction": "along x, y, z"}
    missing = [f"{name}: {value}" for name, value in defaults.items() if name not in data.attrs]
    return Header(
        source,
        (a, b, c) if _is_xyz(data, source) else (c, b, a),
        _numbers(source, data, "spacing_mm", np.ones(3)),
        _numbers(source, data, "origin_mm", np.zeros(3)),
        _numbers(source, data, "direction", np.eye(3)),
        str(data.dtype.newbyteorder("=")),
        assumed=tuple(f"{source.path.name}: {data.name} lacks {text} assumed" for text in missing),
    )


def require_written(what: object, data: h5py.Dataset) -> None:
    """LoadError where parts of a dataset were never written: they read as zeros, a scan that ends in air.

    A label map's background may be left out like that on purpose, but looks no different from a map of which the last
    part is missing: it has to be written, too.
    """
    again = "write it again, its background too (h5py: data[...] = data[...])"
    if data.chunks is None:
        need = int(np.prod(data.shape, dtype=object)) * data.dtype.itemsize
        there, part = int(data.id.get_storage_size()), "bytes"
    else:
        need = int(np.prod([-(-n // chunk) for n, chunk in zip(data.shape, data.chunks, strict=True)], dtype=object))
        there, part = int(data.id.get_num_chunks()), "chunks"
    if there < need:
        raise unusable(what, f"{data.name}: {there} of {need} {part} were ever written; {again}")


def _numbers(source: Source, data: h5py.Dataset, name: str, default: NDArray[Any]) -> NDArray[np.float64]:
    """An attribute of as many numbers as the default has."""
    found = np.asarray(_attribute(source, data, name, default, f"{default.size} numbers"))
    if found.dtype.kind not in "iuf" or found.size != default.size:
        got = f"{data.name} has {name} = {str(found.tolist())[:80]}"
        raise unusable(source, f"{got}; allowed: {default.size} numbers. Check that the file is complete: correct it.")
    return found.astype(float).reshape(default.shape)


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
