"""Scans are known again by their voxels, whatever file and order of axes these are kept in."""

from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.arrays.fingerprint import known_by, known_with_place
from pipeline.arrays.grids import towards_lps
from pipeline.model import Volume

OBLIQUE = Rotation.from_rotvec([0.1, 0.2, -0.15]).as_matrix()


def stored_otherwise(volume: Volume) -> list[Volume]:
    """One scan in space, its axes in every order and sense and its memory in both."""
    out = []
    for order, turned in product(permutations(range(3)), product([False, True], repeat=3)):
        back = tuple(axis for axis in range(3) if turned[axis])
        values, direction = np.flip(volume.values.transpose(order), back), volume.direction[:, list(order)].copy()
        first = np.where(turned, np.array(values.shape) - 1, 0)
        origin = volume.origin_mm + direction @ (volume.spacing_mm[list(order)] * first)
        direction[:, back] *= -1.0
        spacing = volume.spacing_mm[list(order)]
        out += [Volume(np.array(values, order=memory), spacing, origin, direction) for memory in ("C", "F")]
    return out


@pytest.mark.parametrize("kind", ["int16", "float32"])
def test_one_scan_whose_axes_are_stored_in_another_order_is_one(kind: str) -> None:
    """Saved as RAS and with its axes permuted, one insertion counted as three and had an interval."""
    values = (100.0 * np.random.default_rng(0).normal(size=(7, 9, 11))).astype(kind)
    scan = Volume(values, [0.3, 0.4, 0.5], [1.0, 2.0, 3.0], OBLIQUE)
    others = stored_otherwise(scan)
    assert len(others) == 96
    for other in others:
        at = tuple(np.rint(other.to_index(scan.to_mm([2, 3, 4]))).astype(int))
        assert other.values[at] == values[2, 3, 4], "it is the same scan in space"
        np.testing.assert_array_equal(towards_lps(other), values)
        assert known_by(other) == known_by(scan)
        assert known_with_place(other) == known_with_place(scan)
    assert known_with_place(replace(scan, origin_mm=scan.origin_mm + 0.1)) != known_with_place(scan)


def test_another_scan_is_another() -> None:
    rng = np.random.default_rng(1)
    first = Volume(rng.integers(0, 99, (7, 9, 11)).astype(np.int16))
    changed = first.values.copy()
    changed[3, 4, 5] += 1
    assert known_by(Volume(changed)) != known_by(first)


@pytest.mark.parametrize("kind", ["uint8", "int16", "uint16", "float32"])
def test_a_scan_in_other_units_is_the_same_scan(kind: str) -> None:
    """One insertion as raw values and in Hounsfield units counted as two, and one could be calibrated and judged."""
    values = np.random.default_rng(2).integers(0, 99, (7, 9, 11))
    keys = {known_by(Volume((gain * values + offset).astype(kind))) for gain in (1, 2) for offset in (0, 3, 50)}
    assert len(keys) == 1
    assert known_by(Volume(np.zeros((3, 3, 3), kind))) not in keys
