"""Calibration on wires of the solver itself, which tests the fit alone; truth by the rod is ``studies/calibration``."""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.special import ndtr

from pipeline.calibrate import estimates, segments
from pipeline.calibrate.design import predicted, straight_to
from pipeline.calibrate.estimates import Estimate, _followed, _judged, calibrated
from pipeline.calibrate.fit import Problem
from pipeline.calibrate.insertions import beyond_their_priors, limit_of, moved_of
from pipeline.calibrate.residuals import Evidence, weights_of
from pipeline.calibrate.search import Fit, fitted, own_roll, roll_fitted
from pipeline.calibrate.trials import OWN, WALL_OFFSET, Point, Trial, replayed
from pipeline.calibrate.unknowns import BENDING, FRICTION, REST, ROLL, TAPER, bent, lacking, spread_in_words, unknowns
from pipeline.cli import main
from pipeline.compare.pooled import is_pooled
from pipeline.model import Clamp, Curve, Lumen, Wall, Wire
from pipeline.run import calibration, calibration_files, inputs
from pipeline.run.cache import Store
from pipeline.run.calibrated import as_calibrated, data_of
from pipeline.run.calibrated_wire import wire_rows
from pipeline.run.calibration import SAME_MM, CalibrationError, depth_offset, design, gathered, over_insertions
from pipeline.run.calibration_files import (
    _walls_known,
    contradicted,
    estimates_of,
    flattened,
    misfit,
    no_common_roll,
    reservation,
)
from pipeline.run.inputs import described, other_file, stated, times_of
from pipeline.run.log import Log
from pipeline.run.outputs import error_row, summary_row
from pipeline.run.stages import Context, Known
from pipeline.run.stages.known import Frame
from pipeline.run.stages.roll import with_fitted_roll
from pipeline.simulate.clamp import Prior, moved
from pipeline.simulate.config import SolverConfig
from pipeline.simulate.resolution import moved_mm
from pipeline.status import FrameStatus, InputError, StageError
from pipeline.study.manifest import read_manifest
from pipeline.study.parameters import ParametersError, read_parameters
from pipeline.study.settings import Config
from reports.calibration import to_its_digits
from solver import Grid, VesselWall
from tests.pipeline.test_manifest import GOOD, written

WIRE = Wire("w", 0.18, [(0.0, 0.5), (10.0, 0.5), (30.0, 2.0)], [(0.0, 0.1), (8.0, 0.1), (8.0, 0.0)])
SETTINGS = SolverConfig(segment_mm=1.0, finest_mm=1.0)
X, Y, Z = np.meshgrid(*(np.arange(a, b, 0.5) for a, b in ((-5, 16), (-5, 5), (-4, 34))), indexing="ij")
BENT = np.hypot(X - 0.012 * np.maximum(Z, 0.0) ** 2, Y) - 1.6
VESSEL = VesselWall(Grid(BENT, [0.5] * 3, [-5.0, -5.0, -4.0]), stiffness_N_mm2=1.0)
DEPTHS = (10.0, 16.0, 24.0, 16.0)
TRUE = {ROLL: 17.0, REST: np.log(1.15), TAPER: np.log(1.4), "wall:0.05": np.log(0.8), FRICTION: 0.04}


def trial(wire: Wire = WIRE, values=TRUE, depths=DEPTHS, noise=0.0, **changes) -> Trial:
    clamp = Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    empty = Trial("t", "t", VESSEL, wire, Wall(0.05), clamp, Prior(0.1, 1.0), (), 0.3, **changes)
    planned = straight_to(empty, depths, [30.0] * len(depths))
    (wires,) = replayed([(planned, Point(values, np.zeros(OWN + len(depths))))], SETTINGS)
    rng, seen = np.random.default_rng(3), []
    for frame, found in zip(planned.seen, wires, strict=True):
        points = found.joints_mm + noise * rng.normal(size=found.joints_mm.shape)
        seen.append(replace(frame, curve=Curve(points, np.full(len(points), 0.02), 0.05)))
    force = changes.get("force_N")
    force = None if force is None else np.array([found.push_force_N for found in wires])
    return replace(planned, seen=tuple(seen), force_N=force)


def all_of(*trials: Trial, weighed=False):
    return unknowns([t.wall.stiffness_N_mm2 for t in trials], 0.0, weighed=weighed)


def test_parameters_are_found_again_and_the_clamp_with_them():
    shifted = replace(trial(), given=replace(trial().given, entry_mm=np.array([0.05, -0.04, 0.0])))
    fit = calibrated(all_of(shifted), [Evidence(shifted)], SETTINGS)
    for estimate in fit.estimates:
        true = TRUE[estimate.unknown.name]
        assert abs(estimate.value - true) < max(2.0 * estimate.sd, 1e-3), estimate.unknown.name
    by_name = {e.unknown.name: e for e in fit.estimates}
    assert by_name[ROLL].seen
    assert by_name[REST].seen
    own = fit.fit.linear.x[fit.fit.problem.parts[0]]
    # stated 0.064 mm beside where it is held
    assert np.linalg.norm(moved(shifted.given, own[:5]).entry_mm[:2]) < 0.03
    assert all(frame.after_mm < frame.before_mm for frame in fit.frames)
    assert {frame.turned for frame in fit.frames} == {""}, "its roll is exact"


@pytest.mark.slow
@pytest.mark.parametrize(("stated_deg", "apart"), [pytest.param(0.0, False, marks=pytest.mark.slow), (-12.0, True)])
def test_rolls_that_are_stated_wrongly_have_no_common_offset(stated_deg, apart):
    """Of two insertions, one stated 11 degrees off, the mean was taken: 5 degrees wrong for both, +- 0.7, seen."""
    first, second = (
        replace(trial(noise=0.01), name="a", group="a"),
        replace(trial(noise=0.01, depths=(12.0, 18.0, 22.0)), name="b", group="b"),
    )
    seen = tuple(replace(frame, roll_deg=frame.roll_deg + stated_deg) for frame in second.seen)
    both = first, replace(second, seen=seen)
    found = calibrated(all_of(*both), [Evidence(one) for one in both], SETTINGS)
    roll = next(e for e in found.estimates if e.unknown.name == ROLL)
    assert roll.seen is not apart
    assert ("b wants 12 degrees more than a" in roll.why) is apart
    assert roll.used == (0.0 if apart else pytest.approx(17.0, abs=1.0))
    assert {frame.turned for frame in found.frames} == {"as_calibrated" if apart else ""}
    assert bool(no_common_roll(found)) is apart, "it stood in the parameter's row alone"


@pytest.mark.slow
@pytest.mark.parametrize("off_deg", [9.0, pytest.param(20.0, marks=pytest.mark.slow)])
def test_rolls_that_are_stated_a_little_wrongly_are_no_taper(off_deg):
    """Rolls stated 5 to 20 degrees wrong, each otherwise: the taper was 0.76 to 1.5, seen, up to 6.5 sd off."""
    turns = (off_deg, -off_deg, 0.5 * off_deg)
    depths = (DEPTHS, (12.0, 18.0, 22.0), (9.0, 14.0, 20.0, 26.0))
    made = []
    for n, (turn, at) in enumerate(zip(turns, depths, strict=True)):
        one = replace(trial(noise=0.01, depths=at), name=str(n), group=str(n), roll_sigma_deg=off_deg)
        seen = tuple(replace(frame, roll_deg=frame.roll_deg + turn) for frame in one.seen)
        made.append(Evidence(replace(one, seen=seen)))
    found = calibrated(all_of(*(one.trial for one in made)), made, SETTINGS)
    by_name = {e.unknown.name: e for e in found.estimates}
    for name in (REST, TAPER, FRICTION):
        assert abs(by_name[name].value - TRUE[name]) < max(2.5 * by_name[name].sd, 1e-3), name
    if by_name[ROLL].seen:
        mean = TRUE[ROLL] - np.mean(turns)
        assert abs(by_name[ROLL].value - mean) < 2.0 * by_name[ROLL].sd
        assert by_name[ROLL].sd > 0.5 * off_deg / np.sqrt(3.0), "three rolls each known to so much"


AGREED = (
    "halving them moved no fitted wire by more than 0.06 mm, near snaps apart, and no parameter by more than its sd"
)


@pytest.fixture(scope="module")
def at_truth() -> Fit:
    """A fit that found the truth."""
    problem = Problem(all_of(one := trial()), {}, (Evidence(one),), SETTINGS)
    x = np.concatenate([[TRUE[u.name] for u in problem.free], np.zeros(OWN + len(DEPTHS))])
    return Fit(problem, problem.linear(x), ())


