"""Wires that another simulator wrote, one file a frame or all in one HDF5 file. Out: LPS mm, base first.

What a file's numbers mean is stated, by the file, its format or whoever names it, and never guessed: a wire in metres
or RAS that is taken for mm and LPS is another wire. A frame without a usable wire is known as such and by its reason.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from pipeline.arrays.polyline import UNITS_MM
from pipeline.load.curves import READERS, distinct, points_in_table
from pipeline.load.geometry import LoadError, Source, refused, unusable
from pipeline.load.guard import size_of
from pipeline.load.hdf5 import inside, require_usual, require_written, text_of
from pipeline.load.order import last_counts
from pipeline.load.outside import millimetres, to_whole
from pipeline.load.stated import stated_in, stated_in_table
from pipeline.load.surfaces import RAS_TO_LPS
from pipeline.load.tables import rows_of
from pipeline.load.vtk import read_vtk_points
from pipeline.model import Array
from pipeline.status import FrameStatus
from reports.result_file import read_result
from reports.texts import UnreadableError
from solver import Status

OF_KIND = {**READERS, ".vtk": read_vtk_points}
IN_HDF5 = (".h5", ".hdf5")
KINDS = (".csv", *OF_KIND, *IN_HDF5)
MOST_POINTS = 1_000_000
"""Of one wire in a HDF5 file: a few packed kB may stand for more than there is memory."""
USUAL = {"space": "LPS", "unit": "mm"}
"""What is stated of coordinates, in the order of ``stated_in``, and what most have."""
_JUDGED = "UNDER_RESOLVED", "SELF_CONTACT", "SIMULATE_FAILED", "CURVE_UNUSABLE", "NOT_TO_DEPTH"
REFUSED = {s.identifier: s.value for s in (*Status, *map(FrameStatus.__getitem__, _JUDGED)) if s != Status.CONVERGED}
"""Sentences on wires that a run refuses, by the status of their frames; other statuses are of traces."""


@dataclass(frozen=True, eq=False)
class OtherFile:
    """A frame's wire as it was read. points_mm : (n, 3) LPS, or None where ``problem`` says why there is none.

    missing : the simulator wrote nothing for the frame.     unclear : nobody says what its numbers mean, or two say
    different things.     where : the file with its folder, empty where there is none.     unit : stated of its numbers.
    refused : status, sentence and message of a wire that its own run refused.
    """

    name: str
    points_mm: Array | None = None
    problem: str = ""
    missing: bool = False
    unclear: bool = False
    where: str = ""
    unit: str = "mm"
    refused: tuple[str, ...] = ("", "", "")


def kind_of(path: Path) -> str:
    """The ending by which a file is read; empty where it is no wire's."""
    return next((kind for kind in KINDS if path.name.lower().endswith(kind)), "")


def read_wires(files: Sequence[Source], count: int, space: str = "", unit: str = "") -> list[OtherFile]:
    """The wire of each of ``count`` frames. space, unit : of coordinates that no file states.

    Raises LoadError where it is not known which file belongs to which frame, or of no file what its numbers mean: then
    all would be wrong. A file that is missing, cannot be read or alone does not state this concerns its frame alone.
    """
    if len(files) == 1 and kind_of(files[0].path) in IN_HDF5:
        return _in_hdf5(files[0].path, count, space, unit)
    wrong = next((f.path for f in files if not kind_of(f.path)), None)
    if wrong is not None:
        raise refused(wrong, repr(wrong.suffix), ", ".join(KINDS), "export the wire in one of these")
    numbered = numbered_frames([file.path for file in files], count)
    missing = OtherFile("no file", problem="there is none for this frame", missing=True)
    read = {i: replace(_read(path, space, unit), where=str(path)) for i, path in numbered.items()}
    unclear = next((file for file in read.values() if file.unclear), None)
    if unclear and all(file.points_mm is None for file in read.values()):
        raise LoadError(f"{unclear.where}: {unclear.problem}")
    return [read.get(i, missing) for i in range(count)]


