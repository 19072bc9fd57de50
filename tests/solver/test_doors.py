"""Every public argument is looked at where it comes in: what cannot be used is refused by name, with what was found."""

from __future__ import annotations

import inspect
import math
import re
import sys
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

import solver
from solver import Catheter, Grid, GuideWire, Insertion, Insertions, VesselWall, doors, relax, skips, warm_up
from solver.wall import MAKE_A_DISTANCE
from tests.solver.scenes import tube_grid

WIRE = GuideWire(1.0, 0.18, 10.0)
TUBE = np.full((3, 4, 5), -1.0)
ENDLESS = np.where(np.arange(60).reshape(3, 4, 5) % 2, np.inf, -np.inf)
WALL = VesselWall(Grid(TUBE), 1.0)
MASK = np.hypot(*np.mgrid[-3:3.5, -3:3.5, 0:5][:2]) < 2.0
MASKS = [1.0 - 2.0 * MASK, 0.5 - MASK, np.where(MASK, -1e3, 1e3), np.sign(np.mgrid[-3.0:4, 0:7, 0:7][0])]

NOT_NUMBERS = [np.nan, np.inf, -np.inf, "12", "nan", b"1", None, True, np.True_, [1.0], [[1.0]], {}, 1j, object()]
NOT_NUMBERS += [np.array([1.0, 2.0]), np.array(True), np.array("1"), np.ma.masked, 10**400]
ROW = [[0, 0, 1]]
NOT_VECTORS = [np.nan, "123", ["0", "0", "1"], None, 1.0, [0.0, 1.0], [0, 0, 1, 0], ROW, [0, 0, np.nan]]
NOT_VECTORS += [[0, 0, np.inf], [None, 0, 1], [[0], [0, 1]], {}, {0.0, 1.0, 2.0}, np.array([False, False, True])]
NOT_VECTORS += [np.ma.array([0.0, 0.0, 1.0], mask=[True, False, False]), [0j, 0j, 1j], [0, 0, 10**400]]
NOT_WORDS = [None, 1, True, "", "Newton", ["newton"], np.array(["newton", "slide"]), b"newton", np.nan]
NOT_TABLES = [[], [[]], [1.0, 2.0], [[0, 1.0, 2.0]], [[0, 1], [1]], [["0", "1"]], [[np.nan, 1.0]], [[0.0, np.nan]]]
NOT_TABLES += [[[np.inf, 1.0]], [[5, 1.0], [0, 2.0]], [[-1.0, 1.0]], [[0.0, 1.0], [np.nan, 2.0]], np.ones((2, 2), bool)]
NOT_TABLES += [
    lambda s: 0.5 if s < 30.0 else 5.0,
    lambda s: math.exp(s),
    lambda s: {}[float(s[0])],
    lambda s: s * np.nan,
    lambda s: "1",
    lambda s: None,
    lambda s: s > 3.0,
    lambda s: s[:3],
    lambda s: 1e300 * s,
]
HUGE, BELOW = [1e30, 1e300, np.float64(1e18)], [0.0, -1.0, -1e-30]
ENTRY = {"entry_mm": [0, 0, 0], "entry_direction": [0, 0, 1]}
FAR = [[0, 0, 1e9], [-1e300, 0, 0]]


def wire(**arguments: Any) -> Any:
    return GuideWire(**({"segment_mm": 1.0, "radius_mm": 0.18, "bending_stiffness_N_mm2": 10.0} | arguments))


def wall(**arguments: Any) -> Any:
    return VesselWall(**({"distance": Grid(TUBE), "stiffness_N_mm2": 1.0} | arguments))


def insertion(**arguments: Any) -> Any:
    return Insertion(**({"wire": WIRE, "wall": WALL} | ENTRY | arguments))


def relaxed(**arguments: Any) -> Any:
    return relax(**({"wire": WIRE, "depth_mm": 5.0} | arguments))


def to_depths(**arguments: Any) -> Any:
    return insertion().to_depths(**({"depths_mm": [1.0, 2.0]} | arguments))


def grid(**arguments: Any) -> Any:
    return Grid(**({"values": TUBE} | arguments))