@pytest.mark.parametrize(
    ("asked", "moves_mm", "fitted_with", "said"),
    [
        ("auto", 0.0, [1.0], AGREED),
        ("auto", 0.7, [1.0, 0.25], AGREED),
        ("auto", 50.0, [1.0, 0.0625], "halving longer ones moved 4 of 4 fitted wires by more than 0.06 mm"),
        (0.4, 50.0, [0.4], "as stated"),
    ],
)
def test_segments_of_a_fit_are_as_short_as_its_wires_need(monkeypatch, at_truth, asked, moves_mm, fitted_with, said):
    """They were the longest under auto, and twice those that were stated: friction was 8 standard deviations off."""
    used, (wires,) = [], segments._wires(at_truth, SETTINGS)

    def fit_with(solver):
        used.append(solver)
        return at_truth

    def of_length(_, solver):
        return [[replace(wire, joints_mm=wire.joints_mm + moves_mm * solver.segment_mm**2) for wire in wires]]

    monkeypatch.setattr(segments, "_wires", of_length)
    monkeypatch.setattr(segments, "MOST_SD", np.inf)
    _, found = segments.resolved(fit_with, WIRE, SolverConfig(segment_mm=asked))
    assert [solver.segment_mm for solver in used] == fitted_with
    assert {solver.finest_mm for solver in used} == {1.0}, "no step is repeated in a fit"
    assert (found.mm, found.reason) == (fitted_with[-1], said)
    assert ("0.0625 mm, the shortest, may be too long" in found.doubt) == (moves_mm > 10.0 and asked == "auto")


def test_a_wire_near_a_snap_asks_for_no_shorter_segments(monkeypatch, at_truth):
    """One of 55 led to segments of 0.0625 mm, five times the time, and a wall 8.7 instead of 5.7 % off."""
    wires = segments._wires(at_truth, SETTINGS)
    gone = [[replace(wire, joints_mm=wire.joints_mm + 3.0, uncertain=True) for wire in wires[0]]]
    monkeypatch.setattr(segments, "MOST_SD", np.inf)
    assert segments._moved(at_truth, wires, gone) == ""
    certain = [[replace(wire, uncertain=False) for wire in gone[0]]]
    assert "fitted wires by more than 0.06 mm" in segments._moved(at_truth, wires, certain)


@pytest.mark.parametrize(("shares", "moved"), [(0.5, ""), (3.0, "rest_curvature by 3.")])
def test_segments_may_not_move_a_parameter_by_more_than_is_known_of_it(at_truth, shares, moved):
    """Of a rest curvature 1.5 standard deviations were wires 0.05 mm elsewhere, which is near enough for a run."""
    coarse, sd = segments._wires(at_truth, SETTINGS), at_truth.sd[REST]
    further = at_truth.linear.x + shares * sd * np.array([u.name == REST for u in at_truth.problem.free] + [False] * 11)
    fine = segments._wires(replace(at_truth, linear=replace(at_truth.linear, x=further)), SETTINGS)
    assert max(moved_mm(a, b) for a, b in zip(coarse[0], fine[0], strict=True)) < 0.06
    assert segments._moved(at_truth, fine, coarse).startswith(moved)
    assert bool(segments._moved(at_truth, coarse, fine)) == bool(moved)


def test_segments_of_a_fitted_roll_may_not_turn_it_by_more_than_is_known_of_it(monkeypatch):
    """``roll_deg = "fit"`` took the longest ones unasked."""
    one = replace(trial(values=TRUE | {ROLL: 0.0}, depths=(14.0,)), wire=bent(WIRE, TRUE), roll_free=True)
    fit, found = segments.resolved(partial(roll_fitted, Evidence(one), 0.04), WIRE, SolverConfig())
    assert (fit.problem.solver.segment_mm, found.doubt) == (found.mm, "")
    monkeypatch.setattr(segments, "AGREED_MM", np.inf)
    wires, sd = segments._wires(fit, SETTINGS), own_roll(fit).sd_deg
    turned = fit.linear.x + 3.0 * sd * (np.arange(len(fit.linear.x)) == OWN - 1)
    aside = segments._wires(replace(fit, linear=replace(fit.linear, x=turned)), SETTINGS)
    assert segments._moved(fit, wires, wires) == ""
    assert segments._moved(fit, wires, aside).startswith("roll_offset_deg by 3.")


@pytest.mark.parametrize("moves_mm", [0.01, 1.0])
def test_a_planned_study_is_linearised_with_segments_as_short_as_its_wires_need(monkeypatch, moves_mm):
    """``--design`` took the longest ones unasked."""
    planned, used, plain = straight_to(trial(), (10.0, 16.0), [0.0] * 2), [], segments._wires

    def of_length(fit, solver):
        used.append(solver.segment_mm)
        return [[replace(w, joints_mm=w.joints_mm + moves_mm * solver.segment_mm) for w in plain(fit, solver)[0]]]

    monkeypatch.setattr(segments, "_wires", of_length)
    monkeypatch.setattr(segments, "MOST_SD", np.inf)
    predicted(all_of(planned)[:2], [planned], SolverConfig())
    assert min(used) == (0.5 if moves_mm == 0.01 else 0.0625)


def test_wires_of_a_fit_have_the_stated_segments():
    one = trial()
    at = Point(TRUE, np.zeros(OWN + len(DEPTHS)))
    for mm in (0.5, 1.0):
        (wires,) = replayed([(one, at)], SolverConfig().quick(mm))
        steps = np.linalg.norm(np.diff(wires[0].joints_mm, axis=0), axis=1)
        assert np.median(steps) == pytest.approx(mm, rel=0.01)


def test_cases_of_one_insertion_are_turned_by_one_mistake():
    """Three cases of one group had their roll known by the root of 3 better than it was stated."""
    made = [replace(trial(depths=depths), roll_sigma_deg=5.0) for depths in (DEPTHS, (12.0, 18.0, 22.0), (9.0, 20.0))]
    sds = []
    for groups in ("t", "t", "t"), ("a", "b", "c"):
        both = tuple(Evidence(replace(one, group=name)) for one, name in zip(made, groups, strict=True))
        problem = Problem(all_of(*made), {}, both, SETTINGS)
        means, sigmas = problem.prior
        assert len(means) == len(problem.free) + OWN * len(set(groups)) + 9
        assert np.isfinite(sigmas).all()
        assert sorted({int(i) for part in problem.parts for i in part}) == [*range(len(problem.free), len(means))]
        sds.append(float(np.sqrt(problem.linear(means).covariance[0, 0])))
    assert sds[0] > 4.9
    assert sds[1] < 4.0


def test_a_straight_uniform_wire_shows_no_roll_and_no_taper():
    plain = replace(WIRE, bending_stiffness_N_mm2=1.0, rest_curvature_per_mm=0.0)
    one = trial(plain, {FRICTION: 0.0})
    fit = calibrated(all_of(one), [Evidence(one)], SETTINGS)
    unseen = {e.unknown.name for e in fit.estimates if not e.seen}
    assert {ROLL, REST, TAPER} <= unseen
    assert all(fit.values[name] == 0.0 for name in (ROLL, REST, TAPER))


def test_a_straight_wire_is_followed_from_one_roll_however_it_is_stated():
    """Stated as pairs its distances counted as curvature: 24 rolls were tried, and three starts followed to one end."""
    for straight in (0.0, [(0.0, 0.0), (8.0, 0.0)]):
        one = trial(replace(WIRE, rest_curvature_per_mm=straight), depths=(10.0, 16.0))
        assert len(fitted(all_of(one), [Evidence(one)], SETTINGS).starts) == 1