def numbered_frames(paths: Sequence[Path], count: int) -> dict[int, Path]:
    """Files by frame: by the last number in their names, counted from 0 or 1, else in the order given.

    Names of depths are in order, but which one is missing they do not tell.
    """
    found = last_counts([path.name.lower().removesuffix(kind_of(path)) for path in paths])
    numbers = [number for number in found if number is not None]
    unique = set(numbers)
    if len(unique) == len(paths) and paths:
        first = 1 if 0 not in unique and count in unique else 0
        if (0 in unique or count in unique) and unique <= set(range(first, first + count)):
            return {number - first: path for number, path in zip(numbers, paths, strict=True)}
    if len(paths) == count or not paths:
        return dict(enumerate(paths))
    if len(paths) == 1:
        kind = kind_of(paths[0])
        why = f"one {'table' if kind == '.csv' else 'file'}, {paths[0].name}, for {count} frames: a {kind} holds one"
        do = f"split it into wire_000{kind} to wire_{count - 1:03d}{kind}, or write all into one frames.h5"
        raise unusable(paths[0].parent, f"{why} frame's wire; {do} (/frames/NNN/simulated_mm)")
    shown = f"{len(paths)} files, {paths[0].name} to {paths[-1].name}, for {count} frames"
    do = f"number them from 0 to {count - 1}; an empty file stands for a frame that the simulator failed in"
    unnumbered = " (a decimal, as of a depth, is no number of a frame)" * (None in found)
    raise unusable(paths[0].parent, f"got {shown}: it is not known which belongs to which{unnumbered}; {do}")


def _in_hdf5(path: Path, count: int, space: str, unit: str) -> list[OtherFile]:
    """/frames/NNN/simulated_mm, NNN from 0, as in frames.h5: LPS mm by its layout."""
    if space not in ("", "LPS") or unit not in ("", "mm"):
        raise unusable(path, f"the layout of frames.h5 is LPS mm, stated was {space} {unit}; write CSV files instead")
    size_of(path)
    try:
        with h5py.File(path, "r") as file:
            frames = inside(file, "frames", Source(path))
            groups = _by_number(path, frames)
            held = {n: inside(group, "simulated_mm", Source(path)) for n, group in groups.items()}
            wires = {n: wire for n, wire in held.items() if wire is not None}
            require_usual(path, file, frames, *groups.values(), *wires.values())
            points = {n: _written(path, wire) for n, wire in wires.items()}
            said = {n: text_of(groups[n].attrs.get("status", "")).lower() for n in wires}
    except (OSError, KeyError, ValueError, AttributeError, TypeError, RuntimeError) as error:
        what, allowed = "no HDF5 file, or one of another layout", "/frames/NNN/simulated_mm (n, 3), NNN from 0"
        raise refused(path, what, allowed, "write it so") from error
    beyond = sorted(n for n in groups if not 0 <= n < count)
    if beyond:
        raise unusable(path, f"got frame {beyond[0]} for {count} frames; number them from 0 to {count - 1}")
    missing = OtherFile(path.name, problem="it has no simulated_mm for this frame", missing=True)
    read = {n: replace(_checked(f"{path.name}#{n}", wire), where=f"{path}#{n}") for n, wire in points.items()}
    own = {n: (s, REFUSED[s], "") for n, s in said.items() if s in REFUSED} | _refused_beside(path)
    found = {n: replace(file, refused=own.get(n, file.refused)) for n, file in read.items()}
    return [found.get(n, missing) for n in range(count)]


def _refused_beside(wires: Path) -> dict[int, tuple[str, ...]]:
    """By number the frames whose simulation failed in the run that wrote these wires, and why; by no other file."""
    frames, why = _beside(wires).get("frames", []), ("status", "sentence", "message")
    return {f["frame"]: tuple(f.get(key) or "" for key in why) for f in frames if f.get("stage") == "simulate"}


def warned_beside(files: Sequence[Source]) -> list[str]:
    """What the run that wrote these wires was warned of them; nothing for wires of another origin."""
    return list(_beside(files[0].path).get("warnings_of_wires", ())) if len(files) == 1 else []


def result_beside(files: Sequence[Source]) -> Path | None:
    """Where the result of the run lies that wrote these wires, from which statuses and warnings are taken."""
    return files[0].path.with_name("result.json") if len(files) == 1 and files[0].path.name == "frames.h5" else None


def _beside(wires: Path) -> dict[str, Any]:
    """The result of the run that wrote these wires; empty for any other file."""
    path = result_beside([Source(wires)])
    try:
        return {} if path is None else read_result(path)
    except UnreadableError as error:
        raise LoadError(str(error)) from None


