"""How far the budget is right: ``python -m tests.studies.budget FOLDER [--seed 200] [--studies 20] [--members 48]``.

Twenty insertions whose inputs lie as far off as the budget says: clamp, depth, roll, the lumen's surface, rest
curvature, taper and the wall's stiffness are drawn, the true wire is that of ``data_synthetic``'s rod. To be quick no
images are made: lumen and traces are given, with errors drawn as tracing and segmenting make them. Then the same with
an error planted into the truth alone: friction of 0.1, and a taper half as long again. Bars: 92 to 98 % of the points
within 2u away from releases; a planted error is beyond 2u on half of the points of the last 20 mm, and no such claim is
made in more than one study of twenty without. All frames' ends are judged together, too (``ends_rank``).
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter, gaussian_filter1d

from data_synthetic import catalogue
from data_synthetic.catalogue.scene import Setup
from data_synthetic.geometry import rotate
from data_synthetic.rod.replay import TrueFrame
from data_synthetic.rod.truth import converged_truth
from pipeline.arrays.polyline import to_length
from pipeline.budget import coefficients, frame_budget, rank_of_ends
from pipeline.load import Scans
from pipeline.model import Array, Curve, Lumen, arc_length
from pipeline.run.cache import Store
from pipeline.run.log import Log
from pipeline.run.stages import Context, Known
from pipeline.run.stages.budget import Work, budgeted
from pipeline.run.stages.compare import compare_frames
from pipeline.run.stages.known import Frame
from pipeline.run.stages.simulate import simulate_frames
from pipeline.study.manifest import Case, read_manifest
from pipeline.study.settings import Config
from solver import Grid

SCENES = ("siphon", "bend", "s-curve")
FRAMES, VOXEL_MM, ROOM_MM, STEP_MM = 6, 0.3, 7.0, 0.3
ENTRY_MM, DIRECTION_DEG, ROLL_DEG, INSERTION_MM = 0.15, 2.0, 2.0, 0.5
REST_CURVATURE, TAPER, WALL = 0.02, 0.05, 0.5
LUMEN_VOXELS, LUMEN_SMOOTH_VOXELS, BIAS_VOXELS = 0.12, 1.1, 0.05
TRACE_VOXELS, TRACE_CORRELATED_MM, TIP_VOXELS, KNOT_MM = 0.06, 1.3, 0.25, 3.0
PLANTS = ("none", "friction", "taper")
DISTAL_MM, FOUND, CLAIMED = 20.0, 0.5, 0.05


def setup_of(name: str, rng: np.random.Generator) -> Setup:
    """A scene's set-up with a roll of its own."""
    setup = catalogue.describe(name).setup(rng, FRAMES)
    turn = rng.uniform(-180.0, 180.0)
    return replace(setup, rolls_deg=tuple(roll + turn for roll in setup.rolls_deg))


def planted(setup: Setup, plant: str) -> Setup:
    """The set-up of the true wire: with what is planted, which the manifest does not know."""
    if plant == "friction":
        return replace(setup, friction=0.1)
    if plant == "taper":
        bending = tuple((1.5 * at, value) for at, value in setup.wire.bending_N_mm2)
        return replace(setup, wire=replace(setup.wire, bending_N_mm2=bending))
    return setup


def seen_lumen(setup: Setup, truth: Sequence[TrueFrame], rng: np.random.Generator) -> Lumen:
    """The lumen around the true wires, its surface a little off."""
    points = np.concatenate([frame.points_mm for frame in truth])
    low, high = points.min(axis=0) - ROOM_MM, points.max(axis=0) + ROOM_MM
    shape = np.ceil((high - low) / VOXEL_MM).astype(int) + 1
    where = low + VOXEL_MM * np.moveaxis(np.indices(shape), 0, -1).reshape(-1, 3)
    distance = setup.anatomy.distance(where).reshape(shape)
    field = gaussian_filter(rng.standard_normal(shape), LUMEN_SMOOTH_VOXELS)
    off = LUMEN_VOXELS * field / field.std() + BIAS_VOXELS * rng.standard_normal()
    return Lumen(Grid((distance + VOXEL_MM * off).astype(np.float32), np.full(3, VOXEL_MM), low))


