"""The clamp fitted to the traces: better than what it corrects, sure of itself as far as it is right."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from pipeline.arrays.polyline import angle_deg, at_arc
from pipeline.model import Array, Clamp, Curve
from pipeline.run.stages.clamp import clamp_of
from pipeline.run.stages.given import manifest_clamp, seen_in
from pipeline.run.stages.known import Frame
from pipeline.simulate import together
from pipeline.simulate.clamp import Prior, TracedFrame, depth_from, estimated_clamp, moved
from pipeline.simulate.clamp_told import IF_AS_MODELLED, left_out
from pipeline.simulate.evidence import (
    TraceSamples,
    covariance_of,
    covariance_of_traces,
    posterior,
    roughness_mm,
    sigma_across,
)
from pipeline.simulate.way import Stop, Way
from pipeline.status import FrameStatus, StageError
from solver import GuideWire, Insertion, Solution
from solver.relax import base_frame

VOXEL_MM = 0.3
PRIOR = Prior(0.5 * VOXEL_MM, 2.0)
CURVED_MM, CURVATURE = 10.0, 0.15
WIRE = GuideWire(
    segment_mm=0.5, radius_mm=0.18, bending_stiffness_N_mm2=5.0,
    rest_curvature_per_mm=np.array([[0.0, CURVATURE], [CURVED_MM, CURVATURE], [CURVED_MM, 0.0]]),
)  # fmt: skip


def free_wire(depth_mm: float, curved_mm: float = CURVED_MM) -> Array:
    """A wire with a curved tip that touches nothing, from the origin along z, bent towards x; points every 0.3 mm."""
    s = np.linspace(0.0, depth_mm, max(3, round(depth_mm / VOXEL_MM)))
    angle = CURVATURE * np.maximum(s - max(depth_mm - curved_mm, 0.0), 0.0)
    straight = s - angle / CURVATURE
    x, z = (1 - np.cos(angle)) / CURVATURE, straight + np.sin(angle) / CURVATURE
    return np.column_stack([x, 0 * s, z])


def trace(depth_mm: float, noise_mm: float, rng: np.random.Generator) -> Curve:
    """A trace whose errors are correlated over a millimetre, as a spline's are."""
    points = free_wire(depth_mm)
    s = np.linspace(0.0, depth_mm, len(points))
    root = np.linalg.cholesky(np.exp(-0.5 * (s[:, None] - s) ** 2 / 1.29**2) + 1e-8 * np.eye(len(s)))
    errors = noise_mm * root @ rng.normal(size=(len(s), 3))
    errors[:, 2] = 0.0
    return Curve(points + errors, np.full(len(s), max(noise_mm, 1e-3)), 0.01, levels={"knot_mm": 3.0})


def replay(
    clamps: Sequence[Clamp], seen: Sequence[TracedFrame], depths: Sequence[Sequence[float]], wire: GuideWire = WIRE
) -> list[list[Solution]]:
    """The solver's free wire from each clamp."""
    wires = [Insertion(wire, None, c.entry_mm, c.direction, material_axis=c.material_axis) for c in clamps]
    ways = [Way.reading(map(Stop, [f.index for f in seen], way, [f.roll_deg for f in seen])) for way in depths]
    return together(wires, ways)


def estimate(curves: Sequence[Curve], given: Clamp, prior: Prior = PRIOR) -> Clamp:
    return estimated_clamp(
        [TracedFrame(i, curve) for i, curve in enumerate(curves)], given, prior, (replay, replay), VOXEL_MM
    )


def off(tilt_deg: float, at_mm: Sequence[float] = (0.1, 0.1, 0.0)) -> Clamp:
    """The true clamp as a manifest states it."""
    tilt = np.radians(tilt_deg)
    return Clamp(np.array(at_mm), np.array([0.0, np.sin(tilt), np.cos(tilt)]), np.array([1.0, 0.0, 0.0]))


def error_deg(clamp: Clamp) -> float:
    return angle_deg(clamp.direction, np.array([0.0, 0.0, 1.0]))