SCENE = {"wire": ["wire", None, 1.0, WALL], "wall": ["wall", 1.0, TUBE, Grid(TUBE), WIRE]}
CLAMP = {
    "entry_mm": NOT_VECTORS + FAR,
    "entry_direction": [*NOT_VECTORS, [0, 0, 0], [0, 0, 1e300]],
    "down": [v for v in NOT_VECTORS if v is not None] + [[0, 0, 0]],
    "material_axis": [v for v in NOT_VECTORS if v is not None] + [[0, 0, 2.0], [0, 0, 0]],
}
METHOD = {
    "method": NOT_WORDS,
    "quadrature": NOT_WORDS,
    "tolerance": NOT_NUMBERS + HUGE + BELOW + [1.0],
    "max_iterations": NOT_NUMBERS + HUGE + BELOW + [0.5, 1.5],
}
DOORS: dict[str, tuple[Callable[..., Any], dict[str, list[Any]]]] = {
    "wire": (
        wire,
        {
            "segment_mm": NOT_NUMBERS + HUGE + BELOW + [50.0],
            "radius_mm": NOT_NUMBERS + HUGE + [-1.0, 60.0],
            "bending_stiffness_N_mm2": [v for v in NOT_NUMBERS if not callable(v)] + NOT_TABLES + HUGE + BELOW,
            "rest_curvature_per_mm": [v for v in NOT_NUMBERS if not callable(v)] + NOT_TABLES + HUGE + [3.0, -3.0],
            "weight_N_per_mm": NOT_NUMBERS + HUGE + [-1e-6],
            "torsional_stiffness_N_mm2": [v for v in NOT_NUMBERS if v is not np.inf] + HUGE + BELOW,
        },
    ),
    "catheter": (
        lambda **how: Catheter(**({"bending_stiffness_N_mm2": 50.0, "radius_mm": 0.9} | how)),
        {"bending_stiffness_N_mm2": NOT_NUMBERS + HUGE + [-1.0], "radius_mm": NOT_NUMBERS + HUGE + BELOW + [60.0]},
    ),
    "wall": (
        wall,
        {
            "distance": [
                "x",
                None,
                TUBE,
                TUBE < 0,
                Grid(TUBE < 0),
                Grid((TUBE < 0).astype(np.uint8)),
                Grid(-TUBE),
                Grid(ENDLESS),
            ]
            + [Grid(np.where(np.arange(60).reshape(3, 4, 5) == 7, bad, -1.0)) for bad in (np.nan, np.inf, -1e30)]
            + [Grid(mask.astype(kind)) for mask in MASKS for kind in (np.float32, np.float64)],
            "stiffness_N_mm2": NOT_NUMBERS + HUGE + BELOW,
            "friction": NOT_NUMBERS + HUGE + [-0.1],
            "hull": [
                *NOT_WORDS,
                "offset ",
                "samples",
                "samples:",
                "samples:0",
                "samples:257",
                "samples:-1",
                "samples:²",
            ],
        },
    ),
    "grid": (
        grid,
        {
            "values": [
                "x",
                None,
                1.0,
                [1.0, 2.0],
                [[[1.0], [1.0, 2.0]]],
                np.zeros((2, 2)),
                np.zeros((0, 2, 2)),
                np.full((2, 2, 2), None),
                np.full((2, 2, 2), "1"),
                np.ma.array(TUBE, mask=TUBE < 0),
            ],
            "spacing_mm": [*NOT_VECTORS, [1.0, 0.0, 1.0], [1.0, -1.0, 1.0], [1e9, 1, 1]],
            "origin_mm": NOT_VECTORS + FAR,
            "direction": [*NOT_VECTORS, np.eye(2), 2 * np.eye(3), np.ones((3, 3)), np.eye(3) > 0, np.eye(3) * np.nan],
        },
    ),
    "insertion": (
        insertion,
        SCENE
        | CLAMP
        | METHOD
        | {
            "initial": NOT_WORDS,
            "catheter": ["x", 1.0, WIRE, Catheter],
            "step_mm": NOT_NUMBERS + HUGE + BELOW + [1e-12],
            "roll_step_deg": NOT_NUMBERS + HUGE + BELOW + [1e-12],
            "finest_mm": [n for n in NOT_NUMBERS if n is not np.inf] + BELOW + [1e-12],
            "shaft_mm": NOT_NUMBERS + HUGE + [-1.0],
            "shaft_friction_N": NOT_NUMBERS + HUGE + [-1.0],
            "max_joints": NOT_NUMBERS + HUGE + BELOW + [0.5, 10.5],
            "tip_load_N": [*NOT_VECTORS, [0, 0, 1e9]],
        },
    ),
    "insertions": (
        lambda insertions=(), **a: Insertions(insertions, **a),
        {
            "insertions": [None, 1.0, "x", [None], [WIRE], insertion(), [insertion(), 1.0]],
            "threads": [v for v in NOT_NUMBERS if v is not None] + HUGE + BELOW + [0.5],
        },
    ),
    "many": (
        lambda **a: Insertions([insertion(), insertion()]).to_depths(**({"depths_mm": [1.0, 2.0]} | a)),
        {
            "depths_mm": [5.0, "12", None, ["1", "2"], [-1.0], [1j], [[1.0]], [[1.0], [np.nan]], [[1.0], 2.0], {1.0}],
            "roll_deg": ["1", None, np.nan, [0.0], [0.0, np.nan], [0.0] * 3, [0.0, [0.0] * 3], [True, 0.0], {}, 1e9],
        },
    ),
    "like": (
        lambda **a: WALL.like(**a),
        {
            "stiffness_N_mm2": [v for v in NOT_NUMBERS if v is not None] + HUGE + BELOW,
            "friction": [v for v in NOT_NUMBERS if v is not None] + HUGE + [-0.1],
        },
    ),
    "shifted": (
        lambda **a: WALL.shifted(**a),
        {"offset_mm": ["x", None, 0.1, TUBE[:2], np.where(TUBE < 0, np.nan, 0.0), TUBE < 0, 1e9 * TUBE]},
    ),
    "to_depths": (
        to_depths,
        {
            "depths_mm": [
                5.0,
                "12",
                b"12",
                None,
                ["1", "2"],
                [1.0, np.nan],
                [np.inf],
                [-1.0],
                [[1.0, 2.0]],
                [None],
                [1j],
                np.array([True, False]),
                [True, False],
                {1.0, 2.0},
                {1.0: 2.0},
                np.ma.array([1.0, 2.0], mask=[0, 1]),
                10**400,
            ],
            "roll_deg": [v for v in NOT_NUMBERS if np.shape(v) != (2,)]
            + [[0.0, 0.0, 0.0], [0.0, np.nan], ["0", "0"], [[0.0, 0.0]], [True, False], np.array([True, False]), 1e9],
            "catheter_mm": [v for v in NOT_NUMBERS if np.shape(v) != (2,)] + [[0.0], [0.0, np.nan], -1.0, 1.0],
        },
    ),
    "relax": (
        relaxed,
        SCENE
        | CLAMP
        | METHOD
        | {
            "depth_mm": NOT_NUMBERS + HUGE + BELOW + [1e9, 20_001.0],
            "roll_deg": NOT_NUMBERS + HUGE,
            "start_mm": [v for v in NOT_VECTORS if v is not None]
            + [[[0, 0, 0]], [[0, 0, 0], [0, 0, 0]], [[0, 0, 0], [0, 0, np.nan]], [[0, 0], [0, 1]], np.eye(3) > 0]
            + [
                [["0", "0", "0"], ["0", "0", "1"]],
                [[0, 0, 50.0], [0, 0, 60.0]],
                np.zeros((0, 3)),
                [[0, 0, 0], [0, 0, 1e9]],
            ],
            "load_N": [v for v in NOT_VECTORS if v is not None]
            + [np.zeros((5, 3)), np.full((6, 3), np.nan), [0, 0, 1e9]],
        },
    ),
    "segments_at": (lambda **a: WIRE.segments_at(**a), {"depth_mm": NOT_NUMBERS + HUGE + [-1.0]}),
    "arcs_at": (lambda **a: WIRE.arcs_at(**a), {"depth_mm": NOT_NUMBERS + HUGE + [-1.0]}),
    "hull_points": (lambda **a: WALL.hull_points(**a), {"radius_mm": NOT_NUMBERS + HUGE + [-1.0]}),
    "look_up": (
        lambda **a: WALL.look_up(**a),
        {"points_mm": [v for v in NOT_VECTORS if v is not ROW] + [np.zeros((2, 2, 3)), *FAR]},
    ),
    "to_index": (
        lambda **a: Grid(TUBE).to_index(**a),
        {"points_mm": ["x", None, 1.0, [1.0, 2.0], [0, 0, np.nan], *FAR]},
    ),
    "beyond_mm": (
        lambda **a: Grid(TUBE).beyond_mm(**a),
        {"points_mm": ["x", None, 1.0, [1.0, 2.0], [0, 0, np.nan], *FAR]},
    ),
    "to_mm": (lambda **a: Grid(TUBE).to_mm(**a), {"index": ["x", None, 1.0, [1.0, 2.0], [0, 0, np.nan], [True] * 3]}),
    "with_values": (lambda **a: Grid(TUBE).with_values(**a), {"values": ["x", None, 1.0, np.zeros((2, 2))]}),
    "crop": (
        lambda **a: Grid(TUBE).crop(**({"start": (0, 0, 0), "stop": (2, 2, 2)} | a)),
        {
            "start": ["x", None, 1, (0, 0), (-1, 0, 0), (2, 0, 0), (0.5, 0, 0), (np.nan, 0, 0), (True, False, False)],
            "stop": ["x", None, 1, (2, 2), (2, 2, 9), (4, 2, 2), (0, 2, 2), (1.5, 2, 2), (np.nan, 2, 2)],
        },
    ),
    "warm_up": (warm_up, {"beside": [None, "yes", 2, 1.0, [True], np.nan]}),
}
CASES = [
    pytest.param(call, name, values, id=f"{door}-{name}")
    for door, (call, arguments) in DOORS.items()
    for name, values in arguments.items()
]