@pytest.mark.quick(1)
@pytest.mark.parametrize("times", [8.0, 12.0])
def test_what_the_traces_contradict_does_not_stay_as_stated(monkeypatch, times):
    """A shaft stated three times too stiff stayed so, "not seen", and bent the rest curvature by 3.2 of its sd."""
    stiff = replace(WIRE, bending_stiffness_N_mm2=[(0.0, 0.5), (10.0, 0.5), (30.0, 2.0 * times)])
    one = replace(trial(noise=0.02, depths=DEPTHS[:3]), wire=stiff)
    monkeypatch.setattr(calibration, "all_unknowns", lambda _: all_of(one))
    found: Any = SimpleNamespace(cases=(), trials=(one,))
    if times > 10.0:  # a factor on it is at least 1 in 5
        with pytest.raises(
            CalibrationError, match=r"taper: the traces contradict .* end of its range, 0.2: nothing"
        ) as e:
            calibration.calibrate(found, SimpleNamespace(solver=SETTINGS))  # type: ignore[arg-type]
        assert str(e.value).count("the end of its range") == 1, "it was said twice"
        return
    fit = calibration.calibrate(found, SimpleNamespace(solver=SETTINGS))  # type: ignore[arg-type]
    by_name = {e.unknown.name: e for e in fit.estimates}
    assert abs(by_name[TAPER].used - TRUE[TAPER] + np.log(times)) < 2.0 * by_name[TAPER].sd
    assert by_name[TAPER].seen
    assert not by_name["wall:0.05"].seen
    (told,) = contradicted(fit)
    assert told.startswith("taper: the traces contradict the stated 1: there the objective is higher by 2")
    assert "known to a factor of 1.4 only" in told


def test_what_is_held_as_stated_bends_nothing_that_is_seen(monkeypatch, at_truth):
    """Each alone may be as stated; a rest curvature that they move by more than 2 sd together was called seen."""
    one = at_truth.problem.free[1]
    every = at_truth.problem.free
    found = [Estimate(u, 0.0, 0.1, 0.0, u is one, "little is known" * (u is not one), ()) for u in every]
    for change, seen in ((0.19, 1), (0.21, len(found))):
        last = replace(at_truth, problem=replace(at_truth.problem, free=(), held={one.name: change}))
        monkeypatch.setattr(estimates, "held_at_prior", lambda *_, last=last: last)
        taken, fit = estimates._with_the_stated(at_truth, found, no_roll=False)
        assert sum(e.seen for e in taken) == seen
        assert fit is (last if seen == 1 else at_truth)
    assert "as stated it moves rest_curvature by more than 2 standard deviations" in taken[-1].why


def test_a_standard_deviation_is_that_of_what_is_used(at_truth):
    """It was that of the free fit, whose misfit is another: 3.3 % where the used value was 12 % off."""
    held = {TAPER: 0.0, "wall:0.05": 0.0, FRICTION: 0.4}
    free = tuple(u for u in at_truth.problem.free if u.name not in held)
    problem = replace(at_truth.problem, free=free, held=held)
    at = np.concatenate([[60.0, TRUE[REST]], np.zeros(OWN + len(DEPTHS))])
    last = Fit(problem, problem.linear(at), ())
    about = estimates._about(at_truth, last)
    assert about.scale == pytest.approx(last.linear.scale)
    assert about.scale > 4.0 * at_truth.linear.scale
    assert about.covariance[1, 1] > 1.5 * at_truth.linear.covariance[1, 1]
    assert estimates._about(at_truth, at_truth) is at_truth.linear


def test_a_wire_is_told_what_it_is_stated_without():
    """To see the taper of a wire of one stiffness, "deeper insertions" were recommended."""
    assert lacking(WIRE) == {}
    even = replace(WIRE, bending_stiffness_N_mm2=[(0.0, 2.0), (30.0, 2.0)])
    assert list(lacking(even)) == list(lacking(replace(even, bending_stiffness_N_mm2=2.0))) == [TAPER]
    for straight in (0.0, [(0.0, 0.0), (8.0, 0.0)]):
        assert list(lacking(replace(WIRE, rest_curvature_per_mm=straight))) == [ROLL, REST]


def test_the_wire_is_told_along_its_length_with_its_deviation():
    """The page had factors alone: EI of the shaft, and that the tip's was held, had to be computed by hand."""
    free = {u.name: u for u in unknowns([], 0.0, weighed=True)}
    found = [
        SimpleNamespace(unknown=free[name], sd=sd, seen=name == TAPER)
        for name, sd in ((TAPER, 0.1), (FRICTION, 0.07), (BENDING, 0.3))
    ]
    fit: Any = SimpleNamespace(values={TAPER: np.log(1.5), FRICTION: 0.0, BENDING: 0.0}, estimates=found)
    fit.correlation = np.array([[1.0, -0.8, 0.0], [-0.8, 1.0, 0.0], [0.0, 0.0, 1.0]])
    rows = wire_rows(WIRE, fit, {"sd": 0.02, "seen": True})
    assert [row["at_mm"] for row in rows] == [0.0, 10.0, 30.0, 0.0, 8.0, 8.0]
    assert [row["used"] for row in rows] == pytest.approx([0.5, 0.5, 3.0, 0.1, 0.1, 0.0])
    assert [row["sd"] for row in rows] == pytest.approx([0.0, 0.0, 0.1, 0.02, 0.02, 0.0]), "the tip is held"
    found[2].seen = True
    weighed = wire_rows(replace(WIRE, bending_stiffness_N_mm2=2.0), fit, {"sd": 0.02, "seen": False})
    assert [row["sd"] for row in weighed] == pytest.approx([0.3, 0.0, 0.0, 0.0])
    assert weighed[0]["at_mm"] is None
    assert [row["sd"] for row in wire_rows(WIRE, fit, {"sd": 0.0, "seen": False})][2] == pytest.approx(
        np.hypot(0.1, 0.3)
    )


def test_what_follows_in_a_profile_stays_within_its_bounds():
    """They followed a friction below 0: a taper one standard deviation off was told as three."""
    deviations = np.array([0.16, 0.07, 0.5])
    together = np.array([[1.0, -0.8, 0.2], [-0.8, 1.0, 0.2], [0.2, 0.2, 1.0]])
    normal = np.linalg.inv(together * np.outer(deviations, deviations))
    root, low = np.linalg.cholesky(normal).T, np.array([-1.0, 0.0, -np.inf])
    problem: Any = SimpleNamespace(
        prior=(np.zeros(3), np.full(3, np.inf)), precision=0.0, clipped=lambda x: np.maximum(x, low)
    )
    linear: Any = SimpleNamespace(normal=normal, jacobian=[root])
    for taper in (0.16, -0.16):
        start = np.array([taper, 0.0, 3.0])
        moved = _followed(problem, linear, 0, start, [-root @ start])

        def value(others: Any, at: float = taper) -> float:
            x = np.array([at, *others])
            return float(x @ normal @ x)

        best = minimize(value, [0.1, 0.0], bounds=[(0.0, None), (None, None)], tol=1e-12)
        assert moved == pytest.approx([taper, *best.x], abs=1e-4)


def test_nothing_follows_residuals_that_are_no_numbers():
    """A profile that met one never ended."""
    prior = np.zeros(2), np.full(2, np.inf)
    problem: Any = SimpleNamespace(prior=prior, precision=0.0, clipped=lambda x: np.maximum(x, -1.0))
    linear: Any = SimpleNamespace(normal=np.eye(2), jacobian=[np.eye(2)])
    start = np.array([0.1, 0.2])
    assert np.array_equal(_followed(problem, linear, 0, start, [np.full(2, np.nan)]), start)


def test_derivatives_are_those_of_whole_insertions():
    one = Evidence(trial())
    problem = Problem(all_of(one.trial), {}, (one,), SETTINGS)
    x = np.concatenate([[TRUE[u.name] for u in problem.free], np.zeros(OWN + len(DEPTHS))])
    linear = problem.linear(x)
    for k in (0, 1, 2, 3, 5, 9):
        way = np.zeros(len(x))
        way[k] = 0.5 * problem.columns(0).get(k, 0.1)
        (there,), (back,) = problem.residuals([x + way, x - way], linear.weights, linear.scale)
        central = (back - there) / (2 * way[k])
        assert linear.jacobian[0][:, k] == pytest.approx(central, abs=0.12 * np.abs(central).max())


def test_an_insertion_with_other_voxels_has_a_covariance_of_its_own():
    """Replaced, it had the Cholesky factor of the insertion that it was made of."""
    one = Evidence(trial())
    before = one.root(1.0)
    other = replace(one, trial=replace(one.trial, voxel_mm=2.0 * one.trial.voxel_mm))
    assert not np.allclose(other.root(1.0), before)


def test_a_frame_that_lets_go_does_not_decide():
    weights, scale = weights_of([np.array([1.0, 1.2, 0.9, 80.0])], stated=True)
    assert scale == pytest.approx(1.1)
    assert weights[0][:3] == pytest.approx(1.0)
    assert weights[0][3] * 80.0 == pytest.approx(4.0 * scale)


def test_stated_noise_is_never_made_smaller():
    assert weights_of([np.full(5, 0.1)], stated=True)[1] == 1.0
    assert weights_of([np.full(5, 0.1)], stated=False)[1] == pytest.approx(0.1)


