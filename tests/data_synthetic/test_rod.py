"""The true wire against closed forms and against itself: independent of the simulator that it judges."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from data_synthetic.anatomy import shapes
from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.rod.relax import Equilibrium, relax
from data_synthetic.rod.replay import TrueFrame, TrueInsertion, replay
from data_synthetic.rod.rod import Rod, TrueWire, cell_means, edge_lengths, make_rod, shape_from_points
from data_synthetic.rod.truth import cached_replay
from tests.later import later

Array = NDArray[np.float64]
LENGTH, STIFFNESS = 100.0, 10.0
X, Y, Z = np.eye(3)


def cantilever(n: int, rest: float = 0.0, load_N: float = 0.0) -> Equilibrium:
    wire = TrueWire(bending_N_mm2=((0.0, STIFFNESS),), rest_curvature_per_mm=((0.0, rest),))
    rod = make_rod(wire, X, Y, LENGTH, LENGTH / n)
    loads = np.zeros((len(rod.lengths) + 1, 3))
    loads[-1, 1] = load_N
    return relax(replace(rod, loads_N=loads), straight_shape(rod), 1e-8, 3000)


def straight_shape(rod: Rod) -> object:
    places = np.concatenate([[0.0], np.cumsum(rod.lengths)])
    return shape_from_points(rod, places[:, None] * rod.elastic.introducer)


@pytest.mark.parametrize(
    ("alpha", "x", "y"),
    [(1.0, 0.94356676, 0.30172077), (10.0, 0.44500440, 0.81060902), *later((5.0, 0.61237164, 0.71379152))],
)
def test_elastica_under_a_dead_tip_load(alpha: float, x: float, y: float) -> None:
    tip = cantilever(100, load_N=alpha * STIFFNESS / LENGTH**2).shape.points[-1] / LENGTH
    np.testing.assert_allclose(tip, [x, y, 0.0], rtol=0.0, atol=1e-4)  # a tenth of the 0.1 % asked for


def test_elastica_converges_in_second_order() -> None:
    exact = np.array([0.61237164, 0.71379152, 0.0])
    errors = [
        np.linalg.norm(cantilever(n, load_N=5 * STIFFNESS / LENGTH**2).shape.points[-1] / LENGTH - exact)
        for n in (25, 50, 100)
    ]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 2.0) < 0.15), orders


def test_rest_circle_is_free_of_force_and_energy() -> None:
    curvature = 0.01
    e = cantilever(200, rest=curvature)
    angle = curvature * LENGTH
    np.testing.assert_allclose(
        e.shape.points[-1], [np.sin(angle) / curvature, (1 - np.cos(angle)) / curvature, 0], rtol=0.0, atol=5e-4
    )
    assert e.energy_N_mm < 1e-15


def test_cells_average_a_jump_exactly() -> None:
    profile = ((0.0, 0.1), (8.0, 0.1), (8.0, 0.0))
    means = cell_means(profile, np.array([0.0, 7.5, 9.0]), np.array([1.0, 8.5, 10.0]))
    np.testing.assert_allclose(means, [0.1, 0.05, 0.0], rtol=0.0, atol=1e-15)
    tapered = cell_means(((0.0, 0.5), (30.0, 5.0)), np.array([0.0, 29.0]), np.array([2.0, 31.0]))
    np.testing.assert_allclose(tapered, [0.65, 0.5 * (4.925 + 5.0)], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("depth", [2.0, 7.31, 50.0])
def test_edges_add_up_to_the_depth(depth: float) -> None:
    lengths = edge_lengths(depth, 0.2)
    assert lengths.sum() == pytest.approx(depth, abs=1e-12)
    assert 0.1 - 1e-9 <= lengths[0] <= 0.3 + 1e-9


@pytest.fixture(scope="module")
def bend() -> Anatomy:
    return shapes.bend(turn_mm=15.0)


def insertion(wall: Anatomy, step_mm: float, **changes: object) -> TrueInsertion:
    plain = TrueInsertion(TrueWire(), wall, 2.0, np.array([0, 0, -8.0]), Z, X, step_mm, 0.4)
    return replace(plain, **changes)  # type: ignore[arg-type]


def distance_apart(a: TrueFrame, b: TrueFrame) -> float:
    """Largest distance at equal arc length."""
    places = np.linspace(0, min(a.depth_mm, b.depth_mm), 200)
    return float(np.max(np.linalg.norm(at_arc(a, places) - at_arc(b, places), axis=1)))


def at_arc(frame: TrueFrame, places: Array) -> Array:
    edges = np.linalg.norm(np.diff(frame.points_mm, axis=0), axis=1)
    arc = np.concatenate([[0.0], np.cumsum(edges)])
    return np.column_stack([np.interp(places, arc, frame.points_mm[:, a]) for a in range(3)])


def test_halving_moves_the_truth_by_less_than_a_hundredth(bend: Anatomy) -> None:
    coarse, fine = (list(replay(insertion(bend, h), [15.0, 24.0])) for h in (0.4, 0.2))
    for a, b in zip(coarse, fine, strict=True):
        assert a.residual_N < 1e-7
        assert distance_apart(a, b) < 0.01


def test_wall_forces_and_clamp_balance(bend: Anatomy) -> None:
    frame = next(iter(replay(insertion(bend, 0.4), [30.0])))
    touching = np.linalg.norm(frame.contact_N, axis=1) > 0
    phi = bend.distance(frame.points_mm)
    assert touching.any()
    # a node carries its share of an edge that touches, be it the other end that does
    assert np.all(phi[touching] + 0.18 > -0.02)
    assert np.all(touching[phi + 0.18 > 0])
    assert frame.depth_mm == 30.0
    length = np.linalg.norm(np.diff(frame.points_mm, axis=0), axis=1).sum()
    assert length == pytest.approx(30.0, abs=1e-3)  # stretch of 2e4 N of axial stiffness


def test_rolling_by_half_a_turn_mirrors_a_planar_insertion(bend: Anatomy) -> None:
    """A bend in x-z and a hook in y: rolls of +90 and -90 degrees are mirror images."""
    left, right = (next(iter(replay(insertion(bend, 0.4), [20.0], r))) for r in (90.0, -90.0))
    np.testing.assert_allclose(left.points_mm * [1, -1, 1], right.points_mm, rtol=0.0, atol=1e-5)
    assert abs(left.points_mm[-1, 1]) > 0.3


def test_roll_chooses_the_branch() -> None:
    fork = shapes.bifurcation()
    for roll, side in ((0.0, 1.0), (180.0, -1.0)):
        tip = next(iter(replay(insertion(fork, 0.8), [24.0], roll))).points_mm[-1]
        assert side * tip[0] > 3.0


def test_rigid_motion_moves_the_truth_along(bend: Anatomy) -> None:
    """The whole scene turned about z by 40 degrees: the wire turns with it."""
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    here = next(iter(replay(insertion(bend, 0.4), [20.0], 30.0)))
    moved = Anatomy(tuple(replace(t, points_mm=t.points_mm @ turn.T, tangents=t.tangents @ turn.T) for t in bend.tubes))
    there = next(iter(replay(insertion(moved, 0.4, material_axis=turn @ X), [20.0], 30.0)))
    np.testing.assert_allclose(here.points_mm @ turn.T, there.points_mm, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize(
    "spoil", [lambda whole: whole[:-100], lambda whole: b"", lambda whole: whole[:60] + whole[70:]]
)
def test_a_damaged_file_of_the_cache_is_a_miss(
    bend: Anatomy, spoil: Callable[[bytes], bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file that was cut short ended in a traceback of zipfile."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    given = insertion(bend, 0.8), [4.0], [0.0]
    (before,) = cached_replay(*given)
    (path,) = tmp_path.rglob("*.npz")
    path.write_bytes(spoil(path.read_bytes()))
    (again,) = cached_replay(*given)
    np.testing.assert_array_equal(again.points_mm, before.points_mm)
