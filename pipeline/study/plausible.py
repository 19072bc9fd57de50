"""What a manifest says of its scans and hardly can be: an entry that leads out of them, depths in another unit."""

from collections.abc import Iterator, Sequence
from operator import attrgetter

import numpy as np

from pipeline.load import Header, read_header
from pipeline.load.curves import read_truth
from pipeline.model import Array, arc_length
from pipeline.simulate.clamp_told import FARTHEST_MM, LARGEST_TURN_DEG
from pipeline.simulate.others import oddity
from pipeline.study.devices import implausible, odd_catheter, odd_wall
from pipeline.study.infer import beside
from pipeline.study.manifest import Case
from pipeline.study.same_scans import continued, shared
from pipeline.study.settings import Config
from pipeline.trace.config import MOST_APART
from reports.case_files import listed

SHORT_WAY = 0.5
"""Share of the largest stated depth that the scan holds ahead of the entry at least; a vessel may turn."""
SHORT_MM = 10.0
"""Where no depth is stated: what it holds at least."""
LONGER_BACK = 3.0
"""Times as much as it holds the other way, for the direction to be doubted."""


def first_of(case: Case, config: Config) -> Header | None:
    """The header of a scan of the case; None without any."""
    source = case.reference or next(iter(case.frames), None)
    return None if source is None else read_header(source, config.load, case.spacing_mm)


def leads_out(case: Case, header: Header) -> list[str]:
    """A sentence where entry_direction points to the near edge of the scan. header : of a scan with that entry."""
    ahead, behind = (_to_the_edge(case, header, sign) for sign in (1.0, -1.0))
    least = SHORT_WAY * max(case.insertion_mm) if case.insertion_mm else SHORT_MM
    if ahead >= least or behind < LONGER_BACK * ahead:
        return []
    stated = f", for insertion_mm up to {max(case.insertion_mm):g} mm" if case.insertion_mm else ""
    return [
        f"entry_direction leads out of the scan {ahead:.1f} mm from entry_mm{stated}; the other way it holds "
        f"{behind:.0f} mm: entry_direction points the way the wire is pushed; is it turned round?"
    ]


IN_METRES_MM = 1e-3, 0.05
"""Largest coordinate of an entry in mm that may be one in metres, from and to: less is the origin itself, rounded."""


def entry_in_metres(case: Case, header: Header | None) -> list[str]:
    """A sentence where an entry is so near the scanner's origin that it may be in metres. header : of a scan."""
    least, most = IN_METRES_MM
    in_mm = 1e3 * np.asarray(case.entry_mm)
    if not least <= float(np.abs(case.entry_mm).max()) < most:
        return []
    if header is not None and np.any(header.grid.beyond_mm(in_mm) > max(header.grid.spacing_mm)):  # it lies in no scan
        return []
    told = ", ".join(f"{value:g}" for value in in_mm)
    return [f"entry_mm lies within {most:g} mm of 0, 0, 0: is it in metres ([{told}] mm)?"]


def loose_entry(case: Case) -> list[str]:
    """A sentence where the entry is known so badly that a budget explains nearly every error by it."""
    stated = (
        ("entry_sigma_mm", case.entry_sigma_mm or 0.0, FARTHEST_MM, "mm"),
        ("entry_direction_sigma_deg", case.entry_direction_sigma_deg, LARGEST_TURN_DEG, "degrees"),
    )
    return [
        f"{key} = {sigma:g}: a clamp that lies more than {most:g} {unit} off is not accepted, and with an entry known "
        "so badly a budget explains nearly every error; measure it, or state how well it is really known"
        for key, sigma, most, unit in stated
        if sigma > most
    ]


SHALLOWEST_MM, LONGEST_WAY = 1.0, 3.0
"""Least depth that an insertion reaches, and most times that a vessel's way may be as long as its scan's diagonal."""


BACK_MM = 0.5
"""Fall of the depth from frame to frame that is more than how it was read or rounded."""


def odd_depths(case: Case, header: Header | None) -> list[str]:
    """Sentences where the stated depths are in another unit than mm, or go down. header : of a scan of the case."""
    if not case.insertion_mm:
        return []
    return [*_of_no_wire(case.insertion_mm, header), *_drawn_back(case.insertion_mm)]


