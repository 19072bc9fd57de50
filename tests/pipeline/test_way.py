"""The way of the hand: a frame whose trace is refused is gone through by every replay, and read by none of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pipeline.budget.config import BudgetConfig
from pipeline.calibrate.residuals import Evidence
from pipeline.calibrate.trials import OWN, Point, replayed, way_at
from pipeline.compare.config import CompareConfig
from pipeline.model import Clamp, Curve, Lumen
from pipeline.run.cache import Store
from pipeline.run.log import Log
from pipeline.run.stages import clamp as clamp_stage
from pipeline.run.stages import entries, roll, variants
from pipeline.run.stages.budget import Work, _snapped, budgeted
from pipeline.run.stages.given import seen_in, trial_of
from pipeline.run.stages.known import Context, Frame, Known
from pipeline.run.stages.way import passed_at, way_of
from pipeline.simulate import insertion_of
from pipeline.simulate.config import SimulateConfig, SolverConfig
from pipeline.simulate.way import Stop, Way
from pipeline.status import FrameStatus
from pipeline.study.explain import described
from pipeline.study.manifest import Case, read_manifest
from pipeline.study.settings import Config
from solver import Grid, Solution
from tests.pipeline.test_simulate import MANIFEST

DEPTHS, ROLLS = [15.0, 24.0, 25.0, 30.0], [0.0, 0.0, 180.0, 180.0]
"""At 24 mm the wire has taken one arm of the fork, where it stays when turned; turned before it takes the other."""
REFUSED = 1
SETTINGS = Config(
    solver=SolverConfig(segment_mm=0.5),
    simulate=SimulateConfig(depth="manifest"),
    compare=CompareConfig(simulated_nulls=True),
    budget=BudgetConfig(members=8, members_alone=0),
)


def fork() -> Lumen:
    """A tube that parts after 20 mm into two arms, 28 degrees to either side in the plane of the tip's curve."""
    axes = [np.arange(a, b, 0.4) for a, b in ((-10.0, 10.0), (-4.0, 4.0), (-6.0, 36.0))]
    at = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    arm = 20.0 * np.array([np.sin(np.radians(28.0)), 0.0, np.cos(np.radians(28.0))])
    middle = np.array([0.0, 0.0, 20.0])
    tubes = [(np.array([0.0, 0.0, -6.0]), middle, 2.0), *((middle, middle + arm * (s, 0, 1), 1.4) for s in (1, -1))]
    distance = np.full(at.shape[:3], np.inf)
    for a, b, radius in tubes:
        t = np.clip((at - a) @ (b - a) / np.sum((b - a) ** 2), 0.0, 1.0)
        distance = np.minimum(distance, np.linalg.norm(at - a - t[..., None] * (b - a), axis=-1) - radius)
    grid = Grid(distance.astype(np.float32), np.full(3, 0.4), np.array([-10.0, -4.0, -6.0]))
    return Lumen(grid, grid.with_values((distance < 0).astype(np.uint8)))


LUMEN = fork()
CLAMP = Clamp(
    np.zeros(3),
    np.array([0.0, 0.0, 1.0]),
    np.array([1.0, 0.0, 0.0]),
    covariance=np.diag([0.0, 4e-4, 4e-4, 0, 1e-6, 1e-6]),
)


@pytest.fixture
def run(tmp_path: Path) -> Context:
    """A case with stated depths and rolls, its settings and a log."""
    path = tmp_path / "manifest.toml"
    stated = f"insertion_mm = {DEPTHS}\nroll_deg = {ROLLS}\ninsertion_sigma_mm = 0.05\nroll_sigma_deg = 1.0"
    path.write_text(MANIFEST.replace("insertion_mm = [6.0, 12.0]", stated), encoding="utf-8")
    case = read_manifest(path).cases[0]
    curved = [(0.0, 0.12), (8.0, 0.12), (8.0, 0.0)]
    case = case.model_copy(update={"wire": replace(case.wire, rest_curvature_per_mm=curved)})
    return Context(case, SETTINGS, Store(None), Log(lambda *_: None))


def wires(case: Case, kept: Sequence[int] = range(4)) -> list[Solution]:
    """The wires at some of the depths, the others left out of the way."""
    insertion = insertion_of(case.wire, case.wall, LUMEN, CLAMP, SolverConfig(segment_mm=0.5))
    return list(insertion.to_depths([DEPTHS[i] for i in kept], [ROLLS[i] for i in kept]))


