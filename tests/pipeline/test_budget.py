"""The budget: draws, lumens that lie elsewhere, errors over their uncertainty, frames with two shapes, the files."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import h5py
import numpy as np
import pandas as pd
import pytest

from pipeline.budget import (
    SOURCES,
    FrameSample,
    Nominal,
    alone,
    coefficients,
    drawn,
    exact,
    frame_budget,
    joint,
    rank_of_ends,
    releases,
    sigmas_of,
)
from pipeline.budget.ensemble import Scene, replayed
from pipeline.budget.inputs import FRICTION, ROLL_DEG, Member, Sigmas, members_per_lumen
from pipeline.budget.shapes import Shapes, energy_score_mm, parted, shapes_of
from pipeline.budget.surface import offset_field
from pipeline.budget.verdict import ROUND, axes_across, judged, reach_mm
from pipeline.cli import main
from pipeline.model import Array, Clamp, Curve, Lumen, Wall, Wire
from pipeline.run.stages.budget import Work, _lost, _row
from pipeline.run.stages.known import Frame
from pipeline.simulate.clamp_told import IF_AS_MODELLED
from pipeline.simulate.config import SimulateConfig, SolverConfig
from pipeline.simulate.evidence import TraceSamples
from pipeline.simulate.way import Stop, Way
from pipeline.study.manifest import ManifestError, read_manifest
from reports import tables
from reports.figures import figures_of
from reports.schema import BUDGET, ENTRIES, ERRORS, POINTS, SUMMARY, WIRE_LINES
from solver import Grid
from tests.reports.reading import read_vtp

FIGURES = ("budget", "error_over_u")
WIRE = Wire("w", 0.18, [(0.0, 0.5), (30.0, 5.0)], [(0.0, 0.12), (8.0, 0.12), (8.0, 0.0)])
ALONG_Z = np.column_stack([np.zeros(61), np.zeros(61), np.linspace(0.0, 30.0, 61)])


def nominal(*, traced: bool = True, friction: float = 0.0) -> Nominal:
    covariance = np.diag([0.04, 0.01, 0.01, 1e-4, 1e-4, 0.0])
    clamp = Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0]), covariance=covariance)
    return Nominal(clamp, np.array([10.0, 20.0]), np.zeros(2), SimulateConfig(friction=friction), np.full(2, traced))


def sigmas(of: Nominal, **stated: float) -> Sigmas:
    return sigmas_of(stated, of, WIRE, np.full(2, 0.1), 0.3)


def test_a_lumen_moves_by_what_is_said_and_as_smoothly_along_all_axes() -> None:
    grid = Grid(np.zeros((80, 60, 40), np.float32), np.array([0.3, 0.3, 0.6]))
    field = offset_field(grid, np.random.default_rng(3))
    assert field.shape == grid.shape
    assert field.std() == pytest.approx(1.0, abs=0.05)
    assert abs(field.mean()) < 0.05
    near = [float(np.mean(field[2:] * field[:-2])), float(np.mean(field[:, :, 1:] * field[:, :, :-1]))]
    assert near[0] == pytest.approx(near[1], abs=0.06), "0.6 mm apart, by two voxels or by one"
    assert 0.4 < near[0] < 0.8


def test_draws_have_the_stated_spread_and_are_the_same_alone() -> None:
    start = nominal()
    known = sigmas(start, roll_deg=3.0, rest_curvature=0.1)
    members = drawn(start, known, 400, 8)
    assert np.std([m.roll_deg[0] for m in members]) == pytest.approx(3.0, rel=0.1)
    assert np.std([m.config.rest_curvature_scale for m in members]) == pytest.approx(0.1, rel=0.1)
    assert np.std([m.clamp.entry_mm[0] for m in members]) == pytest.approx(0.2, rel=0.1)
    assert len({m.lumen for m in members}) == 50
    for source in SOURCES:
        for whole, own in zip(members[:20], drawn(start, alone(known, source), 20, 8), strict=True):
            if source == "roll":
                assert np.array_equal(whole.roll_deg, own.roll_deg)
                assert np.array_equal(own.clamp.entry_mm, np.zeros(3))
                assert np.array_equal(own.depth_mm, start.depth_mm)
            if source == "clamp":
                assert np.array_equal(whole.clamp.direction, own.clamp.direction)
                assert (own.roll_deg[0], own.config.taper_scale, own.narrower_mm) == (0.0, 1.0, 0.0)


@pytest.mark.parametrize(("members", "lumens"), [(24, 24), (48, 48), (100, 50), (200, 50), (1000, 125)])
def test_the_spread_rests_on_many_lumens(members: int, lumens: int) -> None:
    """It is most of it: with 8 members in each, 48 of them drew 6 lumens."""
    start = nominal()
    found = drawn(start, sigmas(start), members, members_per_lumen(members))
    assert len({m.lumen for m in found}) == lumens


def tube(radius: float) -> Lumen:
    """Along z."""
    axes = [np.arange(a, b, 0.4) for a, b in ((-4.0, 4.0), (-4.0, 4.0), (-3.0, 24.0))]
    x, y, _ = np.meshgrid(*axes, indexing="ij")
    distance = (np.hypot(x, y) - radius).astype(np.float32)
    grid = Grid(distance, np.full(3, 0.4), np.array([-4.0, -4.0, -3.0]))
    return Lumen(grid, grid.with_values((distance < 0).astype(np.uint8)))


@pytest.mark.parametrize("bias_mm", [-0.1, -0.6, 0.3])
def test_a_lumen_may_be_wider_by_more_than_the_wire_is_thick(bias_mm: float) -> None:
    """It was simulated as 0.18 mm wider, the radius of the wire: u at the tip was a fifth to a third too small."""
    clamp = Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    arc, way = np.linspace(0.0, 20.0, 41), Way.reading([Stop(0, 20.0)])
    found = []
    for radius, narrower in ((1.2, bias_mm), (1.2 - bias_mm, 0.0)):
        scene = Scene(WIRE, Wall(2.0, 0.0), tube(radius), SolverConfig(segment_mm=0.5), [ALONG_Z[:41]], way)
        member = Member(clamp, np.array([20.0]), np.zeros(1), SimulateConfig(), narrower, 0, 0.0)
        found.append(replayed(scene, [[member]], [arc])[0][0][0])
    assert abs(found[1][-1, 0]) > 0.4
    np.testing.assert_allclose(*found, rtol=0.0, atol=2e-3)  # the single precision of the distances


@pytest.mark.parametrize(("segment_mm", "long_enough"), [(1.0, True), (4.0, False)])
def test_members_have_the_segments_of_the_simulated_wire_where_longer_ones_lie_elsewhere(
    segment_mm: float, long_enough: bool
) -> None:
    """With all inputs exact u was 1.9 mm: members of 1 mm snapped aside where the wire of 0.125 mm did not.

    And what long segments are off is no uncertainty of an input.
    """
    lumen, curved = tube(1.2), replace(WIRE, bending_stiffness_N_mm2=[(0.0, 0.3), (2.0, 5.0)])
    arc, way = np.linspace(0.0, 20.0, 41), Way.reading([Stop(0, 20.0)])
    fine = Scene(curved, Wall(2.0, 0.0), lumen, SolverConfig(segment_mm=0.25), [ALONG_Z[:41]], way)
    clamp = Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    work = object.__new__(Work)
    work.scene, work.nominal = fine, Nominal(clamp, np.array([20.0]), np.zeros(1), SimulateConfig(), np.zeros(1, bool))
    work.sigmas = exact(sigmas_of({}, work.nominal, curved, np.zeros(1), 0.4))
    work.run = cast(Any, SimpleNamespace(config=SimpleNamespace(budget=SimpleNamespace(seed=0))))
    (member,) = drawn(work.nominal, work.sigmas, 1, 1)
    work.seen = [FrameSample(arc, replayed(fine, [[member]], [arc])[0][0][0])]
    quick = replace(fine, solver=replace(fine.solver, segment_mm=segment_mm))
    work._settle(quick)
    assert (work.scene.solver.segment_mm == segment_mm) == long_enough
    ((wires,),) = work.ensembles([(work.sigmas, 3)])
    np.testing.assert_allclose(wires, np.broadcast_to(work.seen[0].nominal_mm, wires.shape), rtol=0.0, atol=1e-9)
    apart = replayed(quick, [[member]], [arc])[0][0][0] - work.seen[0].nominal_mm
    assert np.abs(apart).max() > 0.003, "mm"


def test_what_a_calibration_found_is_drawn_where_nothing_is_stated() -> None:
    """A rest curvature known to 2 % was drawn with the default of 5 %, without a word."""
    calibrated = {"rest_curvature": 0.02, "roll_deg": 3.0, "friction": 0.01}
    known = sigmas_of({"friction": 0.05}, nominal(), WIRE, np.full(2, 0.1), 0.3, calibrated=calibrated)
    assert (known.rest_curvature, known.said["rest_curvature"]) == (0.02, "0.02 (relative), calibrated")
    assert known.roll == pytest.approx(np.hypot(ROLL_DEG, 3.0)), "its own error, and that of the common offset"
    assert known.said["roll"].endswith("degrees, default and calibrated")
    assert (known.friction, known.said["friction"]) == (0.05, "0.05, stated")
    assert known.said["taper"].endswith("default")


def test_a_calibrated_offset_of_depths_is_one_for_all_frames() -> None:
    """Drawn for each frame anew, an offset of 1 mm made steps of 1.4 mm between them."""
    stated = nominal(traced=False)
    known = sigmas_of({}, stated, WIRE, np.full(2, 0.1), 0.3, calibrated={"insertion_mm": 1.0})
    assert known.said["depth"].endswith("; 1.00 mm, common, calibrated")
    for sigmas_ in (known, alone(known, "depth")):
        depths = np.array([member.depth_mm for member in drawn(stated, sigmas_, 200, 1)])
        assert np.std(depths, axis=0) == pytest.approx(1.0, rel=0.15)
        assert np.std(depths[:, 1] - depths[:, 0]) == pytest.approx(0.14, rel=0.15)
    assert {member.depth_mm[0] for member in drawn(stated, exact(known), 9, 1)} == {10.0}
    traced = sigmas_of({}, nominal(), WIRE, np.full(2, 0.1), 0.3, calibrated={"insertion_mm": 1.0})
    assert np.ptp([member.depth_mm[0] for member in drawn(nominal(), traced, 50, 1)]) < 2.0, "mm: the traces' are not"


def test_a_noisy_scan_has_a_lumen_that_is_less_known() -> None:
    start = nominal()
    quiet, noisy = (sigmas_of({}, start, WIRE, np.full(2, 0.1), 0.2, noise_mm=mm).lumen for mm in (0.0, 0.04))
    assert (quiet, noisy) == pytest.approx((0.014, np.hypot(0.014, 0.04)))
    assert sigmas(start).lumen == pytest.approx(0.12 * 0.3, rel=0.02), "a lumen that is no scan's"


def test_a_clamp_moved_along_the_wire_leaves_a_traced_tip_where_it_is_seen() -> None:
    along = replace(nominal().clamp, covariance=np.diag([0.0, 0.0, 0.25, 0.0, 0.0, 0.0]))
    for traced in (True, False):
        start = nominal(traced=traced)._replace(clamp=along)
        members = drawn(start, alone(sigmas(start), "clamp"), 10, 8)
        ends = np.array([m.clamp.entry_mm[2] + m.depth_mm[0] for m in members])
        assert (np.ptp(ends) < 1e-9) == traced


def test_a_fitted_roll_is_as_uncertain_as_its_fit_says() -> None:
    """Known to 9.5 degrees it was drawn with the default of 5: 33 % of an exact model's points were beyond 2 u."""
    fitted = nominal()._replace(roll_sd_deg=9.5)
    known = sigmas(fitted)
    assert (known.roll, known.said["roll"]) == (9.5, "9.5 degrees, fitted")
    assert sigmas(fitted, roll_deg=2.0).said["roll"] == "2 degrees, stated"
    straight = replace(WIRE, rest_curvature_per_mm=0.0)
    assert sigmas_of({}, fitted, straight, np.full(2, 0.1), 0.3).roll == 0.0