def _drawn_back(depths: Sequence[float]) -> list[str]:
    """A sentence where depths go down, but for a wire that is pushed in and drawn back once."""
    deepest = int(np.argmax(depths))
    back = np.flatnonzero(np.diff(depths) < -BACK_MM)
    if not len(back) or (deepest > 0 and back[0] >= deepest and np.all(np.diff(depths)[deepest:] <= BACK_MM)):
        return []
    first = int(back[0])
    more = f" ({len(back)} times)" if len(back) > 1 else ""
    return [
        f"insertion_mm goes down from {depths[first]:g} mm (frame {first}) to {depths[first + 1]:g} mm{more}: the wire "
        "is replayed as drawn back there; are the frames in order?"
    ]


def _of_no_wire(depths: Sequence[float], header: Header | None) -> list[str]:
    deepest = max(depths)
    diagonal = np.inf if header is None else float(np.linalg.norm(np.array(header.shape) * header.spacing_mm))
    if SHALLOWEST_MM <= deepest <= LONGEST_WAY * diagonal:
        return []
    than = f"and the scan is {diagonal:.0f} mm across" if deepest > SHALLOWEST_MM else "no wire is seen to move by that"
    return [f"insertion_mm goes to {deepest:g} mm, {than}: is it in another unit than mm, or the scan's header?"]


TRUTH_OFF_MM, TRUTH_OFF = 5.0, 0.25
"""How much longer or shorter than insertion_mm a true wire may be, mm and as a share: the larger counts."""


def odd_truth(case: Case, curves: Sequence[Array]) -> list[str]:
    """A sentence where true wires (n, 3) cannot be those of their frames."""
    entry, direction = np.array(case.entry_mm), np.array(case.entry_direction)
    said = [oddity(points, entry, direction) for points in curves]
    if case.insertion_mm and not any(said):
        lengths = [float(arc_length(points)[-1]) for points in curves]
        said = [
            f"it is {length:.1f} mm long, insertion_mm states {mm:g}; are the frames in order?"
            if abs(length - mm) > max(TRUTH_OFF_MM, TRUTH_OFF * mm)
            else ""
            for length, mm in zip(lengths, case.insertion_mm, strict=True)
        ]
    wrong = [(number, text) for number, text in enumerate(said) if text]
    if not wrong:
        return []
    number, text = wrong[0]
    more = f" ({len(wrong)} of {len(said)} frames)" if len(wrong) > 1 else ""
    return [
        f"the true wire of frame {number} cannot be its wire: {text}{more}; the columns of the truth say nothing then"
    ]


HALF_A_TURN_DEG = 180.0


def wrapped_rolls(case: Case) -> list[str]:
    """A sentence where the roll goes from one end of its circle to the other: with friction the way there counts."""
    rolls = np.atleast_1d(np.asarray(case.stated_roll_deg, dtype=np.float64))
    far = np.flatnonzero(np.abs(np.diff(rolls)) > HALF_A_TURN_DEG)
    if not len(far):
        return []
    before, after = rolls[far[0]], rolls[far[0] + 1]
    on = after - 360.0 * np.sign(after - before)
    return [
        f"roll_deg goes from {before:g} to {after:g} in frame {far[0] + 1}: the wire is turned by {after - before:g} "
        f"degrees there, and with friction the way counts; a hand that went on the short way has {on:g}"
    ]


def _to_the_edge(case: Case, header: Header, sign: float) -> float:
    """How far the scan reaches from the entry along its direction, or against it, mm."""
    points = np.asarray(case.entry_mm) + sign * np.outer([0.0, 1.0], case.entry_direction)
    start, one = header.grid.to_index(points)
    step = one - start
    limit = np.where(step > 0.0, np.array(header.shape) - 0.5, -0.5)
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(max(0.0, np.nanmin(np.where(step != 0.0, (limit - start) / step, np.inf))))


def other_voxels(header: Header) -> list[str]:
    """A sentence where the manifest's ``spacing_mm`` stands in for another one that a scan states."""
    if any("lacks spacing" in note for note in header.assumed):  # that is what the key is for
        return []
    return [f"spacing_mm: {note}; is that meant?" for note in header.assumed if "where the file has" in note]


def forgotten_reference(case: Case) -> list[str]:
    """A sentence where a case has no reference, and a scan lies beside its frames that is named as one."""
    if case.reference is not None or not case.frames or case.traces:
        return []
    found = beside([source.path for source in case.frames])
    if not found:
        return []
    return [
        f"no reference, though {found[0].name} lies beside the frames: the lumen comes from frame 0, with the wire in "
        f'it; add reference = "{found[0].name}" (with its folder), or rename it'
    ]


