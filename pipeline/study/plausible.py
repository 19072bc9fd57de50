"""What a manifest says and hardly can be: a wire that no guide wire is, an entry that leads out of the scan."""

from collections.abc import Iterable, Iterator, Sequence
from operator import attrgetter

import numpy as np

from pipeline.load import Header, read_header
from pipeline.load.curves import read_truth
from pipeline.model import Array, OverWire, Wire, arc_length
from pipeline.simulate.others import oddity
from pipeline.study.manifest import Case
from pipeline.study.same_scans import continued, shared
from pipeline.study.settings import Config

RADII_MM = (0.1, 0.5)
"""Guide wires of 0.008 to 0.038 inch: radii of 0.10 to 0.48 mm."""
SOFTEST_GPA, STIFFEST_GPA = 0.1, 400.0
"""Moduli that a solid rod would bend like the wire's stiffest part with: rubber's and tungsten's. Guide wires of 0.035
inch were measured at 9.5 to 158 GPa (Harrison et al., J Endovasc Ther 18, 2011, doi 10.1583/11-3592.1); the wires of
the catalogue have 4.9. A factor of 1000 takes any of them out of this range."""

HEAVIEST_N_MM3 = 2.0e-4
"""Weight of tungsten or platinum, 19.3 to 21.5 g/cm3, a fluid's lift left out."""
SHARPEST = 0.5
"""Of a wire's radius over that of its bend: about its own diameter nobody bends a wire, J tips of 1.5 mm have 0.3."""
LEAST_TWIST, MOST_TWIST, ROD_TWIST = 0.01, 3.0, 0.77
"""Torsional stiffness over that of the stiffest bend, guide wires' and a round rod's, which is 1 / (1 + Poisson's ratio
of 0.3): a coil about a core bends stiffly for its twist or twists stiffly for its bend; a unit is 1000 or more off."""
STIFFER_TIP = 1.5
"""How much stiffer than its far end the tip is at least where it is doubted."""


def implausible(cases: Iterable[Case]) -> list[str]:
    """Sentences on the wires of these cases, a wire of several cases once."""
    return list(dict.fromkeys(f"wire {case.wire.name!r}: {text}" for case in cases for text in _oddities(case.wire)))


def _rod_of_1_gpa(radius_mm: float) -> float:
    """Bending stiffness of a solid rod, N mm2."""
    return 1000.0 * 0.25 * float(np.pi) * radius_mm**4


def _oddities(wire: Wire) -> Iterator[str]:
    radius, (thinnest, thickest) = wire.radius_mm, RADII_MM
    if not thinnest <= radius <= thickest:
        what = "is it the diameter, or in another unit?" if radius > thickest else "is it in another unit?"
        yield f"radius_mm = {radius:g}: guide wires have {thinnest:g} to {thickest:g} mm; {what}"
    profile = np.atleast_2d(wire.bending_stiffness_N_mm2)[:, -1]
    tip, shaft, most = float(profile[0]), float(profile[-1]), float(profile.max())
    of_1_gpa = _rod_of_1_gpa(radius)
    modulus = most / of_1_gpa
    if not SOFTEST_GPA <= modulus <= STIFFEST_GPA:
        least, largest = SOFTEST_GPA * of_1_gpa, STIFFEST_GPA * of_1_gpa
        yield (
            f"bending_stiffness_N_mm2 of {most:.3g} at the most: a rod of radius_mm = {radius:g} has {least:.2g} (of "
            f"rubber) to {largest:.3g} N mm2 (of tungsten), and guide wires lie between; is it in another unit, or the "
            "radius wrong?"
        )
    sharpest = float(np.abs(np.atleast_2d(wire.rest_curvature_per_mm)[:, -1]).max())
    if sharpest * radius > SHARPEST:
        yield (
            f"rest_curvature_per_mm of {sharpest:.3g} at the most: a bend of {1.0 / sharpest:.2g} mm radius in a wire "
            f"of radius_mm = {radius:g}; is it a radius (mm), or per metre?"
        )
    heaviest = HEAVIEST_N_MM3 * np.pi * radius**2
    if wire.weight_N_per_mm > heaviest:
        yield (
            f"weight_N_per_mm = {wire.weight_N_per_mm:.3g}: a rod of tungsten of radius_mm = {radius:g} weighs "
            f"{heaviest:.2g} N/mm; is it in another unit?"
        )
    if tip > STIFFER_TIP * shaft:
        yield (
            f"bending_stiffness_N_mm2 is {tip:g} at the tip and {shaft:g} at its far end: guide wires are softest at "
            "the tip; profiles count from the tip, is it turned round?"
        )
    yield from _of_twist(wire.torsional_stiffness_N_mm2, most)


def _of_twist(twist: float, bend: float) -> Iterator[str]:
    """A sentence where the torsional stiffness is in another unit than that of the stiffest bend."""
    if np.isfinite(twist) and not LEAST_TWIST * bend <= twist <= MOST_TWIST * bend:
        yield (
            f"torsional_stiffness_N_mm2 = {twist:.3g} is {twist / bend:.2g} times the wire's largest bending stiffness"
            f" of {bend:.3g}: a round rod has {ROD_TWIST:g} times, guide wires {LEAST_TWIST:g} to {MOST_TWIST:g}; is "
            "one of them in another unit (1 N m2 is 1e6 N mm2)? Left out, the wire does not twist"
        )


