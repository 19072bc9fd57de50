"""Every problem of a study at once, from the manifest and the scans' headers alone."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.load import LoadError, Scans, Source, read_headers
from pipeline.load.curves import read_truth
from pipeline.load.views import read_views
from pipeline.load.wires import read_wires
from pipeline.simulate.others import oddity
from pipeline.study.manifest import Case, not_one_per_frame
from pipeline.study.settings import Config


def check(cases: Sequence[Case], config: Config) -> list[str]:
    """Problems of all cases, each with its case's id."""
    return [f"case {case.id!r}: {text}" for case in cases for text in check_case(case, config)]


def check_case(case: Case, config: Config) -> list[str]:
    """What would stop or spoil this case; empty when nothing is found."""
    problems = [f"{path}: no such file or folder" for path in inputs_of(case) if not path.exists()]
    if problems:
        return problems
    try:
        scans = read_headers(case.reference, case.frames, config.load, case.spacing_mm)
    except LoadError as error:
        return [str(error)]
    count = len(scans.frames) or case.frame_count
    problems += _entry_problems(case, scans)
    problems += not_one_per_frame(case.lists, count)
    problems += _others_problems(case, count)
    for path, read in ((case.truth, read_truth), (case.projections, read_views)):
        try:
            _ = None if path is None else read(path, count)
        except LoadError as error:
            problems.append(str(error))
    return problems


def _others_problems(case: Case, count: int) -> list[str]:
    """What is wrong with all wires of another simulator; what is wrong with some of them is for their frames to say."""
    if case.simulated is None:
        return []
    try:
        files = read_wires(case.simulated.files, count, case.simulated.space, case.simulated.unit)
    except LoadError as error:
        return [str(error)]
    entry, direction = np.array(case.entry_mm), np.array(case.entry_direction)
    wrong = [f.problem if f.points_mm is None else oddity(f.points_mm, entry, direction) for f in files]
    if not files or not case.simulated.files or not all(wrong):
        return []
    return [f"none of the other simulator's {count} wires can be used; {files[0].name}: {wrong[0]}"]


def inputs_of(case: Case) -> list[Path]:
    """Every file or folder that a case names, once."""
    values = [item for _, value in case for item in (value if isinstance(value, tuple) else (value,))]
    paths = (item.path if isinstance(item, Source) else item for item in values)
    return list(dict.fromkeys(path for path in paths if isinstance(path, Path)))


def _entry_problems(case: Case, scans: Scans) -> list[str]:
    """Points that lie outside the scan: usually RAS for LPS, or metres for millimetres."""
    header = scans.first
    if header is None:
        return []
    problems = []
    for name, points in (("entry_mm", [case.entry_mm]), ("lumen_seed_mm", case.lumen_seed_mm)):
        index = header.grid.to_index(points)
        for point, voxel in zip(points, index, strict=True):
            if np.any(voxel < -0.5) or np.any(voxel > np.array(header.shape) - 0.5):
                corners = header.grid.to_mm([[0, 0, 0], [n - 1 for n in header.shape]]).round(1).tolist()
                problems.append(
                    f"{name} {list(point)} lies outside the scan (voxel {voxel.round(1).tolist()} of "
                    f"{list(header.shape)}); the scan spans {corners[0]} to {corners[1]} mm in LPS; "
                    "is the point in RAS, or in voxels?"
                )
    return list(dict.fromkeys(problems))