def test_stiffness_has_a_scale_only_with_forces():
    stiffer = TRUE | {BENDING: np.log(1.3)}
    one = trial(values=stiffer, force_N=np.zeros(len(DEPTHS)), force_sigma_N=1e-4)
    silent = replace(one, force_N=None)
    free = all_of(one, weighed=True)
    x = np.concatenate([[stiffer[u.name] for u in free], np.zeros(OWN + len(DEPTHS))])
    at = [u.name for u in free].index(BENDING)
    sd = [
        float(np.sqrt(Problem(free, {}, (Evidence(t),), SETTINGS).linear(x).covariance[at, at])) for t in (one, silent)
    ]
    assert sd[0] < 0.2 < 0.65 < sd[1]


def test_a_sag_scan_weighs_the_wire():
    wide = VesselWall(Grid(np.hypot(X - 5.0, Y) - 9.0, [0.5] * 3, [-5.0, -5.0, -4.0]), stiffness_N_mm2=1.0)
    heavy = replace(WIRE, bending_stiffness_N_mm2=0.8, rest_curvature_per_mm=0.0, weight_N_per_mm=2e-5)
    clamp = Clamp(np.zeros(3), np.array([0.0, 0.0, 1.0]), None, down=np.array([1.0, 0.0, 0.0]))
    one = Trial("sag", "sag", wide, heavy, Wall(0.05), clamp, Prior(0.05, 0.5), (), 0.3)
    known = {}
    for name, weight in (("sags", 2e-5), ("floats", 0.0)):
        light = replace(one, wire=replace(heavy, weight_N_per_mm=weight))
        planned = straight_to(light, (20.0, 30.0), (0.0, 0.0))
        known[name] = {p.unknown.name: p.sd for p in predicted(all_of(one, weighed=True), [planned], SETTINGS)}
    assert known["sags"][BENDING] < 0.1
    assert known["floats"][BENDING] == pytest.approx(0.7, rel=0.01)


def test_a_misfit_is_told():
    one = trial()
    fit = calibrated(all_of(one)[:1], [Evidence(one)], SETTINGS)
    assert misfit(replace(fit, scale=1.0)) == []
    assert "lumen, the wire's profile" in misfit(replace(fit, scale=9.0))[0]


def test_a_misfit_names_what_is_stated_as_exact(at_truth):
    """A direction 5 degrees off, stated as exact, made a taper of 0.71 +- 4 %; lumen, rolls and profile were named."""
    problem = at_truth.problem
    held = Evidence(replace(problem.evidence[0].trial, prior=Prior(0.1, 0.0), roll_sigma_deg=5.0))
    fit: Any = SimpleNamespace(fit=replace(at_truth, problem=replace(problem, evidence=(held,))), scale=9.0)
    assert "to be off: entry_direction of t (stated as exact), lumen, stated rolls" in misfit(fit)[0]
    fit.fit = at_truth
    told = "to be off: roll_deg of t (stated as exact), lumen, "
    assert f"{told}the wire's profile or" in misfit(fit)[0], "the rolls were named twice"
    other = replace(problem.evidence[0].trial, name="o", group="o", roll_sigma_deg=5.0)
    fit.fit = replace(at_truth, problem=replace(problem, evidence=(*problem.evidence, Evidence(other))))
    assert f"{told}other stated rolls, the wire's profile or" in misfit(fit)[0]


def test_a_roll_that_is_not_common_is_told_in_the_warning(monkeypatch, at_truth):
    """Which insertion wants how much stood in the parameter's row, and again as a warning."""
    monkeypatch.setattr(calibration_files, "depth_offset", lambda *_: (0.0, np.nan))
    roll = next(u for u in unknowns([], 0.0, weighed=False) if u.name == ROLL)
    apart = "the insertions want no common one: b wants 12 degrees more than a"
    estimate = Estimate(roll, 0.0, 5.0, 0.0, False, apart, ())
    fit: Any = SimpleNamespace(estimates=[estimate], scale=1.0, fit=at_truth, apart=apart)
    assert estimates_of(of_voxels(0.3), fit)[0]["why"] == "the insertions want no common one: see the warning"
    assert no_common_roll(fit) == [f"{ROLL}: {apart}"]


def test_what_is_seen_under_a_misfit_says_so_and_what_ends_at_its_bound(monkeypatch, at_truth):
    """With the wire's profile stated wrongly a wall of 0.06 was "seen"; friction was "0.0000 +- 0.0092"."""
    monkeypatch.setattr(calibration_files, "depth_offset", lambda *_: (0.0, np.nan))
    unknown = {u.name: u for u in unknowns([], 0.0, weighed=False)}
    rows = [Estimate(unknown[TAPER], 0.0, 0.5, 0.0, False, "little is known", ())]
    rows.append(Estimate(unknown[FRICTION], 0.0, 0.0092, 0.0, True, "", ()))
    rows.append(Estimate(unknown[REST], 0.0, 0.1, 0.1, True, "", ()))
    fit: Any = SimpleNamespace(estimates=rows, scale=1.0, fit=at_truth, apart="")
    assert reservation(fit) == []
    fit.scale = 9.0
    assert [row["why"] for row in estimates_of(of_voxels(0.3), fit)][:3] == [
        "little is known",
        "0 is the end of what is possible: at most 0.0092, to one side",
        "",  # what holds of all is said once, and hides no value of all parameters free
    ]
    assert reservation(fit)[0].startswith("what is seen holds only if all else is right")


def with_wall_moved(fit: Fit, mm: float) -> Fit:
    """A fit that moved the wall of its insertion."""
    wall = np.arange(len(fit.linear.x)) == fit.problem.parts[0][WALL_OFFSET]
    return replace(fit, linear=replace(fit.linear, x=np.where(wall, mm, fit.linear.x)))


def test_an_insertion_far_from_what_is_stated_is_told(at_truth):
    """A lumen 10 % too narrow: the walls were moved by 3.1 of their prior's deviations, and nothing said so."""
    assert beyond_their_priors(at_truth) == []
    (told,) = beyond_their_priors(with_wall_moved(at_truth, -0.15))
    assert told.startswith(
        "the walls were moved by -0.15 mm in t (prior 0 +- 0.045): the lumen may be so much too narrow"
    )
    assert "too wide, or radius_mm too small" in beyond_their_priors(with_wall_moved(at_truth, 0.15))[0]
    moved = moved_of(with_wall_moved(at_truth, -0.15))
    assert [one.value for one in moved] == pytest.approx([0.0] * 5 + [-0.15, 0.0])
    assert [one.prior_sd for one in moved] == pytest.approx([0.1] * 3 + [1.0] * 2 + [0.045, 0.0])
    assert [one.beyond for one in moved] == [False] * 5 + [True, False]
    assert all(0.0 < one.sd <= one.prior_sd for one in moved[:-1])


@pytest.mark.parametrize("numbers", [1, 3, 4, 35, 70])
def test_one_right_study_in_a_hundred_has_an_insertion_told(numbers):
    """Beyond 3 standard deviations each, up to 9 % of right studies of 5 insertions had a warning, 17 % of 10."""
    assert 2.0 * numbers * ndtr(-limit_of(numbers)) < 0.01001


def with_walls(fit: Fit, walls_mm: dict[str, float], bias_mm: dict[str, float]) -> Fit:
    """A fit of insertions with walls moved so far. bias_mm : how well the walls of some are stated to be known."""
    one = fit.problem.evidence[0].trial
    named = [replace(one, name=name, group=name, lumen_bias_mm=bias_mm.get(name)) for name in walls_mm]
    problem = replace(fit.problem, evidence=tuple(map(Evidence, named)))
    x = np.zeros(len(problem.prior[0]))
    for part, mm in zip(problem.parts, walls_mm.values(), strict=True):
        x[part[WALL_OFFSET]] = mm
    linear: Any = SimpleNamespace(x=x, covariance=np.eye(len(x)))
    return Fit(problem, linear, ())


def test_insertions_that_agree_on_another_lumen_are_told_together(at_truth):
    """All at 3.1: less than what one of 18 numbers may have by chance, and more than all walls have."""
    (told,) = beyond_their_priors(with_walls(at_truth, {"a": -0.14, "b": -0.14, "c": -0.14}, {}))
    assert "the walls were moved by -0.14, -0.14, -0.14 mm in a, b, c (prior 0 +- 0.045): all insertions agree" in told
    assert beyond_their_priors(with_walls(at_truth, {"a": -0.14, "b": -0.13, "c": -0.14}, {})), "2.9 is no other lumen"
    assert beyond_their_priors(with_walls(at_truth, {"a": -0.14, "b": -0.12, "c": -0.14}, {})) == []
    assert beyond_their_priors(with_walls(at_truth, {"a": -0.15, "b": -0.15, "c": -0.001}, {})) == []


