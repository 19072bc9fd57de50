"""Every way in which a scan may lie in files: ``python -m tests.studies.formats`` (make formats).

One small scan, known in mm and grey, is written in many variants, by SimpleITK, h5py, pydicom or byte by byte. Each is
to be read right, read right with a note of what was assumed, or refused with a sentence that names the trouble. The
last column, *wrong and silent*, is to be 0.
"""

from __future__ import annotations

import gzip
import struct
import sys
import tempfile
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray

from pipeline.load import LoadError, Source, each_volume, load, read_header
from pipeline.load.config import LoadConfig
from tests.pipeline.enhanced_dicom import enhanced
from tests.studies.format_dicom import dicom_variants

SPACING, ORIGIN = np.array([0.4, 0.5, 0.7]), np.array([12.0, -30.0, 5.0])
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
SHAPE = (5, 7, 9)
Values = NDArray[np.int64]


def numbered(top: int = 1000) -> Values:
    """values[x, y, z] = x + 10 y + 100 z: any swap of axes, any shift by a voxel shows."""
    x, y, z = np.meshgrid(*map(np.arange, SHAPE), indexing="ij")
    return np.asarray(x + 10 * y + 100 * z) % top


@dataclass(frozen=True)
class Variant:
    """One way to write the scan.

    write : fills a folder and says what to open.     want : "right", a word of the note that must be there, or
    "!word" of the sentence with which it must be refused.
    """

    name: str
    write: Callable[[Path], Path | Source]
    want: str = "right"
    values: Values | None = None
    spacing: NDArray[np.float64] | None = None
    origin: NDArray[np.float64] | None = None
    direction: NDArray[np.float64] | None = None
    item: int | None = None


def outcome(variant: Variant, folder: Path) -> str:
    """right, noted, refused, or wrong with what is."""
    made = variant.write(folder)
    source = made if isinstance(made, Source) else Source(made)
    try:
        header = read_header(source, LoadConfig())
        if variant.item is not None:
            header = list(each_volume(header))[variant.item]
        volume = load(header)
    except LoadError as error:
        word = variant.want.removeprefix("!")
        refused = variant.want.startswith("!") and word in str(error)
        return "refused" if refused else f"wrong: refused with {str(error)[:160]!r}"
    if variant.want.startswith("!"):
        return f"wrong: read, not refused for {variant.want[1:]}"
    want = numbered() if variant.values is None else variant.values
    pairs = {
        "spacing": (volume.spacing_mm, SPACING if variant.spacing is None else variant.spacing),
        "origin": (volume.origin_mm, ORIGIN if variant.origin is None else variant.origin),
        "direction": (volume.direction, TURN if variant.direction is None else variant.direction),
    }
    wrong = [f"{name} {got}" for name, (got, right) in pairs.items() if not np.allclose(got, right, atol=2e-5)]
    if volume.values.shape != want.shape or not np.allclose(volume.values, want, atol=1e-3):
        wrong.append("grey values")
    noted = any(variant.want in note for note in volume.assumed)
    if variant.want == "right" and any("assumed" in note for note in volume.assumed):
        wrong.append(f"a note: {volume.assumed}")
    if variant.want != "right" and not noted:
        wrong.append(f"no note of {variant.want!r}")
    return f"wrong: {'; '.join(wrong)}" if wrong else "right" if variant.want == "right" else "noted"


def image(values: Values | None = None, kind: str = "int16", turn: NDArray[np.float64] = TURN) -> sitk.Image:
    found = sitk.GetImageFromArray(np.ascontiguousarray((numbered() if values is None else values).astype(kind).T))
    found.SetSpacing(SPACING.tolist())
    found.SetOrigin(ORIGIN.tolist())
    found.SetDirection(turn.ravel().tolist())
    return found


def by_itk(name: str, *, compress: bool = False, kind: str = "int16", turn: NDArray[np.float64] = TURN) -> Callable:
    def write(folder: Path) -> Path:
        top = 120 if kind in ("int8", "uint8") else 1000
        sitk.WriteImage(image(numbered(top), kind, turn), str(folder / name), useCompression=compress)
        return folder / name

    return write


def changed(write: Callable[[Path], Path], *pairs: tuple[str, str]) -> Callable:
    """A text header with parts of it replaced (after "key =" or "key:" the rest of the line); they must be there."""

    def change(folder: Path) -> Path:
        path = write(folder)
        raw = path.read_bytes()
        for old, new in pairs:
            assert old.encode() in raw, (old, raw[:400])
            if old.endswith(("=", ":")):
                at = raw.index(old.encode()) + len(old)
                raw = raw[:at] + b" " + new.encode() + raw[raw.index(b"\n", at) :]
            else:
                raw = raw.replace(old.encode(), new.encode(), 1)
        path.write_bytes(raw)
        return path

    return change


