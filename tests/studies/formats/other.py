"""The scan in formats that ITK reads and wireval does not, and files that are no scan."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tests.studies.formats.base import Variant, by_itk

FULL = False
"""Whether the bomb is a real one: 20 s to pack; its header and length are judged alike."""


def other_variants() -> Iterator[Variant]:
    for suffix in ("gipl", "vtk", "img.gz", "spr"):
        yield Variant(f"{suffix}, by ITK", by_itk(f"a.{suffix}", turn=np.eye(3)), "!none of the formats allowed")
    yield Variant("hdr, Analyze", analyze, "!Analyze")
    yield Variant("a text", lambda f: _text(f / "a.txt"), "!cannot read")
    yield Variant("a text called .mha", lambda f: _text(f / "a.mha"), "!cannot read")
    yield Variant("a text called .nrrd", lambda f: _text(f / "a.nrrd"), "!cannot read")
    yield Variant("a text called .nii", lambda f: _text(f / "a.nii"), "!cannot read")
    yield Variant("a text called .nii.gz", lambda f: _text(f / "a.nii.gz"), "!cannot read")
    yield Variant("a text called .h5", lambda f: _text(f / "a.h5"), "!HDF5")
    yield Variant("a text called .dcm", lambda f: _text(f / "a.dcm"), "!cannot read")
    yield Variant("an empty file", lambda f: _text(f / "a.mha", ""), "!empty")
    yield Variant("an empty folder", lambda f: f, "!0 DICOM image series")
    yield Variant("bombs", bomb, "!unpack")


def _text(path: Path, text: str = "hello, this is no scan\n") -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def analyze(folder: Path) -> Path:
    """A pair without NIfTI's mark."""
    path = by_itk("a.hdr")(folder)
    path.write_bytes(path.read_bytes()[:344] + bytes(4))
    return path


def bomb(folder: Path) -> Path:
    """3 GB of zeros in 3 MB: as much as the header says."""
    path = by_itk("a.mha", compress=True)(folder)
    raw = path.read_bytes()
    head = raw[: raw.index(b"LOCAL\n") + 6].replace(b"5 7 9", b"1200 1200 1200")
    packed = zlib.compressobj(9)
    zeros = bytes(2**20)
    body = b"".join(packed.compress(zeros) for _ in range(1200**3 * 2 // 2**20 + 1)) if FULL else zlib.compress(zeros)
    path.write_bytes(head + body + bytes(5 * 2**20 if not FULL else 0))
    return path
