"""The scan as a dataset of an HDF5 file, alone, in a group and behind links."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import h5py
import numpy as np

from pipeline.load import Source
from tests.studies.formats.base import KINDS, ORIGIN, SPACING, TURN, Variant, numbered


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
    empty = h5py.Empty("f8")
    for name, allowed in (("spacing_mm", "3 numbers"), ("direction", "9 numbers"), ("axes", "'z,y,x' or 'x,y,z'")):
        said = f"!/volume has an empty attribute {name}; allowed: {allowed}"
        yield Variant(f"h5, empty {name}", hdf5(**{name: empty}), said)
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