def test_what_is_not_stated_is_a_default_that_is_said() -> None:
    plain, told = sigmas(nominal()), sigmas(nominal(), roll_deg=0.0, friction=0.02)
    assert (plain.roll, plain.said["roll"]) == (ROLL_DEG, f"{ROLL_DEG:g} degrees, default")
    estimated = nominal()._replace(clamp=replace(nominal().clamp, note="estimated"))
    assert [IF_AS_MODELLED in sigmas(of).said["clamp"] for of in (nominal(), estimated)] == [False, True]
    assert (told.roll, told.said["roll"]) == (0.0, "0 degrees, stated")
    assert (plain.friction, told.friction) == (0.0, 0.02), "without friction none is drawn by default"
    assert sigmas(nominal(friction=0.1)).friction == pytest.approx(FRICTION * 0.1)
    assert min(m.config.friction or 0.0 for m in drawn(nominal(), told, 50, 8)) == 0.0


@pytest.mark.parametrize("count", [20, 400])
def test_ninety_five_of_a_hundred_right_errors_are_within_two_u(count: int) -> None:
    """Whatever the covariance's axes, and though it is known from few members."""
    rng = np.random.default_rng(count)
    root = np.array([[0.3, 0.1, 0.05], [0.0, 0.05, 0.0], [0.1, 0.0, 0.4]])
    axes = axes_across(ALONG_Z, np.full(1, 15.0))
    inside = []
    for _ in range(1500):
        wires = rng.normal(size=(count, 1, 3)) @ root
        moment = np.einsum("mni,mnj->nij", wires, wires) / count
        error = rng.normal(size=(1, 3)) @ root + 0.02 * rng.normal(size=(1, 3))
        inside.append(judged(error, moment, np.full(1, 0.02**2), axes, count).ratio[0] <= 2.0)
    assert np.mean(inside) == pytest.approx(0.95, abs=0.02)


