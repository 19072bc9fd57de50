"""Every problem of a study at once, from the manifest and the scans' headers alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.load import LoadError
from pipeline.load.scans import Scans, read_headers
from pipeline.load.truth import read_truth
from pipeline.run.case import inputs_of
from pipeline.study.config import Config
from pipeline.study.manifest import Case, Manifest


def check_case(case: Case, config: Config) -> list[str]:
    """What would stop or spoil this case; empty when nothing is found."""
    problems = [f"{path}: no such file or folder" for path in inputs_of(case) if not path.exists()]
    if problems:
        return problems
    try:
        scans = read_headers(case, config.load)
    except LoadError as error:
        return [str(error)]
    problems += _entry_problems(case, scans)
    count = len(scans.frames) or case.frame_count
    for name in ("insertion_mm", "roll_deg"):
        values = getattr(case, name)
        if isinstance(values, tuple) and len(values) != count:
            problems.append(f"{name} has {len(values)} entries for {count} frames; give one per frame")
    if case.truth:
        try:
            read_truth(case.truth, count)
        except LoadError as error:
            problems.append(str(error))
    return problems


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
                corners = (
                    header.grid.to_mm(np.array([(0, 0, 0), header.shape]) - [[0], [1]]).round(1).tolist()
                )
                problems.append(
                    f"{name} {list(point)} lies outside the scan (voxel {voxel.round(1).tolist()} of "
                    f"{list(header.shape)}); the scan spans {corners[0]} to {corners[1]} mm in LPS; "
                    "is the point in RAS, or in voxels?"
                )
    return list(dict.fromkeys(problems))


def check(manifest: Manifest, config: Config, only: Sequence[str] = ()) -> list[str]:
    """Problems of all cases, each with its case's id."""
    chosen = [case for case in manifest.cases if not only or case.id in only]
    return [f"case {case.id!r}: {text}" for case in chosen for text in check_case(case, config)]
