"""Friction of the true wire against Euler's capstan, and against what holds of any sliding wire."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from data_synthetic.anatomy import shapes
from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.rod import replay as replaying
from data_synthetic.rod.relax import Equilibrium, relax
from data_synthetic.rod.replay import TrueInsertion, _advance, _rod, replay
from data_synthetic.rod.rod import ELASTIC_SLIP_MM, Rod, Sliders, TrueWire, edge_lengths, shape_from_points

X, Y, Z = np.eye(3)
LOAD_N, SOFT_N_MM2 = 0.5, 0.01
DEPTH_MM, TURN_MM = 36.0, 15.0
INNER_MM = 2.0 - 0.18


@pytest.fixture(scope="module")
def bend() -> Anatomy:
    return shapes.bend(turn_mm=TURN_MM)


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """A dead load on the tip of every wire."""

    def with_load(insertion: TrueInsertion, depth: float, roll_deg: float) -> Rod:
        rod = _rod(insertion, depth, roll_deg)
        loads = np.zeros((len(rod.lengths) + 1, 3))
        loads[-1] = LOAD_N * X
        return replace(rod, loads_N=loads)

    monkeypatch.setattr(replaying, "_rod", with_load)


def soft_wire_around(bend: Anatomy, friction: float) -> TrueInsertion:
    """A wire as soft as a thread, drawn round the inner side of a bend of 90 degrees by a dead load."""
    wire = TrueWire(0.18, ((0.0, SOFT_N_MM2),), ((0.0, 0.0),))
    entry = np.array([INNER_MM, 0.0, -6.0])  # in line with the inner side, so that the clamp turns nothing
    return TrueInsertion(wire, bend, 20.0, entry, Z, X, 0.4, 0.4, friction)


def laid_around(insertion: TrueInsertion) -> Equilibrium:
    """At rest without friction: straight up, round the inner side, straight on."""
    rod = replaying._rod(insertion, DEPTH_MM, 0.0)
    arc = np.concatenate([[0.0], np.cumsum(rod.lengths)])
    turn = TURN_MM - INNER_MM
    angle = np.clip((arc - 6.0) / turn, 0.0, np.pi / 2)
    x = INNER_MM + turn * (1.0 - np.cos(angle)) + np.maximum(arc - 6.0 - turn * np.pi / 2, 0.0)
    z = -6.0 + np.minimum(arc, 6.0) + turn * np.sin(angle)
    return relax(rod, shape_from_points(rod, np.column_stack([x, 0 * x, z])), 1e-7)


def base_tension(insertion: TrueInsertion, state: Equilibrium, depth: float) -> float:
    """Tension behind the clamp: the strain of the first edge."""
    first = state.shape.points[1] - state.shape.points[0]
    length = edge_lengths(depth, insertion.step_mm)[0]
    return insertion.wire.axial_N * (float(np.linalg.norm(first)) / length - 1.0)


def drawn_then_let_in(insertion: TrueInsertion) -> tuple[float, float]:
    """Tension at the clamp after the wire was drawn back by 2 mm, and after it was let in again."""
    state, depth, tensions = laid_around(insertion), DEPTH_MM, []
    for change in (-0.4, 0.4):
        for _ in range(5):
            state = _advance(insertion, state, depth, depth + change, 0.0)
            depth += change
        tensions.append(base_tension(insertion, state, depth))
    return tensions[0], tensions[1]


@pytest.mark.usefixtures("drawn")
@pytest.mark.parametrize("friction", [0.1, 0.3])
def test_capstan(bend: Anatomy, friction: float) -> None:
    """Euler: the tension behind a turn of theta is the load times exp(-mu theta) let in, exp(mu theta) drawn back."""
    turn = np.exp(friction * np.pi / 2)
    drawn, let_in = drawn_then_let_in(soft_wire_around(bend, friction))
    assert let_in == pytest.approx(LOAD_N / turn, rel=0.01)
    assert drawn == pytest.approx(LOAD_N * turn, rel=0.01)


@pytest.mark.usefixtures("drawn")
def test_without_friction_the_tension_is_the_load(bend: Anatomy) -> None:
    for tension in drawn_then_let_in(soft_wire_around(bend, 0.0)):
        assert tension == pytest.approx(LOAD_N, rel=2e-3)


@pytest.mark.slow
def test_vanishing_friction_is_no_friction(bend: Anatomy) -> None:
    plain = TrueInsertion(TrueWire(), bend, 2.0, np.array([0, 0, -8.0]), Z, X, 0.4, 0.4)
    without, with_little = (next(iter(replay(replace(plain, friction=mu), [24.0]))).points_mm for mu in (0.0, 1e-7))
    np.testing.assert_allclose(with_little, without, rtol=0.0, atol=1e-4)


def test_friction_keeps_a_wire_where_it_was_pushed(bend: Anatomy) -> None:
    """In and out again: the frictionless wire comes back to where it was at that depth, the other one does not."""
    plain = TrueInsertion(TrueWire(), bend, 2.0, np.array([0, 0, -8.0]), Z, X, 0.4, 0.4)
    apart = []
    for mu in (0.0, 0.2):
        there, _, back = replay(replace(plain, friction=mu), [24.0, 27.0, 24.0])
        apart.append(float(np.linalg.norm(there.points_mm - back.points_mm, axis=1).max()))
    assert apart[0] < 1e-4
    assert apart[1] > 0.02


def test_sliders_never_hold_more_than_their_limit_and_derive_from_their_energy() -> None:
    rng = np.random.default_rng(0)
    points, anchor = rng.normal(size=(6, 3)), rng.normal(size=(6, 3))
    anchor[3] = points[3] + 0.3 * ELASTIC_SLIP_MM * X
    normal = rng.normal(size=(6, 3))
    sliders = Sliders(rng.uniform(0.1, 1, 6), normal / np.linalg.norm(normal, axis=1)[:, None], anchor)
    gradient, bands = np.zeros(20), np.zeros((11, 20))
    sliders.add(points, gradient, bands)
    force = gradient.reshape(-1, 4)[:, 1:]
    assert np.all(np.linalg.norm(force, axis=1) <= sliders.limit[1:] * (1 + 1e-12))
    assert np.abs(np.sum(force * sliders.normal[1:], axis=1)).max() < 1e-12
    for n in range(1, 6):
        for a in range(3):
            step = np.zeros((6, 3))
            step[n, a] = 1e-6
            slope = (sliders.energy(points + step) - sliders.energy(points - step)) / 2e-6
            assert slope == pytest.approx(force[n - 1, a], abs=1e-7)
            moved = np.zeros(20)
            sliders.add(points + step, moved, np.zeros((11, 20)))
            column = (moved - gradient)[4 * (n - 1) + 1 + a] / 1e-6
            assert column == pytest.approx(bands[0, 4 * (n - 1) + 1 + a], rel=1e-3, abs=1e-4)