@pytest.mark.parametrize(("call", "name", "values"), CASES)
def test_what_cannot_be_used_is_refused_by_name_at_the_call(
    call: Callable[..., Any], name: str, values: list[Any]
) -> None:
    word = {"distance": "(distance|grid values)", "start": "(start|crop)", "stop": "(stop|crop)"}.get(name, name)
    said = []
    for value in values:
        try:
            call(**{name: value})
        except ValueError as error:
            said.append(str(error))
        else:
            pytest.fail(f"{name} = {value!r} is not refused")
    assert [text for text in said if not re.match(rf"(?s)\w+: {word}: got .+; allowed: .+; \w+", text)] == []


def test_the_ends_of_a_range_lie_within_it() -> None:
    allowed = doors.Range(0.5, 2.0, "1 is usual")
    assert [doors.number("wall", "k", end, allowed) for end in (0.5, 2.0, np.float32(0.5), np.array(2))] == [
        0.5,
        2,
        0.5,
        2,
    ]
    for beyond in (np.nextafter(0.5, 0.0), np.nextafter(2.0, 3.0)):
        with pytest.raises(ValueError, match=r"got [0-9.]+; allowed: a number from 0\.5 to 2"):
            doors.number("wall", "k", beyond, allowed)


@pytest.mark.parametrize("kind", [float, np.float32, np.float64, np.array])
def test_ideal_torque_control_may_be_of_any_kind_of_float(kind: Any) -> None:
    """numpy.float32(inf) was refused with "got inf", which is the default."""
    assert not wire(torsional_stiffness_N_mm2=kind(np.inf)).twists


