"""Headers that say two things, and voxels that are not all there: a reader that takes either is wrong in silence."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np

from pipeline.load import Source
from tests.studies.formats.base import ORIGIN, SHAPE, SPACING, TURN, Variant, by_itk, changed, numbered
from tests.studies.formats.hdf5 import grouped
from tests.studies.formats.meta import ascii_mha, big_endian
from tests.studies.formats.nifti import SLOPE, SROW, nifti
from tests.studies.formats.nrrd import ascii_nrrd

BITPIX, INTERCEPT = 72, 116


def contradictions() -> Iterator[Variant]:
    mha, nrrd = by_itk("a.mha"), by_itk("a.nrrd")
    for old, new in (("DimSize", "DimSize = 5 7 8"), ("ElementSpacing", "ElementSpacing = 1 1 1")):
        yield Variant(f"mha, two of {old}", changed(mha, ("NDims", f"{new}\nNDims")), f"!{old}")
    yield Variant("mha, one line twice", changed(mha, ("NDims", "NDims = 3\nNDims")))
    for old, new in (("space origin", "space origin: (1,2,3)"), ("type", "type: int")):
        yield Variant(f"nrrd, two of {old}", changed(nrrd, ("dimension", f"{new}\ndimension")), f"!{old}")
    packed = by_itk("a.mha", compress=True)
    yield Variant("mha, packed to 5 bytes", changed(packed, ("CompressedDataSize =", "5")), "!CompressedDataSize = 5")
    yield Variant(
        "mha, packed to more", changed(packed, ("CompressedDataSize =", "99999")), "!CompressedDataSize = 99999"
    )
    yield Variant("mha, two comments", changed(mha, ("NDims", "Comment = a\nComment = b\nNDims")))
    for old, new in (("Offset", "Position = 1 2 3"), ("TransformMatrix", "Rotation = 1 0 0 0 1 0 0 0 1")):
        yield Variant(f"mha, {old} by two names", changed(mha, ("NDims", f"{new}\nNDims")), f"!{old}")
    orders = changed(mha, ("NDims", "ElementByteOrderMSB = True\nNDims"))
    yield Variant("mha, byte order by two names", orders, "!ElementByteOrderMSB = True")
    skips = changed(nrrd, ("dimension", "byteskip: 3\nbyte skip: 0\ndimension"))
    yield Variant("nrrd, byte skip by two names", skips, "!byte skip: 3 and byte skip: 0")
    for word in ("true", "T", "1"):
        swapped = changed(big_endian, ("BinaryDataByteOrderMSB = True", f"BinaryDataByteOrderMSB = {word}"))
        yield Variant(f"mha, big-endian {word}", swapped)
    for name in ("BinaryData", "CompressedData", "BinaryDataByteOrderMSB"):
        yield Variant(f"mha, {name} perhaps", changed(mha, (f"\n{name} =", "perhaps")), f"!{name} = 'perhaps'")
    yield from of_voxels()


def of_voxels() -> Iterator[Variant]:
    yield Variant("nii, bitpix 8", nifti((BITPIX, "h", 8)), "!bitpix 8")
    yield Variant("nii, sform nan", nifti((SROW, "f", float("nan"))), "!sform")
    for slope, shift, want in ((np.inf, 0.0, "!scl_slope inf"), (2.0, np.nan, "!scl_inter nan"), (np.nan, 7.0, "")):
        named = f"nii, slope {slope:g} and intercept {shift:g}"
        yield Variant(named, nifti((SLOPE, "ff", (slope, shift))), want or "right")
    for text, said in (
        ("65541", "of 65541"),
        ("3.5", "of 3.5"),
        ("1e300", "of 1e"),
        ("nan", "of nan"),
        ("1_5", "that are no"),
    ):
        for kind, plain in (("mha", ascii_mha), ("nrrd", ascii_nrrd)):
            yield Variant(f"{kind}, written out with {text}", last_of(plain, text), f"!voxels {said}")
    for name, written in (("slab", np.s_[:8]), ("first chunk", np.s_[:2, :2, :2])):
        yield Variant(f"h5, {name} alone written", part_of_chunks(written), "!its background too")
    yield Variant("h5, sequence without its last volume", part_of_sequence, "!2 of 3 chunks were ever written")
    said = {"plane": "a dataset of the shape (7, 5)", "group": "a group, of volume", "nothing": "an empty dataset"}
    for what, word in {"link": "a link to nothing", **said}.items():
        yield Variant(f"h5, group with a {what}", group_with(what), f"!{word}")
    yield Variant("h5, group with depths", group_with("depths"), values=numbered() + 2, item=2)


def last_of(plain: Callable[[Path], Path], text: str) -> Callable[[Path], Path]:
    """Voxels that are written out, the last of them as this text."""

    def write(folder: Path) -> Path:
        path = plain(folder)
        path.write_bytes(path.read_bytes().rpartition(b" ")[0] + b" " + text.encode())
        return path

    return write


def part_of_chunks(written: object) -> Callable[[Path], Source]:
    """A dataset of which some chunks were never written: they read as zeros."""

    def write(folder: Path) -> Source:
        with h5py.File(folder / "s.h5", "w") as file:
            data = file.create_dataset("volume", SHAPE[::-1], "i2", chunks=(2, 2, 2), compression="gzip")
            data[written] = numbered().T[written]
            data.attrs.update(spacing_mm=SPACING, origin_mm=ORIGIN, direction=TURN)
        return Source(folder / "s.h5", "/volume")

    return write


def part_of_sequence(folder: Path) -> Source:
    """A 4-D dataset whose writer ended before the last volume."""
    with h5py.File(folder / "s.h5", "w") as file:
        data = file.create_dataset("frames", (3, *SHAPE[::-1]), "i2", chunks=(1, *SHAPE[::-1]))
        data[:2] = numbered().T
        data.attrs.update(spacing_mm=SPACING, origin_mm=ORIGIN, direction=TURN)
    return Source(folder / "s.h5", "/frames")


def group_with(what: str) -> Callable[[Path], Source]:
    """Volumes, and something beside them."""

    def write(folder: Path) -> Source:
        source = grouped(folder)
        with h5py.File(folder / "s.h5", "a") as file:
            if what == "link":
                file["frames/3"] = h5py.SoftLink("/nowhere")
            elif what == "nothing":
                file["frames/3"] = h5py.Empty("i2")
            else:
                name, shape = {"depths": ("depths", 4), "plane": ("3", (7, 5)), "group": ("3/volume", (9, 7, 5))}[what]
                file[f"frames/{name}"] = np.zeros(shape)
        return source

    return write
