"""The order of work in one frame: subtract the background, explain what is left in one way or several, judge."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.model import Array, Curve, Lumen, Volume, arc_length
from pipeline.status import FrameStatus
from pipeline.trace._kernels.ridges import smooth_voxels
from pipeline.trace.attempt import ENTRY_REACH_MM, Attempt, Entry, again, cold, dense, misfit, warm
from pipeline.trace.background import wall_blur
from pipeline.trace.config import TraceConfig
from pipeline.trace.crests import SEED_SIGMAS, STRICT_BEND, gaussian_taps
from pipeline.trace.in_plane import near_rotation_plane
from pipeline.trace.judge import LEAST_SEEN, SURE_CNR, Verdict, depth_at, judge
from pipeline.trace.level import levelled
from pipeline.trace.noise import inflation
from pipeline.trace.region import MAD
from pipeline.trace.scene import Scene, build_scene
from pipeline.trace.tube import Tube, evaluate, point_sigmas

SAMPLE_VOXELS = 1.0
"""Spacing of the curve's points."""
FINE_VOXELS = 0.55
"""Blur in which crests are looked for where strands may cross: they stay apart longest."""
WIDE_VOXELS = 1.2
"""Blur in which crests are looked for when the finest one gave doubts: right between contrasts of 2.5 and 5."""
WIDE_SIGMAS = 4.0
"""and the height at which they start there: noise gives some, which are too short to matter."""
BRIDGE_SIGMA_VOXELS = 0.5
"""Standard deviation across the wire that a point on a bridged gap gets at least."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """An attempt, the curve read off it (local points, their sigma, the tip's) and the verdict."""

    attempt: Attempt
    points: Array
    sigma: Array
    tip_sigma: float
    length_mm: float
    verdict: Verdict


def _entry_parameter(tube: Tube, entry: Entry) -> float:
    """Parameter at which the curve crosses the entry plane nearest the entry; 0 when it starts beyond it."""
    u = np.linspace(0, tube.intervals, 40 * tube.intervals + 1)
    points, _ = evaluate(tube.controls, u)
    along = (points - entry.point) @ entry.direction
    near = np.linalg.norm(points - entry.point, axis=1)
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


def _near_bridges(points: Array, attempt: Attempt, reach: float) -> NDArray[np.bool_]:
    """Points of the curve that lie on a bridge."""
    gaps = attempt.path[attempt.bridged]
    if len(gaps) == 0:
        return np.zeros(len(points), bool)
    square = np.min(np.sum((points[:, None] - gaps[None]) ** 2, axis=2), axis=1)
    return np.asarray(square < reach**2)


def _read_off(scene: Scene, attempt: Attempt | None, entry: Entry, config: TraceConfig) -> list[Candidate]:
    """The curve of an attempt with its verdict; nothing for no attempt."""
    if attempt is None:
        return []
    h = float(scene.spacing.min())
    u = _even_parameters(attempt.tube, _entry_parameter(attempt.tube, entry), SAMPLE_VOXELS * h)
    points, _ = evaluate(attempt.tube.controls, u)
    sigma, tip = point_sigmas(attempt.tube, u)
    length = float(arc_length(scene.world(points))[-1])
    bridged = _near_bridges(points, attempt, h)
    verdict = judge(scene, attempt, points, bridged, length)
    return [Candidate(attempt, points, sigma, tip, length, verdict)]


def _doubtful(scene: Scene, found: list[Candidate], entry: Entry, config: TraceConfig) -> bool:
    """Whether another explanation should be tried."""
    if not found:
        return True
    best = found[0]
    off = 0.0 if entry.expected_mm is None else abs(best.length_mm - entry.expected_mm)
    weak = best.attempt.cnr(scene) < SURE_CNR
    doubts = best.verdict.doubts > 1.5 or best.attempt.leftover_mm > 1.5 or best.attempt.bridges > 0
    return weak or doubts or off > config.length_tolerance_mm or best.verdict.status is not FrameStatus.OK


def _missed(found: Candidate, entry: Entry, config: TraceConfig) -> float:
    """How far the length is beyond what may differ from the expected depth, mm."""
    if entry.expected_mm is None:
        return 0.0
    return max(0.0, abs(found.length_mm - entry.expected_mm) - config.length_tolerance_mm)


def _best(scene: Scene, found: list[Candidate], entry: Entry, config: TraceConfig) -> Candidate:
    """The candidate that leaves least unexplained: misfit, with a length far from the expected one held against it.

    A millimetre missing or too much costs half of what a millimetre of wire explains, a flagged one a tenth.
    """
    if len(found) == 1:
        return found[0]
    costs = np.array(misfit(scene, [c.attempt for c in found]))
    h = float(scene.spacing.min())
    for n, c in enumerate(found):
        worth = c.attempt.cnr(scene) ** 2 * np.pi * (c.attempt.tube.sigma / h) ** 2 / h
        doubtful = float(c.verdict.flagged.sum()) * h
        costs[n] += worth * (0.5 * _missed(c, entry, config) + 0.1 * doubtful)
    return found[int(np.argmin(costs))]


def explain(scene: Scene, entry: Entry, previous: Curve | None, config: TraceConfig) -> Candidate | None:
    """The curve of one scene: from the frame alone; where that leaves doubts also wider and from the frame before."""
    gap = config.longest_gap_mm
    found = _read_off(scene, cold(scene, entry, config.ridge_voxels, SEED_SIGMAS, gap), entry, config)
    if _doubtful(scene, found, entry, config):
        if not found or found[0].attempt.cnr(scene) > SURE_CNR:
            strict = cold(scene, entry, FINE_VOXELS, SEED_SIGMAS, gap, STRICT_BEND)
            found += _read_off(scene, strict, entry, config)
        found += _read_off(scene, cold(scene, entry, WIDE_VOXELS, WIDE_SIGMAS, gap), entry, config)
        if previous is not None and len(previous.points_mm):
            found += _read_off(scene, warm(scene, entry, previous, config.ridge_voxels, gap), entry, config)
    return _best(scene, found, entry, config) if found else None


def _levelled(
    scene: Scene, best: Candidate, entry: Entry, lumen: Lumen, config: TraceConfig
) -> tuple[Scene, Candidate]:
    """Without a reference: the lumen's own grey under the wire taken from beside it, and the fit done again."""
    voxel = float(np.min(scene.region.box.spacing_mm))
    tube = best.attempt.tube
    even = levelled(scene, dense(tube, float(scene.spacing.min())), tube.sigma, wall_blur(lumen, voxel))
    found = _read_off(even, again(even, best.attempt, entry.direction), entry, config)
    return even, found[0]


def _none(status: FrameStatus, got: str, allowed: str, do: str, counters: dict[str, float]) -> Curve:
    note = f"trace: wire: got {got}; expected {allowed}; {do}"
    return Curve(np.zeros((0, 3)), np.zeros(0), status=status, note=note, counters=counters)


def _traces_of_wire(scene: Scene) -> bool:
    """Whether the lumen holds more bright voxels than noise makes: three times as many above 3.5 sigmas, and 15."""
    sample = smooth_voxels(scene.grey, gaussian_taps(1.0), scene.region.within)
    noise = MAD * float(np.median(np.abs(sample - np.median(sample))))
    up, down = (int(np.sum(s * (sample - np.median(sample)) > 3.5 * noise)) for s in (1, -1))
    return up > 3 * max(down, 5)


def _no_wire(scene: Scene) -> Curve:
    got = f"nothing that stands out of {scene.noise:.0f} grey of noise and passes the entry"
    if _traces_of_wire(scene):
        return _none(
            FrameStatus.TRACE_LOW_CONTRAST, got, "a contrast of 2.5 noises",
            "give the curve of the frame before, check entry_mm, or scan with more dose", scene.counters,
        )  # fmt: skip
    return _none(
        FrameStatus.NO_WIRE, got, f"a bright line within {ENTRY_REACH_MM} mm of entry_mm",
        "check entry_mm and that the frame shows a wire", scene.counters,
    )  # fmt: skip


def _curve(scene: Scene, best: Candidate, axis: Array, config: TraceConfig) -> Curve:
    """The curve in LPS mm with its uncertainty: the fit's, scaled by the noise met, wider where it was bridged."""
    h = float(scene.spacing.min())
    more = inflation(scene, best.points, best.attempt.tube)
    across, along = more.at(depth_at(scene, best.points))
    sigma = across * best.sigma
    sigma = np.where(best.verdict.flagged, np.maximum(sigma, BRIDGE_SIGMA_VOXELS * h), sigma)
    points = scene.world(best.points)
    in_plane = near_rotation_plane(points, axis, config.in_plane_deg)
    a = best.attempt
    counters = scene.counters | {
        "pieces": float(a.pieces), "bridges": float(a.bridges), "leftover_mm": a.leftover_mm,
        "iterations": float(a.tube.iterations), "residual_rms": a.tube.residual_rms, "blur_mm": a.tube.sigma,
        "cnr": a.cnr(scene), "inflation": float(np.median(across)), "inflation_tip": float(along[-1]),
        "from_previous": float(a.from_previous), "faint_mm": best.verdict.faint_mm, "double_mm": best.verdict.double_mm,
        "in_plane_mm": float(in_plane.mean()) * best.length_mm,
    }  # fmt: skip
    return Curve(
        points, sigma, float(along[-1]) * best.tip_sigma, best.verdict.flagged, best.verdict.status,
        best.verdict.note, counters, in_plane,
    )  # fmt: skip


def _faint_for_its_noise(curve: Curve) -> Curve:
    """The curve, or the same as too low in contrast where correlated noise hides the wire more than white noise."""
    seen = curve.counters["cnr"] / max(1.0, curve.counters["inflation"])
    if seen > LEAST_SEEN or curve.status is not FrameStatus.OK or curve.counters["from_previous"]:
        return curve
    note = f"trace: wire: got a wire {seen:.1f} noises bright, noise counted as it is correlated; expected {LEAST_SEEN}"
    note += " at least; scan with more dose or a smoother reconstruction kernel"
    return replace(curve, status=FrameStatus.TRACE_LOW_CONTRAST, note=note)


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
    lumen's wall).  entry_mm, entry_direction : (3,) LPS mm.  previous : the curve of the frame before, if any; it is
    consulted only where the frame alone leaves doubts.  expected_mm : insertion depth, which helps to decide.
    Returns a Curve; what went wrong is its status and note.
    """
    config = config or TraceConfig()
    scene = build_scene(frame, lumen, reference)
    heading = np.asarray(entry_direction, float) / np.linalg.norm(np.asarray(entry_direction, float))
    entry = Entry(scene.local(np.asarray(entry_mm, float)[None])[0], scene.turned(heading), expected_mm)
    best = explain(scene, entry, previous, config)
    if best is None:
        return _no_wire(scene)
    if scene.modelled:
        scene, best = _levelled(scene, best, entry, lumen, config)
    axis = np.asarray(config.rotation_axis, float) if config.rotation_axis else frame.direction[:, 2]
    curve = _faint_for_its_noise(_curve(scene, best, axis, config))
    if curve.status is FrameStatus.OK and _missed(best, entry, config) > 0:
        note = f"trace: length: got {best.length_mm:.2f} mm; expected {expected_mm:.2f} mm (insertion_mm) to within "
        note += f"{config.length_tolerance_mm} mm; look at the picture, then correct the manifest"
        return replace(curve, status=FrameStatus.LENGTH_MISMATCH, note=note)
    return curve
