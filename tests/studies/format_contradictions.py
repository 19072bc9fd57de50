"""Headers that say two things, and voxels that are not all there: a reader that takes either is wrong in silence."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np

from pipeline.load import Source
from tests.studies import formats

BITPIX, INTERCEPT = 72, 116


def contradictions() -> Iterator[formats.Variant]:
    Variant, changed, nifti = formats.Variant, formats.changed, formats.nifti
    mha, nrrd = formats.by_itk("a.mha"), formats.by_itk("a.nrrd")
    for old, new in (("DimSize", "DimSize = 5 7 8"), ("ElementSpacing", "ElementSpacing = 1 1 1")):
        yield Variant(f"mha, two of {old}", changed(mha, ("NDims", f"{new}\nNDims")), f"!{old}")
    yield Variant("mha, one line twice", changed(mha, ("NDims", "NDims = 3\nNDims")))
    for old, new in (("space origin", "space origin: (1,2,3)"), ("type", "type: int")):
        yield Variant(f"nrrd, two of {old}", changed(nrrd, ("dimension", f"{new}\ndimension")), f"!{old}")
    packed = formats.by_itk("a.mha", compress=True)
    yield Variant("mha, packed to 5 bytes", changed(packed, ("CompressedDataSize =", "5")), "!CompressedDataSize = 5")
    for word in ("true", "T", "1"):
        swapped = changed(formats.big_endian, ("BinaryDataByteOrderMSB = True", f"BinaryDataByteOrderMSB = {word}"))
        yield Variant(f"mha, big-endian {word}", swapped)
    for name in ("BinaryData", "CompressedData", "BinaryDataByteOrderMSB"):
        yield Variant(f"mha, {name} perhaps", changed(mha, (f"\n{name} =", "perhaps")), f"!{name} = 'perhaps'")
    yield Variant("nii, bitpix 8", nifti((BITPIX, "h", 8)), "!bitpix 8")
    yield Variant("nii, sform nan", nifti((formats.SROW, "f", float("nan"))), "!sform")
    for slope, shift, want in ((np.inf, 0.0, "!scl_slope inf"), (2.0, np.nan, "!scl_inter nan"), (np.nan, 7.0, "")):
        named = f"nii, slope {slope:g} and intercept {shift:g}"
        yield Variant(named, nifti((formats.SLOPE, "ff", (slope, shift))), want or "right")
    for text, said in (("65541", "65541"), ("3.5", "3.5"), ("1e300", "1e"), ("nan", "nan")):
        for kind, plain in (("mha", formats.ascii_mha), ("nrrd", formats.ascii_nrrd)):
            yield Variant(f"{kind}, written out with {text}", last_of(plain, text), f"!voxels of {said}")
    for name, written in (("slab", np.s_[:8]), ("first chunk", np.s_[:2, :2, :2])):
        yield Variant(f"h5, {name} alone written", part_of_chunks(written), "!were ever written")
    for what, word in (("link", "a link to nothing"), ("plane", "a dataset of the shape (7, 5)")):
        yield Variant(f"h5, group with a {what}", group_with(what), f"!{word}")
    yield Variant("h5, group with depths", group_with("depths"), values=formats.numbered() + 2, item=2)


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
            data = file.create_dataset("volume", formats.SHAPE[::-1], "i2", chunks=(2, 2, 2), compression="gzip")
            data[written] = formats.numbered().T[written]
            data.attrs.update(spacing_mm=formats.SPACING, origin_mm=formats.ORIGIN, direction=formats.TURN)
        return Source(folder / "s.h5", "/volume")

    return write


def group_with(what: str) -> Callable[[Path], Source]:
    """Volumes, and something beside them."""

    def write(folder: Path) -> Source:
        source = formats.grouped(folder)
        with h5py.File(folder / "s.h5", "a") as file:
            if what == "link":
                file["frames/3"] = h5py.SoftLink("/nowhere")
            else:
                file["frames/depths" if what == "depths" else "frames/3"] = np.zeros(4 if what == "depths" else (7, 5))
        return source

    return write
