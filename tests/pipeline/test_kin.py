"""Insertions into one phantom that nobody names: by where their wires lie, and by their shape."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipeline.run.kin import in_one_place, of_one_shape

Array = NDArray[np.float64]


def helix(radius_mm: float = 8.0, length_mm: float = 60.0) -> Array:
    """A wire (n, 3) on a helix that begins at the origin."""
    angle = np.arange(0.0, length_mm, 0.3) / np.hypot(radius_mm, 6.0)
    return np.stack([radius_mm * (np.cos(angle) - 1.0), radius_mm * np.sin(angle), 6.0 * angle], axis=1)


def moved(wire: Array) -> Array:
    return np.asarray(Rotation.from_rotvec([0.2, -0.4, 0.3]).apply(wire) + [30.0, -5.0, 2.0])


def test_wires_in_one_place() -> None:
    wire = helix()
    assert in_one_place(wire, wire[:120] + [0.3, 0.3, 0.3])
    assert in_one_place(wire[:120], wire)
    assert not in_one_place(wire, wire + [0.0, 0.0, 3.0]), "it begins elsewhere"
    assert not in_one_place(wire, helix(12.0)), "it goes elsewhere"
    assert not in_one_place(wire, moved(wire))


def test_wires_of_one_shape() -> None:
    wire = helix()
    assert of_one_shape(wire, moved(wire))
    assert of_one_shape(wire, moved(wire[:150] + 0.2))
    assert not of_one_shape(wire, moved(helix(12.0)))
    assert not of_one_shape(wire, wire * [1.0, 1.0, -1.0]), "a helix to the left is no helix to the right"
    line = np.outer(np.arange(0.0, 60.0), [0.0, 0.6, 0.8])
    assert not of_one_shape(line, moved(line)), "any two straight wires have one shape"
