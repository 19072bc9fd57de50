"""The scan pulled straight along a wire: the wire lies in the middle, and what lies beside it is where it is."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.arrays.polyline import carried
from pipeline.model import Volume
from pipeline.run.straightened import ACROSS, MOST_PLANES, straightened

TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
WINDOW = (0.0, 100.0)


def arc_of_a_circle(length_mm: float) -> np.ndarray:
    t = np.linspace(0.0, length_mm, 200) / 20.0
    return np.column_stack([20.0 * (1 - np.cos(t)), 0.0 * t, 20.0 * np.sin(t)])


def scan(direction: np.ndarray) -> Volume:
    """A wire on the circle, as wide as two voxels, one beside it towards y, and a fainter one towards the centre."""
    spacing, shape = np.array([0.4, 0.5, 0.45]), (90, 60, 90)
    origin = np.array([10.0, 0.0, 8.0]) - direction @ (spacing * (np.array(shape) - 1) / 2)
    index = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    x, y, z = np.moveaxis(index * spacing @ direction.T + origin, -1, 0)
    values = np.zeros(shape, np.float32)
    for sideways, inwards, grey in ((0.0, 0.0, 100.0), (2.4, 0.0, 90.0), (0.0, 2.4, 45.0)):
        apart = np.hypot(np.hypot(x - 20.0, z) - 20.0 + inwards, y - sideways)
        values += grey * np.exp(-((apart / 0.6) ** 2)).astype(np.float32)
    return Volume(values, spacing, origin, direction)


@pytest.mark.parametrize("direction", [np.eye(3), TURN], ids=["aligned", "oblique"])
def test_the_wire_is_in_the_middle_and_neighbours_are_where_they_are(direction: np.ndarray) -> None:
    values, along, across, normal = straightened(scan(direction), arc_of_a_circle(16.0), WINDOW)
    middle, off = ACROSS // 2, round(2.4 / across)
    assert along == across == pytest.approx(0.3)
    assert values.shape == (54, ACROSS, ACROSS)
    assert values[:, middle, middle].min() > 170  # of 255: between voxels a wire of two voxels loses some
    # along z at the entry, the first direction is y and the second z x y, which points away from the centre
    assert normal == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    means = {(a, b): values[:, middle + a, middle + b].mean() for a, b in ((off, 0), (-off, 0), (0, off), (0, -off))}
    assert means[off, 0] > 150
    assert 70 < means[0, -off] < 130
    assert max(means[-off, 0], means[0, off]) < 10


def test_normals_are_carried_without_twist() -> None:
    """On a circle the one across its plane stays; on a helix one turns back about the tangent by its torsion."""
    z, turn = np.array([0.0, 0.0, 1.0]), np.linspace(0.0, 4.0 * np.pi, 4001)
    circle = np.stack([-np.sin(turn), np.cos(turn), 0.0 * turn], axis=1)
    np.testing.assert_allclose(carried(circle, z), np.tile(z, (len(turn), 1)), rtol=0.0, atol=1e-12)
    helix = 0.8 * circle + 0.6 * z
    inwards = np.stack([-np.cos(turn), -np.sin(turn), 0.0 * turn], axis=1)
    normals = carried(helix, inwards[0])
    np.testing.assert_allclose(np.sum(normals * helix, axis=1), 0.0, rtol=0.0, atol=1e-12)
    # torsion over the angle of the turn is 0.6, the sine of the pitch; its error goes with the step, 0.003
    np.testing.assert_allclose(np.sum(normals * inwards, axis=1), np.cos(0.6 * turn), rtol=0.0, atol=1e-3)


def test_a_long_wire_has_no_more_planes_and_what_is_outside_is_dark() -> None:
    values, along, _, _ = straightened(scan(np.eye(3)), arc_of_a_circle(200.0), WINDOW)
    assert len(values) in (MOST_PLANES, MOST_PLANES + 1)
    assert along == pytest.approx(200.0 / MOST_PLANES, rel=1e-3)
    assert values[len(values) // 2].max() == 0