CATHETER_RADII_MM = (0.2, 2.0)
"""Outer hulls of 1.2 to 12 French: from the end of a microcatheter to a guiding sheath."""
SOFTEST_TUBE_GPA, STIFFEST_TUBE_GPA = 0.002, 150.0
"""Moduli that a solid rod of a catheter's radius would bend like it with: tubes of silicone of 5 MPa with a wall of a
tenth of the radius, and of steel with one of three tenths."""
USUAL_TUBE_GPA = (0.04, 0.4)
"""Those of catheters of 5 French (a radius of 0.9 mm) with 20 to 200 N mm2."""


def odd_catheter(catheter: OverWire | None) -> list[str]:
    """Sentences where a catheter hardly can be one."""
    return [] if catheter is None else [f"catheter {text}" for text in _of_catheter(catheter)]


def _of_catheter(catheter: OverWire) -> Iterator[str]:
    radius, (thinnest, thickest) = catheter.radius_mm, CATHETER_RADII_MM
    if not thinnest <= radius <= thickest:
        what = "is it in French (6 of them are a radius of 1 mm)?" if radius > thickest else "is it in another unit?"
        yield f"radius_mm = {radius:g}: catheters have {thinnest:g} to {thickest:g} mm; {what}"
        return  # what a tube bends like goes by the fourth power of it
    stiffness, of_1_gpa = catheter.bending_stiffness_N_mm2, _rod_of_1_gpa(radius)
    if stiffness > 0.0 and not SOFTEST_TUBE_GPA <= stiffness / of_1_gpa <= STIFFEST_TUBE_GPA:  # 0 is none, on purpose
        least, largest = (gpa * of_1_gpa for gpa in (SOFTEST_TUBE_GPA, STIFFEST_TUBE_GPA))
        usual = " to ".join(f"{gpa * of_1_gpa:.3g}" for gpa in USUAL_TUBE_GPA)
        yield (
            f"bending_stiffness_N_mm2 = {stiffness:.3g}: a tube of radius_mm = {radius:g} has {least:.2g} (of soft "
            f"silicone) to {largest:.2g} N mm2 (of steel), and {usual} is usual; is it in another unit (1 N m2 is "
            "1e6 N mm2), or the radius wrong?"
        )


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


def leads_out(case: Case, header: Header | None) -> list[str]:
    """A sentence where entry_direction points to the near edge of the scan. header : of a scan with that entry."""
    if header is None:
        return []
    ahead, behind = (_to_the_edge(case, header, sign) for sign in (1.0, -1.0))
    least = SHORT_WAY * max(case.insertion_mm) if case.insertion_mm else SHORT_MM
    if ahead >= least or behind < LONGER_BACK * ahead:
        return []
    stated = f", for insertion_mm up to {max(case.insertion_mm):g} mm" if case.insertion_mm else ""
    return [
        f"entry_direction leads out of the scan {ahead:.1f} mm from entry_mm{stated}; the other way it holds "
        f"{behind:.0f} mm: entry_direction points the way the wire is pushed; is it turned round?"
    ]


SHALLOWEST_MM, LONGEST_WAY = 1.0, 5.0
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
    return [f"insertion_mm goes to {deepest:g} mm, {than}: is it in another unit than mm?"]


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


def other_voxels(header: Header | None) -> list[str]:
    """A sentence where the manifest's ``spacing_mm`` stands in for another one that a scan states."""
    notes = () if header is None else header.assumed
    if any("lacks spacing" in note for note in notes):  # that is what the key is for
        return []
    return [f"spacing_mm: {note}; is that meant?" for note in notes if "where the file has" in note]


THINNEST_VOXELS = 0.5


def too_thin(case: Case, header: Header | None) -> list[str]:
    """A sentence where the wire is so thin in its voxels that traces are worse than they say.

    Measured on bends (`wireval synth bend --voxel-mm`): 0.36 mm in voxels of 0.4 to 0.6 mm lie off by 0.9 to 1.2 times
    the stated sigma, in voxels of 0.8 mm by 2.5 times, with tips up to 0.7 mm off.
    """
    if header is None or not case.frames or case.traces:
        return []
    voxel, diameter = float(np.prod(header.spacing_mm) ** (1.0 / 3.0)), 2.0 * case.wire.radius_mm
    if diameter >= THINNEST_VOXELS * voxel:
        return []
    return [
        f"the wire's diameter, {diameter:.2g} mm, is less than half a voxel ({voxel:.2g} mm): traces may be off by two "
        "or three times their trace_sigma_mm there, tips by a voxel; scan with smaller voxels"
    ]


def in_case(case: Case, scan: Header | None) -> list[str]:
    """What is doubtful in a case beside its wire and its truth. scan : header of a scan of the case."""
    of_scan = [*other_voxels(scan), *leads_out(case, scan), *odd_depths(case, scan)]
    return [*of_scan, *wrapped_rolls(case), *odd_catheter(case.catheter), *too_thin(case, scan)]


def doubts(cases: Sequence[Case], config: Config) -> Iterator[str]:
    """All that is doubtful in a study, by its manifest and the headers of its scans, a sentence each."""
    yield from implausible(cases)
    for case in cases:
        said = in_case(case, first_of(case, config))
        said += odd_truth(case, read_truth(case.truth, None)) if case.truth else []
        yield from (f"case {case.id!r}: {text}" for text in said)
    yield from shared(cases)
    yield from continued(cases)


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