def without(write: Callable[[Path], Path], *keys: str) -> Callable:
    """A text header without the lines of these keys."""

    def change(folder: Path) -> Path:
        path = write(folder)
        lines = path.read_bytes().split(b"\n")
        path.write_bytes(b"\n".join(line for line in lines if not line.startswith(tuple(k.encode() for k in keys))))
        return path

    return change


KINDS = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64")


def itk_variants() -> Iterator[Variant]:
    for suffix in ("mha", "mhd", "nrrd", "nhdr", "nii", "nii.gz", "hdr"):
        yield Variant(f"{suffix}, plain", by_itk(f"a.{suffix}"))
        for kind in KINDS:
            top = 120 if kind in ("int8", "uint8") else 1000
            yield Variant(f"{suffix}, {kind}", by_itk(f"a.{suffix}", kind=kind), values=numbered(top))
    for suffix in ("mha", "mhd", "nrrd", "nhdr"):
        yield Variant(f"{suffix}, packed", by_itk(f"a.{suffix}", compress=True))
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
    yield Variant("mha, sheared", changed(plain, ("TransformMatrix =", "0 1 0 -1 0.2 0 0 0 1")), "!sheared")
    yield Variant("mha, slope 2", changed(plain, ("ElementType", "ElementToIntensityFunctionSlope = 2\nElementType")),
                  values=2 * numbered())  # fmt: skip
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


def cut(name: str, count: int, *, compress: bool = False) -> Callable:
    def write(folder: Path) -> Path:
        path = by_itk(name, compress=compress)(folder)
        path.write_bytes(path.read_bytes()[:-count])
        return path

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


def nrrd_variants() -> Iterator[Variant]:
    plain = by_itk("a.nrrd")
    units = 'space units: "{0}" "{0}" "{0}"\nendian'
    yield Variant("nrrd, in mm", changed(plain, ("endian", units.format("mm"))))
    yield Variant("nrrd, in um", changed(plain, ("endian", units.format("um"))), "!spacing")
    yield Variant("nrrd, in furlong", changed(plain, ("endian", units.format("furlong"))), "!furlong")
    metres = changed(plain, ("endian", units.format("cm")))
    yield Variant("nrrd, in cm", metres, spacing=10 * SPACING, origin=10 * ORIGIN)
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
    yield Variant("nrrd, packed and cut short", cut("a.nrrd", 20, compress=True), "!end too early")
    yield Variant("nrrd, written out", ascii_nrrd)
    yield Variant("nrrd, bzip2", packed_nrrd)
    for name in ("%s.raw", "../x.raw", "/etc/passwd"):
        yield Variant(f"nhdr, data in {name}", changed(by_itk("a.nhdr"), ("a.raw", name)), "!")
    yield Variant(
        "nrrd, 4-D, second volume", sequence("a.nrrd"), "space", values=numbered() + 1, direction=np.eye(3), item=1
    )
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
    import bz2

    path = changed(by_itk("a.nrrd"), ("encoding: raw", "encoding: bzip2"))(folder)
    raw = path.read_bytes()
    at = raw.index(b"\n\n") + 2
    path.write_bytes(raw[:at] + bz2.compress(raw[at:]))
    return path


def nifti(*fields: tuple[int, str, object], packed: bool = False, big: bool = False) -> Callable:
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


FORMS, QFORM, SFORM, UNITS, PIXDIM, SLOPE, DIM, SROW = 252, 252, 254, 123, 76, 112, 40, 280


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
    yield Variant("nii, no unit", nifti((UNITS, "B", 0)), "unit")
    m = nifti((UNITS, "B", 1))
    yield Variant("nii, in metres", m, "!spacing")
    yield Variant("nii, in um", nifti((UNITS, "B", 3)), "!spacing")
    yield Variant("nii, unit 7", nifti((UNITS, "B", 7)), "!unit")
    yield Variant("nii, slope 2 and intercept -5", nifti((SLOPE, "ff", (2.0, -5.0))), values=2 * numbered() - 5)
    yield Variant("nii, slope 0.5", nifti((SLOPE, "ff", (0.5, 0.0))), values=numbered() / 2)
    yield Variant("nii, slope nan", nifti((SLOPE, "ff", (float("nan"), 0.0))))
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


def hdf5(name: str = "/volume", **attributes: object) -> Callable:
    kind = str(attributes.pop("kind", "int16"))
    shape = attributes.pop("shape", None)

    def write(folder: Path) -> Source:
        with h5py.File(folder / "s.h5", "w") as file:
            if shape:
                data = file.create_dataset(name, shape, kind, chunks=(64,) * 3)
            else:
                data = file.create_dataset(name, data=numbered().T.astype(kind))
            said = {"spacing_mm": SPACING, "origin_mm": ORIGIN, "direction": TURN} | attributes
            for key, value in said.items():
                if value is not None:
                    data.attrs[key] = value
        return Source(folder / "s.h5", name)

    return write


