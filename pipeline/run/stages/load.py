"""load: headers, truth and the list of frames."""

from dataclasses import replace

from pipeline.load import read_headers
from pipeline.load.curves import read_truth
from pipeline.load.geometry import LoadError
from pipeline.load.views import read_views
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.study.case_rules import not_one_per_frame
from pipeline.study.devices import implausible
from pipeline.study.manifest import Case
from pipeline.study.plausible import in_case, measured_otherwise, odd_truth


def open_case(run: Context, known: Known) -> Known:
    """Read the headers and the truth, and list the frames with what the manifest says of each."""
    case = run.case
    with run.log.timed("load"):
        scans = read_headers(case.reference, case.frames, run.config.load, case.spacing_mm)
    run.log.assumptions += [*case.unconfirmed, *_axis_assumed(case), *scans.assumed, *measured_otherwise(run.config)]
    count = len(scans.frames) or case.frame_count
    wrong = not_one_per_frame(case.lists, count)
    if wrong:
        raise LoadError(f"case {case.id!r}: {wrong[0]}")
    run.log.assumptions += [case.calibrated] * bool(case.calibrated)
    run.log.warnings += [text for text in (case.own_parameters, case.calibrated_kin) if text]
    run.log.warnings += [*implausible([case]), *in_case(case, scans.first)]
    offset, rolls = run.config.simulate.roll_offset_deg, case.stated_roll_deg
    frames = [Frame(i, roll_deg=roll + offset) for i, roll in enumerate(each_frame(rolls, count))]
    if case.catheter:
        tips = each_frame(case.catheter.insertion_mm, count)
        frames = [replace(f, catheter_mm=tip) for f, tip in zip(frames, tips, strict=True)]
    if case.insertion_mm:
        frames = [replace(f, expected_mm=mm) for f, mm in zip(frames, case.insertion_mm, strict=True)]
    if case.projections:
        views = read_views(case.projections, count)
        frames = [replace(f, view=view) for f, view in zip(frames, views, strict=True)]
    if case.truth:
        truth = read_truth(case.truth, count)
        run.log.warnings += odd_truth(case, truth)
        frames = [replace(f, truth_mm=points) for f, points in zip(frames, truth, strict=True)]
    return replace(known, scans=scans, frames=tuple(frames))


def _axis_assumed(case: Case) -> list[str]:
    """A sentence where a wire with a curved tip is turned by a roll whose zero nobody has stated."""
    said = any(text.startswith("material_axis:") for text in case.unconfirmed)
    if not case.wire.curved or case.material_axis is not None or case.roll_deg == "fit" or said:
        return []
    return ["material_axis is not stated: at roll 0 the tip bends towards the world axis least along entry_direction"]


def each_frame(given: float | tuple[float, ...], count: int) -> tuple[float, ...]:
    """A number for every frame: the manifest's list, or its one number for all."""
    return given if isinstance(given, tuple) else (given,) * count