def test_insertions_are_told_with_the_prior_of_each(at_truth):
    """The prior of the first stood for all: 0.045 for a wall that is stated to be known to 0.1."""
    (told,) = beyond_their_priors(with_walls(at_truth, {"a": -0.2, "b": -0.5, "c": -0.21}, {"b": 0.1}))
    assert "by -0.2, -0.21 mm in a, c (prior 0 +- 0.045), by -0.5 mm in b (prior 0 +- 0.1): all insertions" in told


def test_how_far_the_wires_lie_with_the_walls_as_they_are_given(at_truth):
    """0.045 mm "as calibrated" was 0.13 to 0.16 mm in a run, which has the walls of the manifest."""
    for mm, worse in ((0.0, False), (-0.14, True)):
        (frame, *_) = estimates._errors(with_wall_moved(at_truth, mm), at_truth.problem.evidence)
        assert bool(abs(frame.as_given_mm - frame.after_mm) > 0.01) is worse


def test_the_wall_is_known_as_well_as_the_manifest_states(study):
    """A stated lumen_bias_mm was ignored: the prior stayed 0.15 voxel."""
    text = (study / "manifest.toml").read_text(encoding="utf-8")
    unsure = "roll_deg = 5.0\n[case.uncertainty]\nlumen_bias_mm = 0.3\nlumen_mm = 0.2"
    (study / "manifest.toml").write_text(text.replace("roll_deg = 5.0", unsure), encoding="utf-8")
    found = gathered(read_manifest(study / "manifest.toml").cases[:1], Config(), Store(None), lambda _: None)
    (one,) = found.trials
    assert one.sigmas[WALL_OFFSET] == 0.3
    assert np.diag(Evidence(one).modelled).min() == pytest.approx(0.2**2, rel=0.5)
    assert _walls_known(found) == ["a: the wall is known as stated: lumen_bias_mm = 0.3, lumen_mm = 0.2"]


def test_a_frame_that_is_not_fitted_is_named(study):
    """Of a depth stated 5 mm off: "8 of 9 frames are fitted", neither which nor why."""
    text = (study / "manifest.toml").read_text(encoding="utf-8").replace("8.0, 10.0, 12.0", "8.0, 10.0, 12.0, 30.0")
    text = text.replace('"2.csv"', '"2.csv", "3.csv"')
    (study / "manifest.toml").write_text(text, encoding="utf-8")
    found = gathered(read_manifest(study / "manifest.toml").cases[:1], Config(), Store(None), lambda _: None)
    (told,) = found.warnings
    assert told.startswith("not fitted: a frame 3: length_mismatch: ")


def test_the_roll_of_one_frame_is_found_from_anywhere():
    for true in (-150.0, 10.0, 120.0):
        one = trial(values=TRUE | {ROLL: 0.0}, depths=(14.0,))
        turned = tuple(replace(frame, roll_deg=30.0 - true) for frame in one.seen)
        free = Evidence(replace(one, seen=turned, wire=bent(WIRE, TRUE), roll_free=True))
        found = own_roll(roll_fitted(free, 0.04, SETTINGS))
        assert found.roll_deg == pytest.approx(true, abs=3.0)
        assert found.sd_deg < 5.0


def test_more_frames_tell_more():
    few, many = (
        straight_to(trial(), depths, [0.0] * len(depths)) for depths in ((10.0, 16.0), (10.0, 16.0, 24.0, 16.0))
    )
    free = all_of(few)
    for a, b in zip(predicted(free, [few], SETTINGS), predicted(free, [many], SETTINGS), strict=True):
        assert b.sd <= 1.01 * a.sd, a.unknown.name


PARAMETERS = """schema = 1
wire = "w"
bending_stiffness_N_mm2 = [[0.0, 0.6], [30.0, 2.5]]
rest_curvature_per_mm = 0.05
friction = 0.03
roll_offset_deg = 12.5
depth_offset_mm = 0.4
absolute_stiffness = false
[[wall]]
stated_N_mm2 = 2.0
stiffness_N_mm2 = 1.5
[[estimate]]
name = "rest_curvature"
value = 1.2
sd = 0.01
logarithmic = true
seen = true
used = 1.2
[[estimate]]
name = "taper"
value = 1.1
sd = 0.5
logarithmic = true
seen = false
used = 1.0
[[used]]
case = "a"
group = "a"
data = []
"""
STUDY = """schema = 1
[wires.w]
radius_mm = 0.18
bending_stiffness_N_mm2 = 1.0
[[case]]
id = "a"
role = "calibration"
lumen = "tube.swc"
traces = ["0.csv", "1.csv", "2.csv"]
insertion_mm = [8.0, 10.0, 12.0]
entry_mm = [0.0, 0.0, 0.0]
entry_direction = [0.0, 0.0, 1.0]
wire = "w"
roll_deg = 5.0
[[case]]
id = "b"
lumen = "tube.swc"
traces = ["3.csv"]
insertion_mm = [9.0]
entry_mm = [0.0, 0.0, 0.0]
entry_direction = [0.0, 0.0, 1.0]
wire = "w"
[case.wall]
stiffness_N_mm2 = 7.0
"""


@pytest.fixture
def study(tmp_path):
    """Two cases with traces of their own; the first was calibrated with."""
    (tmp_path / "manifest.toml").write_text(STUDY, encoding="utf-8")
    (tmp_path / "tube.swc").write_text("1 3 0 0 -3 2 -1\n2 3 0 0 20 2 1\n", encoding="utf-8")
    for n in range(4):
        lines = "\n".join(f"0.{n},0,{z}" for z in np.linspace(0, 8 + n, 9))
        (tmp_path / f"{n}.csv").write_text(f"x,y,z\n{lines}\n", encoding="utf-8")
    (first, _) = read_manifest(tmp_path / "manifest.toml").cases
    data = json.dumps(list(data_of(first))[:1])
    (tmp_path / "p.toml").write_text(PARAMETERS.replace("data = []", f"data = {data}"), encoding="utf-8")
    return tmp_path


def test_a_run_takes_the_parameters(study):
    cases = read_manifest(study / "manifest.toml").cases
    (case,), notes = as_calibrated(cases, study / "p.toml")
    assert case.id == "b"
    assert case.wire.bending_stiffness_N_mm2 == [(0.0, 0.6), (30.0, 2.5)]
    assert (case.wall.stiffness_N_mm2, case.wall.friction) == (7.0, 0.03)
    assert case.roll_deg == 12.5
    assert case.insertion_mm == (9.4,)
    assert case.calibrated.startswith(
        "calibrated with a: rest_curvature; not seen there, as stated: taper; no wall stated"
    )
    assert "no wall stated at 7 N/mm2" in case.calibrated
    assert "'a' was calibrated with and is not scored" in notes[0]


def test_the_budget_is_told_how_well_what_was_seen_is_known(study):
    rows = "".join(
        f'[[estimate]]\nname = "{name}"\nvalue = 1.0\nsd = 0.1\nlogarithmic = true\nseen = {seen}\nused = 1.0\n'
        for name, seen in (("wall:7", "true"), ("friction", "false"), ("wall:2", "true"), ("wall:3", "false"))
    )
    text = (study / "p.toml").read_text(encoding="utf-8")
    rows += "[[wall]]\nstated_N_mm2 = 7.0\nstiffness_N_mm2 = 7.0\n"
    (study / "p.toml").write_text(text.replace("[[used]]", f"{rows}[[used]]"), encoding="utf-8")
    (case,), _ = as_calibrated(read_manifest(study / "manifest.toml").cases, study / "p.toml")
    assert case.calibrated_sigma == {"rest_curvature": 0.01, "wall_stiffness": 0.1}, (
        "its own wall; nothing of the taper"
    )
    assert "rest_curvature, wall:7;" in case.calibrated
    assert not {"wall:2", "wall:3"} & {*case.calibrated.replace(";", ",").split(", ")}, "another's wall is none of its"