def seen_wire(points: Array, rng: np.random.Generator) -> Curve:
    """A trace of a true wire: errors across it that are correlated along it, and a tip that is a little off."""
    longer = TIP_VOXELS * VOXEL_MM * rng.standard_normal()
    curve = to_length(points, float(arc_length(points)[-1]) + longer, VOXEL_MM)
    count = len(curve)
    width = TRACE_CORRELATED_MM / VOXEL_MM / np.sqrt(2.0)
    noise = gaussian_filter1d(rng.standard_normal((count + 60, 3)), width, axis=0)[30:-30]
    along = np.gradient(curve, axis=0)
    along /= np.linalg.norm(along, axis=1)[:, None]
    noise *= np.sqrt(2.0 * np.sqrt(np.pi) * width)
    noise -= np.sum(noise * along, axis=1)[:, None] * along
    sigma = np.full(count, TRACE_VOXELS * VOXEL_MM)
    return Curve(curve + sigma[:, None] * noise, sigma, tip_sigma_mm=0.0, levels={"knot_mm": KNOT_MM})


def manifest(setup: Setup, rng: np.random.Generator) -> Case:
    """The case as it is stated: everything off by what is said of it."""
    z = rng.standard_normal(16)
    tilt = rotate(setup.direction, np.cross(setup.direction, z[:3]) / np.linalg.norm(np.cross(setup.direction, z[:3])),
                  np.radians(DIRECTION_DEG) * np.hypot(z[3], z[4]))  # fmt: skip
    wire = setup.wire
    bending = [[at * float(np.exp(TAPER * z[5])), value] for at, value in wire.bending_N_mm2]
    curvature = [[at, value / max(1 + REST_CURVATURE * z[6], 0.5)] for at, value in wire.rest_curvature_per_mm]
    depths = np.array(setup.depths_mm) + INSERTION_MM * rng.standard_normal(len(setup.depths_mm))
    text = f"""schema = 1
[wires.w]
radius_mm = {wire.radius_mm}
bending_stiffness_N_mm2 = {np.array(bending).tolist()}
rest_curvature_per_mm = {np.array(curvature).tolist()}
[[case]]
id = "drawn"
lumen = "given.stl"
traces = {json.dumps(["given.csv"] * len(depths))}
entry_mm = {(setup.entry_mm + ENTRY_MM * z[7:10]).tolist()}
entry_direction = {tilt.tolist()}
material_axis = {np.array(setup.material_axis).tolist()}
entry_sigma_mm = {ENTRY_MM}
entry_direction_sigma_deg = {DIRECTION_DEG}
wire = "w"
insertion_mm = {depths.tolist()}
insertion_sigma_mm = {INSERTION_MM}
roll_deg = {(np.array(setup.rolls_deg) + ROLL_DEG * z[10]).tolist()}
roll_sigma_deg = {ROLL_DEG}
[case.wall]
stiffness_N_mm2 = {float(setup.stiffness_N_mm2 * np.exp(WALL * z[11]))}
[case.uncertainty]
rest_curvature = {REST_CURVATURE}
taper = {TAPER}
wall_stiffness = {WALL}
lumen_mm = {LUMEN_VOXELS * VOXEL_MM}
lumen_bias_mm = {BIAS_VOXELS * VOXEL_MM}
"""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "manifest.toml"
        path.write_text(text, encoding="utf-8")
        return read_manifest(path).cases[0]


def judged(seed: int, plant: str, config: Config) -> tuple[Context, Known]:
    """One study through simulate and compare, without a budget."""
    name = SCENES[seed % len(SCENES)]
    setup = setup_of(name, np.random.default_rng([seed, 1]))
    true = planted(setup, plant)
    truth, _ = converged_truth(true.insertion(), true.depths_mm, true.rolls_deg, STEP_MM)
    rng = np.random.default_rng([seed, 2])
    case = manifest(setup, rng)
    lumen = seen_lumen(setup, truth, rng)
    curves = [seen_wire(frame.points_mm, rng) for frame in truth]
    rolls = case.roll_deg if isinstance(case.roll_deg, tuple) else (case.roll_deg,) * len(curves)
    frames = tuple(
        Frame(i, expected_mm=mm, roll_deg=roll, curve=curve, truth_mm=frame.points_mm)
        for i, (mm, roll, curve, frame) in enumerate(zip(case.insertion_mm or (), rolls, curves, truth, strict=True))
    )
    given: Any = ("given",) * len(frames)
    known = Known(Scans(None, given), lumen, frames=frames)
    run = Context(case, config, Store(None), Log(lambda *_: None))
    return run, budgeted(run, compare_frames(run, simulate_frames(run, known)))