def test_a_clamp_is_found_in_exact_traces() -> None:
    found = estimate([trace(8.0 + 4 * i, 0.0, np.random.default_rng(0)) for i in range(5)], off(2.0))
    assert error_deg(found) < 0.1
    assert np.linalg.norm(found.entry_mm[:2]) < 0.01


def test_where_the_curved_tip_is_all_that_is_seen_it_corrects_and_knows_what_it_cannot_tell() -> None:
    found = estimate([trace(depth, 0.0, np.random.default_rng(0)) for depth in (5.0, 7.0, 8.5)], off(2.0))
    # an arc slid along itself is the same arc: the prior's 0.15 mm along it are 1.3 degrees
    assert error_deg(found) < 1.3
    assert error_deg(found) < 2 * found.sigma_deg


def test_long_segments_that_lay_the_wire_elsewhere_turn_no_clamp() -> None:
    """Before a bend of 4 mm radius those of 1 mm turned it by 2 degrees, three of its standard deviations."""
    coarse = partial(replay, wire=replace(WIRE, segment_mm=4.0))
    seen = [TracedFrame(i, trace(9.0 + i, 1e-4, np.random.default_rng(0))) for i in range(3)]
    long, both = (
        estimated_clamp(seen, off(2.0), PRIOR, replays, VOXEL_MM) for replays in ((coarse, coarse), (coarse, replay))
    )
    assert error_deg(long) > 0.5
    assert error_deg(both) < 0.1


def test_it_is_as_far_off_as_it_says() -> None:
    within = []
    for seed in range(100, 120):
        rng = np.random.default_rng(seed)
        found = estimate([trace(8.0 + 4 * i, 0.03, rng) for i in range(5)], off(2.0))
        sigma = np.sqrt(np.diag(np.asarray(found.covariance)))
        within += [*(np.abs(found.entry_mm[:2]) < 2 * sigma[:2]), *(np.abs(found.direction[:2]) < 2 * sigma[3:5])]
    # 80 components, of which 95 % are expected; four in ten thousand such tests find fewer than 85 %
    assert np.mean(within) >= 0.85


def test_one_frame_that_disagrees_is_named_and_left_out() -> None:
    rng = np.random.default_rng(100)
    curves = [trace(8.0 + 4 * i, 0.02, rng) for i in range(5)]
    arc = np.linspace(0.0, 16.0, 54)
    bent = at_arc(curves[2].points_mm, arc) + np.column_stack([0.02 * arc**1.5, 0 * arc, 0 * arc])
    curves[2] = Curve(bent, np.full(54, 0.02), 0.01, levels={"knot_mm": 3.0})
    found = estimate(curves, off(2.0))
    assert "traces of frame 2: left out of the clamp. Traced, they lie" in found.warning
    assert "look at these traces first" in found.warning
    assert error_deg(found) < 0.8
    assert (found.fitted, found.left_out) == ((0, 1, 3, 4), (2,))


def test_an_exact_manifest_is_not_moved() -> None:
    curves = [trace(8.0 + 4 * i, 0.02, np.random.default_rng(i)) for i in range(5)]
    given = off(2.0)
    exact = estimate(curves, given, Prior(0.0, 0.0))
    np.testing.assert_array_equal(exact.direction, given.direction)
    half = estimate(curves, given, Prior(0.15, 0.0))
    np.testing.assert_allclose(half.direction, given.direction, rtol=0.0, atol=1e-15)
    assert np.linalg.norm(half.entry_mm - given.entry_mm) > 0.02
    assert half.sigma_deg == 0.0


def test_no_trace_leaves_the_manifest_with_its_own_uncertainty() -> None:
    found = estimate([], off(2.0))
    assert found.note == ""
    assert found.sigma_deg == pytest.approx(2.0)
    assert found.sigma_mm == pytest.approx(0.15)


