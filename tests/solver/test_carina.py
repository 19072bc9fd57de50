"""Over a carina's edge a wire may press, and not pass through the wall behind it; where it may, it is not refused."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from solver import GuideWire, Insertion, Status, VesselWall
from tests.solver.entry_points import through_wall
from tests.solver.scenes import Array, Distance, fork_distance, sampled
from tests.solver.test_septum import wall_of


def buried(x: Array, lumen: Distance) -> float:
    """Distance, mm, of the wall where a wire crosses the plane of a fork's septum; -inf where it does not."""
    out = [-np.inf]
    for a, b in pairwise(x):
        if a[0] * b[0] < 0.0:
            out.append(float(lumen(a + a[0] / (a[0] - b[0]) * (b - a))))
    return max(out)


@pytest.mark.parametrize("radius", [0.12, 0.18])
@pytest.mark.parametrize(("half", "roll"), [(0.25, 20.0), (0.35, 20.0), (0.35, 180.0)])
def test_a_narrow_carina_is_not_passed_by_sinking_into_it(half: float, roll: float, radius: float) -> None:
    """The wall's law hardly resists in a wedge: wires lay across a septum of 1.8 mm, 8 radii deep, "converged"."""

    def fork(p: Array) -> Array:
        return fork_distance(p, 0.6, half, 6.0)

    wall = VesselWall(sampled(fork, 0.3, (-6, -3, -3), (6, 3, 20), "float32"), 2.0)
    wire = GuideWire(0.5, radius, [[0, 1.0], [10, 2.0]], [[0, 0.55], [5, 0.55], [5, 0]])
    insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0])
    found = list(insertion.to_depths(np.arange(1.0, 17.0), roll))
    # the edge is known to half a voxel and no better
    assert max(buried(s.joints_mm, fork) for s in found if s.converged) < max(radius, 0.15) + 0.15
    assert found[-1].status is Status.THROUGH_WALL


def across(half: float, past: float, shift: float, pieces: int = 30) -> Array:
    """Joints of a straight wire across both limbs of a fork of lumen 1 mm, ``past`` mm beyond the carina's edge."""
    at = 1.0 / np.sin(half) + past
    x = np.linspace(-1.0, 1.0, pieces + 1) * min(at * np.tan(half), 6.0) + shift
    return np.column_stack([x, np.full_like(x, 0.03), np.full_like(x, at)])


@pytest.mark.parametrize("half", [0.3, 0.45, 0.65, 0.9])
@pytest.mark.parametrize("voxel", [0.15, 0.3])
def test_a_wall_is_seen_at_any_angle_of_the_fork(half: float, voxel: float) -> None:
    """Compared with the way through, the way around a wide fork is never long: 7 mm of wall were passed there."""
    wall = wall_of(lambda p: fork_distance(p, 1.0, half, 0.0), voxel, length=9.0)
    for shift in (0.0, 1e-7, 0.04, 0.11):  # a joint in the plane of symmetry belongs to neither side
        passed = [
            through_wall(wall.field, across(half, past, shift) - wall.middle_mm, 30, 0.18)
            for past in (2.0, 3.0, 4.0, -0.3)
        ]
        assert passed == [True, True, True, False]


@pytest.mark.parametrize("voxel", [0.2, 0.4])
def test_where_the_axis_stays_in_the_lumen_no_wall_is_passed(voxel: float) -> None:
    """In a tube of 0.5 mm beside a shallow aneurysm, the floor of the one is as near as that of the other."""

    def lumen(p: Array) -> Array:
        dome = np.linalg.norm(p - np.array([4.15, 0.0, 0.0]), axis=-1) - 3.884
        return np.asarray(np.minimum(np.hypot(p[..., 0], p[..., 1]) - 0.5, dome))

    wall = VesselWall(sampled(lumen, voxel, (-2.07, -2.07, -10.07), (9, 2.1, 12), "float32"), 3.0)
    insertion = Insertion(GuideWire(0.25, 0.18, 20.0), wall, [-0.1, 0.03, -3.0], [0.28, 0.06, 1.0])
    for found in insertion.to_depths([1.0, 2.0, 2.1, 3.0, 4.0]):
        assert lumen(found.joints_mm).max() < 0.0
        assert found.converged
