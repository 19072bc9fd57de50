"""No stationary point that is not a minimum is called converged: a straight wire beyond its critical load is left."""

from __future__ import annotations

import numpy as np
import pytest

from solver import GuideWire, Status, relax
from tests.analytic import hencky_load

STIFFNESS = 10.0


def neutral_load(m: int) -> float:
    """Load at which the last m joints of a long wire of 1 mm segments are neutral: Hencky's chain on a whole cell."""
    return 4 * STIFFNESS * np.sin(np.pi / (2 * (2 * m + 1))) ** 2


def test_straight_wire_at_a_thousand_times_its_critical_load_is_left() -> None:
    solution = relax(GuideWire(1, 0.18, STIFFNESS), None, depth_mm=50, load_N=[0, 0, -10])
    assert 10 / hencky_load(STIFFNESS, 1.0, 50) == pytest.approx(1000, rel=0.02)
    assert solution.converged
    # straight it has F L = 500 N mm; hanging down from a hairpin -F L and what the hairpin costs
    assert -500 < solution.energy_N_mm < -450


@pytest.mark.parametrize("m", [1, 2, 3, 5, 8, 12])
@pytest.mark.parametrize("off", [-1e-9, 0.0, 1e-9])
def test_a_neutral_tail_hides_no_way_down(m: int, off: float) -> None:
    """Eliminating the neutral joints foretells any fall at all: the way down is to be found in spite of that."""
    load = neutral_load(m) * (1 + off)
    solution = relax(GuideWire(1.0, 0.18, STIFFNESS), depth_mm=24.0, load_N=[0, 0, -load])
    assert solution.converged
    assert solution.energy_N_mm < 0.9 * 24.0 * load


@pytest.mark.parametrize("twist", [np.inf, 5.0])
@pytest.mark.parametrize("load", np.geomspace(0.06, 1e5, 14))
def test_no_load_beyond_the_critical_one_leaves_a_wire_straight(load: float, twist: float) -> None:
    wire = GuideWire(1.0, 0.18, STIFFNESS, torsional_stiffness_N_mm2=twist)
    solution = relax(wire, depth_mm=24.0, load_N=[0, 0, -load])
    assert load > hencky_load(STIFFNESS, 1.0, 24)
    assert solution.energy_N_mm < 24.0 * load * (1.0 - 1e-3)
    assert solution.status is not Status.CONVERGED or solution.energy_N_mm < 0.99 * 24.0 * load


def test_without_a_way_down_a_steep_saddle_is_not_called_converged() -> None:
    """The seed's sweeps start from a gradient, and have none here: they must say that this is no minimum."""
    wire = GuideWire(1.0, 0.18, STIFFNESS)
    solution = relax(wire, depth_mm=24.0, load_N=[0, 0, -10.0], method="closed_form")
    assert not solution.converged
