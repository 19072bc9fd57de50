"""The order of work in one frame: find pieces, join them, end them at the tip, fit the whole, cut at the entry."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline._kernels.jets import values_at
from pipeline.config import TraceConfig
from pipeline.model import Array, Curve, Lumen, Volume, arc_length
from pipeline.status import FrameStatus
from pipeline.trace.crests import find_crests
from pipeline.trace.link import Path, link
from pipeline.trace.noise import inflation
from pipeline.trace.scene import Scene, build_scene
from pipeline.trace.tip import cut_at_tip, resampled
from pipeline.trace.tube import Tube, TubeData, evaluate, fit_tube, point_sigmas, spline_through, tint_nodes

ENTRY_REACH_MM = 4.0
"""How far from the manifest's entry the wire may pass."""
PREFIX_MM = 3.0
"""How much wire before the entry is fitted along: its end must not disturb the fit at the entry."""
SAMPLE_VOXELS = 1.0
"""Spacing of the curve's points."""


def _none(
    status: FrameStatus, what: str, got: str, allowed: str, do: str, counters: dict[str, float]
) -> Curve:
    note = f"trace: {what}: got {got}; expected {allowed}; {do}"
    return Curve(np.zeros((0, 3)), np.zeros(0), status=status, note=note, counters=counters)


def _knot_voxels(cnr: float) -> float:
    """Distance between the spline's knots: noise falls with it, a bend's bias rises (0.004 / 0.009 / 0.046 voxel
    at 8 / 10 / 14 voxels for radii of 20 to 40)."""
    return float(np.interp(cnr, [4.0, 8.0, 16.0], [12.0, 10.0, 8.0]))


def first_tube(scene: Scene, points: Array, sigma_mm: float) -> Tube:
    """Where the fit starts: a spline along the path, with the amplitude seen there."""
    h = float(scene.spacing.min())
    line = resampled(points, 0.5 * h)
    crest = values_at(scene.grey, scene.spacing, 0.7 * h, np.ascontiguousarray(line[::4]))
    gain = 1.0 + (0.7 * h / sigma_mm) ** 2
    amplitude = max(float(np.median(crest)) * gain, scene.noise)
    controls = spline_through(line, _knot_voxels(amplitude / scene.noise) * h)
    nodes = tint_nodes(len(controls) - 3)
    return Tube(controls, np.full(nodes, amplitude), sigma_mm, 0.0)


def _prefixed(path: Path, entry: Array, direction: Array) -> tuple[Array, NDArray[np.bool_], bool]:
    """The path from at most PREFIX_MM before the entry plane, and whether wire was cut off there."""
    along = (path.points - entry) @ direction
    near = np.linalg.norm(path.points - entry, axis=1) < ENTRY_REACH_MM + PREFIX_MM
    before = np.flatnonzero((along < -PREFIX_MM) & near)
    # only what comes before the point nearest the entry is prefix: the wire may come back past the plane
    nearest = int(np.argmin(np.linalg.norm(path.points - entry, axis=1)))
    before = before[before < nearest]
    start = int(before[-1]) + 1 if len(before) else 0
    far = np.flatnonzero(~near[:nearest])
    start = max(start, int(far[-1]) + 1 if len(far) else 0)
    return path.points[start:], path.bridged[start:], start > 0


def _entry_parameter(tube: Tube, entry: Array, direction: Array) -> float:
    """Parameter at which the curve crosses the entry plane nearest the entry; 0 when it starts beyond it."""
    u = np.linspace(0, tube.intervals, 40 * tube.intervals + 1)
    points, _ = evaluate(tube.controls, u)
    along = (points - entry) @ direction
    near = np.linalg.norm(points - entry, axis=1)
    crossing = np.flatnonzero((along[:-1] < 0) & (along[1:] >= 0) & (near[:-1] < ENTRY_REACH_MM))
    if len(crossing) == 0:
        return 0.0
    n = int(crossing[np.argmin(near[crossing])])
    share = along[n] / (along[n] - along[n + 1])
    return float(u[n] + share * (u[n + 1] - u[n]))


def _even_parameters(tube: Tube, start: float, step: float) -> Array:
    """Parameters from ``start`` to the end at about equal steps of arc."""
    u = np.linspace(start, tube.intervals, 20 * tube.intervals + 2)
    arc = arc_length(evaluate(tube.controls, u)[0])
    s = np.linspace(0, arc[-1], max(3, round(arc[-1] / step) + 1))
    return np.interp(s, arc, u)


