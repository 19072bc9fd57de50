"""Headers of NRRD (.nrrd, .nhdr, .seg.nrrd), read here: with their units, their space and 3D Slicer's segments."""

import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.load.geometry import unusable
from pipeline.load.guard import opened, size_of
from pipeline.load.outside import millimetres, named_files, numbers, said_twice
from pipeline.load.voxels import Head, Names, Placed, axes_of

LONGEST_HEADER = 4 * 2**20
_NAMES = {
    "i1": ("signed char", "int8", "int8_t"), "u1": ("uchar", "unsigned char", "uint8", "uint8_t"),
    "i2": ("short", "short int", "signed short", "signed short int", "int16", "int16_t"),
    "u2": ("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"),
    "i4": ("int", "signed int", "int32", "int32_t"), "u4": ("uint", "unsigned int", "uint32", "uint32_t"),
    "i8": ("longlong", "long long", "long long int", "signed long long", "int64", "int64_t"),
    "u8": ("ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"),
    "f4": ("float",), "f8": ("double",),
}  # fmt: skip
TYPES = {name: kind for kind, names in _NAMES.items() for name in names}
PACKINGS = {
    "raw": "", "gzip": "deflate", "gz": "deflate", "bzip2": "bzip2", "bz2": "bzip2", "ascii": "ascii", "text": "ascii",
    "txt": "ascii",
}  # fmt: skip
TO_LPS = {
    "left-posterior-superior": (1, 1, 1), "lps": (1, 1, 1), "right-anterior-superior": (-1, -1, 1), "ras": (-1, -1, 1),
    "left-anterior-superior": (1, -1, 1), "las": (1, -1, 1),
}  # fmt: skip


def data_files(path: Path) -> list[Path]:
    """The files that hold the voxels, there or not; LoadError where the header does not say which."""
    fields, _ = _fields(path)
    axes = _axes(path, fields)
    return _files(path, fields, axes.shape[2] * axes.items)


class Axes(NamedTuple):
    """Of a volume and of how many; channels : values per voxel.     vectors : in space, of each axis that has one.

    leading : the first axis counts the channels.
    """

    shape: tuple[int, int, int]
    items: int
    channels: int
    vectors: list[Any]
    leading: bool


def _axes(path: Path, fields: dict[str, str]) -> Axes:
    count = int(numbers(path, fields, "dimension", 1, whole=True)[0])
    if not 1 <= count <= 8:
        raise unusable(path, f"dimension: {count}; allowed: 3, or 4 for a sequence")
    sizes = [int(n) for n in numbers(path, fields, "sizes", count, whole=True)]
    vectors = _vectors(path, fields, count)
    kinds = fields.get("kinds", "").lower().split() or ["domain"] * count
    without = [n for n, vector in enumerate(vectors) if vector is None]
    leading = count == 4 and (without[0] == 0 if without else kinds[0] not in DOMAINS)
    volumes = without in ([], [3]) and (sizes[-1] == 1 or kinds[-1] in (*DOMAINS, "list"))
    if count == 4 and not leading and not volumes:
        got = f"space directions {fields.get('space directions', '')[:80]!r} and kinds {fields.get('kinds', '')[:80]!r}"
        raise unusable(path, f"{got}; allowed: three axes in space, then one that counts volumes; save it again")
    shape, items = axes_of(path, sizes[1:] if leading else sizes)
    return Axes(shape, items, sizes[0] if leading else 1, [v for v in vectors if v is not None], leading)