def test_so_many_are_where_the_fewest_members_tell() -> None:
    """Eight, about the nominal wire: 96.1 % were, by the formula for what lies about a mean."""
    rng, count, points = np.random.default_rng(5), 8, 60_000
    wires, error = rng.normal(size=(count, points, 3)), rng.normal(size=(points, 3))
    moment = np.einsum("mni,mnj->nij", wires, wires) / count
    axes = axes_across(ALONG_Z, np.full(points, 15.0))
    inside = judged(error, moment, np.zeros(points), axes, count).ratio <= 2.0
    assert np.mean(inside) == pytest.approx(0.95, abs=0.003)  # three sigma


def test_only_what_lies_across_counts_and_a_round_u_is_the_mean() -> None:
    axes = axes_across(ALONG_Z, np.full(1, 15.0))
    along = judged(np.array([[0.0, 0.0, 9.0]]), 0.01 * np.eye(3)[None], np.zeros(1), axes, 1000)
    assert along.ratio[0] == pytest.approx(0.0, abs=1e-9)
    assert reach_mm(0.01 * np.eye(3)[None], axes, 100_000)[0] == pytest.approx(0.1 * ROUND, rel=1e-3)


def straight(offset: Array) -> Array:
    """Wires along z (members, 61, 3), their tips to the side by offsets (members,)."""
    bent = np.zeros((len(offset), 61, 3)) + ALONG_Z
    bent[:, :, 0] += offset[:, None] * (ALONG_Z[:, 2] / 30.0) ** 2
    return bent