def lost_header(header: Header) -> list[str]:
    """A sentence where a scan has voxels of just 1 mm from 0, 0, 0 along the axes: as where its header was lost."""
    grid = header.grid
    plain = np.all(grid.spacing_mm == 1.0) and np.all(grid.origin_mm == 0.0)
    if not plain or not np.all(np.isin(np.abs(grid.direction), (0.0, 1.0))):
        return []
    return [
        "the scan has voxels of 1 mm from 0, 0, 0 along the axes, as where a program that knows of no header wrote it: "
        "are they? Else export it anew, or give spacing_mm"
    ]


THINNEST_VOXELS = 0.5


def too_thin(case: Case, header: Header) -> list[str]:
    """A sentence where the wire is so thin in its voxels that traces are worse than they say.

    Measured on bends (`wireval synth bend --voxel-mm`): 0.36 mm in voxels of 0.4 to 0.6 mm lie off by 0.9 to 1.2 times
    the stated sigma, in voxels of 0.8 mm by 2.5 times, with tips up to 0.7 mm off.
    """
    voxel, diameter = float(np.prod(header.spacing_mm) ** (1.0 / 3.0)), 2.0 * case.wire.radius_mm
    if diameter >= THINNEST_VOXELS * voxel:
        return []
    return [
        f"the wire's diameter, {diameter:.2g} mm, is less than half a voxel ({voxel:.2g} mm): traces may be off by two "
        "or three times their trace_sigma_mm there, tips by a voxel; scan with smaller voxels"
    ]


def slices_apart(header: Header) -> list[str]:
    """A sentence where slices lie so far apart that no trace is accepted."""
    far, near = float(header.spacing_mm.max()), float(header.spacing_mm.min())
    if far / near < MOST_APART:
        return []
    return [
        f"the scan has slices of {far:.3g} mm and pixels of {near:.3g} mm, {far / near:.1f} times as far apart: from "
        f"{MOST_APART:g} times on no trace is accepted; reconstruct thinner slices"
    ]


def in_case(case: Case, scan: Header | None) -> list[str]:
    """What is doubtful in a case beside its wire and its truth. scan : header of a scan of the case."""
    of_scan = [] if scan is None else [*other_voxels(scan), *lost_header(scan), *leads_out(case, scan)]
    said = [*forgotten_reference(case), *of_scan, *loose_entry(case), *odd_depths(case, scan), *wrapped_rolls(case)]
    said += [*entry_in_metres(case, scan), *odd_wall(case.wall), *odd_catheter(case.catheter)]
    if scan is not None and case.frames and not case.traces:
        said += [*too_thin(case, scan), *slices_apart(scan)]
    return said


def doubts(cases: Sequence[Case], config: Config) -> Iterator[str]:
    """All that is doubtful in a study, by its manifest and the headers of its scans, a sentence each."""
    yield from implausible(cases)
    said: dict[str, list[str]] = {}
    for case in cases:
        texts = in_case(case, first_of(case, config))
        texts += odd_truth(case, read_truth(case.truth, None)) if case.truth else []
        for text in texts:
            said.setdefault(text, []).append(repr(case.id))
    yield from (f"case{'s' * (len(ids) > 1)} {listed(ids)}: {text}" for text, ids in said.items())
    yield from shared(cases)
    yield from among(cases)


def among(of_study: Sequence[Case], left_out: Sequence[str] = ()) -> list[str]:
    """What is doubtful of cases among themselves, and belongs on the page of their run, which leaves some out."""
    cases = [case for case in of_study if case.id not in left_out]
    return [*continued(cases), *_of_two_kinds(cases)]


def _of_two_kinds(cases: Sequence[Case]) -> list[str]:
    """That figures over all cases would be of wires in space and of wires in projections."""
    scored = [case for case in cases if case.role == "validation" and case.compared]
    flat = [case.id for case in scored if case.projections is not None]
    if not 0 < len(flat) < len(scored):
        return []
    return [
        f"case{'s' * (len(flat) > 1)} {listed(flat)}: distances in projections lack what lies along the rays, about "
        "half of a squared error; the other cases have distances in space, and figures over all of them mix both: "
        "quote each kind alone (--only)"
    ]


MEASURES = "compare.skip_mm", "compare.sample_mm", "compare.simulated_nulls", "trace.length_tolerance_mm"
"""Settings that decide what counts as an error."""


def measured_otherwise(config: Config) -> list[str]:
    """A sentence for each setting that decides what counts as an error and is not the default."""
    read = [attrgetter(name) for name in MEASURES]
    return [
        f"{name} = {value(config)} where the default is {value(Config())}: errors are not those of the default"
        for name, value in zip(MEASURES, read, strict=True)
        if value(config) != value(Config())
    ]