def test_an_entry_far_off_is_not_followed_but_said() -> None:
    curves = [trace(20.0, 0.01, np.random.default_rng(i)) for i in range(3)]
    found = estimate(curves, off(0.0, (3.0, 0.0, 0.0)))
    np.testing.assert_array_equal(found.entry_mm, [3.0, 0.0, 0.0])
    assert "Check entry_mm" in found.warning
    lines = found.warning.rpartition("the clamp is ")[2].replace(", entry_direction", "\nentry_direction")
    said = tomllib.loads(lines)
    assert np.linalg.norm(said["entry_mm"]) < 1.0, "what may be copied is where the traces begin"
    assert angle_deg(np.array(said["entry_direction"]), curves[0].points_mm[5] - curves[0].points_mm[0]) < 5.0


def test_along_the_wire_the_clamp_stays_where_it_is_stated() -> None:
    """What the model gets wrong slid it, and all depths with it: here a curve that is 1 mm longer than the solver's."""
    curves = [
        Curve(free_wire(depth, CURVED_MM + 1.0), np.full(round(depth / VOXEL_MM), 0.02), 0.01, levels={"knot_mm": 3.0})
        for depth in (9.0, 11.1, 14.1, 17.1)
    ]
    given = off(0.0, (0.0, 0.0, 0.0))
    found = estimate(curves, given, Prior(0.25, 2.0))
    assert found.entry_mm[2] == pytest.approx(0.0, abs=1e-12)
    assert depth_from(found, curves[-1]) == pytest.approx(curves[-1].length_mm, abs=0.02)
    assert np.asarray(found.covariance)[2, 2] == pytest.approx(0.25**2)


def test_what_is_held_makes_the_rest_less_certain() -> None:
    rng = np.random.default_rng(100)
    jacobian, noise = rng.normal(size=(20, 3, 4)), 0.01 * np.eye(20)
    sigmas, held = np.array([0.5, 1.0, 0.2, 0.0]), np.array([True, False, False, False])
    off_by = []
    for _ in range(4000):
        true = sigmas * rng.normal(size=4)
        seen = jacobian @ true + 0.1 * rng.normal(size=(20, 3))
        mean, spread, _ = posterior(seen, jacobian, noise, sigmas, held, np.zeros(4))
        off_by.append(true - mean)
        assert mean[0] == mean[3] == 0.0
    np.testing.assert_allclose(spread, np.cov(np.transpose(off_by)), rtol=0.0, atol=0.01)


def test_a_trace_is_less_certain_where_it_begins() -> None:
    """Its variance there is twice that farther on (measured: 1.2 to 2.5 times), over half a knot."""
    arc = np.array([0.0, 0.7, 7.0])
    trace = TraceSamples(0, arc, np.zeros((3, 3)), np.full(3, 0.02), knot_mm=1.4)
    assert sigma_across(trace, 0.3) == pytest.approx(0.02 * np.sqrt([2.0, 1.0 + np.exp(-0.5), 1.0]))


@pytest.mark.parametrize("uncertain", [[1], [3, 4], [12], range(8, 12), range(16, 20)])
def test_a_point_that_is_less_certain_than_its_neighbours_makes_the_clamp_no_more_certain(
    uncertain: Sequence[int],
) -> None:
    """Where a gap was bridged a clamp was held to be known twice as well: correlated with its neighbours, a point that
    is four times as uncertain told the error that they share."""
    arc = np.arange(0.5, 10.1, 0.5)
    known = TraceSamples(0, arc, np.zeros((20, 3)), np.full(20, 0.035), 3.8)
    less = replace(known, sigma_mm=np.where(np.isin(np.arange(20), uncertain), 0.15, known.sigma_mm))
    place_and_tilt = np.eye(3)[:, :2] * np.stack([np.ones(20), arc], axis=1)[:, None, :]
    at, held = np.zeros(2), np.zeros(2, bool)

    def sigmas(traces: Sequence[TraceSamples]) -> Array:
        jacobian = np.concatenate([place_and_tilt] * len(traces))
        noise = covariance_of(traces, VOXEL_MM)
        return np.sqrt(np.diag(posterior(jacobian[..., 0], jacobian, noise, np.array([0.15, 0.035]), held, at)[1]))

    assert np.all(sigmas([less]) >= 0.98 * sigmas([known]))
    assert np.all(sigmas([known, less]) >= 0.98 * sigmas([known, known]))
    assert np.all(sigmas([known, less]) <= 1.01 * sigmas([known])), "a trace more takes no knowledge away"


