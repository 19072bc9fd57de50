"""A branch that frames show and the reference does not: tubes with a wire, drawn by formula."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial import cKDTree
from scipy.special import ndtr

from pipeline.model import Lumen, Volume
from pipeline.register import anchor, register
from pipeline.register.frames import alignment_of, sentences_of
from solver import Grid
from tests.pipeline.test_bent import LATTICE, RADIUS, SKIP, distance, line, turned, wire

MOUTH = line(0)[np.argmin(np.abs(line(0)[:, 2] - 15.0))]
BRANCH = MOUTH + np.linspace(0.0, 9.0, 100)[:, None] * np.array([0.8, 0.0, 0.6])
NOISE = 60.0


def scan(number: int, radius: float, vessel: float = 400.0, voxels: float = 0.0, gain: float = 1.0) -> Volume:
    """A frame of the tube, with a branch of this radius; the reference is number 0, without a wire."""
    move = turned(voxels, voxels, 0).moved
    deep = np.maximum(RADIUS - distance(move(line(0))), radius - distance(move(BRANCH)) if radius else -9.0)
    grey = vessel * ndtr(deep / 0.25)
    if number:
        grey += 1500.0 * np.exp(-0.5 * (distance(move(wire(0))) / 0.25) ** 2)
    grey = gain * (grey + np.random.default_rng(number).normal(0.0, NOISE, LATTICE.shape))
    return Volume(grey.astype(np.int16), LATTICE.spacing_mm, LATTICE.origin_mm)


def told(reference: Volume, frame: Volume) -> list[str]:
    lumen = Lumen(LATTICE.with_values((distance(line(0)) - RADIUS).astype(np.float32)))
    to = anchor(reference, lumen)
    found = register(frame, to, SKIP)
    assert found.trusted
    alignment = alignment_of(lumen, to.reference, SKIP, switched_on=True, own_curves=False)
    return [said for said in sentences_of(alignment, {1: found})[1] if "beside the lumen" in said]


@pytest.mark.quick(1)
@pytest.mark.parametrize(
    ("radius", "vessel", "voxels", "gain"), [(0.7, 400.0, 0.0, 1.2), (0.9, -400.0, 0.0, 1.0), (1.2, 400.0, 3.0, 0.8)]
)
def test_a_branch_that_only_the_frame_shows_is_told(radius: float, vessel: float, voxels: float, gain: float) -> None:
    """Once a wrong reference turned a wire in the wrong vessel, 3 mm off, into a frame that was ok."""
    (said,) = told(scan(0, 0.0, vessel), scan(1, radius, vessel, voxels, gain))
    place = np.array([float(v) for v in said.partition("(")[2].partition(")")[0].split(",")])
    mouth = turned(voxels, voxels, 0).moved(BRANCH)
    assert np.linalg.norm(mouth - place, axis=1).min() < 1.5


@pytest.mark.quick(1)
@pytest.mark.parametrize(("shown", "radius"), [(0.0, 0.0), (1.2, 1.2), (1.2, 0.0)])
def test_what_the_reference_shows_too_is_not_told(shown: float, radius: float) -> None:
    assert not told(scan(0, shown), scan(1, radius, gain=1.1))


def test_a_wire_that_leaves_the_lumen_is_no_branch() -> None:
    frame = scan(1, 0.0)
    out = frame.values + 1500.0 * np.exp(-0.5 * (distance(BRANCH) / 0.25) ** 2)
    assert not told(scan(0, 0.0), Volume(out.astype(np.int16), frame.spacing_mm, frame.origin_mm))


@pytest.mark.quick(2)
@pytest.mark.parametrize("shift", [-0.5, -0.4, 0.5, 1.5])
def test_bone_beside_the_vessel_is_no_branch_where_the_phantom_moved(shift: float) -> None:
    """Once 9 cells: at the next voxel its edge is half a voxel off, a third of a step of four times the contrast."""
    away, noise = distance(line(0)), np.random.default_rng(1).normal(0.0, NOISE, LATTICE.shape)
    clean = 400.0 * ndtr((RADIUS - away) / 0.25) + 1600.0 * ndtr((away - RADIUS - 0.9) / 0.25)
    moved = ndimage.shift(clean, (shift, 0.0, 0.0), order=1, mode="nearest")
    lumen = Lumen(LATTICE.with_values((away - RADIUS).astype(np.float32)))
    reference, frame = (
        Volume((grey + rest).astype(np.int16), LATTICE.spacing_mm, LATTICE.origin_mm)
        for grey, rest in ((clean, noise), (moved, noise[::-1]))
    )
    found = register(frame, anchor(reference, lumen), SKIP)
    assert found.applied
    assert not found.branch.told


def test_padding_in_the_frame_is_no_branch() -> None:
    frame = scan(1, 0.0)
    padded = np.where(np.arange(LATTICE.shape[0])[:, None, None] > 48, np.int16(300), frame.values)
    assert not told(scan(0, 0.0), Volume(padded, frame.spacing_mm, frame.origin_mm))


def test_what_lies_far_away_is_not_beside_the_lumen() -> None:
    """Once all of the box was: segmentation cuts distances off at 3 mm, 4.3 of these voxels."""
    cut = Lumen(LATTICE.with_values(np.minimum(distance(line(0)) - RADIUS, 1.2).astype(np.float32)))
    reference = scan(0, 0.0)
    shell = anchor(reference, cut).shell
    assert cKDTree(line(0)).query(shell.points_mm)[0].max() < RADIUS + 1.2
    assert len(shell.points_mm) > 1000


def test_a_branch_is_told_in_thick_slices() -> None:
    """Once two cells one above the other did not touch."""
    lattice = Grid(np.zeros((60, 60, 34), np.float32), np.array([0.3, 0.3, 0.9]), LATTICE.origin_mm)
    points = lattice.to_mm(np.stack(np.meshgrid(*map(np.arange, lattice.shape), indexing="ij"), -1).reshape(-1, 3))
    tube, branch = (cKDTree(curve).query(points)[0].reshape(lattice.shape) for curve in (line(0), BRANCH))
    noise = np.random.default_rng(2).normal(0.0, NOISE, (2, *lattice.shape))
    deep = RADIUS - tube, np.maximum(RADIUS - tube, 1.0 - branch)
    reference, frame = (
        Volume((400.0 * ndtr(d / 0.3) + rest).astype(np.int16), lattice.spacing_mm, lattice.origin_mm)
        for d, rest in zip(deep, noise, strict=True)
    )
    to = anchor(reference, Lumen(lattice.with_values((tube - RADIUS).astype(np.float32))))
    assert register(frame, to, SKIP).branch.told
