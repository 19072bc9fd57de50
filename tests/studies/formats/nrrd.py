"""The scan as NRRD with headers that were edited, and as one volume of a sequence."""

from __future__ import annotations

import bz2
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import SimpleITK as sitk

from tests.studies.formats.base import ORIGIN, SPACING, TURN, Variant, by_itk, changed, cut, image, numbered, without


def nrrd_variants() -> Iterator[Variant]:
    plain = by_itk("a.nrrd")
    units = 'space units: "{0}" "{0}" "{0}"\nendian'
    yield Variant("nrrd, in mm", changed(plain, ("endian", units.format("mm"))))
    yield Variant("nrrd, in um", changed(plain, ("endian", units.format("um"))), "!spacing")
    yield Variant("nrrd, in furlong", changed(plain, ("endian", units.format("furlong"))), "!furlong")
    metres = changed(plain, ("endian", units.format("cm")))
    yield Variant("nrrd, in cm", metres, spacing=10 * SPACING, origin=10 * ORIGIN)
    unquoted = changed(plain, ("endian", "space units: cm cm cm\nendian"))
    yield Variant("nrrd, in cm without quotes", unquoted, spacing=10 * SPACING, origin=10 * ORIGIN)
    yield Variant("nrrd, a pair for a field", changed(plain, ("endian", "space units:=cm\nendian")), "!key/value pair")
    for pair in ("Space:=right-anterior-superior", "endian:=big", "Units:=HU", "type:=CT", "space units: ??? ??? ???"):
        yield Variant(f"nrrd, with {pair}", changed(plain, ("endian", f"{pair}\nendian")))
    yield Variant(
        "nrrd, a space of no body", changed(plain, ("left-posterior-superior", "3D-left-handed")), "left-handed"
    )
    ras = changed(plain, ("left-posterior-superior", "right-anterior-superior"))
    flip = np.array([-1.0, -1.0, 1.0])
    yield Variant("nrrd, RAS", ras, origin=flip * ORIGIN, direction=flip[:, None] * TURN)
    yield Variant("nrrd, space of Mars", changed(plain, ("left-posterior-superior", "mars")), "!mars")
    yield Variant("nrrd, no origin", without(plain, "space origin"), "origin", origin=np.zeros(3))
    bare = without(plain, "space", "kinds")
    yield Variant("nrrd, no space", bare, "spacing", spacing=np.ones(3), origin=np.zeros(3), direction=np.eye(3))
    for text in ("-1", "1000000000", "2", "three"):
        yield Variant(f"nrrd, dimension {text}", changed(plain, ("dimension:", text)), "!")
    for text, word in (("5 7 90", "cut short"), ("5 7 8", "holds more"), ("0 7 9", "axes"), ("5 -7 9", "axes")):
        yield Variant(f"nrrd, sizes {text}", changed(plain, ("sizes:", text)), f"!{word}")
    for text in ("hex", "lzma"):
        yield Variant(f"nrrd, encoding {text}", changed(plain, ("encoding:", text)), "!encoding")
    yield Variant("nrrd, no endian", without(plain, "endian"), "!endian")
    yield Variant(
        "nrrd, a vector of nan",
        changed(plain, ("space directions:", "(0,nan,0) (-0.5,0,0) (0,0,0.7)")),
        "!space directions",
    )
    yield from nrrd_others()


def nrrd_others() -> Iterator[Variant]:
    yield Variant("nrrd, packed and cut short", cut("a.nrrd", 20, compress=True), "!end too early")
    yield Variant("nrrd, written out", ascii_nrrd)
    yield Variant("nrrd, bzip2", packed_nrrd)
    for name in ("%s.raw", "../x.raw", "/etc/passwd"):
        yield Variant(f"nhdr, data in {name}", changed(by_itk("a.nhdr"), ("a.raw", name)), "!")
    yield Variant(
        "nrrd, 4-D, second volume", sequence("a.nrrd"), "space", values=numbered() + 1, direction=np.eye(3), item=1
    )
    for name, vectors, kinds in (
        ("colours", "(0.4,0,0) (0,0.5,0) (0,0,0.7) none", "domain domain domain RGB-color"),
        ("of volumes in between", "(0.4,0,0) none (0,0.5,0) (0,0,0.7)", "domain list domain domain"),
    ):
        four = changed(sequence("a.nrrd"), ("space directions:", vectors), ("kinds:", kinds))
        yield Variant(f"nrrd, an axis {name}", four, "!counts volumes")
    yield Variant("mha, 4-D, second volume", sequence("a.mha"), values=numbered() + 1, direction=np.eye(3), item=1)
    yield Variant(
        "nii.gz, 4-D, second volume", sequence("a.nii.gz"), values=numbered() + 1, direction=np.eye(3), item=1
    )


def sequence(name: str) -> Callable:
    def write(folder: Path) -> Path:
        both = sitk.JoinSeries([image(turn=np.eye(3)), image(numbered() + 1, turn=np.eye(3))])
        sitk.WriteImage(both, str(folder / name))
        return folder / name

    return write


def ascii_nrrd(folder: Path) -> Path:
    path = changed(by_itk("a.nrrd"), ("encoding: raw", "encoding: ascii"))(folder)
    raw = path.read_bytes()
    path.write_bytes(raw[: raw.index(b"\n\n") + 2] + " ".join(map(str, numbered().T.ravel())).encode())
    return path


def packed_nrrd(folder: Path) -> Path:
    path = changed(by_itk("a.nrrd"), ("encoding: raw", "encoding: bzip2"))(folder)
    raw = path.read_bytes()
    at = raw.index(b"\n\n") + 2
    path.write_bytes(raw[:at] + bz2.compress(raw[at:]))
    return path
