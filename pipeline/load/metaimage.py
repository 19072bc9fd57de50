"""Headers of MetaImage (.mha, .mhd), read here: ITK's own reader crashes on some, and fills in what others lack."""

from pathlib import Path

import numpy as np

from pipeline.load.geometry import unusable
from pipeline.load.guard import opened, size_of
from pipeline.load.outside import millimetres, named_files, numbers, said_twice
from pipeline.load.voxels import Head, Placed, axes_of

LONGEST_HEADER = 65536
TYPES = {
    "MET_CHAR": "i1", "MET_UCHAR": "u1", "MET_SHORT": "i2", "MET_USHORT": "u2", "MET_INT": "i4", "MET_UINT": "u4",
    "MET_LONG": "i4", "MET_ULONG": "u4", "MET_LONG_LONG": "i8", "MET_ULONG_LONG": "u8", "MET_FLOAT": "f4",
    "MET_DOUBLE": "f8",
}  # fmt: skip
PLACES = ("Offset", "Position", "Origin")
TURNS = ("TransformMatrix", "Orientation", "Rotation")


def data_files(path: Path) -> list[Path]:
    """The files that hold the voxels, there or not; LoadError where the header does not say which."""
    tags, below, _ = _tags(path)
    _, shape, items = _axes(path, tags)
    return _files(path, tags["ElementDataFile"], below, shape[2] * items)


def head_of(path: Path) -> Head:
    """What the header says; LoadError where that cannot be a scan."""
    tags, below, end = _tags(path)
    count, shape, items = _axes(path, tags)
    kind = tags.get("ElementType", "").removesuffix("_ARRAY")
    if kind not in TYPES:
        raise unusable(path, f"ElementType = {kind!r}; allowed: {', '.join(TYPES)}")
    packing = "deflate" if _flag(path, tags, "CompressedData") else ""
    if not packing and not _flag(path, tags, "BinaryData", missing="True"):
        packing = "ascii"
    order = _one_of(path, tags, ("BinaryDataByteOrderMSB", "ElementByteOrderMSB"))
    swapped = _flag(path, tags, order)
    stored = np.dtype((">" if swapped else "<") + TYPES[kind])
    channels = int(numbers(path, tags, "ElementNumberOfChannels", 1, whole=True, missing="1")[0])
    files = _files(path, tags["ElementDataFile"], below, shape[2] * items)
    voxel_bytes = int(np.prod(shape)) * items * channels * stored.itemsize
    parts = tuple((name, _begin(name, path, tags, end, voxel_bytes // len(files))) for name in files)
    slope, shift = (
        float(numbers(path, tags, f"ElementToIntensityFunction{name}", 1, missing=text)[0])
        for name, text in (("Slope", "1"), ("Offset", "0"))
    )
    if slope == 0.0:
        raise unusable(path, "ElementToIntensityFunctionSlope 0, all grey is one; allowed: another; correct the header")
    said = int(numbers(path, tags, "CompressedDataSize", 1, whole=True, missing="0")[0])
    geometry, assumed = _geometry(path, tags, count)
    return Head(
        path, shape, stored, parts, *geometry, packing=packing, packed_bytes=said, items=items, channels=channels,
        slope=slope, intercept=shift, assumed=assumed,
    )  # fmt: skip


def _tags(path: Path) -> tuple[dict[str, str], str, int]:
    """The header's tags, the text below it, and the byte at which that begins."""
    with opened(path) as file:
        start = file.read(LONGEST_HEADER)
    key = start.find(b"ElementDataFile")
    end = start.find(b"\n", key) + 1
    if key < 0 or not end:
        raise unusable(path, "cannot read it as MetaImage: no line ElementDataFile; check that the file is complete")
    tags: dict[str, str] = {}
    for line in _text(start[:end]).splitlines():
        name, _, value = (part.strip() for part in line.partition("="))
        if tags.setdefault(name, value) != value and name != "Comment":
            raise said_twice(path, f"{name} = {tags[name][:40]}", f"{name} = {value[:40]}")
    return tags, _text(start[end:]), end


def _flag(path: Path, tags: dict[str, str], name: str, missing: str = "False") -> bool:
    """True or False of a tag; as in MetaIO the first letter tells, or 1 and 0."""
    text = tags.get(name, missing)
    if text[:1] not in ("T", "t", "1", "F", "f", "0"):
        raise unusable(path, f"{name} = {text[:40]!r}; allowed: True, False; correct the header")
    return text[0] in "Tt1"


def _one_of(path: Path, tags: dict[str, str], names: tuple[str, ...]) -> str:
    """The name by which a header gives what has several names, empty for none; LoadError where it gives two things."""
    given = [name for name in names if name in tags]
    for name in given[1:]:
        if tags[name].split() != tags[given[0]].split():
            raise said_twice(path, f"{given[0]} = {tags[given[0]][:40]}", f"{name} = {tags[name][:40]}")
    return given[0] if given else ""


def _text(part: bytes) -> str:
    """Names of files may be in UTF-8; what is not is read byte by byte."""
    try:
        return part.decode()
    except UnicodeDecodeError:
        return part.decode("latin-1")


def _axes(path: Path, tags: dict[str, str]) -> tuple[int, tuple[int, int, int], int]:
    """How many axes there are, the shape of a volume, and how many volumes."""
    count = int(numbers(path, tags, "NDims", 1, whole=True)[0])
    if not 1 <= count <= 8:
        raise unusable(path, f"NDims = {count}; allowed: 3, or 4 for a sequence")
    return count, *axes_of(path, [int(n) for n in numbers(path, tags, "DimSize", count, whole=True)])


def _begin(name: Path, header: Path, tags: dict[str, str], end: int, voxel_bytes: int) -> int:
    """The byte of a data file where its voxels begin."""
    skipped = int(numbers(header, tags, "HeaderSize", 1, whole=True, missing="0")[0])
    least = end if name == header else 0
    if skipped == -1:
        return max(size_of(name) - voxel_bytes, least)
    return least or max(skipped, 0)


def _files(path: Path, text: str, below: str, planes: int) -> list[Path]:
    """The data files: the header's own, or others."""
    return [path] if text.upper() == "LOCAL" else named_files(path, text, below, planes)


def _geometry(path: Path, tags: dict[str, str], count: int) -> tuple[Placed, tuple[str, ...]]:
    """Spacing, origin and direction, and what of it the header lacks."""
    factor = millimetres(path, tags.get("DistanceUnits", "mm"))
    given = next((name for name in ("ElementSpacing", "ElementSize") if name in tags), "")
    place, turn = _one_of(path, tags, PLACES), _one_of(path, tags, TURNS)
    lacks = [
        text
        for name, text in ((given, "spacing: 1 mm"), (place, "origin: 0, 0, 0 mm"), (turn, "direction: along x, y, z"))
        if not name
    ]
    spacing = numbers(path, tags, given, count, missing="1 " * count)[:3] * factor
    origin = numbers(path, tags, place, count, missing="0 " * count)[:3] * factor
    identity = " ".join(map(str, np.eye(count).ravel()))
    matrix = numbers(path, tags, turn, count * count, missing=identity)
    direction = matrix.reshape(count, count).T[:3, :3]
    return (spacing, origin, direction), tuple(f"{path.name}: the header lacks {text} assumed" for text in lacks)
