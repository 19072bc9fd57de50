"""What cannot work is a five-part ValueError at the door or a status with a sentence, never a crash or NaN."""

from __future__ import annotations

import math

import numpy as np
import pytest

from solver import Grid, GuideWire, Insertion, Insertions, Status, VesselWall, relax
from tests.solver.entry_points import outside_by
from tests.solver.scenes import sampled, tube_distance, tube_grid

WIRE = GuideWire(1.0, 0.18, 10.0)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_grid_must_be_finite(bad: float) -> None:
    values = np.zeros((4, 5, 6))
    values[1, 2, 3] = bad
    with pytest.raises(ValueError, match=r"wall: grid values: got .*\[1, 2, 3\].*; allowed: .*; fill or crop"):
        VesselWall(Grid(values), 1.0)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"segment_mm": 0.0}, "segment_mm"),
        ({"segment_mm": np.nan}, "segment_mm"),
        ({"radius_mm": -1.0}, "radius_mm"),
        ({"bending_stiffness_N_mm2": 0.0}, "bending_stiffness_N_mm2"),
        ({"bending_stiffness_N_mm2": [[5, 1.0], [0, 2.0]]}, "bending_stiffness_N_mm2"),
        ({"bending_stiffness_N_mm2": [1.0, 2.0]}, "bending_stiffness_N_mm2"),
        ({"rest_curvature_per_mm": 3.0}, "rest_curvature_per_mm"),
        ({"rest_curvature_per_mm": np.nan}, "rest_curvature_per_mm"),
        ({"torsional_stiffness_N_mm2": 0.0}, "torsional_stiffness_N_mm2"),
    ],
)
def test_wire_refuses_in_five_parts(arguments: dict[str, object], word: str) -> None:
    good: dict[str, object] = {"segment_mm": 1.0, "radius_mm": 0.18, "bending_stiffness_N_mm2": 10.0}
    with pytest.raises(ValueError, match=rf"wire: {word}: got .*; allowed: .*; \w+"):
        GuideWire(**(good | arguments))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "arguments", [{"stiffness_N_mm2": -1.0}, {"friction": -0.1}, {"hull": "samples:0"}, {"hull": "x"}]
)
def test_wall_refuses_in_five_parts(arguments: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"wall: \w+: got .*; allowed: .*; \w+"):
        VesselWall(Grid(np.zeros((4, 4, 4))), **({"stiffness_N_mm2": 1.0} | arguments))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "arguments",
    [
        {"entry_mm": [0, 0]},
        {"entry_mm": [0, np.nan, 0]},
        {"entry_direction": [0, 0, 0]},
        {"material_axis": [0, 0, 2]},
        {"method": "magic"},
        {"initial": "jump"},
        {"quadrature": "none"},
        {"step_mm": 0.0},
        {"tolerance": 0.0},
        {"max_iterations": 0},
    ],
)
def test_insertion_refuses_in_five_parts(arguments: dict[str, object]) -> None:
    good: dict[str, object] = {"entry_mm": [0, 0, 0], "entry_direction": [0, 0, 1]}
    with pytest.raises(ValueError, match=r"(insertion|solver): \w+: got .*; allowed: .*; \w+"):
        Insertion(WIRE, None, **(good | arguments))  # type: ignore[arg-type]


def test_closed_form_refuses_what_it_cannot_do() -> None:
    wire = GuideWire(1.0, 0.18, 10.0, torsional_stiffness_N_mm2=5.0)
    with pytest.raises(ValueError, match="use method newton"):
        relax(wire, depth_mm=5.0, method="closed_form")


def test_depths_must_be_depths() -> None:
    insertion = Insertion(WIRE, None, [0, 0, 0], [0, 0, 1])
    with pytest.raises(ValueError, match=r"insertion: depths_mm: got -1\.0"):
        list(insertion.to_depths([1.0, -1.0]))


def test_entry_outside_the_lumen_is_a_status() -> None:
    solution = next(Insertion(WIRE, VesselWall(tube_grid(), 1.0), [3.5, 0, 5], [0, 0, 1]).to_depths([10.0]))
    assert solution.status is Status.ENTRY_OUTSIDE
    assert solution.depth_mm == 0.0


def test_leaving_the_grid_is_a_status_and_keeps_the_last_good_state() -> None:
    wall = VesselWall(sampled(tube_distance, 0.5, (-4, -4, -4), (4, 4, 20)), 1.0)
    solution = next(Insertion(WIRE, wall, [0, 0, 0], [0, 0, 1]).to_depths([60.0]))
    assert solution.status is Status.LEFT_GRID
    assert 18.0 < solution.depth_mm < 21.0
    assert solution.joints_mm[-1, 2] == pytest.approx(solution.depth_mm)


