"""What a manifest says of a wire and no guide wire has: most of all a value in another unit."""

from collections.abc import Iterable, Iterator

import numpy as np

from pipeline.model import Wire
from pipeline.study.manifest import Case

RADII_MM = (0.1, 0.5)
"""Guide wires of 0.008 to 0.038 inch: radii of 0.10 to 0.48 mm."""
SOFTEST_GPA, STIFFEST_GPA = 0.1, 400.0
"""Moduli that a solid rod would bend like the wire's stiffest part with: rubber's and tungsten's. Guide wires of 0.035
inch were measured at 9.5 to 158 GPa (Harrison et al., J Endovasc Ther 18, 2011, doi 10.1583/11-3592.1); the wires of
the catalogue have 4.9. A factor of 1000 takes any of them out of this range."""


def implausible(cases: Iterable[Case]) -> list[str]:
    """Sentences on the wires of these cases, a wire of several cases once."""
    return list(dict.fromkeys(f"wire {case.wire.name!r}: {text}" for case in cases for text in _oddities(case.wire)))


def _oddities(wire: Wire) -> Iterator[str]:
    radius, (thinnest, thickest) = wire.radius_mm, RADII_MM
    if not thinnest <= radius <= thickest:
        what = "is it the diameter, or in another unit?" if radius > thickest else "is it in another unit?"
        yield f"radius_mm = {radius:g}: guide wires have {thinnest:g} to {thickest:g} mm; {what}"
    most = float(np.max(np.atleast_2d(wire.bending_stiffness_N_mm2)[:, -1]))
    of_1_gpa = 1000.0 * 0.25 * np.pi * radius**4
    modulus = most / of_1_gpa
    if not SOFTEST_GPA <= modulus <= STIFFEST_GPA:
        least, largest = SOFTEST_GPA * of_1_gpa, STIFFEST_GPA * of_1_gpa
        yield (
            f"bending_stiffness_N_mm2 of {most:.3g} at the most: a rod of radius_mm = {radius:g} has {least:.2g} (of "
            f"rubber) to {largest:.3g} N mm2 (of tungsten), and guide wires lie between; is it in another unit, or the "
            "radius wrong?"
        )
