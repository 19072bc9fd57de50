"""The scan of the format study as DICOM, written by pydicom."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.uid import ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian, RLELossless

from tests.pipeline.enhanced_dicom import enhanced
from tests.studies.formats.base import ORIGIN, SPACING, Variant, numbered

CT, XA = "1.2.840.10008.5.1.4.1.1.2", "1.2.840.10008.5.1.4.1.1.12.1"
VALUES = numbered()
Made = tuple[str, Callable[[Path], Any], str, dict[str, Any]]
"""(name, what writes it, what is wanted, what differs from the scan)."""


def one(values: np.ndarray, position: Any, syntax: str, **tags: Any) -> FileDataset:
    """A slice values[x, y]."""
    meta = FileMetaDataset()
    meta.TransferSyntaxUID, meta.MediaStorageSOPClassUID = syntax, CT
    meta.MediaStorageSOPInstanceUID = f"1.2.3.{abs(hash(str(position))) % 10**8}"
    order = {"is_implicit_VR": syntax == ImplicitVRLittleEndian, "is_little_endian": syntax != ExplicitVRBigEndian}
    data = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128, **order)
    said = {
        "SOPClassUID": CT, "SOPInstanceUID": meta.MediaStorageSOPInstanceUID, "SeriesInstanceUID": "1.2.3",
        "Modality": "CT", "Rows": values.shape[1], "Columns": values.shape[0], "BitsAllocated": 16, "BitsStored": 16,
        "HighBit": 15, "PixelRepresentation": 1, "SamplesPerPixel": 1, "PhotometricInterpretation": "MONOCHROME2",
        "ImagePositionPatient": [f"{v:.6g}" for v in position] if position is not None else None,
        "ImageOrientationPatient": [1, 0, 0, 0, 1, 0], "PixelSpacing": [0.5, 0.4],
    } | tags  # fmt: skip
    for name, value in said.items():
        if value is not None:
            setattr(data, name, value)
    kind = ("<", ">")[syntax == ExplicitVRBigEndian] + ("u2", "i2")[data.PixelRepresentation]
    data.PixelData = np.ascontiguousarray(values.T).astype(kind).tobytes()
    return data


def series(
    name: str = "{k}.dcm",
    *,
    place: Callable[[int], Any] = lambda k: ORIGIN + [0, 0, 0.7 * k],
    of: Callable[[int], dict[str, Any]] = lambda _k: {},
    values: np.ndarray = VALUES,
    syntax: str = ExplicitVRLittleEndian,
    skip: tuple[int, ...] = (),
    finish: Callable[[FileDataset], Any] = lambda _data: None,
    **tags: Any,
) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        for k in range(values.shape[2]):
            if k not in skip:
                tags_of = {"InstanceNumber": k + 1} | tags | of(k)
                data = one(values[:, :, k], place(k), syntax, **tags_of)
                finish(data)
                data.save_as(folder / name.format(k=(7 * k) % 11))
        return folder

    return write


def dicom_variants() -> Iterator[Variant]:
    for make in (of_values, of_packed_values, of_stored_bits, of_places, of_tags, of_whole_files, of_folders):
        for name, write, want, more in make():
            yield Variant(name, write, want, **({"direction": np.eye(3)} | more))


def of_values() -> Iterator[Made]:
    for syntax in (ImplicitVRLittleEndian, ExplicitVRLittleEndian, ExplicitVRBigEndian):
        yield f"dicom, {syntax.name}", series(syntax=syntax), "right", {}
    yield "dicom, no suffixes", series("IM{k}"), "right", {}
    rescaled = {"RescaleSlope": 2, "RescaleIntercept": -1024}
    yield "dicom, slope and intercept", series(**rescaled), "right", {"values": 2 * VALUES - 1024}
    yield "dicom, a slope of its own a slice", series(of=lambda k: {"RescaleSlope": k + 1, "RescaleIntercept": 0}), \
        "right", {"values": VALUES * (1 + np.arange(9))}  # fmt: skip
    yield "dicom, 12 of 16 bits", series(BitsStored=12, HighBit=11, PixelRepresentation=0), "right", {}
    odd = VALUES + 0xF000
    yield "dicom, overlay in the upper bits", series(values=odd, BitsStored=12, HighBit=11, PixelRepresentation=0), \
        "right", {}  # fmt: skip
    turned = {"PhotometricInterpretation": "MONOCHROME1", "Modality": "XA", "PixelRepresentation": 0}
    yield "dicom, MONOCHROME1", series(BitsStored=12, HighBit=11, **turned), "MONOCHROME1", {"values": 4095 - VALUES}
    yield "dicom, colours", series(PhotometricInterpretation="RGB"), "!grey values", {}


def of_packed_values() -> Iterator[Made]:
    """The same values as of unpacked slices, whatever ITK makes of the elements that say how to take them."""
    even = np.pad(VALUES, ((0, 3), (0, 1), (0, 0)))  # GDCM refuses tinier planes

    def packed(**more: Any) -> Callable[[Path], Path]:
        return series(**{"values": even, "finish": lambda data: data.compress(RLELossless)} | more)

    yield "dicom, RLE", packed(), "right", {"values": even}
    turned = {"PhotometricInterpretation": "MONOCHROME1", "PixelRepresentation": 0, "BitsStored": 12, "HighBit": 11}
    yield "dicom, RLE, MONOCHROME1 of a CT", packed(**turned), "right", {"values": even}
    yield "dicom, RLE, MONOCHROME1", packed(**turned, Modality="XA"), "MONOCHROME1", {"values": 4095 - even}
    slopes = 1 + 99 * (np.arange(9) > 0)
    own = packed(of=lambda k: {"RescaleSlope": slopes[k], "RescaleIntercept": 0})
    yield "dicom, RLE, a slope of its own a slice", own, "right", {"values": even * slopes}
    for high in (15, 13):
        kept = {"values": even << (high - 11), "BitsStored": 12, "HighBit": high, "PixelRepresentation": 0}
        yield f"dicom, RLE, 12 bits up to bit {high}", packed(**kept), "right", {"values": even}


def of_stored_bits() -> Iterator[Made]:
    def with_table(data: FileDataset) -> None:
        table = Dataset()
        table.LUTDescriptor, table.ModalityLUTType, table.LUTData = (
            [1024, 0, 16],
            "US",
            np.arange(1023, -1, -1).astype("<u2").tobytes(),
        )
        data.ModalityLUTSequence = [table]

    yield "dicom, a modality LUT", series(finish=with_table, PixelRepresentation=0), "!modality LUT applied", {}
    small = VALUES % 200

    def as_words(data: FileDataset, k: int) -> None:
        plane = np.pad(np.ascontiguousarray(small[:, :, k].T).astype("u1").ravel(), (0, 1))
        data.PixelData = plane.reshape(-1, 2)[:, ::-1].tobytes()
        data["PixelData"].VR = "OW"

    short = {"BitsAllocated": 8, "BitsStored": 8, "HighBit": 7, "PixelRepresentation": 0}
    words = series(syntax=ExplicitVRBigEndian, finish=lambda data: as_words(data, data.InstanceNumber - 1), **short)
    yield "dicom, 8 bits as words in big endian", words, "!explicit big endian", {}


def of_places() -> Iterator[Made]:
    yield "dicom, a slice missing", series(skip=(4,)), "!missing slices: 1 of 7 gaps differ from 0.700 mm", {}
    yield "dicom, a slice twice", series(place=lambda k: ORIGIN + [0, 0, 0.7 * (k - (k == 4))]), "!repeated", {}
    yield "dicom, tilted", series(place=lambda k: ORIGIN + [0, 0.5 * k, 0.7 * k]), "!gantry tilt", {}
    long = np.repeat(VALUES, 15, axis=2)
    slow = series("{k}.dcm", place=lambda k: ORIGIN + [0, 0.03 * k, 0.3 * k], values=VALUES)
    yield "dicom, tilted by 5.7 degrees, short", slow, "right", {"spacing": np.array([0.4, 0.5, 0.3])}

    def lean(folder: Path) -> Path:
        for k in range(long.shape[2]):
            place = ORIGIN + np.array([0, 0.03 * k, 0.3 * k])
            one(long[:, :, k], place, ExplicitVRLittleEndian, InstanceNumber=k + 1).save_as(folder / f"{k}.dcm")
        return folder

    yield "dicom, tilted by 5.7 degrees, long", lean, "!gantry tilt", {}
    rounded = series(place=lambda k: ORIGIN + [0, 0, round(0.267 * k, 2)])
    yield "dicom, 0.267 mm written with two decimals", rounded, "right", \
        {"spacing": np.array([0.4, 0.5, round(0.267 * 8, 2) / 8])}  # fmt: skip
    jitter = series(of=lambda k: {"ImageOrientationPatient": [1, 2e-5 * (k % 2), 0, -2e-5 * (k % 2), 1, 0]})
    yield "dicom, orientation jitter of 2e-5", jitter, "right", {}


def of_tags() -> Iterator[Made]:
    mixed = series(of=lambda k: {"ImageOrientationPatient": [1, 0, 0, 0, 0, 1] if k == 3 else [1, 0, 0, 0, 1, 0]})
    yield "dicom, a scout among the slices", mixed, "!orientation", {}
    other = series(of=lambda k: {"SeriesInstanceUID": f"1.2.{3 + (k > 4)}"})
    yield "dicom, two series", other, "!found 2 DICOM image series", {}
    for tag in ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing"):
        yield (
            f"dicom, no {tag}",
            series(**{tag: None}) if tag != "ImagePositionPatient" else series(place=lambda _k: None),
            f"!{tag}",
            {},
        )
    long = series(ImageOrientationPatient=[2, 0, 0, 0, 2, 0])
    yield "dicom, orientation vectors of length 2", long, "!ImageOrientationPatient", {}
    yield "dicom, pixel spacing 0", series(PixelSpacing=[0, 0]), "!spacing", {}
    yield "dicom, pixel spacing -0.4", series(PixelSpacing=[-0.5, -0.4]), "!spacing", {}
    yield "dicom, more rows than pixels", series(Rows=700), "!cut short", {}
    yield "dicom, one slice", series(values=VALUES[:, :, :1]), "!single slice", {}


def of_whole_files() -> Iterator[Made]:
    def run(folder: Path) -> Path:
        whole = one(VALUES[:, :, 0], None, ExplicitVRLittleEndian, NumberOfFrames=9, SOPClassUID=XA, Modality="XA")
        whole.PixelData = np.ascontiguousarray(VALUES.T).astype("<i2").tobytes()
        whole.save_as(folder / "run.dcm")
        return folder / "run.dcm"

    yield "dicom, a 2-D rotational run", run, "!projections", {}

    def whole(folder: Path) -> Path:
        places = [tuple(ORIGIN + [0, 0, 0.7 * k]) for k in range(9)]
        (folder / "e.dcm").write_bytes(enhanced(VALUES, SPACING, places))
        return folder / "e.dcm"

    yield "dicom, enhanced", whole, "right", {}
    yield "dicom, enhanced, no suffix", lambda f: whole(f).rename(f / "e"), "right", {}


def of_folders() -> Iterator[Made]:
    def beside(folder: Path) -> Path:
        series()(folder)
        (folder / "notes.txt").write_text("read me", encoding="utf-8")
        report = Dataset()
        report.SOPClassUID, report.SOPInstanceUID = "1.2.840.10008.5.1.4.1.1.88.11", "1.2.9"
        report.file_meta = FileMetaDataset()
        report.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
        report.save_as(folder / "report.dcm", enforce_file_format=True)
        return folder

    yield "dicom, with notes and a report", beside, "right", {}