@pytest.mark.parametrize("kind", ["normal", "exponential", "uniform"])
def test_one_shape_is_one_shape(kind: str) -> None:
    """Also where a contact cuts off one side of the spread."""
    draw = {"normal": lambda r: r.normal(size=100), "exponential": lambda r: r.exponential(size=100)}
    rng = np.random.default_rng(5)
    named = draw.get(kind, lambda r: r.uniform(-2.0, 2.0, size=100))
    assert sum(parted(straight(0.3 * named(rng))) is not None for _ in range(200)) <= 4


def test_wires_that_are_the_same_have_one_shape() -> None:
    """Half way between two numbers that are neighbours or the same: all members were on one side of it."""
    for offset in (0.0, 0.3, 1.0):
        assert parted(straight(np.full(24, offset))) is None


def test_two_shapes_have_their_probabilities_and_the_real_wire_has_one() -> None:
    rng = np.random.default_rng(1)
    offset = np.where(np.arange(100) < 20, 2.0, 0.0) + 0.1 * rng.normal(size=100)
    wires, (held, gone) = straight(offset), straight(np.array([0.1, 1.8]))
    found = shapes_of(wires, held, gone, ALONG_Z[:, 2])
    assert found is not None
    assert (found.simulated, found.real) == pytest.approx((80.5 / 101, 20.5 / 101))
    assert not found.same
    assert int(found.with_simulated.sum()) == 80
    seen = FrameSample(ALONG_Z[:, 2], held, gone, ALONG_Z[:, 2], np.full(61, 1e-4))
    budget = frame_budget(np.concatenate([wires, np.full((5, 61, 3), np.nan)]), seen)
    assert budget is not None
    assert budget.members == 100, "those that came to no rest do not count"
    assert budget.ratio is not None
    assert np.max(budget.input_mm) < 0.3, "the spread is that within the simulated shape"
    assert budget.ratio[-1] > 2.0
    assert frame_budget(wires[:4], seen) is None
    # seen from the rarer shape: 3.0 mm, the distance between the two, where fewer than eight members shared it
    for count, known in ((7, True), (3, False)):
        few = np.concatenate([wires[:count], wires[20:]])
        budget = frame_budget(few, seen._replace(nominal_mm=gone, curve_mm=held))
        assert budget is not None
        assert (np.max(budget.input_mm) < 0.6) == known
        assert np.isnan(budget.input_mm[-1]) != known