@pytest.mark.parametrize("stated", ["7.000000001", "7.0001", "6.9999"])
def test_a_wall_is_known_by_what_the_manifest_states_but_for_its_last_digits(study, stated):
    """Stated at 0.03333333333 it was as stated, without a word: a factor of 21, and rms 0.166 mm for 0.050."""
    rows = '[[estimate]]\nname = "wall:7"\nvalue = 1.0\nsd = 0.1\nlogarithmic = true\nseen = true\nused = 1.0\n'
    text = (study / "p.toml").read_text(encoding="utf-8").replace("stated_N_mm2 = 2.0", "stated_N_mm2 = 7.0")
    (study / "p.toml").write_text(text.replace("[[used]]", f"{rows}[[used]]"), encoding="utf-8")
    manifest = study / "manifest.toml"
    manifest.write_text(manifest.read_text(encoding="utf-8").replace("7.0", stated), encoding="utf-8")
    (case,), _ = as_calibrated(read_manifest(manifest).cases, study / "p.toml")
    assert case.wall.stiffness_N_mm2 == 1.5
    assert case.calibrated_sigma["wall_stiffness"] == 0.1
    assert "no wall stated" not in case.calibrated


def test_walls_that_nothing_tells_apart_are_refused_before_the_fit(study, capsys):
    """2.0 and 2.0000001 were two walls of one name, and ended in a traceback after the fit."""
    manifest = study / "manifest.toml"
    text = manifest.read_text(encoding="utf-8").replace('id = "b"', 'id = "b"\nrole = "calibration"')
    text = text.replace("roll_deg = 5.0", "roll_deg = 5.0\n[case.wall]\nstiffness_N_mm2 = 7.0000001")
    manifest.write_text(text, encoding="utf-8")
    assert main(["calibrate", str(manifest), "-o", str(study / "out")]) == 2
    assert "state walls of 7.0 and 7.0000001 N/mm2, which nothing tells apart; state one" in capsys.readouterr().err


def test_a_friction_that_was_not_seen_stays_as_the_case_states_it(study):
    """A case stated at 0.3 ran with the 0.03 of those calibrated with, and the page said: as stated."""
    manifest, file = study / "manifest.toml", study / "p.toml"
    manifest.write_text(manifest.read_text(encoding="utf-8") + "friction = 0.3\n", encoding="utf-8")
    (case,), _ = as_calibrated(read_manifest(manifest).cases, file)
    assert case.wall.friction == 0.03, "it was seen"
    file.write_text(file.read_text(encoding="utf-8").replace('name = "taper"', 'name = "friction"'), encoding="utf-8")
    (case,), _ = as_calibrated(read_manifest(manifest).cases, file)
    assert case.wall.friction == 0.3
    assert "not seen there, as stated: friction" in case.calibrated


def test_a_kept_case_is_asked_for_what_is_stated_behind_its_parameters_and_for_these(study, monkeypatch):
    """Results of a wall, or of parameters, that had been changed since were kept beside new ones, without a word."""
    manifest = study / "manifest.toml"
    text = manifest.read_text(encoding="utf-8").replace('id = "b"', 'id = "b"\nparameters = "p.toml"')
    manifest.write_text(text, encoding="utf-8")
    (_, case) = read_manifest(manifest).cases
    (made,), _ = as_calibrated([case], None)
    assert made.wire != case.wire
    assert stated(made) == stated(case)
    manifest.write_text(text.replace("stiffness_N_mm2 = 7.0", "stiffness_N_mm2 = 8.0"), encoding="utf-8")
    assert stated(read_manifest(manifest).cases[1]) != stated(case)
    known, times = described(made), times_of(case)
    # a large file is not read again; with the clock of a node an hour ahead, one that was replaced was not either
    monkeypatch.setattr(inputs, "SMALL_BYTES", 0)
    assert other_file(case, known, times) == other_file(case, known, {}) == ""
    (study / "p.toml").write_text((study / "p.toml").read_text().replace("0.03", "0.04"), encoding="utf-8")
    os.utime(study / "p.toml", ns=(0, times["parameters"]))
    assert other_file(case, known, times) == other_file(case, known, {}) == f"parameters, now {study / 'p.toml'}"


def test_cases_of_different_friction_are_not_calibrated_together(study, capsys):
    """They were, with the mean of both, which neither states."""
    manifest = study / "manifest.toml"
    text = manifest.read_text(encoding="utf-8").replace('id = "b"', 'id = "b"\nrole = "calibration"')
    manifest.write_text(text + "friction = 0.3\n", encoding="utf-8")
    assert main(["calibrate", str(manifest), "-o", str(study / "out")]) == 2
    told = "the calibration cases state 2 coefficients of friction (0 of 'a', 0.3 of 'b'), and one is fitted; state one"
    assert told in capsys.readouterr().err


def test_the_offset_of_depths_is_little_known_from_few_insertions():
    """Two that happen to agree had a standard deviation of next to nothing; 95 % holds 1.96 of it, Student's t more."""
    value, sd = over_insertions([0.40, 0.44], [0.0, 0.0])
    assert (value, 1.96 * sd) == pytest.approx((0.42, 12.706 * 0.02), rel=1e-3)
    draw = np.random.default_rng(2).normal(0.0, 0.3, (4000, 3))
    found = [over_insertions(list(row), [0.0] * 3) for row in draw]
    assert np.mean([abs(mean) <= 1.96 * sd for mean, sd in found]) == pytest.approx(0.95, abs=0.0105)  # three sigma


def test_depths_of_one_insertion_are_one_offset(monkeypatch):
    """Three cases of one group: +- 0.044 mm and seen, where one case alone gives 0.5."""
    monkeypatch.setattr("pipeline.run.calibration.depths_at", lambda trial, _: trial.depths)
    stated = tuple(np.array([10.0, 20.0, np.nan]) for _ in range(3))
    for groups, sd in (("aaa", SAME_MM), ("abc", over_insertions([0.4, 0.5, 0.6], [0.0] * 3)[1])):
        trials = [
            SimpleNamespace(group=name, depths=[10.0 + off, 20.0 + off, 30.0])
            for name, off in zip(groups, (0.4, 0.5, 0.6), strict=True)
        ]
        found: Any = SimpleNamespace(trials=trials, stated_mm=stated)
        assert depth_offset(found, fit_to(3)) == pytest.approx((0.5, sd), rel=0.01)


def fit_to(cases: int) -> Any:
    """A fit, whose parameters no depth depends on."""
    problem = SimpleNamespace(points=lambda _: [None] * cases)
    return SimpleNamespace(fit=SimpleNamespace(linear=SimpleNamespace(x=None), problem=problem))


def test_a_single_stated_depth_is_not_known_exactly(monkeypatch):
    """Its own standard error was 0, and that of two was taken with n for n - 1."""
    monkeypatch.setattr("pipeline.run.calibration.depths_at", lambda trial, _: trial.depths)
    off = {"a": [10.3, 20.5], "b": [10.4, np.nan]}
    trials = [SimpleNamespace(group=name, depths=depths) for name, depths in off.items()]
    found: Any = SimpleNamespace(trials=trials, stated_mm=(np.array([10.0, 20.0]), np.array([10.0, np.nan])))
    sd = np.std([0.3, 0.5], ddof=1)
    assert depth_offset(found, fit_to(2)) == pytest.approx(over_insertions([0.4, 0.4], [sd / np.sqrt(2.0), sd]))
    found = SimpleNamespace(trials=trials[1:], stated_mm=(np.array([10.0, np.nan]),))
    assert depth_offset(found, fit_to(1))[1] == pytest.approx(np.sqrt(2.0) * SAME_MM)


@pytest.mark.parametrize("stated", ["", "uncertainty = { traces_mm = 0.0 }", "uncertainty = { traces_mm = 0.03 }"])
@pytest.mark.parametrize("off_mm", [0.0, 0.002])
def test_a_case_whose_traces_are_those_of_another_is_left_out(study, off_mm, stated):
    """Three copies counted as three insertions, without a word: the roll was known to 2.9 degrees for 5."""
    for n in range(3):
        points = np.loadtxt(study / f"{n}.csv", delimiter=",", skiprows=1) + [off_mm, 0.0, 0.0]
        np.savetxt(study / f"again{n}.csv", points, delimiter=",", header="x,y,z", comments="")
    text = STUDY.replace('traces = ["3.csv"]', 'traces = ["again0.csv", "again1.csv", "again2.csv"]')
    text = text.replace("[9.0]", "[8.0, 10.0, 12.0]").replace('id = "b"', f'id = "b"\nrole = "calibration"\n{stated}')
    (study / "manifest.toml").write_text(text, encoding="utf-8")
    found = gathered(read_manifest(study / "manifest.toml").cases, Config(), Store(None), lambda _: None)
    assert [case.id for case in found.cases] == ["a"]
    (said,) = found.left_out
    assert said.startswith(f"b: left out: 3 frames counted already: frame 0 is traced to within {off_mm:.2g} mm of a ")
    assert "frame of case 'a'" in said


