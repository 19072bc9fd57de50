"""What a manifest says of a wire or a catheter and hardly can be: one that nobody makes, or in another unit."""

from collections.abc import Iterable, Iterator

import numpy as np

from pipeline.model import OverWire, Wall, Wire
from pipeline.study.manifest import Case

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
MOST_TURNED_DEG = 450.0
"""A pigtail turns by a whole turn and somewhat more; a curve per cm in place of one per mm turned a tip by 550."""
TURNED_ROUND = 1.5
"""How many times as stiff as its far end the tip is at least, or the far end as curved as the tip, to be doubted."""
SET_PER_MM = 0.01
"""Curvature up to which a bend is no shaped tip's: the hoop that a wire is packed in, of 100 mm radius or more, leaves
a shaft bent all along."""
COUNT_FROM_TIP = "profiles count from the tip, is it turned round?"
STRAIGHT = 0.01
"""Of the largest curvature: what lies in the vessel is straight up to that."""


def implausible(cases: Iterable[Case]) -> list[str]:
    """Sentences on the wires of these cases, a wire of several cases once, with the deepest insertion of all."""
    cases, deepest_mm = list(cases), dict[str, float]()
    for case in cases:
        here_mm = max(case.insertion_mm or (np.inf,))
        deepest_mm[case.wire.name] = max(here_mm, deepest_mm.get(case.wire.name, 0.0))
    told = (
        f"wire {wire.name!r}: {text}"
        for wire in (case.wire for case in cases)
        for text in (*_oddities(wire), *_curved_elsewhere(wire, deepest_mm[wire.name]))
    )
    return list(dict.fromkeys(told))


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
            f"of radius_mm = {radius:g}; is it a radius (mm), in degrees, or per metre?"
        )
    turned = _turned_deg(wire)
    if turned > MOST_TURNED_DEG:
        yield (
            f"rest_curvature_per_mm turns the wire by {turned:.0f} degrees in all: pigtails turn by 360 or so, and "
            "what turns more lies in itself; is it in degrees, per cm, or the length of the curve wrong?"
        )
    heaviest = HEAVIEST_N_MM3 * np.pi * radius**2
    if wire.weight_N_per_mm > heaviest:
        yield (
            f"weight_N_per_mm = {wire.weight_N_per_mm:.3g}: a rod of tungsten of radius_mm = {radius:g} weighs "
            f"{heaviest:.2g} N/mm; is it in another unit?"
        )
    if tip > TURNED_ROUND * shaft:
        yield (
            f"bending_stiffness_N_mm2 is {tip:g} at the tip and {shaft:g} at its far end: guide wires are softest at "
            f"the tip; {COUNT_FROM_TIP}"
        )
    yield from _of_twist(wire.torsional_stiffness_N_mm2, most)


def _curved_elsewhere(wire: Wire, deepest_mm: float) -> list[str]:
    """A sentence where a wire is curved at its far end, or nowhere within the deepest stated depth."""
    profile = np.atleast_2d(np.abs(wire.rest_curvature_per_mm))
    if profile.shape[1] < 2 or profile[:, 1].max() <= SET_PER_MM:
        return []
    at, curvature = profile.T
    straight = curvature <= STRAIGHT * curvature.max()
    inside = [*straight[at <= deepest_mm], np.interp(deepest_mm, at, curvature) <= STRAIGHT * curvature.max()]
    if all(inside):
        begins_mm = at[np.flatnonzero(~straight)[0] - 1]  # the knot before: of a step, it lies there, too
        what = f"begins {begins_mm:g} mm from the tip, where the deepest insertion_mm is {deepest_mm:g}"
    elif curvature[-1] > max(SET_PER_MM, TURNED_ROUND * curvature[0]):
        what = f"is {curvature[0]:g} at the tip and {curvature[-1]:g} at its far end"
    else:
        return []
    return [f"rest_curvature_per_mm {what}: guide wires are curved at the tip, most of all; {COUNT_FROM_TIP}"]


def _turned_deg(wire: Wire) -> float:
    """By how much the rest curve turns from the tip to where its profile ends, degrees; 0 of a wire that is alike all
    along, whose length nobody states."""
    profile = np.atleast_2d(wire.rest_curvature_per_mm)
    if profile.shape[1] < 2:
        return 0.0
    return float(np.degrees(np.trapezoid(np.abs(profile[:, 1]), profile[:, 0])))


WALLS_N_MM2 = (0.005, 1000.0)
"""Stiffness per mm of wire of a vessel's wall: the softest tube here has 0.03 N/mm2, a sheath of plastic 100."""


def odd_wall(wall: Wall) -> list[str]:
    """A sentence where a wall is stiffer or softer than any."""
    least, most = WALLS_N_MM2
    if least <= wall.stiffness_N_mm2 <= most:
        return []
    return [
        f"wall stiffness_N_mm2 = {wall.stiffness_N_mm2:g}: force per mm of wire and mm of depth; vessels and phantoms "
        f"have {least:g} to {most:g}; is it a modulus, or in another unit?"
    ]


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