def test_the_energy_score_is_least_for_the_right_ensemble() -> None:
    rng = np.random.default_rng(2)
    real = straight(rng.normal(size=300))
    right, narrow, aside = (straight(s * rng.normal(size=60) + m) for s, m in ((1.0, 0.0), (0.2, 0.0), (1.0, 1.0)))
    scores = [np.mean([energy_score_mm(wires, y) for y in real]) for wires in (right, narrow, aside)]
    assert scores[0] < min(scores[1:])
    assert energy_score_mm(np.repeat(real[:1], 9, axis=0), real[0]) == 0.0


def test_a_release_is_counted_once() -> None:
    same, other = (Shapes(0.5, 0.5, s, np.ones(1, bool)) for s in (True, False))
    assert releases([True, False, True], [None, None, same]) == ["both", "", "both"]
    assert releases([True, False, False], [other, other, None]) == ["spurious", "", ""]
    assert releases([False, False, True], [other, other, same]) == ["missed", "", ""], "the simulated one comes late"


def spread_ends(rng: np.random.Generator, members: int = 48, frames: int = 4) -> Array:
    """Coefficients of members and a real one (last) of one distribution, correlated over frames; (.., frames, 8)."""
    root = np.random.default_rng(0).normal(size=(frames * 8, frames * 8)) * np.geomspace(1.0, 0.05, frames * 8)
    return (rng.normal(size=(members + 1, frames * 8)) @ root.T).reshape(members + 1, frames, 8)


@pytest.mark.slow
def test_ranks_of_right_insertions_are_even() -> None:
    """Of 400 right ones 20 are expected to be claimed; 3 standard deviations are 13."""
    rng = np.random.default_rng(5)
    ranks = [rank_of_ends(list(np.moveaxis(spread_ends(rng), 1, 0))) for _ in range(400)]
    assert np.sum(np.array(ranks) <= 0.05) == pytest.approx(20, abs=13)
    assert np.mean(ranks) == pytest.approx(0.5, abs=0.06)


def test_ranks_are_even_where_members_share_a_lumen() -> None:
    """Two members have one lumen, nearly all of what is uncertain: of right ones a half were called rare."""
    rng = np.random.default_rng(11)
    size, whose = 40, np.append(np.repeat(np.arange(50), 2), 50)
    ranks = []
    for _ in range(40):
        lumen, rest = (rng.normal(size=(size, n)) / np.sqrt(n) for n in (40, 8))
        ends = np.sqrt(0.9) * rng.normal(size=(51, 40))[whose] @ lumen.T
        ends = ends + np.sqrt(0.1) * rng.normal(size=(101, 8)) @ rest.T + 0.15 * rng.normal(size=(101, size))
        ranks.append([rank_of_ends([ends], members) for members in (1, 2)])
    rare = np.sum(np.array(ranks) <= 0.05, axis=0)
    assert rare[1] <= 6, "2 expected; 3 standard deviations are 4"
    assert rare[0] > 10, "as it was: the test can fail"


