"""The scan as NIfTI with fields of the header written over."""

from __future__ import annotations

import gzip
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from tests.studies.formats.base import TURN, Variant, by_itk, cut, numbered

FORMS, QFORM, SFORM, UNITS, PIXDIM, SLOPE, DIM, SROW = 252, 252, 254, 123, 76, 112, 40, 280


def nifti(*fields: tuple[int, str, object], packed: bool = False) -> Callable:
    """A NIfTI-1 file of the scan with fields (byte, struct format, value) written over."""

    def write(folder: Path) -> Path:
        path = by_itk("a.nii")(folder)
        raw = bytearray(path.read_bytes())
        for at, form, value in fields:
            struct.pack_into("<" + form, raw, at, *(value if isinstance(value, tuple) else (value,)))
        name = folder / ("b.nii.gz" if packed else "b.nii")
        name.write_bytes(gzip.compress(bytes(raw)) if packed else bytes(raw))
        return name

    return write


HEADER = "i10s18sih2s8h3f4h8f3fh2s4f2i80s24s2h6f12f16s4s"


def big_endian(folder: Path) -> Path:
    """The scan as machines with the other order of bytes write it."""
    path = by_itk("a.nii")(folder)
    raw = path.read_bytes()
    head = struct.pack(">" + HEADER, *struct.unpack_from("<" + HEADER, raw))
    path.write_bytes(head + raw[348:352] + numbered().T.astype(">i2").tobytes())
    return path


def nifti_variants() -> Iterator[Variant]:
    tipped = TURN + np.array([[-5e-5, 0, 0], [0, -5e-5, 0], [0, 0, 0]])
    yield Variant("nii, no forms", nifti((QFORM, "hh", (0, 0))), "neither", origin=np.zeros(3), direction=np.eye(3))
    yield Variant("nii, qform alone", nifti((SFORM, "h", 0)))
    yield Variant("nii, sform alone", nifti((QFORM, "h", 0)))
    yield Variant(
        "nii, forms that disagree", nifti((SROW + 12, "f", -20.0)), "disagree", origin=np.array([20.0, -30, 5])
    )
    yield Variant("nii, sform rounded to 1e-4", nifti((QFORM, "h", 0), (SROW, "f", 4e-5)), direction=tipped)
    yield Variant("nii, sform sheared", nifti((QFORM, "h", 0), (SROW, "f", 0.2)), "!sheared")
    yield Variant("nii, sform sheared, qform good", nifti((SROW, "f", 0.2)), "disagree")
    flat, none = (SROW, "8f", (0.4, 0.5, 0.0, -20.0) * 2), (SROW, "12f", (0.0,) * 12)
    for name, form in (("in one plane", flat), ("zeros", none)):
        yield Variant(f"nii, sform {name}", nifti((QFORM, "h", 0), form), "!sform is singular")
        yield Variant(f"nii, sform {name}, qform good", nifti(form), "sform is singular")
    yield Variant("nii, no unit", nifti((UNITS, "B", 0)), "unit")
    m = nifti((UNITS, "B", 1))
    yield Variant("nii, in metres", m, "!spacing")
    yield Variant("nii, in um", nifti((UNITS, "B", 3)), "!spacing")
    yield Variant("nii, unit 7", nifti((UNITS, "B", 7)), "!unit")
    yield Variant("nii, slope 2 and intercept -5", nifti((SLOPE, "ff", (2.0, -5.0))), values=2 * numbered() - 5)
    yield Variant("nii, slope 0.5", nifti((SLOPE, "ff", (0.5, 0.0))), values=numbered() / 2)
    yield Variant("nii, big-endian", big_endian)
    yield Variant("nii, slope nan", nifti((SLOPE, "ff", (float("nan"), 0.0))))
    yield from nifti_others()


def nifti_others() -> Iterator[Variant]:
    for value in (-1, 0, 9, 2):
        yield Variant(f"nii, dim[0] {value}", nifti((DIM, "h", value)), "!")
    for value, word in ((90, "cut short"), (8, "holds more"), (-9, "axes"), (0, "axes")):
        yield Variant(f"nii, dim[3] {value}", nifti((DIM + 6, "h", value)), f"!{word}")
    yield Variant("nii, spacing 0, no forms", nifti((PIXDIM + 4, "f", 0.0), (QFORM, "hh", (0, 0))), "!spacing")
    yield Variant(
        "nii, spacing nan, no forms", nifti((PIXDIM + 4, "f", float("nan")), (QFORM, "hh", (0, 0))), "!spacing"
    )
    yield Variant("nii, origin nan", nifti((QFORM, "h", 0), (SROW + 12, "f", float("nan"))), "!origin")
    yield Variant("nii, colours", nifti((70, "h", 128)), "!datatype")
    yield Variant("nii, complex", nifti((70, "h", 32)), "!datatype")
    yield Variant("nii, no magic", nifti((344, "4s", b"abcd")), "!NIfTI")
    yield Variant("nii, voxels before the header's end", nifti((108, "f", 10.0)), "!vox_offset")
    yield Variant("nii.gz, dim[3] 90", nifti((DIM + 6, "h", 90), packed=True), "!too early")
    yield Variant("nii.gz, dim[3] 8", nifti((DIM + 6, "h", 8), packed=True), "!unpack to more")
    yield Variant("nii.gz, dims of 30000", nifti((DIM + 2, "hhh", (30000,) * 3), packed=True), "!GiB")
    yield Variant("nii.gz, cut short", cut("a.nii.gz", 60), "!")
    yield Variant("nii.gz, not packed", lambda f: by_itk("a.nii")(f).rename(f / "c.nii.gz"))
    yield Variant("nii, packed", lambda f: by_itk("a.nii.gz")(f).rename(f / "c.nii"))
