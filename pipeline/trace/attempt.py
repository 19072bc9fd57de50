"""One way of explaining a frame: a path, the tube fitted along it, and how well that explains the grey."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.arrays.jets import values_at
from pipeline.arrays.sparse import sparse_zeros
from pipeline.model import Array, Curve, arc_length
from pipeline.trace._kernels.tube import active_voxels
from pipeline.trace.crests import BEND, Crests, Tracklet, find_crests
from pipeline.trace.link import Path, link, with_doubles
from pipeline.trace.scene import Scene
from pipeline.trace.tip import cut_at_tip, resampled
from pipeline.trace.tube import Tube, TubeData, evaluate, fit_tube, predicted, spline_through, tint_nodes

ENTRY_REACH_MM = 4.0
"""How far from the manifest's entry the wire may pass."""
PREFIX_MM = 3.0
"""How much wire before the entry is fitted along: its end must not disturb the fit at the entry."""
THICK_SLICES = 1.5
"""Largest over smallest voxel edge (as the kernels see them) from which slices count as thick."""
KNOTS_PER_PITCH = 2.0
"""Least distance between knots in lengths of wire from slice to slice: with one a slice the curve follows each slice's
own error (0.15 mm of ripple at 2.5 mm slices)."""
STREAK_SHARE = 0.2
"""Crest grey, as a share of the wire's peak, below which a bright line is a streak of the wire: a second wire's crest
has 0.6 to 0.9 of it, streaks of steel in a cone-beam scan reach a few hundredths."""
NEAR_VOXELS = 2.5
"""Crests nearer than this to the curve belong to it."""
FIRST_BLUR = 0.9
"""The wire's blur (voxel) before it is fitted: scanner 0.8, wire and voxel the rest."""


@dataclass(frozen=True, eq=False)
class Entry:
    """Where and whither the wire enters, in kernel coordinates, and the insertion depth expected there (mm)."""

    point: Array
    direction: Array
    expected_mm: float | None = None


@dataclass(frozen=True, eq=False)
class Attempt:
    """A fitted tube with the path that led to it. leftover_mm : crests that it does not explain.

    cut : wire goes on before the path's first point.
    """

    tube: Tube
    path: Array
    bridged: NDArray[np.bool_]
    bridges: int
    leftover_mm: float
    pieces: int
    from_previous: bool = False
    cut: bool = False

    def cnr(self, scene: Scene) -> float:
        """Median peak above the background over the noise of one voxel."""
        return float(np.median(self.tube.tint)) / scene.noise


def knot_voxels(cnr: float) -> float:
    """Distance between the spline's knots: noise falls with it, a bend's bias rises (0.004 / 0.009 / 0.046 voxel
    at 8 / 10 / 14 voxels for radii of 20 to 40)."""
    return float(np.interp(cnr, [4.0, 8.0, 16.0], [12.0, 10.0, 8.0]))


def slice_pitch(scene: Scene, line: Array) -> float:
    """Length of wire (mm) from one slice to the next along a path (n, 3), where slices are thicker than pixels; else 0.

    Such slices are wider apart than the blur can join: between two of them the grey hardly says how high the wire is.
    """
    axis = int(np.argmax(scene.spacing))
    if scene.spacing[axis] < THICK_SLICES * float(scene.spacing.min()):
        return 0.0
    slices = float(np.sum(np.abs(np.diff(line[:, axis])))) / float(scene.spacing[axis])
    return float(arc_length(line)[-1]) / max(slices, 1.0)


def first_tube(scene: Scene, points: Array) -> Tube:
    """Where the fit starts: a spline along the path, with the amplitude seen there."""
    h = float(scene.spacing.min())
    line = resampled(points, 0.5 * h)
    crest = values_at(scene.grey, scene.spacing, 0.7 * h, np.ascontiguousarray(line[::4]))
    gain = 1.0 + (0.7 / FIRST_BLUR) ** 2
    amplitude = max(float(np.median(crest)) * gain, scene.noise)
    knot = max(knot_voxels(amplitude / scene.noise) * h, KNOTS_PER_PITCH * slice_pitch(scene, line))
    controls = spline_through(line, knot)
    nodes = tint_nodes(len(controls) - 3)
    return Tube(controls, np.full(nodes, amplitude), FIRST_BLUR * h, 0.0)


def prefixed(path: Path, entry: Entry) -> tuple[Array, NDArray[np.bool_], bool]:
    """The path from at most PREFIX_MM before the entry plane, and whether wire was cut off there."""
    away = np.linalg.norm(path.points - entry.point, axis=1)
    along = (path.points - entry.point) @ entry.direction
    # only what comes before the point nearest the entry is prefix: the wire may come back past the plane
    nearest = int(np.argmin(away))
    too_far = (along[:nearest] < -PREFIX_MM) | (away[:nearest] > ENTRY_REACH_MM + PREFIX_MM)
    before = np.flatnonzero(too_far)
    start = int(before[-1]) + 1 if len(before) else 0
    return path.points[start:], path.bridged[start:], start > 0


def fit_path(scene: Scene, points: Array, cut: bool, direction: Array, find_tip: bool = True) -> Tube:
    """The tube along a path; ``cut`` when wire goes on before its first point."""
    h = float(scene.spacing.min())
    line = resampled(points, 0.5 * h)
    if find_tip:
        line = cut_at_tip(scene, line, 0.7 * h, FIRST_BLUR * h)
    plane = (line[0] + 2.0 * h * direction, direction) if cut else None
    data = TubeData(scene.grey, scene.spacing, scene.noise, plane)
    return fit_tube(data, first_tube(scene, line))