def test_a_frame_that_two_cases_have_counts_once(study):
    text = STUDY.replace('traces = ["3.csv"]', 'traces = ["2.csv", "3.csv", "4.csv", "5.csv"]')
    text = text.replace("[8.0, 10.0, 12.0]", "[8.0, 9.0, 10.0]").replace("[9.0]", "[10.0, 11.0, 12.0, 13.0]")
    text = text.replace('id = "b"', 'id = "b"\nrole = "calibration"')
    (study / "manifest.toml").write_text(text, encoding="utf-8")
    for n in range(6):
        arc = np.linspace(0.0, 8.0 + n, 20)
        points = np.stack([0.01 * arc**2, 0.0 * arc, arc], axis=1)
        np.savetxt(study / f"{n}.csv", points, delimiter=",", header="x,y,z", comments="")
    found = gathered(read_manifest(study / "manifest.toml").cases, Config(), Store(None), lambda _: None)
    assert [len(trial.seen) for trial in found.trials] == [3, 3]
    told = "b: 1 frame counted already: frame 0 ends where a frame of case 'a' does, to 0.01 mm; taken once"
    assert found.warnings == (told,)


def test_a_clamp_of_another_case_that_a_fit_does_not_take_is_told(study):
    """Parameters were the same with and without it, and nothing said so."""
    text = (study / "manifest.toml").read_text(encoding="utf-8").replace('id = "a"', 'id = "a"\nentry = "case:b"')
    (study / "manifest.toml").write_text(text, encoding="utf-8")
    found = gathered(read_manifest(study / "manifest.toml").cases[:1], Config(), Store(None), lambda _: None)
    (told,) = found.warnings
    assert told.startswith('a: entry = "case:b" is for runs: its clamp is fitted with the parameters')


def test_what_the_solver_doubts_of_a_lumen_is_told_of_its_case(study, monkeypatch):
    """It was a UserWarning of Python on the terminal, with a path and a line of code."""
    monkeypatch.setattr("solver.wall._doubts", lambda *_: "it is no distance")
    cases = read_manifest(study / "manifest.toml").cases[:1]
    (told,) = gathered(cases, Config(), Store(None), lambda _: None).warnings
    assert told == "a: the lumen's signed distance: it is no distance"
    assert told in design(cases, Config(), Store(None))[1]


def test_a_case_does_not_score_itself_under_another_name(study):
    text = (study / "manifest.toml").read_text(encoding="utf-8")
    renamed = text.replace('id = "a"\nrole = "calibration"', 'id = "innocent"')
    (study / "manifest.toml").write_text(renamed, encoding="utf-8")
    cases = read_manifest(study / "manifest.toml").cases
    with pytest.raises(ParametersError, match=r"'innocent': its scans or traces were calibrated with \(as case 'a'\)"):
        as_calibrated(cases, study / "p.toml")
    (case, _), notes = as_calibrated(cases, study / "p.toml", own=True)
    assert case.role == "calibration"  # out of every figure over cases
    assert "say nothing about the model" in notes[0]


def test_scans_that_were_calibrated_with_are_looked_for_unless_they_are_to_be_scored(study):
    """The same voxels in another file were scored as validation."""
    cases = read_manifest(study / "manifest.toml").cases
    (judged,), _ = as_calibrated([case for case in cases if case.id == "b"], study / "p.toml")
    assert judged.calibrated_scans == read_parameters(study / "p.toml").used[0].data
    scored, _ = as_calibrated(cases, study / "p.toml", own=True)
    assert not any(case.calibrated_scans or case.calibrated_traces for case in scored)


def test_a_part_of_the_calibrated_insertion_is_warned_of(study):
    """Even frames taught, odd ones were judged: only an assumption said so, which no gate asks for."""
    cases = read_manifest(study / "manifest.toml").cases
    (used,) = {one.group for one in read_parameters(study / "p.toml").used}
    (judged,), _ = as_calibrated([case for case in cases if case.id == "b"], study / "p.toml")
    assert judged.calibrated_kin == ""
    kin = [case.model_copy(update={"group": used}) for case in cases if case.id == "b"]
    (judged,), _ = as_calibrated(kin, study / "p.toml")
    assert judged.calibrated_kin.startswith(f"its group, {used!r}, is that of a case that was calibrated with")


def test_one_frame_in_common_is_enough(study):
    text = (study / "manifest.toml").read_text(encoding="utf-8").replace('traces = ["3.csv"]', 'traces = ["0.csv"]')
    (study / "manifest.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ParametersError, match="'b'"):
        as_calibrated(read_manifest(study / "manifest.toml").cases, study / "p.toml")


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("friction = 0.03", "friction = -1"), "friction"),
        (("friction = 0.03", "friction = 50.0"), "friction = 50.0: expected a number from 0 to 10"),
        (("depth_offset_mm = 0.4", "depth_offset_mm = -1e9"), "depth_offset_mm = .*: expected a number from -50 to 50"),
        (("absolute_stiffness = false", 'absolute_stiffness = "yes"'), "absolute_stiffness = .yes.: expected true or"),
        (('wire = "w"', 'wire = "other"'), "its wire is 'w', the parameters are those of 'other'"),
        (("schema = 1", "schema = 1\nroll = 3"), "unknown key"),
        (
            ("[[wall]]", "[stated]\nbending_stiffness_N_mm2 = 2.0\nrest_curvature_per_mm = 0.0\n[[wall]]"),
            "stated otherwise",
        ),
        (("schema = 1", "schema = "), "not valid TOML"),
    ],
)
def test_bad_parameters_are_told(study, change, told):
    (study / "p.toml").write_text((study / "p.toml").read_text(encoding="utf-8").replace(*change))
    with pytest.raises(ParametersError, match=told):
        as_calibrated(read_manifest(study / "manifest.toml").cases, study / "p.toml")


def test_the_verb_refuses_what_it_cannot_use(study, capsys):
    manifest = study / "manifest.toml"
    manifest.write_text(manifest.read_text(encoding="utf-8").replace('role = "calibration"\n', ""))
    assert main(["calibrate", str(manifest), "-o", str(study / "out")]) == 2
    assert 'no case has role = "calibration"' in capsys.readouterr().err
    assert main(["run", str(manifest), "-o", str(study / "out"), "--parameters", str(study / "none.toml")]) == 2
    assert "no such file; wireval calibrate" in capsys.readouterr().err


def test_a_plan_that_is_calibrated_is_told_of_design(study, capsys):
    """It had "0 of 14 frames with a trace", as if scans were bad."""
    manifest = study / "manifest.toml"
    text = manifest.read_text(encoding="utf-8")
    text = re.sub(r"(?m)^(frames|traces) = .*$", "", text)
    manifest.write_text(text, encoding="utf-8")
    assert main(["calibrate", str(manifest), "-o", str(study / "out")]) == 2
    said = capsys.readouterr().err
    assert "a: left out: it has neither frames nor traces to fit to" in said
    assert "predicted with --design" in said


@pytest.mark.parametrize(
    ("value", "sd", "logarithmic", "said"),
    [
        (1.03712, 0.1, True, "1.04"),
        (1.03712, 0.0123, True, "1.037"),
        (12.3456, 0.0999, False, "12.35"),
        (-0.001, 0.3, False, "0.00"),
        (1234.5, 250.0, False, "1230"),
        (0.5, 0.0, False, "0.500"),
    ],
)
def test_a_value_has_the_digits_that_its_standard_deviation_leaves(value, sd, logarithmic, said):
    """1.03712 +- 10 %: five digits of which three say nothing."""
    assert to_its_digits({"value": value, "sd": sd, "logarithmic": logarithmic}, "value") == said