def test_two_voxels_along_each_axis_are_enough_for_a_wall() -> None:
    """One is not."""
    x = np.mgrid[0:2, 0:2, 0:2][0].astype(float) - 0.25
    wall = VesselWall(Grid(x), 1.0)
    np.testing.assert_allclose(wall.look_up([[0.25, 0.5, 0.5]])[0], 0.0, rtol=0.0, atol=1e-12)
    with pytest.raises(ValueError, match="at least 2 voxels"):
        VesselWall(Grid(x[:1]), 1.0)


def test_no_public_argument_is_left_out() -> None:
    """What stands in ``solver.__all__``, its public methods, and every argument of theirs is in the list above."""
    listed = {name: set(arguments) for name, (_, arguments) in DOORS.items()}
    classes = {"wire": GuideWire, "catheter": Catheter, "wall": VesselWall, "grid": Grid, "insertions": Insertions}
    classes |= {"insertion": Insertion}
    calls: dict[str, Any] = dict(classes) | {"relax": relax, "warm_up": warm_up}
    for kind in classes.values():
        calls |= {n: f for n, f in vars(kind).items() if inspect.isfunction(f) and not n.startswith("_")}
    # of the two ways to depths the loop kept one
    calls["many"] = Insertions.to_depths
    results = {"Snap", "Solution", "Status"}
    assert set(solver.__all__) - results == {c.__name__ for c in classes.values()} | {"relax", "warm_up"}
    for name, call in calls.items():
        arguments = set(inspect.signature(call).parameters) - {"self"}
        assert arguments == listed.get(name, set()), name