def _fitted(scene: Scene, points: Array, cut: bool, direction: Array) -> Tube | None:
    """:func:`fit_path`, or None where the path is so wrong that its equations have no solution."""
    try:
        return fit_path(scene, points, cut, direction)
    except (np.linalg.LinAlgError, ValueError):
        return None


def dense(tube: Tube, step: float) -> Array:
    """Points of the tube's curve about ``step`` mm apart."""
    length = float(
        arc_length(evaluate(tube.controls, np.linspace(0, tube.intervals, 4 * tube.intervals + 1))[0])[-1]
    )
    return evaluate(tube.controls, np.linspace(0, tube.intervals, max(3, round(length / step) + 1)))[0]


def unexplained_mm(pieces: list[Tracklet], curve: Array, near: float, tube: Tube) -> float:
    """Length of the crests that run further than ``near`` mm from the curve (n, 3); pieces under 1.5 ``near`` are
    noise, and pieces fainter than a share of the wire are its own streaks, not another device."""
    tree = cKDTree(curve)
    least = STREAK_SHARE * float(np.median(tube.tint))
    total = 0.0
    for piece in pieces:
        if float(np.median(piece.values)) < least:
            continue
        far = tree.query(piece.points[::2], distance_upper_bound=near)[0]
        off = float(np.mean(~np.isfinite(far))) * piece.length
        total += off if off > 1.5 * near else 0.0
    return total


def cold(
    scene: Scene, entry: Entry, sigma_voxel: float, seed_sigmas: float, gap_mm: float, bend: float = BEND
) -> Attempt | None:
    """From the frame alone: crests, linked from the entry, ended at the tip, fitted."""
    h = float(scene.spacing.min())
    crests = find_crests(scene, sigma_voxel, seed_sigmas, bend)
    shortest = 3.0 * sigma_voxel * h
    pieces = [p for p in crests.pieces if p.length > shortest] or crests.pieces
    pieces = with_doubles(pieces)
    path = link(pieces, entry.point, entry.direction, gap_mm, ENTRY_REACH_MM)
    if path is None:
        return None
    points, bridged, cut = prefixed(path, entry)
    if arc_length(points)[-1] < 3 * h:
        return None
    tube = _fitted(scene, points, cut, entry.direction)
    if tube is None:
        return None
    left = unexplained_mm(pieces, np.concatenate([path.points, dense(tube, h)]), NEAR_VOXELS * h, tube)
    return Attempt(tube, points, bridged, path.bridges, left, len(pieces), cut=cut)


def again(scene: Scene, attempt: Attempt, direction: Array) -> Attempt:
    """The attempt fitted anew, tip and all, to another scene of the same frame; itself where that has no solution."""
    points = dense(attempt.tube, 0.5 * float(scene.spacing.min()))
    tube = _fitted(scene, points, attempt.cut, direction)
    return attempt if tube is None else replace(attempt, tube=tube)


@contextmanager
def _without(scene: Scene, tube: Tube) -> Iterator[Scene]:
    """The scene with the tube's grey taken away for the length of the block: in place, as a copy holds a whole box."""
    grey = scene.grey.reshape(-1)
    voxels, model = predicted(TubeData(scene.grey, scene.spacing, scene.noise), tube)
    kept = grey[voxels]
    grey[voxels] -= model.astype(np.float32)
    try:
        yield scene
    finally:
        grey[voxels] = kept


def warm(scene: Scene, entry: Entry, previous: Curve, crests_voxel: float, gap_mm: float) -> Attempt | None:
    """From the curve of the frame before: refit it, take its grey away, and follow what is left on from its tip.

    The only way through strands that lie in contact, whose crests have merged into one.
    """
    h = float(scene.spacing.min())
    old = scene.local(previous.points_mm)
    if len(old) < 8:
        return None
    tube = fit_path(scene, old, False, entry.direction, find_tip=False)
    line = dense(tube, 0.5 * h)
    with _without(scene, tube) as others:
        rest: Crests = find_crests(others, crests_voxel)
    heading = line[-1] - line[-max(2, min(8, len(line) // 2))]
    onward = link(rest.pieces, line[-1], heading / np.linalg.norm(heading), gap_mm, 5.0 * h)
    points, bridged, bridges = line, np.zeros(len(line), bool), 0
    if onward is not None:
        ahead = (onward.points - line[-1]) @ heading > 0
        first = int(np.argmax(ahead)) if ahead.any() else len(ahead)
        points = np.concatenate([points, onward.points[first:]])
        bridged = np.concatenate([bridged, onward.bridged[first:]])
        bridges = onward.bridges
    final = _fitted(scene, points, False, entry.direction)
    if final is None:
        return None
    left = unexplained_mm(rest.pieces, dense(final, h), NEAR_VOXELS * h, final)
    return Attempt(final, points, bridged, bridges, left, len(rest.pieces), True)


def misfit(scene: Scene, attempts: list[Attempt]) -> list[float]:
    """Sum of squares of what each attempt leaves, over the voxels that any of them claims, in noise variances."""
    data = TubeData(scene.grey, scene.spacing, scene.noise)
    radius = 3.0 * max(a.tube.sigma for a in attempts)
    h = float(scene.spacing.min())
    slot = sparse_zeros(scene.grey.shape, np.int32)
    curve = np.ascontiguousarray(np.concatenate([dense(a.tube, h) for a in attempts]))
    voxels = active_voxels(scene.grey.shape, scene.spacing, curve, radius, slot)
    out = []
    for attempt in attempts:
        left = scene.grey.reshape(-1)[voxels].astype(float)
        own, model = predicted(data, attempt.tube)
        at = slot.reshape(-1)[own] - 1
        left[at[at >= 0]] -= model[at >= 0]
        out.append(float(np.sum(left**2)) / scene.noise**2)
    return out