def hdf5_variants() -> Iterator[Variant]:
    yield Variant("h5, plain", hdf5())
    for kind in (*KINDS, ">i2", ">f4", "f2", "i8", "u8"):
        top = 120 if kind in ("int8", "uint8") else 1000
        yield Variant(f"h5, {kind}", hdf5(kind=kind), values=numbered() if top == 1000 else numbered().astype(kind))
    for value in (0.5, [0.4, 0.5], "wide", [0.4, 0.5, -0.7], [0.0, 0.5, 0.7], [np.nan, 0.5, 0.7], None):
        yield Variant(f"h5, spacing {value}", hdf5(spacing_mm=value), "!spacing")
    yield Variant("h5, no origin", hdf5(origin_mm=None), "origin", origin=np.zeros(3))
    yield Variant("h5, no direction", hdf5(direction=None), "direction", direction=np.eye(3))
    yield Variant("h5, sheared", hdf5(direction=TURN + [[0, 0, 0.3], [0, 0, 0], [0, 0, 0]]), "!sheared")
    yield Variant("h5, origin nan", hdf5(origin_mm=[np.nan, 0, 0]), "!origin")
    yield Variant("h5, origin of a text", hdf5(origin_mm="here"), "!origin")
    yield Variant("h5, 1 TB and nothing in it", hdf5(shape=(10000, 10000, 5000), kind="int16"), "!GiB")
    yield Variant("h5, 1 GB and nothing in it", hdf5(shape=(1000, 1000, 500), kind="int16"), "!ever written")
    yield Variant("h5, a text", hdf5(kind="S4"), "!numbers")
    yield Variant("h5, complex", hdf5(kind="c8"), "!numbers")
    yield Variant("h5, group out of order", grouped, values=numbered() + 2, item=2)
    yield Variant("h5, group of two geometries", lambda f: grouped(f, shift=1.0), "!geometry differs")
    yield Variant("h5, a link into another file", linked, "!another file")
    yield Variant("h5, a link to a link into another file", linked_twice, "!another file")


def grouped(folder: Path, shift: float = 0.0) -> Source:
    with h5py.File(folder / "s.h5", "w") as file:
        for i in (0, 1, 10, 11, 2):
            data = file.create_dataset(f"frames/{i}", data=numbered().T.astype("i2") + i)
            data.attrs.update(spacing_mm=SPACING, origin_mm=ORIGIN + shift * (i == 10), direction=TURN)
    return Source(folder / "s.h5", "/frames")


def linked(folder: Path) -> Source:
    hdf5()(folder)
    with h5py.File(folder / "t.h5", "w") as file:
        file["volume"] = h5py.ExternalLink("s.h5", "/volume")
    return Source(folder / "t.h5", "/volume")


def linked_twice(folder: Path) -> Source:
    hdf5()(folder)
    with h5py.File(folder / "t.h5", "w") as file:
        file["away"] = h5py.ExternalLink("s.h5", "/volume")
        file["volume"] = h5py.SoftLink("/away")
    return Source(folder / "t.h5", "/volume")


def other_variants() -> Iterator[Variant]:
    yield Variant("gipl, by ITK", by_itk("a.gipl", turn=np.eye(3)), "ITK", direction=np.eye(3))
    yield Variant("vtk, by ITK", by_itk("a.vtk", turn=np.eye(3)), "ITK", direction=np.eye(3))
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


FULL = False
"""Whether the bomb is a real one: 20 s to pack; its header and length are judged alike."""


def variants() -> list[Variant]:
    from tests.studies.format_contradictions import contradictions

    each = (contradictions, itk_variants, meta_variants, nrrd_variants, nifti_variants, hdf5_variants, other_variants)
    found = [variant for make in each for variant in make()]
    for name, write, want, more in dicom_variants(enhanced, numbered(), SPACING, ORIGIN):
        found.append(Variant(name, write, want, **({"direction": np.eye(3)} | more)))
    return found


def main() -> int:
    """Print the table; exit 1 where a variant is wrong."""
    table: Counter[tuple[str, str]] = Counter()
    for variant in variants():
        with tempfile.TemporaryDirectory() as folder:
            found = outcome(variant, Path(folder))
        if found.startswith("wrong"):
            print(f"{variant.name}: {found}")
        table[variant.name.split(",")[0], found.split(":")[0]] += 1
    columns = ("right", "noted", "refused", "wrong")
    print(f"{'format':28s}" + "".join(f"{c:>10s}" for c in columns))
    for kind in dict.fromkeys(kind for kind, _ in table):
        print(f"{kind:28s}" + "".join(f"{table[kind, c]:10d}" for c in columns))
    totals = [sum(n for (_, c), n in table.items() if c == column) for column in columns]
    print(f"{'all ' + str(sum(totals)):28s}" + "".join(f"{n:10d}" for n in totals))
    return int(totals[-1] > 0)


if __name__ == "__main__":
    sys.exit(main())