def _near_bridges(points: Array, path: Array, bridged: NDArray[np.bool_], reach: float) -> NDArray[np.bool_]:
    """Points of the curve that lie on a bridge."""
    gaps = path[bridged]
    if len(gaps) == 0:
        return np.zeros(len(points), bool)
    square = np.min(np.sum((points[:, None] - gaps[None]) ** 2, axis=2), axis=1)
    return np.asarray(square < reach**2)


def _too_long(length: float, expected: float | None, config: TraceConfig) -> bool:
    return expected is not None and abs(length - expected) > config.length_tolerance_mm


def finish(
    scene: Scene, tube: Tube, path: Array, bridged: NDArray[np.bool_], entry: Array, direction: Array
) -> dict[str, Any]:
    """The fitted tube as the fields of a Curve: cut at the entry, evenly sampled, with its uncertainty."""
    h = float(scene.spacing.min())
    u = _even_parameters(tube, _entry_parameter(tube, entry, direction), SAMPLE_VOXELS * h)
    points, _ = evaluate(tube.controls, u)
    sigma, tip = point_sigmas(tube, u)
    flagged = _near_bridges(points, path, bridged, h)
    return {"points_mm": scene.world(points), "sigma_mm": sigma, "tip_sigma_mm": tip, "flagged": flagged}


def _no_wire(scene: Scene, counters: dict[str, float], weak: bool) -> Curve:
    got = f"nothing above {scene.noise:.0f} grey of noise that passes the entry"
    if weak:
        return _none(
            FrameStatus.TRACE_LOW_CONTRAST, "wire", got, "a contrast of 2.5 noises",
            "give the curve of the frame before, or scan with more dose", counters,
        )  # fmt: skip
    return _none(
        FrameStatus.NO_WIRE, "wire", got, f"a bright line within {ENTRY_REACH_MM} mm of entry_mm",
        "check entry_mm and that the frame shows a wire", counters,
    )  # fmt: skip


def trace(
    frame: Volume,
    lumen: Lumen,
    entry_mm: ArrayLike,
    entry_direction: ArrayLike,
    *,
    reference: Volume | None = None,
    previous: Curve | None = None,
    expected_mm: float | None = None,
    config: TraceConfig | None = None,
) -> Curve:
    """The wire of one frame from the plane of entry to the tip.

    frame, reference : scans of one geometry, with and without wire (without: the background is modelled from the
    lumen's wall).  entry_mm, entry_direction : (3,) LPS mm.  previous : the curve of the frame before, if any.
    expected_mm : insertion depth to be compared with.  Returns a Curve; what went wrong is its status and note.
    """
    config = config or TraceConfig()
    scene = build_scene(frame, lumen, reference)
    entry = scene.local(np.asarray(entry_mm, float)[None])[0]
    direction = scene.turned(
        np.asarray(entry_direction, float) / np.linalg.norm(np.asarray(entry_direction, float))
    )
    h = float(scene.spacing.min())
    crests = find_crests(scene, config.ridge_voxels)
    counters = dict(scene.counters)
    path = link(crests.pieces, entry, direction, config.longest_gap_mm, ENTRY_REACH_MM)
    if path is None:
        return _no_wire(scene, counters, False)
    points, bridged, cut = _prefixed(path, entry, direction)
    if arc_length(points)[-1] < 3 * h:
        return _no_wire(scene, counters, False)
    line = cut_at_tip(scene, resampled(points, 0.5 * h), 0.7 * h, 0.9 * h)
    plane = (line[0] + 2.0 * h * direction, direction) if cut else None
    data = TubeData(scene.grey, scene.spacing, scene.noise, plane)
    tube = fit_tube(data, first_tube(scene, line, 0.9 * h))
    fields = finish(scene, tube, points, bridged, entry, direction)
    more = inflation(scene, scene.local(fields["points_mm"]), tube.sigma)
    fields["sigma_mm"], fields["tip_sigma_mm"] = (
        more.across * fields["sigma_mm"],
        more.along * fields["tip_sigma_mm"],
    )
    counters |= {"inflation": more.across, "inflation_tip": more.along}
    counters |= {"pieces": float(len(crests.pieces)), "bridges": float(path.bridges), "leftover_mm": path.leftover_mm,
                 "iterations": float(tube.iterations), "residual_rms": tube.residual_rms, "blur_mm": tube.sigma,
                 "cnr": float(np.median(tube.tint)) / scene.noise}  # fmt: skip
    return Curve(**fields, counters=counters)