def head_of(path: Path) -> Head:
    """What the header says; LoadError where that cannot be a scan."""
    fields, begin = _fields(path)
    shape, items, channels, vectors, leading = _axes(path, fields)
    kind = fields.get("type", "").lower()
    packing = PACKINGS.get(fields.get("encoding", "raw").lower())
    if kind not in TYPES or packing is None:
        got = f"type {kind!r}, encoding {fields.get('encoding')!r}"
        raise unusable(path, f"{got}; allowed: numbers up to 8 bytes, raw, gzip, bzip2 or ascii; save it again")
    if fields.get("endian", "little").lower() not in ("little", "big"):
        raise unusable(path, f"endian: {fields['endian']!r}; allowed: little, big")
    stored = np.dtype((">" if fields.get("endian", "").lower() == "big" else "<") + TYPES[kind])
    if packing != "ascii" and stored.itemsize > 1 and "endian" not in fields:
        raise unusable(path, f"no endian for {stored.itemsize} bytes a voxel; allowed: little, big; correct the header")
    files = _files(path, fields, shape[2] * items)
    share = int(np.prod(shape)) * items * channels * stored.itemsize // len(files)
    skipped, packed = _byte_skip(path, fields, packing), packing in ("deflate", "bzip2")
    lines, raw = _line_skip(path, fields), 0 if packed else skipped
    parts = tuple((name, _begin(name, begin if name == path else 0, lines, raw, share)) for name in files)
    geometry, assumed = _geometry(path, fields, vectors, int(leading))
    return Head(
        path, shape, stored, parts, *geometry, packing=packing, before=skipped if packed else 0,
        items=items, channels=channels, assumed=assumed, names=_segments(fields),
    )  # fmt: skip


ALIAS = {"datafile": "data file", "lineskip": "line skip", "byteskip": "byte skip"}
PLACING = "endian", "space", "space directions", "space origin", "space units", "spacings"
"""Fields that may be missing, so that a pair of the same name passed for one."""
DOMAINS = ("domain", "space", "time", "???", "none")


def _fields(path: Path) -> tuple[dict[str, str], int]:
    """The header's fields and key/value pairs, and the byte after it."""
    with opened(path) as file:
        start = file.read(LONGEST_HEADER)
    if not start.startswith(b"NRRD"):
        raise unusable(path, "cannot read it as NRRD: it does not begin with NRRD000; check that the file is complete")
    blank = re.search(rb"\r?\n\r?\n", start)
    end = blank.end() if blank else len(start)
    fields: dict[str, str] = {}
    text = start[:end].decode("utf-8", errors="replace")
    lines = text.splitlines()
    for n, line in enumerate(lines[1:], 2):
        name, colon, value = line.partition(":")
        if colon and not line.startswith("#"):
            key = f"{name}:=" if value.startswith("=") else ALIAS.get(name.strip().lower(), name.strip().lower())
            value = value.removeprefix("=").strip()
            if fields.setdefault(key, value) != value:
                raise said_twice(path, f"{key}: {fields[key][:40]}", f"{key}: {value[:40]}")
            if key == "data file" and value.upper().split()[:1] == ["LIST"]:  # the header's last field: names follow
                fields[key] = "\n".join((value, *lines[n:]))
                break
    _require_fields(path, fields)
    return fields, end


def _require_fields(path: Path, fields: dict[str, str]) -> None:
    """LoadError for a key/value pair (key:=value, which readers pass over) by the name of a field that is missing."""
    for pair, value in fields.items():
        name = pair.removesuffix(":=").strip().lower()
        if pair.endswith(":=") and name in PLACING and name not in fields:
            what = f"{pair}{value[:40]} is a key/value pair, which readers pass over"
            raise unusable(path, f"{what}; allowed: {name}: {value[:40]}; correct the header")


def _byte_skip(path: Path, fields: dict[str, str], packing: str) -> int:
    """Bytes before the voxels, once unpacked (the format counts them so); -1: all that the voxels leave, if raw."""
    skipped = int(numbers(path, fields, "byte skip", 1, whole=True, missing="0")[0])
    if skipped < (0 if packing else -1):
        encoding = fields.get("encoding", "raw")
        why = f"byte skip {skipped} with encoding {encoding}; allowed: 0 or more, and -1 if raw"
        raise unusable(path, f"{why}; correct the header")
    return skipped


def _line_skip(path: Path, fields: dict[str, str]) -> int:
    """Lines before the voxels."""
    lines = int(numbers(path, fields, "line skip", 1, whole=True, missing="0")[0])
    if not 0 <= lines <= MOST_LINES:
        raise unusable(path, f"line skip {lines}; allowed: 0 to {MOST_LINES}; correct the header")
    return lines


def _begin(name: Path, at: int, lines: int, skipped: int, voxel_bytes: int) -> int:
    """The byte of a data file where its voxels begin: so many lines and bytes after byte ``at``.

    Packed or not, lines are counted as they lie there. skipped : -1 for all that the voxels leave, lines and bytes.
    """
    if skipped == -1:
        return max(size_of(name) - voxel_bytes, at)
    if lines:
        with opened(name) as file:
            file.seek(at)
            for _ in range(lines):
                file.readline(LONGEST_HEADER)
            at = file.tell()
    return at + skipped


