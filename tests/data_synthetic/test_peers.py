"""The true wire against a third party: PyElastica's Cosserat rods, relaxed in time, share no line with it.

Cosserat rods of Gazzola et al., R. Soc. Open Sci. 5 (2018) 171628. Both scenes: 30 mm of wire, EI = 0.5 N mm2.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from data_synthetic.anatomy.shapes import straight
from data_synthetic.rod.relax import relax
from data_synthetic.rod.rod import Rod, TrueWire, make_rod, shape_from_points

Array = NDArray[np.float64]
pytestmark = [pytest.mark.peers, pytest.mark.filterwarnings("ignore")]

LENGTH, RADIUS, STIFFNESS, WALL = 30.0, 0.18, 0.5, 0.5
ELEMENTS = 100
TILT = np.radians(20.0)
X, Y, Z = np.eye(3)


def elastica_rod(ea: Any, direction: Array, normal: Array, tube: Any = None, load: Array | None = None) -> Array:
    """Nodes (n + 1, 3) of PyElastica's rod at rest. Mass and time are arbitrary: only the end counts."""
    step = LENGTH / (ELEMENTS - 0.5)
    modulus = STIFFNESS / (np.pi * RADIUS**4 / 4)
    # its clamp holds the whole first element: half of that lies before the entry
    rod = ea.CosseratRod.straight_rod(
        ELEMENTS, -0.5 * step * direction, direction, normal, LENGTH + 0.5 * step, RADIUS, 1.0,
        youngs_modulus=modulus, shear_modulus=modulus / 1.5,
    )  # fmt: skip

    class Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):  # type: ignore[misc]
        pass

    simulator = Simulator()
    simulator.append(rod)
    simulator.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
    if load is not None:
        simulator.add_forcing_to(rod).using(ea.EndpointForces, np.zeros(3), load, ramp_up_time=10.0)
    if tube is not None:
        simulator.add_forcing_to(rod).using(tube_force(ea, step))
    time_step = 0.2 * step / np.sqrt(modulus)
    simulator.dampen(rod).using(ea.AnalyticalLinearDamper, damping_constant=0.03, time_step=time_step)
    simulator.finalize()
    stepper, now = ea.PositionVerlet(), 0.0
    while now < 2500.0:
        for _ in range(2000):
            now = stepper.step(simulator, now, time_step)
        if now > 700.0 and np.abs(rod.velocity_collection).max() < 1e-6:
            break
    return np.array(rod.position_collection.T)


def tube_force(ea: Any, step: float) -> Any:
    """A straight tube of radius 2 mm along z: k times penetration per mm, half at the tip."""

    class Tube(ea.NoForces):  # type: ignore[misc]
        def apply_forces(self, system: Any, time: float = 0.0) -> None:
            across = system.position_collection[:2]
            distance = np.hypot(*across) + 1e-12
            # the tube closes in slowly: thrown against a wall, the rod would fold
            width = 2.0 + 10.0 * max(0.0, 1.0 - time / 600.0)
            push = -WALL * step * np.maximum(distance + RADIUS - width, 0.0)
            push[-1] *= 0.5
            system.external_forces[:2] += push * across / distance

    return Tube


def truth(rod: Rod) -> Array:
    places = np.concatenate([[0.0], np.cumsum(rod.lengths)])
    start = shape_from_points(rod, places[:, None] * rod.elastic.introducer)
    return relax(rod, start, 1e-8, 3000).shape.points


def apart(a: Array, b: Array) -> float:
    """Largest distance at equal arc length, both measured back from the tip."""
    places = np.linspace(0.0, LENGTH - 0.5, 150)
    return float(np.max(np.linalg.norm(from_tip(a, places) - from_tip(b, places), axis=1)))


def from_tip(points: Array, places: Array) -> Array:
    back = points[::-1]
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(back, axis=0), axis=1))])
    return np.column_stack([np.interp(places, arc, back[:, a]) for a in range(3)])


WIRE = TrueWire(RADIUS, ((0.0, STIFFNESS),), ((0.0, 0.0),))


def test_cantilever_with_a_dead_load(capsys: pytest.CaptureFixture[str]) -> None:
    ea = pytest.importorskip("elastica", reason="needs the extra [peers]")
    load = 5.0 * STIFFNESS / LENGTH**2 * X
    rod = make_rod(WIRE, Z, X, LENGTH, 0.2)
    loads = np.zeros((len(rod.lengths) + 1, 3))
    loads[-1] = load
    close(truth(replace(rod, loads_N=loads)), elastica_rod(ea, Z, X, load=load), "cantilever", capsys)


def test_wire_pressed_against_a_tube(capsys: pytest.CaptureFixture[str]) -> None:
    ea = pytest.importorskip("elastica", reason="needs the extra [peers]")
    direction = np.array([np.sin(TILT), 0.0, np.cos(TILT)])
    normal = np.array([np.cos(TILT), 0.0, -np.sin(TILT)])
    tube = straight(length_mm=60.0, radius_mm=2.0)
    rod = replace(make_rod(WIRE, direction, normal, LENGTH, 0.2), wall=tube, stiffness_N_mm2=WALL)
    mine = truth(rod)
    assert np.any(np.hypot(mine[:, 0], mine[:, 1]) > 2.0 - RADIUS)  # it does touch
    close(mine, elastica_rod(ea, direction, normal, tube=True), "pressed against a tube", capsys)


def close(mine: Array, theirs: Array, scene: str, capsys: pytest.CaptureFixture[str]) -> None:
    distance = apart(mine, theirs)
    with capsys.disabled():
        print(f"\ntruth against PyElastica, {scene}: {distance:.4f} mm apart at most, of {LENGTH:.0f} mm")
    assert distance < 0.05
