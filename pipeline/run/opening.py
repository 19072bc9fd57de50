"""load: headers, hashes, truth and the list of frames."""

from __future__ import annotations

from typing import Any

from pipeline.load import Header, LoadError, scans
from pipeline.load.truth import read_truth
from pipeline.run.cache import file_hash
from pipeline.run.frame import Frame
from pipeline.run.record import CaseRun
from pipeline.simulate.replay import rolls


def open_case(run: CaseRun) -> None:
    """Headers, hashes, truth and the list of frames."""
    case = run.case
    run.frames = [Frame(i) for i in range(case.frame_count)]
    with run.timed("load"):
        run.headers = scans.read_headers(case, run.config.load)
        count = len(run.headers.frames) or case.frame_count
        run.frames = [Frame(i) for i in range(count)]
        for header in filter(None, (run.headers.reference, *run.headers.frames)):
            path = header.source.path
            run.hashes.setdefault(str(path), file_hash(path))
    run.assumptions += run.headers.assumed
    for name, values in (("insertion_mm", case.insertion_mm), ("roll_deg", case.roll_deg)):
        if isinstance(values, tuple) and len(values) != count:
            msg = f"case {case.id!r}: {name} has {len(values)} entries for {count} frames; give one per frame"
            raise LoadError(msg)
    truth = read_truth(case.truth, count) if case.truth else [None] * count
    angles = rolls(case, count, run.config.simulate)
    for frame in run.frames:
        frame.truth_mm, frame.roll_deg = truth[frame.index], angles[frame.index]
        if case.insertion_mm:
            frame.expected_mm = case.insertion_mm[frame.index]


def header_hash(run: CaseRun, header: Header) -> list[Any]:
    """What a stage result depends on in one scan: its content, the item in it, and an overridden spacing."""
    return [run.hashes[str(header.source.path)], header.source.dataset, header.source.item, header.spacing_mm]