MOST_LINES = 1000


def _files(path: Path, fields: dict[str, str], planes: int) -> list[Path]:
    """The data files: the header's own, or others."""
    text, _, below = fields.get("data file", "").partition("\n")
    return named_files(path, text, below, planes) if text else [path]


def _vectors(path: Path, fields: dict[str, str], count: int) -> list[NDArray[Any] | None]:
    """A vector in space for every axis, None for one that has none; unit vectors where the header has no space."""
    text = fields.get("space directions", "")
    words = re.findall(r"none|nan|\([^)]*\)", text.lower())
    if not text:
        return [np.eye(max(count, 3))[i] for i in range(count)]
    if len(words) != count:
        raise unusable(path, f"space directions: {text[:80]!r}; allowed: one vector (x,y,z), or none, for each axis")
    vectors = [None if w in ("none", "nan") else w.strip("()").replace(",", " ") for w in words]
    name = "space directions"
    return [None if v is None else numbers(path, {name: v}, name, len(v.split())) for v in vectors]


def _geometry(path: Path, fields: dict[str, str], vectors: list[Any], leading: int) -> tuple[Placed, tuple[str, ...]]:
    """Spacing, origin and direction in LPS mm, and what of it the header lacks."""
    space = fields.get("space", "").lower().removesuffix("-time")
    lacks = [] if space in TO_LPS else [f"axes of the body in its space {space!r}: left-posterior-superior"]
    lacks = lacks if space else ["space: left-posterior-superior"]
    if space and space not in TO_LPS and space not in ("scanner-xyz", "3d-right-handed", "3d-left-handed"):
        raise unusable(path, f"space: {space!r}; allowed: {', '.join(n for n in TO_LPS if '-' in n)}; save it again")
    flip = np.array(TO_LPS.get(space, (1, 1, 1)), float)
    if "space directions" in fields:
        if len(vectors) < 3 or any(len(v) < 3 for v in vectors[:3]):
            raise unusable(path, "space directions of fewer than three axes; allowed: three vectors (x,y,z)")
        columns = np.array([v[:3] for v in vectors[:3]]).T * flip[:, None]
    else:
        lacks += ["direction: along x, y, z"] + ["spacing: 1 mm"] * ("spacings" not in fields)
        words = fields.get("spacings", "1 1 1" if not leading else "1 1 1 1").split()[leading:][:3]
        columns = np.diag(numbers(path, {"spacings": " ".join(words)}, "spacings", 3))
    stated = fields.get("space units", "") or fields.get("units", "")
    # unquoted ones were passed over: cm as mm
    units = re.findall(r'"([^"]*)"', stated) or [unit for unit in stated.split() if unit not in ("???", "none")]
    named = [unit for unit in units if unit.strip()][:3] or ["mm"]
    if len(set(named)) > 1:
        raise unusable(path, f"units {named} differ between the axes; allowed: one unit for all; convert the file")
    factor = millimetres(path, named[0])
    lacks += ["origin: 0, 0, 0 mm"] * ("space origin" not in fields)
    tags = {"space origin": fields.get("space origin", "(0,0,0)").strip("()").replace(",", " ")}
    origin = numbers(path, tags, "space origin", len(tags["space origin"].split()))[:3]
    if len(origin) != 3:
        raise unusable(path, f"space origin: {fields['space origin'][:80]!r}; allowed: three numbers (x,y,z)")
    size = np.linalg.norm(columns, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        direction = columns / size
    return (size * factor, origin * flip * factor, direction), tuple(
        f"{path.name}: the header lacks {text} assumed" for text in lacks
    )


def _segments(fields: dict[str, str]) -> Names:
    """Every segment of 3D Slicer by its name."""
    found: Names = {}
    for key, name in fields.items():
        match = re.fullmatch(r"(Segment\d+_)Name:=", key)
        if match:
            layer = fields.get(f"{match[1]}Layer:=", "0")
            value = fields.get(f"{match[1]}LabelValue:=", "1")
            if layer.isdecimal() and value.isdecimal():
                found.setdefault(name, []).append((int(layer), int(value)))
    return found
