"""How well the clamp is found: ``python -m tests.studies.clamp FOLDER [--seed 100] [--rms] [--scenes NAME ...]``.

Every scene of the catalogue, its first five frames, at several contrasts: scanned, segmented, traced (kept in FOLDER),
and the clamp estimated from the traces. With ``--rms`` the wires are simulated from the clamp estimated, exact and as
the manifest has it. The truth comes from ``data_synthetic``, never from the solver.
"""

from __future__ import annotations

import argparse
import itertools
import pickle
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np

from data_synthetic import catalogue
from data_synthetic.catalogue.scene import NamedScene, Setup
from data_synthetic.write import write_study
from pipeline.arrays.polyline import angle_deg, resample
from pipeline.compare import point_to_curve
from pipeline.model import Array
from pipeline.run.cache import Store
from pipeline.run.log import Log
from pipeline.run.stages import Context, Known, run_stages
from pipeline.run.stages.clamp import clamp_of
from pipeline.run.stages.known import NO_SCANS
from pipeline.run.stages.simulate import simulate_frames
from pipeline.simulate.clamp import axes_of
from pipeline.study.manifest import Case, read_manifest
from pipeline.study.settings import Config

FRAMES, CNRS, TRUTH_STEP_MM = 5, (16.0, 8.0, 4.0), 0.2
NOISE_AT_CNR_1 = 1250.0
"""sd of the noise (at a voxel of 0.3 mm) with which the wire stands out by 1; ``low-dose`` has 250 and calls it 5."""


@dataclass(frozen=True)
class Traced:
    """A scene up to its traces, with the clamp and the wires as they truly are."""

    name: str
    cnr: float
    seed: int
    case: Case
    known: Known
    entry_mm: Array
    direction: Array
    true_mm: tuple[Array, ...]
    failure: str = ""


def first_frames(scene: NamedScene, cnr: float) -> NamedScene:
    """The scene's first frames, of as many as it has by itself, with another noise."""

    def setup(rng: np.random.Generator, _frames: int) -> Setup:
        whole = scene.setup(rng, scene.frames)
        seen = None if whole.visible is None else whole.visible[:FRAMES]
        moved = None if whole.motion_mm is None else whole.motion_mm[:FRAMES]
        greys = replace(whole.greys, noise=NOISE_AT_CNR_1 / cnr)
        depths, rolls = whole.depths_mm[:FRAMES], whole.rolls_deg[:FRAMES]
        return replace(whole, depths_mm=depths, rolls_deg=rolls, greys=greys, visible=seen, motion_mm=moved)

    return replace(scene, plan=setup, steer=None)


def traced(name: str, cnr: float, seed: int, folder: Path) -> Traced:
    """Scan, segment and trace a scene, or read what an earlier call kept."""
    kept = folder / f"{name}-{seed}-{cnr:g}.pickle"
    if kept.exists():
        found = pickle.loads(kept.read_bytes())
        assert isinstance(found, Traced)
        return found
    scene = catalogue.describe(name)
    scene = first_frames(scene, cnr)
    study = catalogue.build(scene, frames=min(FRAMES, scene.frames), seed=seed, truth_step_mm=TRUTH_STEP_MM)
    with tempfile.TemporaryDirectory() as scratch:
        (case,) = read_manifest(write_study(study, scratch)).cases
        context = Context(case, Config(), Store(None), Log(lambda *_: None), until="trace")
        known = run_stages(context)
    true = tuple(frame.points_mm for frame in study.truth)
    frames = tuple(replace(frame, projections=()) for frame in known.frames)
    failure = str(known.failure or "")
    known = replace(known, scans=NO_SCANS, frames=frames, failure=None)
    found = Traced(name, cnr, seed, case, known, study.setup.entry_mm, study.setup.direction, true, failure)
    folder.mkdir(parents=True, exist_ok=True)
    kept.write_bytes(pickle.dumps(found))
    return found


class Found(NamedTuple):
    """A scene's line: errors of the estimate and of the manifest, and the estimate's own standard deviations."""

    degrees: float
    mm: float
    prior_degrees: float
    prior_mm: float
    sigma_deg: float
    sigma_mm: float
    within: tuple[bool, ...]
    warning: str
    seconds: float


def judged(scene: Traced) -> Found:
    """The clamp of a scene, estimated, against the true one: across the wire, since along it depth takes it up."""
    context = Context(scene.case, Config(), Store(None), Log(lambda *_: None))
    clock = process_time()
    clamp = clamp_of(context, scene.known)
    seconds = process_time() - clock
    case, axes = scene.case, axes_of(scene.direction)
    covariance = np.zeros((6, 6)) if clamp.covariance is None else clamp.covariance
    offset, turn = axes[1:] @ (clamp.entry_mm - scene.entry_mm), axes[1:] @ (clamp.direction - scene.direction)
    own = [np.sqrt(np.diag(axes[1:] @ covariance[k : k + 3, k : k + 3] @ axes[1:].T)) for k in (0, 3)]
    within = (*(np.abs(turn) <= 2 * own[1]), *(np.abs(offset) <= 2 * own[0]))
    given = np.array(case.entry_direction) / np.linalg.norm(case.entry_direction)
    return Found(
        angle_deg(clamp.direction, scene.direction), float(np.linalg.norm(offset)),
        angle_deg(given, scene.direction), float(np.linalg.norm(axes[1:] @ (np.array(case.entry_mm) - scene.entry_mm))),
        clamp.sigma_deg, clamp.sigma_mm, within, clamp.warning, seconds,
    )  # fmt: skip