junk = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True),
    st.integers(-(10**20), 10**20),
    st.text(max_size=5),
    st.booleans(),
    st.none(),
    st.lists(st.floats() | st.booleans() | st.text(max_size=2) | st.none(), max_size=4),
    st.lists(st.lists(st.floats(), max_size=3), max_size=3),
)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.sampled_from(["depth_mm", "roll_deg", "start_mm", "load_N", *CLAMP]), junk)
def test_whatever_is_given_nothing_undefined_is_called_converged(name: str, value: Any) -> None:
    solution, refusal = None, ""
    try:
        solution = relaxed(**{name: value, "max_iterations": 20})
    except ValueError as error:
        refusal = str(error)
    if solution is None:
        assert refusal.split(": ")[1] == name
        return
    assert np.isfinite(solution.joints_mm).all()
    assert np.isfinite(solution.frames).all()
    assert np.isfinite(solution.energy_N_mm)


def test_a_skip_that_is_none_is_refused() -> None:
    with (
        pytest.raises(ValueError, match=r"^skips: name: got 'foresigt'; allowed: .*foresight.*; choose"),
        skips.off("foresigt"),
    ):
        pass


def test_a_depth_is_refused_at_the_call_and_moves_nothing() -> None:
    push = insertion(wall=VesselWall(tube_grid(), 1.0))
    next(push.to_depths([5.0]))
    with pytest.raises(ValueError, match="depths_mm"):
        push.to_depths("12")
    assert push.depth_mm == 5.0


def series(values: list[float]) -> Any:
    return pytest.importorskip("pandas").Series(values)


@pytest.mark.parametrize("kind", [tuple, np.array, series, iter, lambda values: range(1, 1 + len(values))])
def test_lists_of_any_kind_are_taken_alike(kind: Callable[[list[float]], Any]) -> None:
    """Depths were taken as a range or a Series, rolls were not."""
    values = [1.0, 2.0]
    want = [*insertion().to_depths([1.0, 2.0], [1.0, 2.0])]
    found = [*insertion().to_depths(kind(values), kind(values))]
    assert [(s.depth_mm, s.roll_deg) for s in found] == [(s.depth_mm, s.roll_deg) for s in want]
    both = Insertions([insertion(), insertion()]).to_depths(kind(values), kind([1.0, 2.0]))
    assert [[s.roll_deg for s in each] for each in both] == [[1.0, 1.0], [2.0, 2.0]]


def test_what_is_given_is_copied() -> None:
    values, spacing, rows, entry = np.array(tube_grid().values), np.ones(3), np.array([[0.0, 1.0]]), np.zeros(3)
    box, soft = Grid(values, spacing), GuideWire(1.0, 0.1, rows)
    push = insertion(wire=soft, wall=None, entry_mm=entry)
    values[:], spacing[:], rows[:], entry[:] = 7.0, 9.0, 5.0, 3.0
    assert not np.any(box.values == 7.0)
    assert box.spacing_mm.tolist() == [1.0, 1.0, 1.0]
    assert np.asarray(soft.bending_stiffness_N_mm2).tolist() == [[0.0, 1.0]]
    assert next(push.to_depths([2.0])).joints_mm[0].tolist() == [0.0, 0.0, 0.0]
    for array in (box.values, box.spacing_mm, soft.bending_stiffness_N_mm2, soft.profile.stiffness):
        assert not np.asarray(array).flags.writeable


def test_a_read_only_array_is_taken_as_it_is() -> None:
    values = solver.grid.read_only(TUBE)
    assert np.shares_memory(Grid(values).values, TUBE)


