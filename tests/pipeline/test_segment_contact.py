"""Kissing vessels: apart where the wall between them shows, a warning where it does not, none at junctions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial import cKDTree

from data_synthetic.anatomy import shapes
from pipeline.model import Volume
from pipeline.segment import contact, segment
from pipeline.status import FrameStatus, StageError
from solver.grid import Grid
from tests.later import later
from tests.pipeline import phantoms

NOISE = 100.0  # a ninth of the contrast


def scanned(anatomy, low, high, voxel, seed=0):
    """An anatomy's scan, PSF 0.8 voxel."""
    low = np.array(low, float)
    shape = np.ceil((np.array(high) - low) / voxel).astype(int)
    index = np.stack(np.meshgrid(*[np.arange(n) for n in shape], indexing="ij"), axis=-1)
    distance = anatomy.distance(index.reshape(-1, 3) * voxel + low).reshape(shape)
    clean = 100.0 + 900.0 * phantoms.partial_volume(distance, voxel)
    return Volume(phantoms.scan(clean, 0.8, NOISE, seed), [voxel] * 3, low)


def kissing(wall_mm, voxel):
    volume = scanned(shapes.kissing(wall_mm=wall_mm), (-6, -3.5, -1), (6, 3.5, 21), voxel)
    lumen = segment(volume, [[1.8 + 0.5 * wall_mm, 0.0, 10.0]])
    across = lumen.distance.to_mm(np.argwhere(lumen.distance.values < 0))[:, 0] < -0.5
    return lumen, bool(across.any())


@pytest.mark.parametrize("wall_mm", [0.6, 0.9])
def test_vessels_with_two_voxels_between_them_are_kept_apart(wall_mm):
    lumen, merged = kissing(wall_mm, 0.3)
    assert not merged
    assert lumen.warnings == ()


@pytest.mark.parametrize(("wall_mm", "voxel"), [(0.0, 0.3), (0.15, 0.5), *later((0.15, 0.3), (0.3, 0.3))])
def test_vessels_that_merge_are_warned_of_where_they_do(wall_mm, voxel):
    lumen, merged = kissing(wall_mm, voxel)
    assert merged
    assert lumen.counters["touching_places"] == 1
    assert "open to each other in 1 place" in lumen.warnings[0]
    place = [float(c) for c in lumen.warnings[0].split("at [")[1].split("]")[0].split(",")]
    np.testing.assert_allclose(place, [0.0, 0.0, 10.0], rtol=0.0, atol=2.0)


def pressed_flat(membrane_mm, length_mm=10.0, voxel=0.3, radius_mm=1.5):
    """Two vessels that a membrane parts, pressed flat against each other over a length and bent away beyond."""
    shape = (60, 24, 90)
    x, y, z = ((np.indices(shape)[n] - 0.5 * (shape[n] - 1)) * voxel for n in range(3))
    middle = radius_mm - 0.35 + 0.05 * np.maximum(np.abs(z) - 0.5 * length_mm, 0.0) ** 2
    clean = phantoms.partial_volume(np.hypot(np.abs(x) - middle, y) - radius_mm, voxel)
    edges = np.clip(np.abs(x)[None] + 0.5 * voxel * np.array([-1.0, 1.0])[:, None, None, None], None, 0.5 * membrane_mm)
    clean *= 1.0 - (edges[1] - np.maximum(edges[0], -0.5 * membrane_mm)) / voxel
    low = -0.5 * voxel * (np.array(shape) - 1)
    return Volume(phantoms.scan(100.0 + 900.0 * clean, 0.8, 60.0, 0), [voxel] * 3, low)


@pytest.mark.parametrize("membrane_mm", [0.12, 0.2, *later(0.25, 0.3, 0.35)])
def test_a_membrane_thinner_than_a_voxel_is_seen_by_its_darker_sheet(membrane_mm):
    """The grey was above half height all over it, and the wire went through without a word."""
    lumen = segment(pressed_flat(membrane_mm), [[1.5, 0.0, 0.0]])
    assert "open to each other in 1 place" in lumen.warnings[0]
    area = float(lumen.warnings[0].split("mm (")[1].split()[0])
    assert 12.0 < area < 40.0  # 1.9 mm wide over 10 mm, and up to twice that as faces of voxels are counted