def record(run: Context, known: Known, members: int) -> list[dict[str, Any]]:
    """What is kept of a study: of every frame with a budget, its points' errors over u and its shapes; the joint test.

    As the pipeline does it, but for the ensemble's wires, which it does not keep.
    """
    kept = []
    work = Work(run, known, [f for f in known.frames if f.ok and f.comparison is not None])
    rng = np.random.default_rng(0)
    for frame, seen, wires in zip(work.frames, work.seen, work.ensembles([(work.sigmas, members)])[0], strict=True):
        budget = frame_budget(wires, seen)
        if budget is None or budget.ratio is None or budget.u_mm is None:
            continue
        ends = coefficients(wires, seen, work.trace(frame, seen), VOXEL_MM, rng)
        assert ends is not None
        shapes = budget.shapes
        p = None if shapes is None else [shapes.simulated, shapes.real, shapes.same]
        distal = (budget.arc_mm >= budget.arc_mm[-1] - DISTAL_MM).tolist()
        ratio, u = budget.ratio.tolist(), float(np.sqrt(np.mean(budget.u_mm**2)))
        error = 0.0 if frame.comparison is None else float(frame.comparison["rms_mm"])
        kept.append(
            {"ratio": ratio, "distal": distal, "shapes": p, "u_mm": u, "rms_mm": error, "ends": ends.round(6).tolist()}
        )
    return kept


def found(folder: Path, seed: int, plant: str, members: int) -> list[dict[str, Any]]:
    """A study's record, or what an earlier call kept of it."""
    path = folder / f"{seed}-{plant}.json"
    if not path.exists():
        plain = Config()
        compare = replace(plain.compare, simulated_nulls=False)
        folder.mkdir(parents=True, exist_ok=True)
        found = record(*judged(seed, plant, replace(plain, compare=compare)), members)
        path.write_text(json.dumps(found), encoding="utf-8")
    frames: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))
    return frames


def beyond(frames: Sequence[dict[str, Any]], *, distal: bool) -> float:
    """Share of the points beyond 2u, away from releases."""
    calm = [f for f in frames if f["shapes"] is None]
    chosen = [np.array(f["ratio"])[np.array(f["distal"]) | (not distal)] for f in calm]
    return float(np.mean(np.concatenate(chosen) > 2.0)) if chosen else float("nan")


def rank(frames: Sequence[dict[str, Any]]) -> float:
    """The joint test of a study, away from releases."""
    ends = [np.array(f["ends"]) for f in frames if f["shapes"] is None]
    return rank_of_ends(ends) if ends else 1.0


def line(plant: str, studies: Sequence[Sequence[dict[str, Any]]]) -> str:
    """The bars of one plant."""
    every = [frame for frames in studies for frame in frames]
    each = np.array([beyond(frames, distal=True) for frames in studies])
    called = [f["shapes"] for f in every if f["shapes"] is not None]
    even = [same for p, _, same in called if 0.2 <= p <= 0.8]
    e, u = (np.sqrt(np.mean([f[name] ** 2 for f in every])) for name in ("rms_mm", "u_mm"))
    return (
        f"planted {plant}: {len(studies)} studies, {len(every)} frames, E {e:.3f} mm, u_val {u:.3f} mm; within 2u "
        f"{100 - 100 * beyond(every, distal=False):.1f} % of the points ({100 - 100 * beyond(every, distal=True):.1f} "
        f"% of the distal ones); an error is claimed (beyond 2u on {100 * FOUND:.0f} % of the distal points) in "
        f"{int((each >= FOUND).sum())} studies, beyond 2u on a median of {100 * np.median(each):.0f} %; by all frames' "
        f"ends together in {sum(rank(frames) <= CLAIMED for frames in studies)}; "
        f"{len(called)} release frames, of which {len(even)} are called 20 to 80 %: the simulated shape came in "
        f"{sum(even)} of them"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=200)
    parser.add_argument("--studies", type=int, default=20)
    parser.add_argument("--members", type=int, default=48)
    parser.add_argument("--plants", nargs="*", default=PLANTS)
    given = parser.parse_args()
    for plant in given.plants:
        seeds = range(given.seed, given.seed + given.studies)
        print(line(plant, [found(given.folder, seed, plant, given.members) for seed in seeds]), flush=True)


if __name__ == "__main__":
    main()
