"""The wall of a label map: the faces between its voxels, evened out within what the map says.

Along a wall that is nearly parallel to the grid a stair is many voxels long. A blur that evens it out closes branches
and gaps. So here a point stands on every face between a voxel inside and one outside, and moves until it lies on a
circle with its neighbours, but not beyond the centres of the two voxels: one voxel of lumen, or of gap, stays.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.segment._kernels.distance import Owned
from pipeline.segment.closest import find_closest
from pipeline.segment.surface import signed
from solver.grid import Array

REACH = 2.01
"""Voxels between the middles of faces that are neighbours: two along an axis, with some room for rounding."""
ROUNDS = 8
"""How often faces are averaged with their neighbours. Of tubes of radius 2 voxels and more at any angle the wall's
standard deviation is 0.06 voxel after 5, 0.05 after 8; with more, branches of 1 voxel turn uneven."""
STEEP = 0.01
"""Least share of its area with which a face counts: across the wall's direction it has none."""


class _Faces(NamedTuple):
    """Faces between a voxel inside, ``inner`` (n, 3), and the one ``step`` (n, 3) further, which is outside."""

    inner: Array
    step: Array


class _Beside(NamedTuple):
    """Pairs of faces beside each other: positions (m,) of the one and the other, and how much they count (m,)."""

    one: NDArray[np.int64]
    other: NDArray[np.int64]
    weight: Array

    def sum(self, of_one: Array, of_other: Array, count: int) -> Array:
        """For every face the sum of what its pairs (m,) give to the one, and to the other."""
        return np.asarray(np.bincount(self.one, of_one, count) + np.bincount(self.other, of_other, count))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", a, b))


def _faces(inside: NDArray[np.bool_]) -> _Faces:
    inner, step = [], []
    for axis, unit in enumerate(np.eye(3)):
        change = np.diff(inside.astype(np.int8), axis=axis)
        for side in (1, -1):
            found = np.argwhere(change == -side) + (unit if side < 0 else 0)
            inner.append(found)
            step.append(np.broadcast_to(side * unit, found.shape))
    return _Faces(np.concatenate(inner), np.concatenate(step))


def _beside(faces: _Faces, spacing: Array) -> _Beside:
    """Faces within reach that do not look at each other. They count by (voxels / mm)^2 of their distance, so that
    averages reach as far along every axis where voxels are not cubes.
    """
    middle = faces.inner + 0.5 * faces.step
    one, other = cKDTree(middle).query_pairs(REACH, output_type="ndarray").T
    same = _dot(faces.step[one], faces.step[other]) >= 0
    one, other = one[same], other[same]
    way = middle[other] - middle[one]
    return _Beside(one, other, spacing.min() ** 2 * _dot(way, way) / _dot(way * spacing, way * spacing))


def _normals(faces: _Faces, area: Array, beside: _Beside) -> Array:
    """Outward unit normals (n, 3): those of the faces, averaged by area over neighbours that look the same way."""
    normal = faces.step
    for _ in range(ROUNDS):
        given = normal * (area * np.maximum(_dot(faces.step, normal), STEEP))[:, None]
        weight = beside.weight * (_dot(normal[beside.one], normal[beside.other]) >= 0)
        total = [
            along + beside.sum(weight * along[beside.other], weight * along[beside.one], len(area)) for along in given.T
        ]
        normal = np.stack(total, axis=1)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
    return normal


def _evened(at: Array, half: Array, normal: Array, share: Array, beside: _Beside) -> Array:
    """The points (n, 3), mm, moved along their normals until they agree with their neighbours.

    Two points of a circle, and their normals: (q - p) . (n_p + n_q) = 0. Averages of that leave tubes and balls as
    thick as they are.     half (n, 3) : from the face to the outer voxel's centre.     share (n,) : of the wall's area.
    """
    one, other, weight = beside
    both = 0.5 * weight[:, None] * (normal[one] + normal[other])
    whole = share + beside.sum(weight * share[other], weight * share[one], len(at))
    most = np.maximum(_dot(half, normal), 0.0)
    moved, point = np.zeros(len(at)), at
    for _ in range(ROUNDS):
        higher = _dot(point[other] - point[one], both)
        moved += beside.sum(higher * share[other], -higher * share[one], len(at)) / whole
        moved = np.clip(moved, -most, most)
        point = at + moved[:, None] * normal
    return point


def _curvature(point: Array, normal: Array, beside: _Beside) -> Array:
    """Sum of the principal curvatures (n,), 1/mm: twice the mean turn of the normal along the way to neighbours."""
    one, other, weight = beside
    way = point[other] - point[one]
    turn, length = weight * _dot(normal[other] - normal[one], way), weight * _dot(way, way)
    return 2.0 * beside.sum(turn, turn, len(point)) / np.maximum(beside.sum(length, length, len(point)), 1e-9)


def _owners(faces: _Faces, point: Array, spacing: Array, shape: tuple[int, ...]) -> NDArray[np.int32]:
    """For the voxels on both sides of the wall the position + 1 of the nearest of their faces' points, else 0."""
    owner = np.zeros(shape, np.int32)
    voxel = np.concatenate([faces.inner, faces.inner + faces.step]).astype(np.int64)
    number = np.tile(np.arange(len(point)), 2)
    nearest_last = np.argsort(-np.linalg.norm(voxel * spacing - point[number], axis=1), kind="stable")
    owner[tuple(voxel[nearest_last].T)] = number[nearest_last] + 1
    return owner


def distance_to_labels(inside: NDArray[np.bool_], spacing: Array, outer_mm: float) -> NDArray[np.float32]:
    """Signed distance (mm, negative inside) from the wall of the voxels ``inside``; see ``Lumen`` for how far out."""
    faces = _faces(inside)
    beside = _beside(faces, spacing)
    area = (1.0 / spacing)[np.argmax(np.abs(faces.step), axis=1)]  # the same factor for all does not matter
    normal = _normals(faces, area, beside)
    alike = _dot(normal[beside.one], normal[beside.other]) > 0
    beside = _Beside(beside.one[alike], beside.other[alike], beside.weight[alike])
    half = 0.5 * faces.step * spacing
    share = area * np.maximum(_dot(faces.step, normal), STEEP)
    point = _evened(faces.inner * spacing + half, half, normal, share, beside)
    box = Owned(_owners(faces, point, spacing, inside.shape), inside.astype(np.uint8), spacing)
    find_closest(box, np.flatnonzero(box.owner), point, outer_mm)
    return signed(box, (point, normal, _curvature(point, normal, beside)), outer_mm, 0)