@pytest.mark.parametrize("method", ["newton", "closed_form"])
def test_an_undefined_frame_behind_the_doors_is_not_called_converged_either(
    method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.modules["solver.relax"], "base_frame", lambda *_: np.full((3, 3), np.nan))
    assert relaxed(method=method).status is solver.Status.NON_FINITE


def test_what_is_recommended_for_a_mask_leaves_thick_slices_their_lumen() -> None:
    """A filter of one voxel along each axis, 2 mm here, closed the lumen altogether."""
    spacing_mm = [0.35, 0.35, 2.0]
    y, _, z = np.meshgrid(*(np.arange(-a, a, h) for a, h in zip((4, 8, 5), spacing_mm, strict=True)), indexing="ij")
    names = {name: getattr(ndimage, name) for name in ("distance_transform_edt", "gaussian_filter")}
    mask = np.hypot(y, z) < 1.2  # along x, in the plane of the slices
    made = eval(MAKE_A_DISTANCE.partition(": ")[2], names | {"mask": mask, "spacing_mm": spacing_mm})
    assert made[mask].max() < -0.2, "0.7 by one voxel along each axis"


def test_a_distance_that_is_cut_off_is_warned_of() -> None:
    """Narrow bands: beyond them no wall pushes back, and stiff wires lay 9 mm outside the lumen, at rest."""
    grid = tube_grid()
    with pytest.warns(UserWarning, match=r"cut off at 0.5 mm outside the lumen.*up to 3 mm"):
        VesselWall(grid.with_values(solver.grid.read_only(np.clip(grid.values, -0.5, 0.5))), 1.0)
    # a band that was resampled overshoots
    finer = ndimage.zoom(np.clip(grid.values, -0.5, 0.5), 1.5, order=3, mode="nearest")
    with pytest.warns(UserWarning, match="cut off at"):
        VesselWall(Grid(finer, grid.spacing_mm / 1.5, grid.origin_mm), 1.0)
    for most in (2.0, 3.0):
        assert not VesselWall(grid.with_values(solver.grid.read_only(np.minimum(grid.values, most))), 1.0).doubts


@pytest.mark.parametrize("across", [7, 8])
def test_a_distance_that_ends_level_at_the_side_of_its_grid_is_whole(across: int) -> None:
    """Between plates, the outermost layers: they were told to be cut off, and go on beyond the grid."""
    apart = np.abs(0.25 * (np.arange(across) - 0.5 * (across - 1))) - 0.4
    plates = np.broadcast_to(apart[None, :, None], (20, across, 40)).copy()
    assert not VesselWall(Grid(plates, [0.25] * 3, [0.0] * 3), 1.0).doubts


def test_what_is_recommended_for_a_mask_is_a_distance() -> None:
    """The formula without a filter jumped by two voxels across the wall: it was warned of, and 0.7 mm off in places."""
    spacing_mm = [0.5] * 3
    x, y, z = np.meshgrid(*(np.arange(-low, low, 0.5) + 0.07 for low in (4.0, 4.0, 8.0)), indexing="ij")
    names = {name: getattr(ndimage, name) for name in ("distance_transform_edt", "gaussian_filter")}
    recommended = eval(MAKE_A_DISTANCE.partition(": ")[2], names | {"mask": np.hypot(x - 0.3 * z, y) < 2.0} | locals())
    with warnings.catch_warnings(action="error"):
        made = VesselWall(Grid(recommended, spacing_mm, [-3.93, -3.93, -7.93]), 1.0)
    angle, along = np.meshgrid(np.arange(0.0, 6.2, 0.3), np.arange(-4.0, 4.0, 0.37))
    across = np.stack([2.0 * np.cos(angle) + 0.3 * along, 2.0 * np.sin(angle), along], axis=-1).reshape(-1, 3)
    off_mm = made.look_up(across)[0]
    assert np.abs(off_mm).max() < 0.3, "0.6 of a voxel; 1.4 without the filter"
    assert off_mm.std() < 0.08, "0.23 without the filter"