def squares(scene: Traced) -> tuple[Array, int]:
    """Sums of squares (3,) of the simulated wires' distances to the true ones, mm^2, and how many points they are of.

    The clamp is the estimated one, the true one and the manifest's. Only frames that all three simulate count.
    """
    exact = {"entry_mm": tuple(scene.entry_mm), "entry_direction": tuple(scene.direction)}
    plain = Config()
    kept = replace(plain, simulate=replace(plain.simulate, entry="manifest"))
    ways = ((scene.case, plain), (scene.case.model_copy(update=exact), kept), (scene.case, kept))
    found = []
    for case, config in ways:
        known = simulate_frames(Context(case, config, Store(None), Log(lambda *_: None)), scene.known)
        found.append(known.frames)
    total, count = np.zeros(3), 0
    for frames in zip(*found, strict=True):
        wires = [frame.simulated for frame in frames if frame.ok and frame.simulated is not None]
        if len(wires) == len(ways):
            points = [resample(wire.joints_mm, 0.5) for wire in wires]
            total += [
                np.mean(point_to_curve(p, scene.true_mm[frames[0].index])[0] ** 2) * len(points[0]) for p in points
            ]
            count += len(points[0])
    return total, count


def bars(name: str, found: Sequence[Found]) -> str:
    """The bars over some scenes."""
    degrees, mm = (np.array([getattr(f, key) for f in found]) for key in ("degrees", "mm"))
    within = 100 * np.array([f.within for f in found])
    worse = np.array([f.degrees - f.prior_degrees for f in found])
    return (
        f"{name}: {len(found)} scenes; direction {np.median(degrees):.2f} degrees (median; worst {degrees.max():.2f}), "
        f"position {np.median(mm):.3f} mm (worst {mm.max():.3f}); within its own 2 sigma {within[:, :2].mean():.0f} % "
        f"(direction), {within[:, 2:].mean():.0f} % (position); at most {worse.max():+.2f} degrees worse than the "
        f"manifest's ({int((worse > 0.1).sum())} scenes beyond 0.1)"
    )


def pooled(found: Sequence[tuple[Array, int]]) -> str:
    """Root mean square over all points of some scenes, and the estimate's over the exact clamp's, scene by scene."""
    total, count = np.sum([f[0] for f in found], axis=0), sum(f[1] for f in found)
    each = np.array([np.sqrt(f[0][0] / f[0][1]) for f in found if f[1]])
    rms = np.sqrt(total / count)
    return (
        f"pooled RMS to the true wires, clamp estimated {rms[0]:.3f}, exact {rms[1]:.3f}, manifest {rms[2]:.3f} mm: "
        f"{rms[0] / rms[1]:.2f} times that of the exact clamp; by scene {np.median(each):.2f} (median), "
        f"{int((each <= 1.1).sum())} of {len(each)} at most 1.1"
    )


def line(scene: Traced, f: Found) -> str:
    """A scene's line: errors with the estimate's own standard deviation and the manifest's error."""
    marks = "".join(".x"[not within] for within in f.within)
    return (
        f"{scene.name:20s}{scene.cnr:5g}  direction {f.degrees:5.2f} ({f.sigma_deg:.2f}; manifest "
        f"{f.prior_degrees:.2f}) degrees  position {f.mm:.3f} ({f.sigma_mm:.3f}; "
        f"{f.prior_mm:.3f}) mm  {marks} {f.seconds:5.1f} s  {f.warning}"
    )


def main(words: list[str]) -> None:
    """Print a line a scene and contrast, and the bars."""
    parser = argparse.ArgumentParser(prog="python -m tests.studies.clamp", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=100)
    parser.add_argument("--scenes", nargs="*", default=catalogue.names())
    parser.add_argument("--cnr", nargs="*", type=float, default=CNRS)
    parser.add_argument("--rms", action="store_true")
    args = parser.parse_args(words)
    table: dict[float, list[Found]] = {cnr: [] for cnr in args.cnr}
    sums: dict[float, list[tuple[Array, int]]] = {cnr: [] for cnr in args.cnr}
    for name, cnr in itertools.product(args.scenes, args.cnr):
        scene = traced(name, cnr, args.seed, args.folder)
        if scene.failure:
            print(f"{name:20s}{cnr:5g}  {scene.failure}", flush=True)
            continue
        found = judged(scene)
        table[cnr].append(found)
        sums[cnr] += [squares(scene)] if args.rms else []
        print(
            line(scene, found), *(f"{x:.3f}" for s in sums[cnr][-1:] for x in np.sqrt(s[0] / max(s[1], 1))), flush=True
        )
    for cnr, all_found in table.items():
        if all_found:
            print(bars(f"contrast {cnr:g}", all_found))
        if sums[cnr]:
            print(f"contrast {cnr:g}: {pooled(sums[cnr])}")


if __name__ == "__main__":
    main(sys.argv[1:])
