"""Every problem of a study at once, from the manifest, the scans' headers and the small files."""

from collections.abc import Callable, Container, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from pipeline.load import Header, LoadError, Scans, Source, each_volume, read_header, require_one, require_whole
from pipeline.load.curves import read_curve, read_truth
from pipeline.load.guard import is_folder, status_of
from pipeline.load.views import read_views
from pipeline.load.wires import read_wires
from pipeline.simulate.others import oddity
from pipeline.status import nearest
from pipeline.study.case_rules import not_one_per_frame
from pipeline.study.coarse import too_coarse
from pipeline.study.manifest import Case
from pipeline.study.own_lumen import fitting, lumen_problems
from pipeline.study.parameters import ParametersError, read_parameters
from pipeline.study.same_grid import apart
from pipeline.study.same_scans import repeated
from pipeline.study.settings import Config
from pipeline.study.sources import files_of, is_pattern

T = TypeVar("T")
MOST_BESIDE = 2000
"""Names in a folder among which the one that was meant is looked for."""


def check(cases: Sequence[Case], config: Config, *, whole: bool = True) -> list[str]:
    """Problems of all cases, a line each, with its case's id.

    whole : also frames that are cut short. A run does not ask: such a frame is lost, and said, and the others are not.
    """
    found = [(case.id, text) for case in cases for text in check_case(case, config, whole=whole)]
    return [f"case {name!r}: {' '.join(text.split())}" for name, text in found] + too_coarse(cases, config)


def check_case(case: Case, config: Config, *, whole: bool = True) -> list[str]:
    """What would stop or spoil this case; empty when nothing is found."""
    absent = dict(_absent(case))
    found = _Findings([*repeated(case), *absent.values()])
    count, scan = _look_at_scans(case, config, absent, whole, found)
    if count is not None:
        found += not_one_per_frame(case.lists, count)
    found += _told_problems(case, count, absent)
    found += [] if count is None else _others_problems(case, count, scan)
    for source in case.traces:
        if source.path not in absent:
            found.tried(read_curve, source.path)
    if case.parameters and case.parameters not in absent:
        try:
            read_parameters(case.parameters)
        except ParametersError as error:
            found += error.problems
    if case.lumen is not None and case.lumen.path not in absent:
        found += lumen_problems(case, case.lumen, config.segment.least_voxels)
    return found


class _Findings(list[str]):
    """Problems so far: what cannot be read adds its sentence, and hides nothing else."""

    def tried(self, read: Callable[..., T], *args: Any) -> T | None:
        """What is read, or None."""
        try:
            return read(*args)
        except LoadError as error:
            self.append(str(error))
            return None


def _look_at_scans(
    case: Case, config: Config, absent: Container[Path], whole: bool, found: _Findings
) -> tuple[int | None, Header | None]:
    """How many frames the case has, None where a header is not known, whose file may hold several; and a header."""

    def header_of(source: Source | None) -> Header | None:
        if source is None or source.path in absent:
            return None
        return found.tried(read_header, source, config.load, case.spacing_mm)

    empty, frames = header_of(case.reference), [header_of(source) for source in case.frames]
    for header in filter(None, [empty, *frames] if whole else [empty]):
        found.tried(require_whole, header, config.load)
    if empty is not None:
        found.tried(require_one, empty)
    scans = Scans(empty, tuple(volume for header in frames if header for volume in each_volume(header))).cut
    found += apart(scans.all)
    found += entry_problems(case, scans)
    return None if None in frames else len(scans.frames) or case.frame_count, scans.first


def frames_of(case: Case, config: Config) -> int:
    """How many frames a case has: a file may hold several, which its header tells; a folder is one series."""
    held = (1 if is_folder(one.path) else read_header(one, config.load).item_count for one in case.frames)
    return sum(held) or case.frame_count


def _absent(case: Case) -> Iterator[tuple[Path, str]]:
    """The files that a case names and that are not there, or cannot even be asked for, with a sentence each."""
    for path in dict.fromkeys(files_of(case).values()):
        try:
            if status_of(path) is None:
                if path.is_symlink():
                    yield path, f"{path}: a link to nothing ({path.readlink()}); name the file itself"
                    continue
                what = "matches no file" if is_pattern(path.name) else "no such file or folder"
                near = nearest(path.name, [beside.name for beside in islice(path.parent.glob("*"), MOST_BESIDE)])
                yield path, f"{path}: {what}" + f"; did you mean {near!r}?" * bool(near)
        except LoadError as error:
            yield path, str(error)


def _told_problems(case: Case, count: int | None, absent: Container[Path]) -> list[str]:
    """What is wrong with the roll, what is stated of traces, the truth and the projections. count : of the frames."""
    problems, sigma_mm = [], case.uncertainty.traces_mm
    if sigma_mm is not None and not case.traces:
        problems.append(
            f"uncertainty.traces_mm = {sigma_mm:g}: it is of own curves, and the case names no traces; leave it out"
        )
    seen = count if case.frames or case.traces else 0
    if case.roll_deg == "fit" and case.role == "validation" and seen is not None and seen < 2:
        said = "the first one is what it is fitted on, and is not scored; give a number, or two frames or more"
        problems.append(f'roll_deg = "fit" with frames: {seen}; {said}')
    for told, read in ((case.truth, read_truth), (case.projections, read_views)):
        try:
            if told is not None and told not in absent:
                read(told, count)
        except LoadError as error:
            problems.append(str(error))
    return problems


def _others_problems(case: Case, count: int, scan: Header | None) -> list[str]:
    """What is wrong with all wires of another simulator; what is wrong with some of them is for their frames to say."""
    if case.simulated is None:
        return []
    try:
        files = read_wires(case.simulated.files, count, case.simulated.space, case.simulated.unit)
    except LoadError as error:
        return [str(error)]
    entry, direction = np.array(case.entry_mm), np.array(case.entry_direction)
    grid, stated = None if scan is None else scan.grid, case.insertion_mm or ()
    depths = stated if len(stated) == len(files) else [float("nan")] * len(files)
    wrong = [
        file.problem if file.points_mm is None else oddity(file.points_mm, entry, direction, file.unit, depth_mm, grid)
        for file, depth_mm in zip(files, depths, strict=True)
    ]
    if not files or not case.simulated.files or not all(wrong):
        return []
    shown = next((n for n, file in enumerate(files) if not file.missing), 0)
    what = f"{files[shown].where or files[shown].name}: {wrong[shown]}"
    return [f"none of the other simulator's {count} wires can be used; {what}"]


def entry_problems(case: Case, scans: Scans) -> list[str]:
    """Points that lie outside the scan: usually RAS for LPS, or metres for millimetres."""
    header = scans.first
    if header is None:
        return []
    problems, middle, grid = [], 0.5 * (np.array(header.shape) - 1.0), header.grid

    def held(place: ArrayLike) -> bool:
        return bool(np.all(np.abs(grid.to_index(place) - middle) <= middle + 0.5))

    seeds = [point for point in case.lumen_seed_mm if point != case.entry_mm]
    for name, points in (("entry_mm", [case.entry_mm]), ("lumen_seed_mm", seeds)):
        for point in dict.fromkeys(points):
            if not held(point):
                fits, voxel = fitting(point, held, grid), grid.to_index(point).round(1).tolist()
                corners = grid.to_mm([[0, 0, 0], [n - 1 for n in header.shape]]).round(1).tolist()
                problems.append(
                    f"{name} {list(point)} lies outside the scan (voxel {voxel} of {list(header.shape)}); the scan "
                    f"spans {corners[0]} to {corners[1]} mm in LPS; {fits or 'check its coordinates'}"
                )
    return problems
