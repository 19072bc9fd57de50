"""A curved tip under a force across its plane, against a curved beam in closed form.

A joint's rest bend and its bend are one rotation vector. One after the other, they handed half of every rest bend on as
twist: 9 % too soft with segments of 1 mm, of first order. ``python -m tests.solver.test_out_of_plane`` prints the
figures of docs/evidence/solver.md.
"""

from __future__ import annotations

import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver import GuideWire, relax

EI, RADIUS_MM, LENGTH_MM = 0.5, 1.0 / 0.15, 10.0
LENGTHS_MM = (1.0, 0.5, 0.25, 0.125, 0.0625)


def exact_mm_per_N(torsional: float) -> float:
    """Deflection of the tip of a clamped arc under a force normal to its plane (Castigliano, a thin curved beam)."""
    at = np.linspace(0.0, LENGTH_MM / RADIUS_MM, 20_001)
    bending, twisting = RADIUS_MM * np.sin(at), RADIUS_MM * (1.0 - np.cos(at))
    return float(RADIUS_MM * np.trapezoid(bending**2 / EI + twisting**2 / torsional, at))


def too_soft(segment_mm: float, torsional: float = np.inf) -> float:
    """By what share of it the solver's tip gives way more."""
    force = 1e-6 * EI
    wire = GuideWire(segment_mm, 0.18, EI, 1.0 / RADIUS_MM, torsional_stiffness_N_mm2=torsional)
    axis = [1.0, 0.0, 0.0]
    found = relax(wire, None, depth_mm=LENGTH_MM, material_axis=axis, load_N=[0.0, force, 0.0], tolerance=1e-13)
    assert found.converged
    return float(found.joints_mm[-1, 1]) / (force * exact_mm_per_N(torsional)) - 1.0


@pytest.mark.parametrize("torsional", [np.inf, 10 * EI, EI, 0.4 * EI, 0.1 * EI])
def test_the_order_is_two_whatever_the_torsional_stiffness(torsional: float) -> None:
    """Errors of 0.01 to 0.2 % at 0.5 mm; halving the segments divides them by 4, within what is of fourth order."""
    coarse, fine = too_soft(0.5, torsional), too_soft(0.25, torsional)
    assert abs(coarse) < 0.002
    assert coarse / fine == pytest.approx(4.0, rel=0.15)


def test_a_wire_that_may_not_twist_has_frames_carried_parallel() -> None:
    """Each joint turns its frame by the smallest rotation between its segments (Bishop), whatever its rest bend."""
    wire = GuideWire(1.0, 0.18, EI, [[0.0, 0.2], [6.0, 0.05]])
    found = relax(wire, None, depth_mm=LENGTH_MM, load_N=[0.02, 0.03, -0.05], material_axis=[1.0, 0.0, 0.0])
    turns = Rotation.from_matrix(np.einsum("nji,njk->nik", found.frames[:-1], found.frames[1:])).as_rotvec()
    assert found.converged
    assert np.abs(turns[:, 0]).max() > 0.1
    assert np.abs(turns[:, 2]).max() < 1e-13


if __name__ == "__main__":
    for mm in LENGTHS_MM:
        sys.stdout.write(f"segments of {mm:g} mm: {100 * too_soft(mm):.2f} % too soft\n")