def test_the_verb_writes_what_it_reads(study, capsys):
    assert main(["calibrate", str(study / "manifest.toml"), "-o", str(study / "out"), "--no-cache"]) == 0
    found = read_parameters(study / "out" / "parameters.toml")
    assert [used.case for used in found.used] == ["a"]
    ends = [trace[-1] for trace in found.used[0].traced_mm]
    assert [round(end[2]) for end in ends] == [8, 9, 10], "a scan that is written again is known by its trace"
    assert {"taper", "roll_offset_deg"} <= set(found.unseen)
    said = capsys.readouterr().out
    assert "not seen in these traces, stays as stated; the fit alone gave" in said
    assert not re.search(r"\d[eE][+-]?\d+ %", said), "it was +- 1e+02 %"
    assert "calibrated with a: 0 of 6 parameters seen.  parameters: " in said.splitlines()[-1]
    for one in found.estimate:
        assert f"{one.name:20s} {one.used:10g}  +-" in said, "the number that runs take, not one of another fit"
    assert main(["calibrate", str(study / "manifest.toml"), "-o", str(study / "out"), "--no-cache", "-q"]) == 0
    quiet = capsys.readouterr().out.splitlines()
    told = [line for line in said.splitlines() if not line.startswith(("a: ", "segments of ", "warning"))]
    assert quiet[:-1] == told[:-1], "neither progress nor warnings"
    assert "parameters seen" in quiet[-1]
    page = (study / "out" / "calibration.html").read_text(encoding="utf-8")
    assert "not seen" in page
    for text in (said, page):
        assert "the wire is stated as stiff at its tip as at its shaft" in text, (
            "it was to be seen by deeper insertions"
        )
        assert "stated straight: no scan tells at which roll it lies" in text
    assert 'id="wire"' in page
    assert "Shapes tell the ratios of stiffness alone" in page, "absolute_stiffness = false was explained nowhere"
    lines = (study / "out" / "figures" / "profiles.csv").read_text(encoding="utf-8").splitlines()
    assert max(Counter(line.split(",")[0] for line in lines).values()) >= 8, "a curve, not a tent"


def test_a_planned_study_has_a_page(study, capsys):
    assert main(["calibrate", str(study / "manifest.toml"), "-o", str(study / "plan"), "--design"]) == 0
    said = capsys.readouterr().out
    assert f"page: {study / 'plan' / 'design.html'}" in said
    assert "20 % or less counts as seen" in said
    page = (study / "plan" / "design.html").read_text(encoding="utf-8")
    assert "a: 3 frames, voxels of" in page
    assert "state rest_curvature_per_mm if the real tip" in page, "no frame shows the roll of a straight wire"


def test_a_fitted_roll_costs_the_frame_it_was_fitted_on(study):
    manifest = study / "manifest.toml"
    manifest.write_text(manifest.read_text(encoding="utf-8").replace("roll_deg = 5.0", 'roll_deg = "fit"'))
    case, other = read_manifest(manifest).cases
    assert case.stated_roll_deg == 0.0
    run = Context(case.model_copy(update={"wire": bent(WIRE, TRUE)}), Config(), Store(None), Log(lambda *_: None))
    made = trial(values=TRUE | {ROLL: -75.0}, depths=(12.0, 16.0))
    lumen = Lumen(VESSEL.distance)
    curves = [None, *(frame.curve for frame in made.seen)]
    frames = tuple(Frame(n, curve=curve) for n, curve in enumerate(curves))
    frames = (frames[0].failed("trace", FrameStatus.NO_WIRE), *frames[1:])
    known = with_fitted_roll(run, Known(lumen=lumen, frames=frames))
    assert [frame.status for frame in known.frames] == ["no_wire", "roll_fitted", "ok"]
    assert [frame.roll_deg for frame in known.frames] == pytest.approx([-45.0] * 3, abs=3.0)
    assert known.frames[1].ok
    assert f"(standard deviation {known.roll_sd_deg:.1f})" in run.log.assumptions[0]
    row = summary_row(case, known, [error_row(frame) for frame in known.frames])
    assert (row["frames"], row["frames_ok"], row["frames_failed"]) == (2, 1, 1), "what was fitted on is no result"
    assert not is_pooled({"status": known.frames[1].status}, np.ones(3))
    assert "the roll was fitted on frame 1, which is not scored" in run.log.assumptions[0]
    nothing = Known(lumen=lumen, frames=frames[:1])
    with pytest.raises(StageError, match="no frame has a trace to fit it on"):
        with_fitted_roll(run, nothing)
    untouched = replace(run, case=other)
    assert with_fitted_roll(untouched, known) is known


def test_other_simulators_are_scored_with_parameters_too(study, capsys):
    words = ["score", str(study), "--curves", str(study), "--space", "LPS", "-o", str(study / "scored"), "--parameters"]
    assert main([*words, str(study / "none.toml")]) == 2
    assert "none.toml: no such file" in capsys.readouterr().err


def test_what_was_assumed_is_no_problem(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Information used to be counted among the problems where every case was left out."""

    def no_wire(run: Context) -> SimpleNamespace:
        run.log.assumptions.append("the phantom did not move")
        return SimpleNamespace(frames=(), failure="no wire")

    monkeypatch.setattr("pipeline.run.calibration.run_stages", no_wire)
    heard: list[str] = []
    with pytest.raises(InputError) as error:
        gathered(read_manifest(written(tmp_path, GOOD)).cases, Config(), Store(None), heard.append)
    assert len(error.value.problems) == 1
    assert [text.partition(": ")[2] for text in heard] == ["the phantom did not move"]


def test_a_wire_that_is_thin_in_its_voxels_is_warned_of():
    """In scans alone: own curves were not traced here."""

    assert flattened(of_voxels(0.375)) == []
    assert flattened(of_voxels(float(np.float32(0.4)))) == [], "it said 0.90, and too thin below 0.9"
    assert "a: the wire's diameter is 0.48 voxels" in flattened(of_voxels(0.75))[0]
    assert flattened(of_voxels(0.75, frames=("scan",), traces=("curve",))) == []


def of_voxels(voxel_mm, **case) -> Any:
    """What a fit has of one case whose wire has a radius of 0.18 mm."""
    one = SimpleNamespace(**({"id": "a", "frames": ("scan",), "traces": (), "wire": WIRE} | case))
    trials = [SimpleNamespace(wire=SimpleNamespace(radius_mm=0.18), voxel_mm=voxel_mm)]
    return SimpleNamespace(cases=[one], trials=trials)


def test_what_a_thin_wire_is_flattened_by_is_in_the_standard_deviation(monkeypatch):
    """A rest curvature 10 % off had a standard deviation of 2 %."""
    monkeypatch.setattr(calibration_files, "depth_offset", lambda *_: (0.0, np.nan))
    unknown = {u.name: u for u in unknowns([], 0.0, weighed=False)}
    rows = [Estimate(unknown[name], 0.0, 0.02, 0.0, True, "", ()) for name in (REST, TAPER)]
    fit: Any = SimpleNamespace(estimates=rows, scale=1.0, apart="")
    for voxel_mm, sd in ((0.375, 0.02), (0.75, np.hypot(0.02, 0.09)), (0.5, np.hypot(0.02, 0.02))):
        rest, taper, _ = estimates_of(of_voxels(voxel_mm), fit)
        assert rest["sd"] == pytest.approx(sd, rel=0.01)
        assert taper["sd"] == 0.02


def test_a_step_of_three_prior_deviations_costs_nine():
    """Minus twice the logarithm of a normal prior, beside the squares of the residuals."""
    problem = Problem(tuple(all_of(trial())), {}, (Evidence(trial()),), SETTINGS)
    means, sds = problem.prior
    at = int(np.flatnonzero(sds > 0)[0])
    assert problem.value(means, [np.array([2.0, 1.0])]) == pytest.approx(5.0)
    assert problem.value(means + 3.0 * sds * (np.arange(len(means)) == at), []) == pytest.approx(9.0)


def test_how_well_a_factor_is_known_is_said_in_per_cent_or_as_a_factor() -> None:
    """Beside "103 %" in the table the page said that it was known to 1.03; and less than nothing is no wall."""
    free = {u.name: u for u in unknowns([], 0.0, weighed=False)}
    fit: Any = SimpleNamespace(values={TAPER: 0.0, FRICTION: 0.0}, sd={TAPER: 1.034, FRICTION: 0.0754})
    said = [_judged(free[name], fit, ()).why for name in (TAPER, FRICTION)]
    assert said[0] == "known to a factor of 2.8 only; 20 % or less counts as seen"
    assert said[1] == "known to 0.075 only; 0.02 or less counts as seen"
    assert spread_in_words(0.2951, logarithmic=True) == "30 %"
    assert spread_in_words(1.4, logarithmic=True) == "a factor of 4.1"
    assert spread_in_words(1234.5, logarithmic=False) == "1234"  # it was 1e+03
    profile = ((0.0, 9432.0),)
    assert "the objective is higher by 9432;" in _judged(free[TAPER], fit, profile).why  # it was 9.4e+03
