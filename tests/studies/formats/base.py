"""The scan that every variant of the format study holds, and what is to be read of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray

from pipeline.load import LoadError, Source, each_volume, load, read_header
from pipeline.load.config import LoadConfig

SPACING, ORIGIN = np.array([0.4, 0.5, 0.7]), np.array([12.0, -30.0, 5.0])
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
SHAPE = (5, 7, 9)
KINDS = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64")
Values = NDArray[np.int64]


def numbered(top: int = 1000) -> Values:
    """values[x, y, z] = x + 10 y + 100 z: any swap of axes, any shift by a voxel shows."""
    x, y, z = np.meshgrid(*map(np.arange, SHAPE), indexing="ij")
    return np.asarray(x + 10 * y + 100 * z) % top


@dataclass(frozen=True)
class Variant:
    """One way to write the scan.

    write : fills a folder and says what to open.     want : "right", a word of the note that must be there, or
    "!word" of the sentence with which it must be refused.     kind : of the grey values that are to be read.
    """

    name: str
    write: Callable[[Path], Path | Source]
    want: str = "right"
    values: Values | None = None
    spacing: NDArray[np.float64] | None = None
    origin: NDArray[np.float64] | None = None
    direction: NDArray[np.float64] | None = None
    item: int | None = None
    kind: str = ""


BOX = ((1, 2, 3), (4, 6, 8))


def outcome(variant: Variant, folder: Path) -> str:
    """right, noted, refused, or wrong with what is."""
    made = variant.write(folder)
    source = made if isinstance(made, Source) else Source(made)
    try:
        header = read_header(source, LoadConfig())
        if variant.item is not None:
            header = list(each_volume(header))[variant.item]
        volume, crop = load(header), load(header, BOX)
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
    inner = volume.crop(*BOX)
    if not np.array_equal(crop.values, inner.values) or not np.allclose(crop.origin_mm, inner.origin_mm):
        wrong.append("a crop")
    if variant.kind and {volume.values.dtype, crop.values.dtype} != {np.dtype(variant.kind)}:
        wrong.append(f"grey values of {volume.values.dtype}")
    if not (volume.values.flags.f_contiguous and crop.values.flags.f_contiguous):
        wrong.append("another order in memory")  # stages sample voxels in it: sigma was 4 % larger in the other
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


def cut(name: str, count: int, *, compress: bool = False) -> Callable:
    def write(folder: Path) -> Path:
        path = by_itk(name, compress=compress)(folder)
        path.write_bytes(path.read_bytes()[:-count])
        return path

    return write
