"""The scan by ITK in every format that it writes, and as MetaImage with headers that were edited."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import SimpleITK as sitk

from tests.studies.formats.base import KINDS, TURN, Variant, by_itk, changed, cut, image, numbered, without


def itk_variants() -> Iterator[Variant]:
    for suffix in ("mha", "mhd", "nrrd", "nhdr", "nii", "nii.gz", "hdr"):
        yield Variant(f"{suffix}, plain", by_itk(f"a.{suffix}"))
        for packed in (False, True) if suffix in ("mha", "mhd", "nrrd", "nhdr") else (False,):
            for kind in KINDS:
                top, read = 120 if kind in ("int8", "uint8") else 1000, "int32" if kind == "uint32" else kind
                write = by_itk(f"a.{suffix}", kind=kind, compress=packed)
                yield Variant(f"{suffix}, {'packed ' * packed}{kind}", write, values=numbered(top), kind=read)
    for angle in (3.0, 30.0):
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        turn = np.array([[1.0, 0, 0], [0, c, -s], [0, s, c]]) @ TURN
        for suffix in ("mha", "nrrd", "nii.gz"):
            yield Variant(f"{suffix}, turned by {angle:g}", by_itk(f"a.{suffix}", turn=turn), direction=turn)


def meta_variants() -> Iterator[Variant]:
    plain = by_itk("a.mha")
    yield Variant("mha, no spacing", without(plain, "ElementSpacing"), "spacing", spacing=np.ones(3))
    yield Variant("mha, no offset", without(plain, "Offset"), "origin", origin=np.zeros(3))
    yield Variant("mha, no matrix", without(plain, "TransformMatrix"), "direction", direction=np.eye(3))
    for text, word in (("0 0.5 0.7", "spacing"), ("-0.4 0.5 0.7", "spacing"), ("nan 0.5 0.7", "ElementSpacing"),
                       ("wide 0.5 0.7", "ElementSpacing"), ("0.4 0.5", "ElementSpacing"),
                       ("400 500 700", "spacing"), ("4e-4 5e-4 7e-4", "spacing")):  # fmt: skip
        yield Variant(f"mha, spacing {text}", changed(plain, ("ElementSpacing =", text)), f"!{word}")
    for text in ("-1", "1000000000", "2", "three"):
        yield Variant(f"mha, NDims = {text}", changed(plain, ("NDims =", text)), "!")
    for text, word in (("5 7 90", "cut short"), ("5 7 8", "holds more"), ("0 7 9", "axes"), ("-5 7 9", "axes"),
                       ("5000000 7 9", "axes"), ("60000 60000 60000", "GiB")):  # fmt: skip
        yield Variant(f"mha, DimSize {text}", changed(plain, ("DimSize =", text)), f"!{word}")
    for name in ("%s%n%s%n", "../a.raw", "/etc/passwd", "no.raw", "%d%d.raw"):
        yield Variant(f"mhd, data in {name}", changed(by_itk("a.mhd"), ("ElementDataFile =", name)), "!")
    yield from meta_others()


def meta_others() -> Iterator[Variant]:
    plain = by_itk("a.mha")
    yield Variant("mha, sheared", changed(plain, ("TransformMatrix =", "0 1 0 -1 0.2 0 0 0 1")), "!sheared")
    yield Variant("mha, slope 2", changed(plain, ("ElementType", "ElementToIntensityFunctionSlope = 2\nElementType")),
                  values=2 * numbered())  # fmt: skip
    for slope in ("0", "nan", "inf"):
        yield Variant(
            f"mha, slope {slope}",
            changed(plain, ("ElementType", f"ElementToIntensityFunctionSlope = {slope}\nElementType")),
            "!ElementToIntensityFunctionSlope",
        )
    um = changed(plain, ("ElementSpacing =", "400 500 700"), ("Offset =", "12000 -30000 5000"),
                 ("ElementType", "DistanceUnits = um\nElementType"))  # fmt: skip
    yield Variant("mha, in um", um)
    yield Variant("mha, colours", colours("a.mha"), "!values per voxel")
    yield Variant("mha, one slice", one_slice("a.mha"), "!one slice")
    yield Variant("mha, written out", ascii_mha)
    yield Variant("mha, big-endian", big_endian)
    yield Variant("mha, cut short", cut("a.mha", 100), "!cut short")
    yield Variant("mha, packed and cut short", cut("a.mha", 20, compress=True), "!end too early")
    yield Variant("mhd, a list of slices", sliced("LIST"))
    yield Variant("mhd, a pattern of slices", sliced("s%02d.raw 0 8 1"))


def colours(name: str) -> Callable:
    def write(folder: Path) -> Path:
        sitk.WriteImage(sitk.Compose(image(), image()), str(folder / name))
        return folder / name

    return write


def one_slice(name: str) -> Callable:
    def write(folder: Path) -> Path:
        sitk.WriteImage(image()[:, :, :1], str(folder / name))
        return folder / name

    return write


def ascii_mha(folder: Path) -> Path:
    path = changed(by_itk("a.mha"), ("BinaryData = True", "BinaryData = False"))(folder)
    raw = path.read_bytes()
    head = raw[: raw.index(b"LOCAL\n") + 6]
    path.write_bytes(head + " ".join(map(str, numbered().T.ravel())).encode())
    return path


def big_endian(folder: Path) -> Path:
    path = changed(by_itk("a.mha"), ("OrderMSB = False", "OrderMSB = True"))(folder)
    raw = path.read_bytes()
    at = raw.index(b"LOCAL\n") + 6
    path.write_bytes(raw[:at] + np.frombuffer(raw[at:], "<i2").astype(">i2").tobytes())
    return path


def sliced(text: str) -> Callable:
    def write(folder: Path) -> Path:
        names = [f"s{k:02d}.raw" for k in range(9)]
        for k, name in enumerate(names):
            (folder / name).write_bytes(numbered()[:, :, k].T.astype("<i2").tobytes())
        below = text if text != "LIST" else "LIST\n" + "\n".join(names) + "\n"
        path = changed(by_itk("a.mhd"), ("ElementDataFile = a.raw", f"ElementDataFile = {below}"))(folder)
        (folder / "a.raw").unlink()
        return path

    return write
