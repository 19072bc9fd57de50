"""What is wrong with the user's own lumen before anything is computed: it cannot be read, or lies off the entry."""

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from pipeline.arrays.grids import around, corners_mm
from pipeline.load import Header, LoadError, Source, parts_of
from pipeline.load.lumens import LOOK_AT, meant_within_mm, read_lumen
from pipeline.load.masks import mask_header
from pipeline.model import Array, Branches, Shapes, Volume
from pipeline.simulate.others import readings
from pipeline.study.manifest import Case
from pipeline.study.sources import State, state_of
from solver.grid import Grid

WHOLE = 1e-6
"""How far from a whole number a voxel's may be, as written."""
NEAR_MM = 20.0
"""An entry further than this from the box of the own lumen was not meant for it."""
MOST_VOXELS = 400**3
"""Voxels of a label map up to which they are read, in half a second; of a larger one the header alone is."""


def lumen_problems(case: Case, lumen: Source, least_voxels: int) -> Sequence[str]:
    """What is wrong with a lumen; in a case that was found by its run alone, all others were computed before."""
    try:
        files = lumen.path, *parts_of(lumen.path)
    except LoadError as error:
        return [str(error)]
    return _problems(_At(tuple(case.entry_mm), case.entry_sigma_mm), lumen, least_voxels, tuple(map(state_of, files)))


class _At(NamedTuple):
    """What of a case a lumen is held against."""

    entry_mm: tuple[float, ...]
    entry_sigma_mm: float | None


@cache
def _problems(case: _At, lumen: Source, least_voxels: int, _states: tuple[State | None, ...]) -> tuple[str, ...]:
    """Kept as long as the lumen's files stay as they are: `score` asks for each simulator, half a second each time."""
    return tuple(_found(case, lumen, least_voxels))


def _found(case: _At, lumen: Source, least_voxels: int) -> Iterator[str]:
    try:
        found = _read(lumen, least_voxels)
    except LoadError as error:
        yield str(error)
        return
    ends = _ends_mm(found)
    low, high = ends.min(axis=0), ends.max(axis=0)

    def away_mm(point: ArrayLike) -> float:
        return float(np.linalg.norm(np.maximum(np.maximum(low - point, np.asarray(point) - high), 0.0)))

    away = away_mm(case.entry_mm)
    if away > NEAR_MM:
        fits = fitting(case.entry_mm, lambda point: away_mm(point) == 0.0)
        do = fits or "is one of them in RAS, or in another unit than mm?"
        yield f"{lumen}: {_entry(case)} lies {away:.0f} mm from the lumen, which spans {_box(low, high)}; {do}"
    elif isinstance(found, Volume):
        within = meant_within_mm(float(np.max(found.spacing_mm)), case.entry_sigma_mm)
        if not _any_near(found, np.array(case.entry_mm), within):
            yield (
                f"{lumen}: {_entry(case)} has no voxel of the lumen within {within:.1f} mm, which spans "
                f"{_box(low, high)}; expected a lumen that the wire enters; {LOOK_AT}"
            )


def _read(lumen: Source, least_voxels: int) -> Branches | Shapes | Volume | Header:
    """The lumen; of a label map of very many voxels its header."""
    if lumen.path.name.lower().endswith((".swc", ".mrk.json", ".stl", ".vtp")):
        return read_lumen(lumen, least_voxels)
    header = mask_header(lumen)
    return header if np.prod(header.shape, dtype=float) > MOST_VOXELS else read_lumen(lumen, least_voxels)


def _ends_mm(found: Branches | Shapes | Volume | Header) -> Array:
    """Points (n, 3) that span the lumen, LPS mm; of a header those of its grid."""
    if isinstance(found, Shapes):
        return found.points_mm
    if isinstance(found, Branches):
        return np.concatenate([found.start_mm, found.end_mm])
    if isinstance(found, Header):
        return corners_mm(found.grid)
    inside = found.values >= 0.5
    lines = [np.flatnonzero(inside.any(axis=tuple({0, 1, 2} - {axis}))) for axis in range(3)]
    ends = np.meshgrid(*[(line[0], line[-1]) for line in lines], indexing="ij")
    return found.to_mm(np.stack(ends, -1).reshape(-1, 3))


def _any_near(lumen: Volume, point_mm: Array, within_mm: float) -> bool:
    """Whether a voxel of the lumen, to its corners, lies within a distance of a point; those around it are asked."""
    reach_mm = within_mm + 0.5 * float(np.linalg.norm(lumen.spacing_mm))
    box = around(lumen, point_mm[None], reach_mm)
    near = box.to_mm(np.argwhere(box.values >= 0.5))
    return bool(np.any(np.linalg.norm(near - point_mm, axis=1) <= reach_mm))


def _entry(case: _At) -> str:
    return f"entry_mm {list(case.entry_mm)}"


def _box(low: Array, high: Array) -> str:
    return f"{low.round(1).tolist()} to {high.round(1).tolist()} mm in LPS"


def fitting(point_mm: ArrayLike, within: Callable[[Array], bool], scan: Grid | None = None) -> str:
    """What a point that lies outside would be within as; empty where nothing simple helps.

    At most two changes, as of axes and unit, explain anything; and divided by 1000 all points are one. scan : whose
    voxels its numbers may be, where they are whole: with an origin near 0 any point in mm lies in the scan as those.
    """
    point = np.asarray(point_mm, float)[None]
    ways = [(name, p[0]) for name, p in readings(point, "mm") if name.count(" and ") < 2 and "µm" not in name]
    ways.sort(key=lambda way: way[0] != "RAS")
    whole = np.all(np.abs(point - np.rint(point)) < WHOLE)
    if scan is not None and whole and np.all((point >= 0.0) & (point <= np.array(scan.shape) - 1.0)):
        ways.append(("in voxels", scan.to_mm(point)[0]))
    fits = ((name, p) for name, p in ways if within(p))
    name, p = next(fits, ("", point[0]))
    how = f"in {name}" if name.startswith("RAS") else name
    return f"is it {how}? Read so, {(p.round(3) + 0.0).tolist()}, it lies there" if name else ""