@pytest.mark.parametrize(
    ("change", "steep"),
    [(lambda d: d / 0.25, "4"), (lambda d: 1e-3 * d, "0.001"), (lambda d: (d + 2.0) ** 2 - 4.0, "3.9")],
    ids=["in voxels", "in metres", "squared"],
)
def test_a_distance_in_another_unit_is_warned_of(change: Any, steep: str) -> None:
    """Wires went into such a lumen and came to rest, on a wall many times too hard or too soft."""
    grid = tube_grid()
    with pytest.warns(UserWarning, match=f"changes by {steep} per mm across the wall"):
        VesselWall(grid.with_values(solver.grid.read_only(change(grid.values.astype(np.float64)))), 1.0)


@pytest.mark.parametrize(
    "change",
    [
        lambda d: ndimage.distance_transform_edt(d >= 0.0),
        lambda d: ndimage.gaussian_filter(ndimage.distance_transform_edt(d >= 0.0), 1),
        lambda d: d + 2.0,
        np.abs,
    ],
    ids=["outside alone", "outside alone, filtered", "to the centreline", "without a sign"],
)
def test_a_grid_without_a_lumen_is_warned_of(change: Any) -> None:
    """Wires came to rest in it, up to 1.8 mm off and with a push of 1.7 N in place of 0.002."""
    grid = tube_grid()
    with pytest.warns(UserWarning, match=r"least value is .* mm, so that the grid holds no lumen.*subtract the vessel"):
        VesselWall(grid.with_values(solver.grid.read_only(change(grid.values.astype(np.float64)))), 1.0)


def test_distances_that_were_not_smoothed_are_named_as_such() -> None:
    inside = tube_grid().values < 0.0
    halves = (ndimage.distance_transform_edt(half, 0.25) for half in (~inside, inside))
    with pytest.warns(UserWarning, match=r"changes by 2 per mm .*two distance transforms that was not smoothed"):
        VesselWall(Grid(np.subtract(*halves), [0.25] * 3), 1.0)


@pytest.mark.parametrize(
    ("call", "arguments", "advice"),
    [
        (grid, {"spacing_mm": [0.4, 0.4, -0.4]}, "spacing is above 0: turn an axis round in `direction`"),
        (grid, {"spacing_mm": 0.4}, "write [0.4, 0.4, 0.4]"),
        (grid, {"direction": (1, 0, 0, 0, 1, 0, 0, 0, 1)}, "numpy.reshape(image.GetDirection(), (3, 3))"),
        (wire, {"rest_curvature_per_mm": 6.7}, "it is 1/radius, in radians per mm: 0.15 for a J of 6.7 mm"),
        (wire, {"bending_stiffness_N_mm2": [0.5, 5.0]}, "write a number, [[distance from tip mm, value], ...]"),
        (wire, {"bending_stiffness_N_mm2": lambda s: 0.5 if s < 30.0 else 5.0}, "for an if, numpy.where"),
        (Catheter, {"bending_stiffness_N_mm2": 0.9, "radius_mm": 60.0}, "Catheter(bending_stiffness_N_mm2, radius_mm)"),
    ],
)
def test_a_refusal_says_how_to_write_it(call: Callable[..., Any], arguments: dict[str, Any], advice: str) -> None:
    """They said to leave a spacing out, to write plain numbers, and to shorten the segments for a radius of 6.7 mm."""
    with pytest.raises(ValueError, match=re.escape(advice)):
        call(**arguments)


def test_a_wall_in_a_message_is_no_dump_of_its_distances() -> None:
    with pytest.raises(ValueError, match="wire: got VesselWall") as error:
        Insertion(WALL, WALL, entry_mm=[0, 0, 0], entry_direction=[0, 0, 1])  # type: ignore[arg-type]
    grid = "Grid(float64 (3, 4, 5), voxels of 1 x 1 x 1 mm)"
    assert f"got VesselWall(1 N/mm2, friction 0, offset, {grid}); allowed: a GuideWire" in str(error.value)


@pytest.mark.parametrize("lumen", [0.25, 0.5, 2.0])
@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_a_distance_in_mm_is_not_however_thin_the_lumen_or_rough_its_wall(lumen: float, noise: float) -> None:
    grid = tube_grid(lumen=lumen)
    rough = noise * np.random.default_rng(1).normal(size=grid.shape)
    VesselWall(grid.with_values(solver.grid.read_only(np.clip(grid.values + rough, -1.0, 3.0))), 1.0)
    flat = Grid(np.full((4, 4, 4), -1.0))
    VesselWall(flat, 1.0)
