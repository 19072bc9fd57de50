"""A wire that has come through a wall is never called at rest; one that only presses on a wall is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, zoom

from solver import Grid, GuideWire, Insertion, Solution, Status, VesselWall, relax
from solver import _tolerances as tol
from tests.later import later
from tests.solver.scenes import Array, Distance, fork_distance, sampled

CURVED = [[0, 0.3], [6, 0.3], [6, 0.0]]
TAPERED = [[0, 1.0], [15, 4.0]]


def tube(at: tuple[float, float, float], along: tuple[float, float, float], radius: float) -> Distance:
    """A straight tube through a point."""
    u = np.array(along) / np.linalg.norm(along)

    def distance(p: Array) -> Array:
        d = p - np.array(at)
        return np.asarray(np.linalg.norm(d - (d @ u)[..., None] * u, axis=-1) - radius)

    return distance


def both(one: Distance, other: Distance) -> Distance:
    return lambda p: np.minimum(one(p), other(p))


HERE = tube((0, 0, 0), (0, 0, 1), 1.2)


def beside(gap: float, along: tuple[float, float, float] = (0, 0, 1)) -> Distance:
    """A vessel with a septum of ``gap`` mm between it and ``HERE``, at z = 6 mm where they are not parallel."""
    return tube((2.4 + gap, 0, 6), along, 1.2)


def wall_of(distance: Distance, voxel: float = 0.3, stiffness: float = 1.0, length: float = 30.0) -> VesselWall:
    return VesselWall(sampled(distance, voxel, (-4, -4, -3), (8, 4, length), "float32"), stiffness)


def pushed(wire: GuideWire, wall: VesselWall, depths: Array, **how: object) -> list[Solution]:
    insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0], **how)  # type: ignore[arg-type]
    return list(insertion.to_depths(depths))


def strays(solution: Solution, other: Distance) -> bool:
    """Whether the tip lies nearer to the other vessel than to its own, or a part of the wire in it."""
    x = solution.joints_mm
    mine, its = HERE(x), other(x)
    return bool((mine[-1] > 0.0 and its[-1] < mine[-1] - 0.3) or np.any((mine > 0.25) & (its < 0.0)))


def test_the_wire_does_not_come_through_a_septum_of_two_voxels() -> None:
    other = beside(0.6)
    wire = GuideWire(0.5, 0.18, TAPERED, CURVED)
    found = pushed(wire, wall_of(both(HERE, other)), np.arange(1.0, 26.0))
    assert not any(strays(s, other) for s in found)
    first = next(s for s in found if not s.converged)
    assert first.status is Status.THROUGH_WALL
    assert "wall" in first.sentence
    # the last good state is kept, and it is what later depths return, to the shortest of the steps that are tried
    before = [s for s in found if s.converged][-1]
    assert before.depth_mm <= first.depth_mm <= found[-1].depth_mm < first.depth_mm + 0.005
    np.testing.assert_allclose(first.joints_mm, found[-1].joints_mm, rtol=0.0, atol=0.02)


def smoothed(grid: Grid, sigma: float) -> Grid:
    values = gaussian_filter(np.asarray(grid.values, np.float64), sigma / grid.spacing_mm, mode="nearest")
    return Grid(values, grid.spacing_mm, grid.origin_mm)


def resampled(grid: Grid, times: int, order: int) -> Grid:
    sizes = [(n - 1) * times + 1 for n in grid.values.shape]
    values = zoom(np.asarray(grid.values, np.float64), np.array(sizes) / grid.values.shape, order=order)
    return Grid(values, grid.spacing_mm / times, grid.origin_mm)


def wall_with(gap: float, voxel: float, change: Callable[[Grid], Grid], stiffness: float = 1.0) -> VesselWall:
    distance = both(HERE, beside(gap))
    return VesselWall(change(sampled(distance, voxel, (-3, -3, -2), (6, 3, 16), "float64")), stiffness)


@pytest.mark.parametrize(
    ("voxel", "sigma"), [(0.1, 0.5), (0.3, 0.45), *later((0.1, 0.2), (0.1, 0.3), (0.15, 0.3), (0.3, 0.3))]
)
@pytest.mark.parametrize("stiffness", [0.5, 1.0])
def test_a_smoothed_map_has_its_septum_still(voxel: float, sigma: float, stiffness: float) -> None:
    """What people have: a Gaussian rounds the ridge over several voxels, and leaves 0.01 mm and more of it above 0."""
    wall = wall_with(0.6, voxel, lambda grid: smoothed(grid, sigma), stiffness)
    assert wall.look_up([1.5, 0.0, 8.0])[0][0] > 0.01
    found = pushed(GuideWire(0.5, 0.18, TAPERED, CURVED), wall, np.arange(1.0, 13.0))
    assert found[-1].status is Status.THROUGH_WALL
    assert not any(strays(s, beside(0.6)) for s in found)


@pytest.mark.parametrize(("voxel", "times", "order"), [(0.6, 6, 3), (0.5, 5, 1), *later((0.6, 4, 3), (0.3, 3, 3))])
def test_a_resampled_map_has_its_septum_still(voxel: float, times: int, order: int) -> None:
    wall = wall_with(0.6, voxel, lambda grid: resampled(grid, times, order), 0.5)
    found = pushed(GuideWire(0.5, 0.18, TAPERED, CURVED), wall, np.arange(1.0, 13.0))
    assert found[-1].status is Status.THROUGH_WALL
    assert not any(strays(s, beside(0.6)) for s in found)


@pytest.mark.quick(2)
@pytest.mark.parametrize("lumen", ["hairpin", "necked", "narrowed", "carina"])
@pytest.mark.parametrize("change", [(0.1, 0.3), (0.2, 0.3), (0.3, 0.45)])
def test_no_false_alarm_in_smoothed_maps(lumen: str, change: tuple[float, float]) -> None:
    voxel, sigma = change
    grid = sampled(globals()[lumen], voxel, (-4, -4, -3), (8, 4, 20), "float64")
    wall = VesselWall(smoothed(grid, sigma), 0.3)
    for rest, roll in ((0.0, 0.0), (0.15, 130.0)):
        wire = GuideWire(1.0, 0.18, [[0, 0.5], [10, 1.0]], [[0, rest], [5, rest], [5, 0]])
        insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0])
        assert not any(s.status is Status.THROUGH_WALL for s in insertion.to_depths(np.arange(1.0, 17.0), roll))


@pytest.mark.parametrize("bend", [5.0, 6.0, 12.0])
def test_the_inner_wall_of_a_bend_is_no_crease(bend: float) -> None:
    """There the wire lies: to look for another vessel at each of its joints would cost as much as the step."""

    def ring(p: Array) -> Array:
        return np.hypot(np.hypot(p[..., 0] + bend, p[..., 2]) - bend, p[..., 1]) - 1.2

    for voxel in (0.1, 0.3):
        grid = sampled(ring, voxel, (-bend - 0.5, -2, -1), (2, 2, bend + 3), "float64")
        marks = VesselWall(grid, 1.0).field.creases
        for angle in np.linspace(0.1, 1.4, 8):
            place = (bend - 1.2) * np.array([np.cos(angle), 0.0, np.sin(angle)]) - [bend, 0.0, 0.0]
            block = ((place - grid.origin_mm) / voxel / tol.CREASE_BLOCK).astype(int)
            assert not marks[tuple(block)]


@pytest.mark.parametrize("method", ["newton", "closed_form"])
def test_small_steps_do_not_carry_it_through(method: str) -> None:
    """Each step rests on the ridge, or next to it."""
    other, wire = beside(0.6), GuideWire(0.5 if method == "newton" else 1.0, 0.18, TAPERED, CURVED)
    wall = wall_of(both(HERE, other), stiffness=1.0 if method == "newton" else 0.3, length=14.0)
    how: dict[str, object] = {"step_mm": 0.1} if method == "newton" else {"tolerance": 1e-6, "max_iterations": 50}
    found = pushed(wire, wall, np.arange(0.5, 9.0, 0.1 if method == "newton" else 0.5), method=method, **how)
    assert not any(strays(s, other) for s in found)
    assert found[-1].status is Status.THROUGH_WALL


WAYS = {"parallel": (0, 0, 1), "across": (0, 1, 0), "oblique": (0, 1, 1)}


@pytest.mark.quick(1)
@pytest.mark.parametrize("gap", [0.0, 0.6, *later(0.3)])
def test_vessels_that_touch(gap: float) -> None:
    """Random walls, wires, tips and voxels; a septum that the grid does not hold (gap 0) is none to pass, either."""
    rng, outcomes = np.random.default_rng(7), []
    for way in [*WAYS.values()] * 10:
        other = beside(gap, way)
        wall = wall_of(both(HERE, other), rng.choice([0.2, 0.3, 0.4]), 10 ** rng.uniform(-1, 1), 16.0)
        soft, curvature = 10 ** rng.uniform(-0.7, 0.5), rng.uniform(0.1, 0.4)
        rest = [[0, curvature], [6, curvature], [6, 0]]
        wire = GuideWire(rng.choice([0.5, 1.0, 2.0]), 0.18, [[0, soft], [15, 4 * soft]], rest)
        found = pushed(wire, wall, np.arange(1.0, 13.0))
        assert not any(strays(s, other) for s in found if s.converged)
        outcomes.append(found[-1].status)
    assert 1 < outcomes.count(Status.THROUGH_WALL) < 24, "some wires try, most do not"


def test_an_aneurysm_that_touches_another_vessel() -> None:
    def dome(p: Array) -> Array:
        return np.asarray(np.linalg.norm(p - np.array([1.8, 0, 8.0]), axis=-1) - 2.2)

    other = tube((5.3, 0, 0), (0, 0.3, 1), 1.2)
    wire = GuideWire(0.5, 0.18, 0.5, [[0, 0.2], [10, 0.2], [10, 0.0]])
    found = pushed(wire, wall_of(both(both(HERE, dome), other), stiffness=0.3), np.arange(1.0, 25.0))
    assert not any(np.any(other(s.joints_mm) < -0.3) for s in found)


def hairpin(p: Array) -> Array:
    """Two limbs with 0.7 mm of wall between them, joined by a half circle."""
    x, y, z = p[..., 0], p[..., 1], p[..., 2]
    limbs = np.minimum(np.hypot(x, y), np.hypot(x - 3.1, y))
    return np.asarray(np.where(z < 8, limbs, np.hypot(np.hypot(x - 1.55, z - 8) - 1.55, y)) - 1.2)


def necked(p: Array) -> Array:
    dome = np.linalg.norm(p - np.array([2.2, 0, 8.0]), axis=-1) - 2.4
    return np.asarray(np.minimum(HERE(p), dome))


def stenosed(p: Array) -> Array:
    """Narrower than the wire: 0.1 mm."""
    return np.asarray(HERE(p) + 1.1 * np.exp(-(((p[..., 2] - 8) / 1.5) ** 2)))


def narrowed(p: Array) -> Array:
    """Narrower than the wire once a Gaussian has gone over it, and open still."""
    return np.asarray(HERE(p) + 0.55 * np.exp(-(((p[..., 2] - 8) / 1.5) ** 2)))


def carina(p: Array) -> Array:
    return fork_distance(p, 1.2, 0.35, 8.0)


@pytest.mark.quick(2)
@pytest.mark.parametrize("lumen", [hairpin, necked, stenosed, carina])
@pytest.mark.parametrize("stiffness", [0.1, 1.0, 30.0])
@pytest.mark.parametrize("rest", [0.0, 0.15])
def test_no_false_alarm(lumen: Callable[[Array], Array], stiffness: float, rest: float) -> None:
    """Round a tight bend, hugging a soft wall, into an aneurysm, onto a carina, through a stenosis."""
    for bending, roll in ((0.5, 0.0), (3.0, 130.0)):
        wire = GuideWire(1.0, 0.18, [[0, bending], [10, 2 * bending]], [[0, rest], [5, rest], [5, 0]])
        insertion = Insertion(wire, wall_of(lumen, stiffness=stiffness), [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0])
        found = list(insertion.to_depths(np.arange(1.0, 18.0), roll))
        assert not any(s.status is Status.THROUGH_WALL for s in found)


def test_a_start_that_leads_through_the_wall_is_judged_too() -> None:
    wall, wire = wall_of(both(HERE, beside(0.6)), stiffness=20.0), GuideWire(0.5, 0.18, 0.5)
    across = [[0, 0, 0], [0, 0, 5], [3, 0, 8], [3, 0, 20]]
    assert relax(wire, wall, depth_mm=15.0, start_mm=across).status is Status.THROUGH_WALL
    assert relax(wire, wall, depth_mm=15.0, start_mm=[[0, 0, 0], [0, 0, 20]]).converged


def test_an_entry_between_two_vessels_is_refused() -> None:
    wall, wire = wall_of(both(HERE, beside(0.6))), GuideWire(0.5, 0.18, 0.5)
    for x, status in ((1.5, Status.ENTRY_IN_SEPTUM), (1.4, Status.ENTRY_IN_SEPTUM), (1.0, Status.CONVERGED)):
        assert next(Insertion(wire, wall, [x, 0, 0], [0, 0, 1]).to_depths([3.0])).status is status
    # outside, but with lumen on one side alone
    assert next(Insertion(wire, wall, [-1.4, 0, 0], [0, 0, 1]).to_depths([3.0])).converged


@pytest.mark.parametrize("voxel", [0.3, 0.6, 0.9])
@pytest.mark.parametrize("outside", [0.01, 0.1, 0.25])
def test_an_entry_beside_the_inner_wall_of_a_bend_is_between_no_two(voxel: float, outside: float) -> None:
    """Seen from there the one vessel lies on two sides."""
    bend = 4.0

    def ring(p: Array) -> Array:
        return np.hypot(np.hypot(p[..., 0] + bend, p[..., 2]) - bend, p[..., 1]) - 1.2

    wall = VesselWall(sampled(ring, voxel, (-12, -4, -8), (4, 4, 8), "float32"), 1.0)
    insertion = Insertion(GuideWire(0.5, 0.18, 0.5), wall, [-1.2 - outside, 0, 0], [0, 0, 1])
    assert next(insertion.to_depths([2.0])).status is Status.CONVERGED


def test_a_hole_in_the_lumen_is_no_septum() -> None:
    """Noise leaves single voxels out of a thin lumen; there is one and the same vessel on all sides of them."""
    wall = wall_of(HERE, voxel=0.6)
    values = wall.distance.values.copy()
    middle = np.rint((np.zeros(3) - wall.distance.origin_mm) / 0.6).astype(int)
    values[tuple(middle)] = 0.3
    entry = wall.distance.origin_mm + 0.6 * middle
    holed = VesselWall(Grid(values, wall.distance.spacing_mm, wall.distance.origin_mm), 1.0)
    assert holed.look_up(entry)[0][0] > 0.05
    assert next(Insertion(GuideWire(0.5, 0.18, 0.5), holed, entry, [0, 0, 1]).to_depths([3.0])).converged