def _by_number(path: Path, frames: h5py.Group) -> dict[int, h5py.Group]:
    """The groups of frames by their numbers; LoadError where two have one number, as 1 and 001."""
    groups = {to_whole(name): inside(frames, name, Source(path)) for name in frames}
    if len(groups) < len(frames):
        got = f"{len(frames)} groups of {len(groups)} numbers"
        raise unusable(path, f"got {got} below /frames; allowed: one of each number; remove the others")
    return groups


def _written(path: Path, data: h5py.Dataset) -> Array:
    """The points of a dataset; TypeError where they are no numbers, LoadError where some were never written."""
    if data.dtype.kind not in "iuf":
        raise TypeError(f"{data.name} holds {data.dtype}")
    if data.size > 3 * MOST_POINTS:
        got = f"{data.name}: {data.size // 3} points; allowed: {MOST_POINTS}, one each µm of a metre"
        raise unusable(path, f"{got}; write fewer, a few each mm")
    if data.size:
        require_written(path, data)
    return np.array(data, float)


def _read(path: Path, space: str, unit: str) -> OtherFile:
    """One file."""
    if not path.exists() or (path.is_file() and path.stat().st_size == 0):
        return OtherFile(path.name, problem="the file is empty, or not there", missing=True)
    kind = kind_of(path)
    try:
        table = rows_of(path) if kind == ".csv" else None
        points = OF_KIND[kind](path) if table is None else points_in_table(path, table[0])
    except (LoadError, ValueError, TypeError, KeyError, IndexError) as error:
        return OtherFile(path.name, problem=str(error).removeprefix(f"{path}: "))
    try:
        own = stated_in(path, kind) if table is None else stated_in_table(path, *table)
        in_space, in_unit = _agreed(path, own, (space, unit))
    except LoadError as error:
        return OtherFile(path.name, problem=str(error).removeprefix(f"{path}: "), unclear=True)
    # all readers but that of tables convert a file that states RAS by themselves
    turned = in_space == "RAS" and (table is not None or not own[0])
    factor = 1.0 if kind == ".mrk.json" else millimetres(path, in_unit)  # the reader of .mrk.json converts units itself
    return replace(_checked(path.name, points * factor * (RAS_TO_LPS if turned else 1.0)), unit=in_unit)


def _agreed(path: Path, by_file: tuple[str, str], by_caller: tuple[str, str]) -> tuple[str, str]:
    """Space and unit of a file, as it or the caller states them; LoadError where neither does, or they differ."""
    own, given = (dict(zip(USUAL, stated, strict=True)) for stated in (by_file, by_caller))
    for what in USUAL:
        said, typed = (UNITS_MM.get(value, value) for value in (own[what], given[what]))
        if said and typed and said != typed:
            raise unusable(path, f"{what}: the file says {own[what]}, stated was {given[what]}; correct one of them")
    agreed = {what: own[what] or given[what] for what in USUAL}
    if missing := [what for what in USUAL if not agreed[what]]:
        raise unusable(path, _unstated(missing, kind_of(path)))
    millimetres(path, agreed["unit"])
    return agreed["space"], agreed["unit"]


def _unstated(missing: Sequence[str], kind: str) -> str:
    """What to do where space, unit or both are not stated."""
    are = f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} not stated and will not be guessed"
    say = " ".join(f"--{what} {USUAL[what]}" for what in missing)
    keys = ", ".join(f"{what} = {USUAL[what]!r}" for what in missing)
    lines = " and ".join(f"'# {what}: {USUAL[what]}'" for what in missing)
    also = f"; or write {lines} above the table; columns x_mm, y_mm, z_mm say LPS mm" * (kind == ".csv")
    return f"{are}; say {keys} in the manifest's simulated, or {say} to `wireval score`{also}"


def _checked(name: str, points: Array) -> OtherFile:
    """The points without repeats (nodes that wait at the introducer); a problem where they are no curve."""
    if points.ndim != 2 or points.shape[1:] != (3,):
        return OtherFile(name, problem=f"got an array of shape {points.shape}; expected points (n, 3)")
    bad = np.flatnonzero(~np.all(np.isfinite(points), axis=1))
    if len(bad):
        return OtherFile(
            name, problem=f"{len(bad)} of {len(points)} points are NaN or infinite, the first is point {bad[0]}"
        )
    points = distinct(points)
    if len(points) < 2:
        return OtherFile(name, problem=f"got {len(points)} different points; a wire has two or more")
    return OtherFile(name, points)