def test_a_bridged_gap_is_off_as_a_whole_where_errors_are_drawn() -> None:
    """Weighed point by point, its mean would be 0.58 of what is stated of each point; so a right model was rare."""
    arc = np.arange(0.5, 10.1, 0.5)
    gap = (arc > 3.0) & (arc < 6.0)
    trace = TraceSamples(0, arc, np.zeros((20, 3)), np.where(gap, 0.15, 0.035), 3.8)
    mean = gap / gap.sum()
    weighed, drawn = (mean @ covariance_of_traces([trace], VOXEL_MM, drawn=way) @ mean for way in (False, True))
    assert np.sqrt(drawn) > 0.8 * 0.15
    assert np.sqrt(weighed) < 0.6 * 0.15


def test_a_clamp_far_from_what_the_manifest_says_of_it_is_told_by_what_is_off() -> None:
    curves = [trace(8.0 + 4 * i, 0.02, np.random.default_rng(i)) for i in range(5)]
    told = estimate(curves, off(0.0, (0.4, 0.0, 0.0)), Prior(0.1, 2.0))
    assert "off the manifest's by 0.39 mm across the wire, 3.9 times entry_sigma_mm (0.1)" in told.warning
    assert "in direction" not in told.warning
    turned = estimate(curves, off(4.0), Prior(0.15, 1.0))
    assert "degrees in direction, 3." in turned.warning
    assert "entry_direction_sigma_deg (1)" in turned.warning
    assert "across" not in turned.warning
    assert not estimate(curves, off(2.0)).warning


def known_of(curves: Sequence[Curve]) -> tuple[Any, Any]:
    """A case with an exact entry at the origin, run up to its traces."""
    case = SimpleNamespace(
        entry_mm=(0.0, 0.0, 0.0), entry_direction=(0.0, 0.0, 1.0), material_axis=None, down=None, entry_case=None,
        entry_sigma_mm=0.0, entry_direction_sigma_deg=0.0,
    )  # fmt: skip
    frames = [
        SimpleNamespace(index=i, trusted_curve=curve, curve=curve, roll_deg=0.0, catheter_mm=0.0)
        for i, curve in enumerate(curves)
    ]
    log = SimpleNamespace(warnings=[], assumptions=[])
    lumen = SimpleNamespace(distance=SimpleNamespace(spacing_mm=np.full(3, VOXEL_MM)))
    return SimpleNamespace(case=case, log=log), SimpleNamespace(frames=frames, vessel=lumen, off_the_scans=False)


@pytest.mark.parametrize(
    ("entry", "aside_mm", "sigma_mm", "doubted"),
    [
        ("traced", 0.1, 0.0, False),
        ("traced", 1.2, 0.0, True),
        ("traced", 0.1, 1e-6, False),
        ("traced", 1.2, 1e-6, True),
        ("manifest", 0.1, 0.0, False),
        ("manifest", 1.2, 0.0, True),
        ("manifest", 1.2, 0.2, True),
        ("manifest", 1.2, 0.5, False),
    ],
)
def test_an_exact_entry_beside_the_traced_wires_is_told(
    monkeypatch: pytest.MonkeyPatch, entry: str, aside_mm: float, sigma_mm: float, doubted: bool
) -> None:
    """1.6 mm beside them, said to be exact, or known to a nanometre: every frame was ok without a word."""
    monkeypatch.setattr("pipeline.run.stages.clamp._replayed", lambda _run, _known, *args, **_: replay(*args))
    curves = [trace(12.0 + 4 * i, 0.02, np.random.default_rng(i)) for i in range(3)]
    run, known = known_of([Curve(c.points_mm + [aside_mm, 0.0, 0.0], c.sigma_mm, 0.01) for c in curves])
    run.case.entry_sigma_mm = sigma_mm
    run.config = SimpleNamespace(simulate=SimpleNamespace(entry=entry))
    clamp = clamp_of(run, known)
    np.testing.assert_allclose(clamp.entry_mm, np.zeros(3), rtol=0.0, atol=1e-6)
    said = "; ".join(run.log.warnings)
    assert ("mm beside the manifest's entry (median of 3 frames)" in said) == doubted, said