def test_a_small_error_that_all_frames_share_is_found_together() -> None:
    """Within 2 standard deviations at every coefficient, and along what the inputs hardly move."""
    rng = np.random.default_rng(6)
    ends = spread_ends(rng)
    spread = ends[:-1].std(axis=0)
    least = np.linalg.svd(ends[:-1].reshape(48, -1) / spread.ravel())[2][-4:].sum(axis=0).reshape(spread.shape)
    ends[-1] = 1.9 * spread * least / np.abs(least).max()
    assert rank_of_ends(list(np.moveaxis(ends, 1, 0))) == pytest.approx(1 / 49)


def test_the_distance_is_that_of_the_shrunk_moment() -> None:
    rng = np.random.default_rng(7)
    others, tried = rng.normal(size=(12, 30)), rng.normal(size=(3, 30))
    moment = others.T @ others / 12
    moment = (1.0 - joint.SHRUNK) * moment + joint.SHRUNK * np.diag(np.diag(moment))
    expected = np.einsum("ti,ij,tj->t", tried, np.linalg.inv(moment), tried)
    assert joint._squares(tried, others) == pytest.approx(expected, rel=1e-9)


def test_a_rank_needs_members_and_traces() -> None:
    ends = spread_ends(np.random.default_rng(8), members=12, frames=2)
    frames = list(np.moveaxis(ends, 1, 0))
    assert 0.0 < rank_of_ends(frames) <= 1.0
    frames[0][:6] = np.nan  # six members came to no rest in a frame
    assert np.isnan(rank_of_ends(frames))
    assert np.isnan(rank_of_ends([]))
    arc = np.linspace(0.0, 30.0, 61)
    trace = TraceSamples(0, arc, ALONG_Z, np.full(61, 0.02), 3.0)
    wires = np.repeat(ALONG_Z[None], 10, axis=0)
    assert coefficients(wires, FrameSample(arc, ALONG_Z), trace, 0.3, np.random.default_rng(0)) is None, (
        "nothing traced"
    )


def test_a_wire_that_is_bent_otherwise_is_rare_and_one_that_is_not_is_none() -> None:
    """Members lie off by a turn about the entry; the real wire by as much, or bent the other way at its end."""
    rng = np.random.default_rng(9)
    arc, foot = np.linspace(0.0, 30.0, 61), np.linspace(0.0, 30.0, 61)
    trace = TraceSamples(0, arc, ALONG_Z, np.full(61, 0.02), 3.0)
    wires = ALONG_Z + rng.normal(size=(40, 1, 2)) @ np.eye(2, 3) * (arc / 30.0)[:, None]
    for bend, rare in ((0.0, False), (1.0, True)):
        off = 0.5 * arc / 30.0 + bend * np.clip(arc - 15.0, 0.0, None) * (arc - 25.0) / 60.0
        curve = ALONG_Z + off[:, None] * np.array([1.0, 0.0, 0.0])
        seen = FrameSample(arc, ALONG_Z, curve, foot, np.full(61, 0.02**2))
        found = coefficients(wires, seen, trace, 0.3, rng)
        assert found is not None
        assert (rank_of_ends([found]) <= 0.05) == rare


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    assert main(["synth", "bend", "-o", str(folder), "--frames", "3", "--size", "64", "--seed", "7"]) == 0
    return folder