def known(run: Context, refused: Sequence[int] = ()) -> Known:
    """The case traced and simulated, the traces of some frames cut short and refused."""
    frames = []
    for i, wire in enumerate(wires(run.case)):
        points = wire.joints_mm[: len(wire.joints_mm) // 2] if i in refused else wire.joints_mm
        curve = Curve(points, np.full(len(points), 0.02), 0.05)
        frame = Frame(i, expected_mm=DEPTHS[i], depth_mm=DEPTHS[i], roll_deg=ROLLS[i], curve=curve, simulated=wire)
        frames.append(frame.failed("trace", FrameStatus.LENGTH_MISMATCH) if i in refused else frame)
    return Known(lumen=LUMEN, clamp=CLAMP, segment_mm=0.5, frames=tuple(frames))


def said(way: Way) -> list[tuple[int, float, float]]:
    """Number, depth and roll of every stop."""
    return [(stop.frame, round(stop.depth_mm, 6), stop.roll_deg) for stop in way.stops]


WHOLE = list(zip(range(4), DEPTHS, ROLLS, strict=True))


def test_a_way_goes_through_all_stops_up_to_the_last_that_is_read() -> None:
    read, through = [Stop(0, 5.0), Stop(2, 7.0, 90.0, 9.0)], [Stop(3, 8.0), Stop(1, 6.0, 45.0, 3.0)]
    way = Way.reading(read, through)
    assert [stop.frame for stop in way.stops] == [0, 1, 2]
    assert [*way.of("abc")] == ["a", "c"]
    assert way.tips_mm == [0.0] * 3, "no catheter"
    assert replace(way, sheathed=True).tips_mm == [0.0, 3.0, 7.0], "one beyond the wire's tip ends with it"
    assert way.turned(10.0).rolls_deg == [10.0, 55.0, 100.0]
    assert said(way.otherwise([1.0, 2.0, 3.0], [4.0, 5.0, 6.0])) == [(0, 1.0, 4.0), (1, 2.0, 5.0), (2, 3.0, 6.0)]


def test_a_refused_frame_without_a_depth_is_skipped_as_the_simulated_wire_skips_it(run: Context) -> None:
    frames = known(run, [REFUSED]).frames
    lost = replace(frames[REFUSED], expected_mm=float("nan"), curve=None, depth_mm=float("nan"))
    assert passed_at([frames[0], lost, *frames[2:]], {0, 2, 3}, "traced", CLAMP) == []
    assert way_of(run, [frames[0], lost, *frames[2:]], frames[2:3]).depths_mm == [15.0, 25.0]


def test_calibration_goes_through_refused_frames(run: Context) -> None:
    """Without the refused one the wires that are fitted lie in the other arm, 3 mm off."""
    trial = trial_of(run, known(run, [REFUSED]), known(run, [REFUSED]).frames, roll_free=False)
    point = Point({}, np.zeros(OWN + 3))
    assert said(way_at(trial, point)) == WHOLE
    (found,) = replayed([(trial, point)], SolverConfig(segment_mm=0.5))
    apart = Evidence(trial).rows(found, point).across_mm
    assert np.linalg.norm(apart, axis=1).max() < 0.1, "chords of 0.5 mm at the fork"
    assert np.linalg.norm(wires(run.case, [0, 2, 3])[-1].joints_mm[-1] - found[-1].joints_mm[-1]) > 3.0


def test_a_calibrated_roll_turns_frames_that_are_gone_through_too(run: Context) -> None:
    trial = trial_of(run, known(run, [REFUSED]), known(run, [REFUSED]).frames, roll_free=False)
    turned = way_at(trial, Point({"roll_offset_deg": 7.0}, np.zeros(OWN + 3)))
    assert turned.rolls_deg == [r + 7.0 for r in ROLLS]


def test_the_roll_is_fitted_behind_the_frames_before_it(run: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def roll_fitted(one: Evidence, *_: Any) -> Any:
        asked.append(way_at(one.trial, Point({}, np.zeros(OWN + 1))))

    monkeypatch.setattr(roll, "roll_fitted", roll_fitted)
    monkeypatch.setattr(roll, "resolved", lambda fit_with, *_: (fit_with(None), SimpleNamespace(doubt="")))
    monkeypatch.setattr(roll, "own_roll", lambda _: SimpleNamespace(roll_deg=30.0, sd_deg=1.0, rivals_deg=()))
    fit = replace(run, case=run.case.model_copy(update={"roll_deg": "fit"}))
    frames = tuple(replace(frame, roll_deg=0.0) for frame in known(run, [0]).frames)
    roll.with_fitted_roll(fit, replace(known(run), frames=frames))
    assert said(asked[0]) == [(0, 15.0, 0.0), (1, 24.0, 0.0)]
    assert asked[0].read == (False, True)


def test_the_clamp_is_fitted_by_wires_that_went_through_refused_frames(
    run: Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where there are more traces than are fitted, deeper frames are gone through by none of these wires."""
    asked: list[Way] = []
    monkeypatch.setattr(clamp_stage, "together", lambda _, ways: asked.extend(ways))
    case, frames = known(run, [REFUSED]), known(run, [REFUSED]).frames
    clamp_stage._replayed(run, case, [CLAMP], seen_in(frames), [[15.0, 25.0, 30.0]])
    clamp_stage._replayed(run, case, [CLAMP], seen_in(frames)[:1], [[15.0]])
    first = tuple(replace(f, depth_mm=50.0, expected_mm=50.0) if f.index == REFUSED else f for f in frames)
    clamp_stage._replayed(run, replace(case, frames=first), [CLAMP], seen_in(frames)[::2], [[15.0, 30.0]])
    assert [[stop.frame for stop in way.stops] for way in asked] == [[0, 1, 2, 3], [0], [0, 3]]
    assert said(asked[0]) == WHOLE


def test_four_entries_and_rivals_go_through_refused_frames(run: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Way] = []
    monkeypatch.setattr(entries, "together", lambda _, ways: asked.extend(ways))
    monkeypatch.setattr(variants, "simulate", lambda _, way: asked.append(way) or [])
    scans = replace(run, case=run.case.model_copy(update={"frames": ("some",)}))
    case = known(run, [REFUSED])
    entries.replayed_entries(scans, case)
    # another simulator's wire may be missing where its file was refused
    missing = tuple(replace(f, simulated=None) if f.index == REFUSED else f for f in case.frames)
    variants.variant_wires(run, replace(case, frames=missing), variants.variants_of(run, case)[0])
    assert [said(way) for way in asked] == [WHOLE] * 5
    assert {way.read for way in asked} == {(True, False, True, True)}


def test_the_setting_says_how_many_insertions_it_takes(run: Context) -> None:
    """Beside those of the four entries. It said 17, as before tips that are bent otherwise."""
    count = len(variants.variants_of(run, known(run))) + 4
    (told,) = [setting.meaning for setting in described() if setting.key == "simulated_nulls"]
    assert told.endswith(f"That takes {count} more insertions, of a straight wire 4.")


def test_the_budget_of_frames_after_a_refused_one_is_what_it_would_be_without(run: Context) -> None:
    """All members of the fork jumped into the other arm: u of 3.5 mm where it is 0.1."""
    whole, cut = (budgeted(run, known(run, refused)) for refused in ((), (REFUSED,)))
    assert cut.frames[REFUSED].budget is None
    for one, other in zip(whole.frames[2:], cut.frames[2:], strict=True):
        assert one.budget is not None
        assert other.budget is not None
        assert one.budget.members == other.budget.members == 8
        np.testing.assert_allclose(other.budget.input_mm, one.budget.input_mm, rtol=0.0, atol=0.01)
    assert max(float(f.budget.input_mm.max()) for f in cut.frames[2:] if f.budget) < 1.0


def test_depths_on_the_way_are_known_as_well_as_they_were_read(run: Context) -> None:
    """A refused frame goes to its stated depth, known by the scale; the others go to the traced ones."""
    traced = replace(run, config=replace(SETTINGS, simulate=SimulateConfig()))
    case = known(run, [REFUSED])
    frames = [frame for frame in case.frames if frame.ok]
    work = Work(traced, case, frames)
    assert work.nominal.traced.tolist() == [True, False, True, True]
    assert work.sigmas.depth[REFUSED] == 0.05
    assert "traced and 0.05 mm, manifest" in work.sigmas.said["depth"]
    untraced = replace(frames[0], curve=None)
    assert not Work(
        traced, replace(case, frames=(untraced, *case.frames[1:])), [untraced, *frames[1:]]
    ).nominal.traced.any()


def test_a_release_in_a_frame_that_is_gone_through_belongs_to_the_next(run: Context) -> None:
    case = known(run, [REFUSED])
    snapped = replace(case.frames[REFUSED].simulated, snaps=("a snap",))  # type: ignore[type-var,arg-type]
    frames = tuple(replace(f, simulated=snapped) if f.index == REFUSED else f for f in case.frames)
    way = way_of(run, frames, [frames[0], frames[2], frames[3]])
    assert _snapped(replace(case, frames=frames), way) == [False, True, False]