def test_frames_that_show_no_wire_fit_no_clamp() -> None:
    """Lines in the noise of four frames without a wire made the clamp surer, and the right rms threefold."""
    right, noise = (Curve(free_wire(mm), np.full(round(mm / VOXEL_MM), 0.02), 0.01) for mm in (20.0, 30.0))
    frames = [Frame(0), Frame(1)]
    refused = noise.doubted(FrameStatus.TRACE_LOW_CONTRAST, "30 mm of line, 0.7 noises bright")
    traced = [frame.traced_by(curve) for frame, curve in zip(frames, (right, refused), strict=True)]
    assert [frame.index for frame in seen_in(traced)] == [0]


@pytest.mark.parametrize(("sigma_mm", "seen"), [(0.1, False), (0.1, True), (0.0, False)])
def test_a_case_that_shows_no_clamp_lends_none(monkeypatch: pytest.MonkeyPatch, sigma_mm: float, seen: bool) -> None:
    """Its manifest's entry was taken for what its scans show: 0.34 mm rms for 0.06, all frames ok without a word."""
    monkeypatch.setattr("pipeline.run.stages.clamp._replayed", lambda _run, _known, *args, **_: replay(*args))
    curves = [trace(12.0 + 4 * i, 0.02, np.random.default_rng(i)) for i in range(3)] if seen else []
    run, lender = known_of(curves)
    run.case.entry_sigma_mm = sigma_mm
    for step in ("open_case", "segment_vessel", "trace_frames", "with_fitted_roll"):
        monkeypatch.setattr(f"pipeline.run.stages.clamp.{step}", lambda *_: lender)
    monkeypatch.setattr("pipeline.run.stages.clamp.data_of", lambda case: (case.id,))
    for frame in lender.frames:
        frame.voxels = ""
    run.config, run.store = SimpleNamespace(simulate=SimpleNamespace(entry="traced")), None
    other = SimpleNamespace(**{**vars(run.case), "id": "lender", "group": "lender"})
    run.case = SimpleNamespace(**{**vars(run.case), "id": "own", "group": "own", "entry_case": other})
    if sigma_mm and not seen:
        with pytest.raises(StageError, match="case 'own': entry = \"case:lender\", but no frame of that case shows"):
            clamp_of(run, known_of([])[1])
        return
    clamp_of(run, known_of([])[1])
    (said,) = run.log.assumptions
    told = "the clamp was estimated from frames 0, 1, 2" if seen else "its manifest states it exactly"
    assert f"it is that of case 'lender': {told}" in said


def test_depth_is_counted_from_the_clamp() -> None:
    curve = trace(20.0, 0.0, np.random.default_rng(0))
    assert depth_from(off(0.0, (0.0, 0.0, 0.0)), curve) == pytest.approx(curve.length_mm)
    assert depth_from(off(0.0, (0.0, 0.0, 0.4)), curve) == pytest.approx(curve.length_mm - 0.4)