@pytest.fixture(scope="module")
def out(study: Path, store: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("out")
    words = ["--set", "budget.members=24", "--set", "budget.members_alone=8", "--sweep", "simulate.taper_scale=1.1"]
    assert main(["run", str(study / "manifest.toml"), "-o", str(folder), *words]) == 0
    assert main(["run", str(study / "manifest.toml"), "-o", str(folder / "bare"), "--set", "budget.members=0"]) == 0
    return folder


def test_every_frame_has_its_uncertainty_beside_its_error(out: Path) -> None:
    case = out / "cases" / "bend"
    errors, points = tables.read(case / "errors.csv", ERRORS), tables.read(case / "points.csv.gz", POINTS)
    assert (errors["u_val_mm"] > errors["u_input_mm"]).all()
    assert (errors["u_input_mm"] > 0.01).all()
    calm = errors[errors["release"].isna()]
    for row in calm.itertuples():
        ratio = points.loc[points["frame"] == row.frame, "error_over_u"]
        assert row.share_beyond_2u == pytest.approx((ratio > 2.0).mean())
    with h5py.File(case / "frames.h5") as file:
        group = file["frames/002"]
        assert group["covariance_mm2"].shape == (len(group["arc_mm"]), 3, 3)
    summary = tables.read(out / "summary.csv", SUMMARY).iloc[0]
    assert summary["release_frames"] == errors["release"].notna().sum()
    assert summary["u_val_mm"] > 0.0
    assert 0.0 < summary["ends_rank"] <= 1.0
    said = (case / "result.json").read_text(encoding="utf-8")
    assert "budget rests on 24 insertions" in said
    assert "the traces, which state none" not in said


def test_what_is_assumed_of_traces_that_state_none_is_said() -> None:
    """It was the largest term, called "its own", and stood among no assumptions."""
    curves = [Curve(np.zeros((4, 3)), np.full(4, sigma)) for sigma in (0.02, np.nan)]
    known, unknown = (SimpleNamespace(frames=[Frame(0, curve=curve)], voxel=0.3) for curve in curves)
    said = Work.trace_said.fget
    assert said is not None
    assert said(cast(Any, known)) == ""
    assert said(cast(Any, unknown)) == "0.045 mm (0.15 voxels, assumed)"


def test_the_budget_moves_nothing_and_a_sweep_pays_for_none(out: Path) -> None:
    paths = [out / "cases/bend", out / "bare/cases/bend", out / "sweep/simulate.taper_scale=1.1/cases/bend"]
    plain, bare, swept = (tables.read(path / "errors.csv", ERRORS) for path in paths)
    assert plain["rms_mm"].tolist() == bare["rms_mm"].tolist()
    for table, folder in ((bare, paths[1]), (swept, paths[2])):
        assert table["u_val_mm"].isna().all()
        assert not (folder / "budget.csv").exists()
    assert not (paths[2] / "entries.csv").exists()


@pytest.mark.slow
def test_an_ensemble_that_is_too_small_says_so(study: Path, tmp_path: Path) -> None:
    words = ["-o", str(tmp_path), "--until", "compare", "--set", "budget.members=4", "--set", "budget.members_alone=2"]
    assert main(["run", str(study / "manifest.toml"), *words, "--set", "compare.simulated_nulls=false"]) == 0
    assert tables.read(tmp_path / "cases/bend/errors.csv", ERRORS)["u_val_mm"].isna().all()
    said = (tmp_path / "cases/bend/result.json").read_text(encoding="utf-8")
    assert "fewer than 90 % of the 4 insertions" in said
    assert "budget.members_alone = 2: of fewer than 8 insertions" in said


def test_the_table_by_source_adds_up_and_the_four_entries_are_there(out: Path) -> None:
    case = out / "cases" / "bend"
    rows = tables.read(case / "budget.csv", BUDGET).set_index("source")["u_mm"]
    named = [name for name in SOURCES if name != "friction"]
    assert list(rows.index) == [*named, "inputs", "segments", "trace", "u_val", "error"]
    assert rows["u_val"] ** 2 == pytest.approx(rows[["inputs", "segments", "trace"]].pow(2).sum(), rel=1e-4)
    together = float(np.sqrt(rows[named].pow(2).sum()))
    assert rows["inputs"] == pytest.approx(together, rel=0.5), "with 8 and 24 members"
    entries = tables.read(case / "entries.csv", ENTRIES)
    pairs = list(zip(entries["clamp"], entries["depth"], strict=True))
    assert pairs == [(c, d) for c in ("estimated", "manifest") for d in ("traced", "manifest")]
    errors = tables.read(case / "errors.csv", ERRORS)
    pooled = tables.read(out / "summary.csv", SUMMARY)["rms_mm"].iloc[0]
    assert len(errors) == entries["frames"].iloc[0]
    assert entries["rms_mm"].iloc[0] == pytest.approx(pooled, abs=1e-6), "the first row is the run's own"
    assert entries["rms_mm"].nunique() == 4


@pytest.mark.parametrize("step_mm", [0.1, 0.5])
def test_the_end_of_a_wire_is_counted_in_millimetres(step_mm: float) -> None:
    """It was 20 points: of a wire looked at every 0.1 mm its last 2 mm, under "last 10 mm"."""
    arc = np.arange(0.0, 40.0 + 1e-9, step_mm)
    row = _row("inputs", "", [(arc, np.where(arc > 30.0 - 1e-6, 2.0, 0.0))])
    assert row["distal_u_mm"] == 2.0
    assert row["u_mm"] == pytest.approx(1.0, abs=0.02)


def test_the_lines_carry_what_an_error_is_divided_by(out: Path) -> None:
    """They had the trace's standard deviation alone, as u_mm: in ParaView everybody divided the error by that."""
    case = out / "cases" / "bend"
    points = tables.read(case / "points.csv.gz", POINTS)
    for number, samples in points.groupby("frame"):
        arrays = read_vtp(case / "view" / f"wire_simulated_{number:03d}.vtp").point_arrays
        assert list(arrays) == ["error_mm", "arc_mm", "contact_force_N", "trace_sigma_mm", "u_val_mm"]
        assert set(arrays) <= set(WIRE_LINES.names)
        scored = np.isfinite(arrays["error_mm"])
        assert scored.sum() == len(samples)
        np.testing.assert_allclose(arrays["u_val_mm"][scored], samples["u_val_mm"], rtol=1e-6)
        assert np.isnan(arrays["u_val_mm"][~scored]).all()
    assert list(read_vtp(case / "view" / "wire_traced_000.vtp").point_arrays) == ["arc_mm", "trace_sigma_mm"]
    bare = read_vtp(out / "bare" / "cases" / "bend" / "view" / "wire_simulated_000.vtp").point_arrays
    assert "u_val_mm" not in bare


def test_the_pages_show_it(out: Path) -> None:
    folder = out / "cases" / "bend" / "figures"
    assert {"budget", "error_over_u"} <= {path.stem for path in folder.glob("*.png")}
    assert not (out / "bare/cases/bend/figures/error_over_u.png").exists()
    assert len(pd.read_csv(folder / "budget.csv")) == 17
    assert "release_frames" in figures_of("case")


MANIFEST = """
schema = 1
[wires.w]
radius_mm = 0.18
bending_stiffness_N_mm2 = 5.0
[[case]]
id = "tube"
lumen = "none.stl"
entry_mm = [0.0, 0.0, 0.0]
entry_direction = [0.0, 0.0, 1.0]
wire = "w"
insertion_mm = [6.0, 12.0]
roll_sigma_deg = 1.5
insertion_sigma_mm = 0.3
[case.uncertainty]
taper = 0.2
"""


def test_a_manifest_states_what_it_knows(tmp_path: Path) -> None:
    path = tmp_path / "manifest.toml"
    path.write_text(MANIFEST, encoding="utf-8")
    case = read_manifest(path).cases[0]
    assert (case.roll_sigma_deg, case.insertion_sigma_mm, case.uncertainty.taper) == (1.5, 0.3, 0.2)
    path.write_text(MANIFEST.replace("taper = 0.2", "tapper = 0.2\nlumen_mm = -1.0"), encoding="utf-8")
    with pytest.raises(ManifestError) as error:
        read_manifest(path)
    assert "uncertainty tapper: unknown key; did you mean 'taper'" in str(error.value)
    assert "uncertainty lumen_mm" in str(error.value)


def test_frames_without_a_budget_are_named_as_one_or_as_several() -> None:
    """It was said of frames 4."""
    assert _lost({3: None}, 40)[0].startswith("frame 3: fewer than ")
    assert _lost({3: None, 5: None}, 40)[0].startswith("frames 3, 5: fewer than ")