def test_absurd_depth_is_a_status_at_once() -> None:
    solution = next(Insertion(WIRE, VesselWall(tube_grid(), 1.0), [0, 0, 0], [0, 0, 1]).to_depths([1e5]))
    assert solution.status is Status.TOO_LONG


def test_a_depth_that_no_memory_holds_is_refused_at_the_call_as_relax_refuses_it() -> None:
    """It was accepted by to_depths and a status at the first depth."""
    wire = GuideWire(0.5, 0.18, 2.0)
    insertion = Insertion(wire, None, [0, 0, 0], [0, 0, 1])
    for call in (
        lambda depth: insertion.to_depths([10.0, depth]),
        lambda depth: Insertions([insertion]).to_depths([depth]),
        lambda depth: relax(wire, depth_mm=depth),
    ):
        for depth in (1e9, 500_001.0):
            with pytest.raises(ValueError, match=r"depths?_mm: got .*; allowed: a number from .*longer segments"):
                call(depth)
    assert next(insertion.to_depths([499_999.0])).status is Status.TOO_LONG, "max_joints may be raised"


def test_no_pivot_is_stated_of_a_wire_that_is_not_at_rest() -> None:
    """Under Euler's load, after which it folds away slowly, it said 1.0: that of a free wire."""
    solution = relax(GuideWire(0.25, 0.18, 1.0), depth_mm=10.0, load_N=[0, 0, -1000 * math.pi**2 / 400])
    assert not solution.converged
    assert math.isnan(solution.least_pivot)


@pytest.mark.parametrize("lumen", [0.05, 0.1])
def test_lumen_narrower_than_the_wire_and_than_a_voxel(lumen: float) -> None:
    grid = sampled(lambda p: tube_distance(p, lumen), 0.3, (-3, -3, -3), (3, 3, 30))
    solution = next(Insertion(WIRE, VesselWall(grid, 10.0), [0, 0, 0], [0.05, 0, 1]).to_depths([20.0]))
    assert np.isfinite(solution.joints_mm).all()
    assert solution.converged
    assert solution.max_penetration_mm > 0.0


@pytest.mark.parametrize("degrees", [20.0, 60.0])
def test_misaligned_entry_ends_in_a_state_or_a_sentence(degrees: float) -> None:
    tilt = np.deg2rad(degrees)
    wire = GuideWire(1.0, 0.18, [[0, 0.5], [30, 20.0]])
    insertion = Insertion(wire, VesselWall(tube_grid(), 10.0), [0.25, 0, 2], [np.sin(tilt), 0, np.cos(tilt)])
    for solution in insertion.to_depths(np.arange(2.0, 31.0, 2.0)):
        assert np.isfinite(solution.joints_mm).all()
        assert np.isfinite(solution.energy_N_mm)
        assert solution.sentence


def test_iteration_limit_is_a_status() -> None:
    solution = relax(WIRE, depth_mm=100.0, load_N=[0.05, 0, 0], max_iterations=1)
    assert solution.status is Status.MAX_ITERATIONS
    assert "max_iterations" in solution.sentence


@pytest.mark.filterwarnings("ignore:wall")  # the box alone counts, not what is in it
@pytest.mark.parametrize("seed", range(4))
def test_how_far_outside_is_measured_in_millimetres_in_a_turned_grid_of_uneven_voxels(seed: int) -> None:
    """Against the distance to the box of whole voxels, worked out in the grid's own axes."""
    rng = np.random.default_rng(seed)
    turn, spacing, shape = np.linalg.qr(rng.normal(size=(3, 3)))[0], np.array([0.5, 0.8, 1.1]), (6, 7, 8)
    turn[:, 0] *= np.sign(np.linalg.det(turn))
    wall = VesselWall(Grid(rng.normal(size=shape), spacing, [3.0, -2.0, 5.0], turn), 1.0)
    local = rng.uniform(-3.0, 12.0, (9, 3))
    outside = np.maximum(np.maximum(-0.5 * spacing - local, local - (np.array(shape) - 0.5) * spacing), 0.0)
    joints = wall.distance.origin_mm + local @ turn.T
    for k in (1, 4, 8):
        expected = np.linalg.norm(outside[1 : k + 1], axis=1).max()
        assert outside_by(wall.field, joints - wall.middle_mm, k) == pytest.approx(expected, rel=1e-12)