@pytest.mark.quick(2)
@pytest.mark.parametrize(
    ("anatomy", "low", "high"),
    [
        (shapes.bifurcation(), (-12, -3.5, -5), (12, 3.5, 20)),
        (shapes.bifurcation(angle_deg=60.0, branch_mm=1.0), (-14, -3.5, -5), (14, 3.5, 12)),
        (shapes.stenosed(), (-3, -3, 0), (6, 3, 20)),
        (shapes.side_aneurysm(), (-4, -4, -4), (16, 8, 26)),
        (shapes.end_aneurysm(), (-8, -8, -4), (8, 8, 20)),
    ],
)
def test_junctions_narrowings_and_sacs_are_no_contacts(anatomy, low, high):
    assert segment(scanned(anatomy, low, high, 0.4), [[0.0, 0.0, 1.0]]).warnings == ()


def forked(degrees, window, branch_mm=1.2, voxel=0.4):
    """A trunk of radius 1.8 mm and a branch at an angle, which with a ``window`` comes back to it and leaves again."""
    z = np.linspace(0.0, 30.0, 301)
    x = np.tan(np.radians(degrees)) * (z - 4.0)
    if window:
        x = np.minimum(x, 2.6 + 0.03 * (z - 18.0) ** 2)
    branch = np.column_stack([x, 0.0 * x, z])[z >= 4.0]
    index = np.stack(np.indices((52, 16, 75)), axis=-1) * voxel - [3.2, 3.1, -0.1]
    trunk = np.hypot(index[..., 0], index[..., 1]) - 1.8
    values = np.minimum(trunk, cKDTree(branch).query(index)[0] - branch_mm)
    return Grid(values.astype(np.float32), [voxel] * 3, [-3.2, -3.1, 0.1])


@pytest.mark.parametrize(("degrees", "branch_mm"), [(25.0, 1.2), (30.0, 1.2), (30.0, 0.9), (35.0, 1.0)])
def test_the_crotch_of_a_sharp_fork_is_no_contact_and_a_window_further_on_is(degrees, branch_mm):
    """At 30 degrees it was told as vessels open to each other: at its far end both go on both ways."""
    assert contact.contacts(forked(degrees, window=False, branch_mm=branch_mm)) == ()
    (window,) = contact.contacts(forked(degrees, window=True, branch_mm=branch_mm))
    assert abs(window.place_mm[2] - 18.0) < 2.0


def test_an_opening_of_more_faces_than_are_looked_at_is_one(monkeypatch):
    """Faces that are left are more than a voxel apart: the far end of a crotch became an opening of its own, and told.

    Of 76 and of 132 faces every second is left.
    """
    monkeypatch.setattr(contact, "MOST_FACES", 75)
    assert contact.contacts(forked(25.0, window=False)) == ()
    assert len(contact.contacts(forked(30.0, window=True, branch_mm=0.9))) == 1


def test_a_vessel_thinner_than_its_blur_alone_is_refused_by_name():
    axis = np.array([0.3, 0.5, 0.81]) / np.linalg.norm([0.3, 0.5, 0.81])
    points = np.stack(np.indices((32, 32, 32)), axis=-1) * 0.5 - 8.0
    away = np.linalg.norm(points - (points @ axis)[..., None] * axis, axis=-1)
    grey = phantoms.scan(100.0 + 900.0 * phantoms.partial_volume(away - 0.35, 0.5), 0.8, NOISE / 3, 1)
    with pytest.raises(StageError, match="thinner than its blur") as error:
        segment(Volume(grey, [0.5] * 3, [-8.0] * 3), [[0.0, 0.0, 0.0]])
    assert error.value.status is FrameStatus.SEGMENT_FAILED


def test_a_head_taken_for_a_vessel_is_not_looked_at_face_by_face(monkeypatch):
    """All faces at which its cores meet used to be held against each other, minutes long."""
    rng = np.random.default_rng(0)
    field = ndimage.gaussian_filter(rng.normal(size=(64, 64, 64)), 2.5)
    inside = field > -0.3 * field.std()
    depth = ndimage.distance_transform_edt(inside) - ndimage.distance_transform_edt(~inside)
    seen, go_on = [], contact._go_on
    monkeypatch.setattr(contact, "_go_on", lambda found, *of: seen.append(len(found)) or go_on(found, *of))
    contact.contacts(Grid(np.where(inside, 0.5, -0.5) - depth, [1.0] * 3, [0.0] * 3))
    assert 0 < seen[0] <= contact.MOST_FACES
