"""A lumen as voxels: a label map (one label of several by number or name), a layered .seg.nrrd, or probabilities.

Out: a Volume of 0 and 1 (int16), or of probabilities 0..1 (float32) whose wall is at 0.5.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.load import load, read_header
from pipeline.load.config import LoadConfig
from pipeline.load.files import head_of
from pipeline.load.geometry import Header, Mask, Source, judged, refused
from pipeline.load.guard import told
from pipeline.load.voxels import Names, plain, read_box
from pipeline.model import Volume
from pipeline.status import did_you_mean
from solver.grid import read_only

FEW = 16
"""A map of whole numbers up to 255 with more distinct ones than this is a probability in 255 steps."""
MOST_NAMED = 12
WHOLE = np.int16
"""What labels are given as: whole numbers as scans mostly hold them, for which the kernels are compiled. For bytes they
took ten seconds, the first time."""


def read_mask(source: Source, least_voxels: int) -> Volume:
    """The lumen among the voxels of a file; LoadError where it is not clear which, or fewer than ``least_voxels``."""
    label, level = (source.label, source.level) if isinstance(source, Mask) else (None, None)
    volume, names = _voxels(source, label)
    path, value = source.path, names[label][0][1] if isinstance(label, str) else label
    inside = _chosen(path, volume.values, value, names) if level is None else _probability(path, volume.values, level)
    count = int(np.count_nonzero(inside >= 0.5))
    if count < least_voxels:
        allowed = f"at least {least_voxels} (segment.least_voxels)"
        raise refused(path, f"{count} labelled voxels", allowed, "check the label map")
    if count == inside.size:
        raise refused(path, "every voxel labelled", "a lumen with something around it", "check the label map")
    return Volume(read_only(inside), volume.spacing_mm, volume.origin_mm, volume.direction, volume.assumed)


def mask_header(source: Source) -> Header:
    """Geometry of a mask's file, its layers counted as one; LoadError where it has none, or cannot hold the label."""
    path = source.path
    if not _is_nrrd(path):
        header, names = read_header(source), {}
    else:
        with told(path):
            head = head_of(path)
            header, names = judged(head.header(source)), head.names
    _require_label(source, names, np.dtype(header.pixel_type))
    return header


def _is_nrrd(path: Path) -> bool:
    return path.name.lower().endswith((".nrrd", ".nhdr"))


def _require_label(source: Source, names: Names, kind: np.dtype[Any]) -> None:
    """LoadError for a label by a name that the file has not, or by a number that no voxel of its type can be."""
    label = source.label if isinstance(source, Mask) else None
    if isinstance(label, str) and label not in names:
        hint = did_you_mean(label, names) if names else "the file names none; give a number"
        raise refused(source.path, f"no label named {label!r}", "one that the file names", hint)
    if isinstance(label, str) and len(names[label]) > 1:
        values = " and ".join(str(value) for _, value in names[label])
        raise refused(source.path, f"labels {values}, all named {label!r}", "one", "rename them, or give a number")
    # whole numbers may be stored with a factor, but not in NRRD
    if isinstance(label, int) and kind.kind in "iu" and _is_nrrd(source.path):
        least, most = np.iinfo(kind).min, np.iinfo(kind).max
        if not least <= label <= most:
            allowed = f"{least} to {most}, which voxels of type {kind} can be"
            raise refused(source.path, f"label {label}", allowed, "name a label of the file")


def _voxels(source: Source, label: int | str | None) -> tuple[Volume, Names]:
    """The voxels of the layer that holds a label, and the file's labels by their names."""
    path = source.path
    header = mask_header(source)
    head = head_of(path) if _is_nrrd(path) else None
    names = head.names if head else {}
    if header.item_count > 1:
        raise refused(path, f"{header.item_count} volumes", "one label map", "save the one that is meant")
    if head is None or head.channels == 1:
        return load(header, config=LoadConfig()), names
    every = [one for several in names.values() for one in several]
    found = names[label] if isinstance(label, str) else [one for one in every if label in (None, one[1])]
    if len(found) != 1:
        allowed = f"one of {', '.join(sorted(names)[:MOST_NAMED]) or 'none'}"
        raise refused(path, f"{head.channels} layers, label {label!r}", allowed, "give label by its name")
    if found[0][0] >= head.channels:
        raise refused(path, f"a segment in layer {found[0][0]} of {head.channels}", "a layer it has", "save it again")
    values = plain(read_box(head, 0, header.box, found[0][0]), path)
    where = Volume(read_only(values), header.spacing_mm, header.origin_mm, header.direction, header.assumed)
    return where, {**names, **({} if label is not None else {"": found})}


def _chosen(path: Path, values: NDArray[Any], value: int | None, names: Names) -> NDArray[Any]:
    """1 where the voxels have the label; if none is given, 1 where the only label is, or the map's probabilities."""
    if value is None and "" in names:
        value = names[""][0][1]
    if value is not None:
        chosen = np.asarray(values == value)
        if not chosen.any():
            kinds = _different(values)
            others = f"{', '.join(f'{kind:g}' for kind in kinds[:MOST_NAMED])}{' ...' * (len(kinds) > MOST_NAMED)}"
            raise refused(path, f"no voxel of label {value}", f"one of its values, {others}", "name another label")
        return chosen.astype(WHOLE)
    low, high = float(values.min()), float(values.max())
    whole = values.dtype.kind in "iu" or bool(np.all(values == np.rint(values)))
    if not whole:
        return _probability(path, values, 0.5)
    kinds = _different(values)
    if len(kinds) == 2 and low == 0:
        return np.asarray(values != 0).astype(WHOLE)
    if len(kinds) > FEW and low >= 0 and 200 <= high <= 255:
        return _probability(path, values, 0.5)
    shown = ", ".join(f"{kind:g}" for kind in kinds[:MOST_NAMED])
    each = [f"{name} = {one[1]}" for name, several in names.items() for one in several]
    named = f" ({', '.join(each[:MOST_NAMED])})" if names else ""
    got = f"{len(kinds)} different values, {shown}{named}"
    do = 'name one, lumen = {file = "...", label = 2}, or a probability, lumen = {file = "...", level = 0.5}'
    raise refused(path, got, "0 and one label", do)


def _different(values: NDArray[Any]) -> NDArray[Any]:
    """The different values, ascending; counted rather than sorted where they are few."""
    low, high = int(values.min()), int(values.max())
    if values.dtype.kind not in "iu" or high - low > 65535:
        return np.unique(values)
    seen = np.zeros(high - low + 1, bool)
    seen[values.astype(np.int64, order="K") - low] = True
    return np.flatnonzero(seen) + low


def _probability(path: Path, values: NDArray[Any], level: float) -> NDArray[np.float32]:
    """Values 0..1 or 0..255 as probabilities, stretched so that ``level`` becomes 0.5."""
    low, high = float(values.min()), float(values.max())
    if low < -1e-3 or high > 255.5 or 1.001 < high <= 100:
        raise refused(path, f"values from {low:g} to {high:g}", "0 to 1, or 0 to 255", "name a label, or rescale it")
    share = np.clip(values.astype(np.float32) / np.float32(255.0 if high > 1.001 else 1.0), 0, 1)
    return np.asarray(np.interp(share, (0.0, level, 1.0), (0.0, 0.5, 1.0)), np.float32)