def test_traces_are_not_blamed_where_most_of_them_fit_no_clamp() -> None:
    """A wrong roll was told as frames that disagree with the others, whose traces agree with them to 0.03 mm."""
    seen = dict(enumerate([trace(20.0, 0.0, np.random.default_rng(0))] * 6))
    assert "within 0.00 mm of the others: look at the wire's tip" in left_out(seen, [3], 5)
    points = seen[3].points_mm
    turned = Curve(points + 0.02 * np.arange(len(points))[:, None], np.zeros(len(points)))
    assert "mm of the others: look at these traces first" in left_out({**seen, 3: turned}, [3], 5)
    short = Curve(turned.points_mm[: len(points) // 3], np.zeros(len(points) // 3))
    assert "look at the wire's tip first (curve, roll, stiffness), since these" in left_out(
        {**seen, 3: short}, [3], 5
    ), "the trace of the least deep frame was blamed where the wire was stated straight, or turned by 30 degrees"
    most = left_out(seen, [0, 1, 2, 3], 2)
    assert "disagree" not in most
    assert "frames 0, 1, 2, 3" in most
    assert "check entry_mm first (beyond the real clamp a wire moves from frame to frame" in most
    assert most.index("entry_mm") < most.index("roll") < most.index("before the traces")


def test_a_clamp_is_known_under_a_condition_that_a_good_fit_does_not_show() -> None:
    """Wires that were no solutions of the model lay 0.9 to 1.7 degrees off, stated 0.2 as a fact."""
    curves = []
    for depth in (16.0, 20.0, 24.0, 28.0):
        points = at_arc(free_wire(depth), np.arange(0.0, depth + 0.1, 0.5))
        points[:, 0] += points[:, 2] ** 2 / 500.0  # held as stated, and bowed to 250 mm
        curves.append(Curve(points, np.full(len(points), 0.02), 0.05))
    found = estimate(curves, off(0.0, (0.0, 0.0, 0.0)))
    assert error_deg(found) > 2.0 * found.sigma_deg
    assert not found.warning
    assert f"degrees {IF_AS_MODELLED}, which a good fit does not show" in found.note


def test_rough_traces_are_told_as_such_and_kept() -> None:
    """Own curves with 0.03 mm of noise at every point: 10 of 12 right ones were left out, and the entry was blamed."""
    rng = np.random.default_rng(4)
    curves = []
    for depth in np.linspace(16.0, 30.0, 8):
        points = at_arc(free_wire(depth), np.arange(0.0, depth + 0.1, 0.5))
        points[1:] += 0.03 * rng.normal(size=points[1:].shape)
        curves.append(Curve(points, np.full(len(points), np.nan)))
    found = estimate(curves, off(0.2))
    assert "frames 0, 1, 2, 3, 4, 5, 6, 7: the solver" in found.note, "all are kept"
    assert "scatter by 0.02" in found.warning
    assert "where a standard deviation of 0.045 mm leaves 0.01 mm" in found.warning
    assert "entry_mm" not in found.warning
    assert error_deg(found) < 3.0 * found.sigma_deg


def test_a_wire_that_is_bent_otherwise_makes_no_trace_rough() -> None:
    arc = np.arange(0.5, 9.6, 0.5)
    given = TraceSamples(0, arc, np.zeros((len(arc), 3)), np.full(len(arc), np.nan), np.nan)
    bent = np.column_stack([0.05 * arc**1.5, 0.5 * np.maximum(arc - 4.0, 0.0), 0.0 * arc])
    noise = 0.03 * np.random.default_rng(1).normal(size=bent.shape) * (1.0, 1.0, 0.0)
    assert roughness_mm([0.1 * bent], [given], VOXEL_MM) == 0.0
    assert roughness_mm([0.1 * bent + noise], [given], VOXEL_MM) == pytest.approx(0.03, rel=0.3)
    assert roughness_mm([bent[:3]], [given], VOXEL_MM) == 0.0, "too few points"


def test_a_clamp_that_is_turned_keeps_the_material_axis_that_was_not_stated() -> None:
    """Of the turned clamp another world axis is least along the direction: a roll meant 90 degrees more."""
    case = SimpleNamespace(
        entry_mm=(0.0, 0.0, 0.0), entry_direction=(0.101, 0.055, 0.993), material_axis=None, down=None,
        entry_sigma_mm=None, entry_direction_sigma_deg=2.0,
    )  # fmt: skip
    lumen = SimpleNamespace(distance=SimpleNamespace(spacing_mm=np.full(3, VOXEL_MM)))
    given, _, _ = manifest_clamp(cast(Any, SimpleNamespace(case=case)), cast(Any, SimpleNamespace(vessel=lumen)))
    for tilts in ((0.0, 0.0), (-0.1, 0.05), (0.05, -0.1), (0.1, 0.1)):
        clamp = moved(given, np.array([0.0, 0.0, 0.0, *tilts]))
        first = base_frame(clamp.direction, clamp.material_axis, 0.0)[:, 0]
        assert (
            angle_deg(first, np.array([0.0, 1.0, 0.0])) < 12.0
        )  # the turn itself, 8 degrees at most, and what was tilted before
