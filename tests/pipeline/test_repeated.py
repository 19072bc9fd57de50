"""Scans are known again by their voxels, whatever file and order of axes these are kept in, and by their traces."""

from dataclasses import replace
from itertools import permutations, product
from typing import cast

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipeline.arrays.fingerprint import known_by, known_with_place
from pipeline.arrays.grids import towards_lps
from pipeline.model import Curve, Volume
from pipeline.run.stages.known import Frame
from pipeline.run.stages.repeated import alike, copies, kept, once, rescanned, scanned_twice

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
    assert known_by(Volume(np.zeros((3, 3, 3), kind))) == ""


SIGMA = 0.03


def traced(noise: float, seed: int, length_mm: float = 30.0, sigma: float = SIGMA) -> Frame:
    """A frame whose trace is off a bent wire by this share of its standard deviation, smoothly, along two axes."""
    arc = np.arange(0.0, length_mm + 0.1, 0.25)
    off = np.random.default_rng(seed).normal(0.0, SIGMA * noise, (2, len(arc) // 8 + 2))
    knots = np.linspace(0.0, arc[-1], off.shape[1])
    x, y = (np.interp(arc, knots, row) * np.sqrt(1.5) for row in off)  # a line between knots has 2/3 of their variance
    points = np.stack([x + 0.01 * arc**2, y, arc], axis=1)
    tip = 0.1 if sigma == SIGMA else np.nan  # the user's own curve states none
    return Frame(seed, curve=Curve(points, np.full(len(points), sigma), tip_sigma_mm=tip))


def test_a_scan_that_was_written_again_with_some_noise_is_told() -> None:
    """One frame of five, listed again with a tenth of its noise more, had a skill of 0.997 where 0.995 was right."""
    first = traced(1.0, 0)
    assert first.curve is not None
    again = replace(first, index=1, curve=replace(first.curve, points_mm=first.curve.points_mm + [0.0, 0.003, 0.0]))
    (said,) = alike([first, again, traced(1.0, 2), traced(1.0, 3, 31.0)])
    assert said.startswith("frame 1 is traced to within 0.003 mm of frame 0 (traces are known to 0.03 mm): one scan")
    assert [f.status for f in once([first, again])] == ["ok", "ok"], "scans without noise are alike, too"


def test_two_scans_of_one_wire_are_two() -> None:
    """Each has noise of its own: none of 400 pairs is taken for one scan, were they of wires of 15 mm."""
    assert alike([traced(1.0, seed, 15.0) for seed in range(29)]) == []


def test_a_scan_that_was_calibrated_with_is_known_by_its_trace() -> None:
    """With a grey more it had other voxels, and was judged with what it had taught."""
    learnt, other = traced(1.0, 0), traced(1.0, 1)
    assert learnt.curve is not None
    seen = once([learnt, other], traced_mm=[kept(learnt.curve).round(3)])
    assert [f.status for f in seen] == ["repeated", "ok"]
    assert "of a scan that was calibrated with (" in seen[0].message


def test_an_insertion_that_looks_like_the_calibrated_one_scanned_again_is_told() -> None:
    """With noise of its own in each scan it counted as blind, without a word."""
    learnt = [kept(cast(Curve, traced(1.0, seed, 20.0 + seed).curve)) for seed in range(3)]
    again = [traced(1.0, 10 + seed, 20.0 + seed) for seed in range(3)]
    assert {f.status for f in once(again, traced_mm=learnt)} == {"ok"}
    (said,) = rescanned(again, learnt)
    assert said.startswith("frames 10, 11, 12 lie where scans that were calibrated with do")
    assert not rescanned(again[:1], learnt), "at one depth two insertions may lie alike"
    assert not rescanned([traced(1.0, seed, 40.0 + seed) for seed in range(3)], learnt)


def test_own_curves_of_the_calibrated_insertion_are_told() -> None:
    """They state no standard deviation: the insertion that had taught the parameters was judged in silence."""
    learnt = [kept(cast(Curve, traced(1.0, seed, 20.0 + seed).curve)) for seed in range(3)]
    again = [traced(0.5, 10 + seed, 20.0 + seed, sigma=np.nan) for seed in range(3)]
    assert "lie where scans that were calibrated with do" in rescanned(again, learnt)[0]
    assert not rescanned([traced(0.5, seed, 40.0 + seed, sigma=np.nan) for seed in range(3)], learnt)


@pytest.mark.parametrize("sigma", [SIGMA, np.nan, 0.0, 0.05])
def test_copies_of_another_case_are_known_and_one_wire_scanned_twice_is_doubted(sigma: float) -> None:
    """Counted as two insertions, one made standard deviations smaller by the root of 2."""
    learnt = [kept(cast(Curve, traced(1.0, seed, 20.0 + seed).curve)) for seed in range(3)]
    same = [traced(1.0, seed, 20.0 + seed, sigma) for seed in range(3)]
    found = copies(same, (), learnt, "a frame of case 'a'")
    assert [*found] == [0, 1, 2]
    assert found[0].startswith("is traced to within 0 mm of a frame of case 'a'")
    again = [traced(1.0, 10 + seed, 20.0 + seed, sigma) for seed in range(3)]
    assert not copies(again, (), learnt, "a frame of case 'a'")
    (said,) = scanned_twice(again, learnt, "a")
    assert said.startswith("frames 10, 11, 12 lie where those of case 'a' do, and count as another insertion: if it is")
    elsewhere = [traced(1.0, seed, 40.0 + seed, sigma) for seed in range(3)]
    assert not scanned_twice(elsewhere, learnt, "a")
    assert [*copies([replace(elsewhere[1], voxels="v")], ("v",), learnt, "it")] == [1]


def test_own_curves_are_known_by_their_ends_alone() -> None:
    """Nobody states how well they are known: wires of one depth may be told to a hundredth of a millimetre."""
    own = [traced(0.0, 0, sigma=np.nan), traced(0.0, 1, sigma=np.nan)]
    assert {f.status for f in once(own)} == {"ok"}
    assert alike(own) == []
