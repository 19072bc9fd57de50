"""Result folders that look like a run's, without a run: for the tests and for looking at the pages.

The curves, errors and scans are invented (a siphon-like wire, a blurred vessel, correlated noise); no number
here says anything about the solver. ``python -m tests.reports.fake_results DIR`` writes one of every kind.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter

from pipeline.model import Volume
from pipeline.run.straightened import straightened
from reports import export, frames_file, tables
from reports.frames_file import FrameArrays, ScanCrop
from reports.schema import ERRORS, FAILURES, OVERALL_FILE, POINTS, SUMMARY, SWEEP, TIMINGS

SPACING = np.full(3, 0.4)
ORIGIN = np.array([-20.0, -14.0, -6.0])
SHAPE = (90, 80, 130)


@dataclass(frozen=True)
class FakeCase:
    """What the folder of one case should look like."""

    name: str
    frames: int = 30
    seed: int = 0
    truth: bool = False
    failed: tuple[int, ...] = ()
    simulated_only: bool = False
    role: str = "validation"
    error_mm: float = 0.2


def siphon(depth_mm: float, step_mm: float = 0.5) -> np.ndarray:
    """A wire through a siphon to a depth, (n, 3) LPS mm."""
    t = np.arange(0.0, 120.0, 0.05)
    x = 9.0 * np.sin(t / 11.0) * (1 - np.exp(-t / 10.0)) - 2.0
    y = 7.0 * np.sin(t / 7.0) * (t / 60.0) + 2.0
    z = t * 0.42 - 3.0 + 3.0 * np.sin(t / 15.0)
    curve = np.column_stack([x, y, z])
    arc = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    at = np.append(np.arange(0.0, depth_mm, step_mm), depth_mm)
    return np.column_stack([np.interp(at, arc, c) for c in curve.T])


def write_run(out: Path, cases: tuple[FakeCase, ...], sweep: bool = False) -> Path:
    """Write OUT with every case, the tables of the run and run.json; return OUT."""
    summaries, failures = [], []
    for case in cases:
        rows = _errors(case)
        folder = out / "cases" / case.name
        statistics = _statistics(case, rows)
        summaries.append({"case": case.name, "group": "g1", "role": case.role, "status": _status(case), **statistics})
        failures += [_failure(case, frame) for frame in case.failed]
        _write_case(folder, case, rows, statistics)
    tables.write(out / "summary.csv", SUMMARY, summaries)
    tables.write(out / "failures.csv", FAILURES, failures)
    if sweep:
        tables.write(out / "sweep.csv", SWEEP, list(_sweep(cases)))
    tables.write(out / OVERALL_FILE, SUMMARY, [_overall(summaries)])
    run = {"cases": [c.name for c in cases], "config": _config(), "provenance": _provenance()}
    typed = {"argv": ["wireval", "run", "manifest.toml", "-o", "out"]}
    for folder in (out, *(out / "cases" / case.name for case in cases)):
        (folder / "provenance.json").write_text(json.dumps(typed), encoding="utf-8")
    (out / "run.json").write_text(json.dumps(run, indent=1), encoding="utf-8")
    return out


def _overall(summaries: list[dict[str, Any]]) -> dict[str, Any]:
    counts = {name: sum(row[name] for row in summaries) for name in ("frames", "frames_ok", "frames_failed")}
    ends = {"rms_mm": 0.25, "rms_low_mm": 0.2, "rms_high_mm": 0.31}
    return {"case": "(all)", **counts, **ends, "insertions": 4, "interval": "from 4 insertions only"}


def _depths(case: FakeCase) -> np.ndarray:
    return np.linspace(20.0, 70.0, case.frames)


def _errors(case: FakeCase) -> list[dict[str, Any]]:
    rng = np.random.default_rng(case.seed)
    rows = []
    for frame, depth in enumerate(_depths(case)):
        rows.append(_row(case, frame, float(depth), rng))
        if case.simulated_only:
            kept = ("frame", "insertion_mm", "roll_deg", "max_penetration_mm", "push_force_N", "joints")
            rows[-1] = {k: rows[-1][k] for k in (*kept, "iterations")} | {"status": "simulated"}
        if frame in case.failed:
            rows[-1] = {"frame": frame, "status": "no_wire", "insertion_mm": depth}
    return rows


def _row(case: FakeCase, frame: int, depth: float, rng: np.random.Generator) -> dict[str, Any]:
    rms = case.error_mm * (0.6 + 0.8 * frame / case.frames) * rng.uniform(0.9, 1.1)
    null = rms * rng.uniform(3.2, 3.8)
    row: dict[str, Any] = {
        "frame": frame,
        "status": "ok",
        "insertion_mm": depth,
        "roll_deg": 0.0,
        "rms_mm": rms,
        "mean_mm": 0.85 * rms,
        "p95_mm": 1.9 * rms,
        "max_mm": 2.6 * rms,
        "back_rms_mm": 1.05 * rms,
        "hausdorff_mm": 2.7 * rms,
        "arc_rms_mm": 1.2 * rms,
        "arc_max_mm": 3.0 * rms,
        "tip_mm": 2.2 * rms * rng.uniform(0.5, 1.5),
        "tip_angle_deg": rng.uniform(2, 15),
        "branch_ok": frame != case.frames - 2,
        "null_centreline_rms_mm": null,
        "null_shortest_rms_mm": 1.15 * null,
        "null_min_bending_rms_mm": 0.6 * null,
        "null_previous_rms_mm": 0.4 * null if frame else None,
        "skill": 1 - (rms / null) ** 2,
        "coverage": 1.0,
        "trace_sigma_mm": 0.02 * rng.uniform(0.8, 1.2),
        "tip_sigma_mm": 0.06 * rng.uniform(0.8, 1.2),
        "max_penetration_mm": 0.05 + 0.01 * rng.random(),
        "push_force_N": 0.02 + 0.004 * frame**1.2 * rng.uniform(0.9, 1.1),
        "joints": int(depth) + 1,
        "iterations": int(rng.integers(12, 90)),
    }
    if case.truth:
        row |= {"trace_mean_mm": 0.025 * rng.uniform(0.7, 1.3), "trace_max_mm": 0.09 * rng.uniform(0.7, 1.3)}
        row |= {"trace_tip_mm": 0.12 * rng.uniform(0.3, 2.0), "truth_rms_mm": 0.98 * rms}
        row |= {"truth_tip_mm": 2.0 * rms}
    return row


def _statistics(case: FakeCase, rows: list[dict[str, Any]]) -> dict[str, Any]:
    ok = [r for r in rows if r["status"] in ("ok", "simulated")]
    counts = {"frames": case.frames, "frames_ok": len(ok), "frames_failed": case.frames - len(ok)}
    forces = {
        "max_penetration_mm": max((r["max_penetration_mm"] for r in ok), default=None),
        "push_force_max_N": max((r["push_force_N"] for r in ok), default=None),
    }
    if case.simulated_only or not ok:
        return {**counts, **forces}

    def pooled(name: str) -> float:
        values = [r[name] for r in ok if r[name] is not None]
        return float(np.sqrt(np.mean(np.square(values)))) if values else np.nan

    rms = pooled("rms_mm")
    tips = float(np.median([r["tip_mm"] for r in ok]))
    nulls = {name: pooled(name) for name in ok[0] if name.startswith("null_")}
    skill = 1 - (rms / nulls["null_centreline_rms_mm"]) ** 2
    shape = {"rms_mm": rms, "rms_low_mm": 0.8 * rms, "rms_high_mm": 1.25 * rms, "mean_mm": 0.85 * rms}
    shape |= {"p95_mm": 1.9 * rms, "max_mm": 2.9 * rms, "arc_rms_mm": 1.2 * rms, "branch_ok_fraction": 0.97}
    shape |= {"tip_median_mm": tips, "tip_low_mm": 0.7 * tips, "tip_high_mm": 1.4 * tips, "coverage": 1.0}
    shape |= {"skill": skill, "skill_low": skill - 0.08, "skill_high": skill + 0.03}
    if case.truth:
        shape |= {"trace_mean_median_mm": 0.026, "trace_tip_median_mm": 0.11, "truth_rms_mm": 0.98 * rms}
    return {**counts, **shape, **nulls, **forces}


def _status(case: FakeCase) -> str:
    return "frames_failed" if case.failed else "simulated" if case.simulated_only else "ok"


def _failure(case: FakeCase, frame: int) -> dict[str, Any]:
    return {
        "case": case.name,
        "frame": frame,
        "stage": "trace",
        "status": "no_wire",
        "sentence": "no wire was found in this frame; check that the scan shows one and that entry_mm lies on it",
        "message": f"trace: case {case.name} frame {frame}: brightest ridge at CNR 1.3, needed 2.5 <b>&</b>; "
        "lower trace.min_cnr or give the curve by hand",
        "log": f"cases/{case.name}/log.txt",
    }


def _write_case(folder: Path, case: FakeCase, rows: list[dict[str, Any]], statistics: dict[str, Any]) -> None:
    folder.mkdir(parents=True)
    tables.write(folder / "errors.csv", ERRORS, rows)
    tables.write(folder / "timings.csv", TIMINGS, list(_timings(case)))
    frames = list(_frames(case))
    frames_file.write_frames(folder / "frames.h5", _scan(case), frames)
    if not case.simulated_only:
        tables.write(folder / "points.csv.gz", POINTS, _points(frames))
    (folder / "log.txt").write_text("load: 30 frames\n", encoding="utf-8")
    last = next(wire for frame in reversed(frames) if (wire := frame.simulated_mm) is not None)
    _write_view(folder / "view", last)
    result = {
        "schema": 1,
        "case": case.name,
        "role": case.role,
        "group": "g1",
        "status": _status(case),
        "sentence": "two frames have no result" if case.failed else "every frame is ok",
        "key": "key",
        "frames": [_frame_status(case, row) for row in rows],
        "failures": [_failure(case, frame) for frame in case.failed],
        "summary": {"case": case.name, "group": "g1", "role": case.role, "status": _status(case)}
        | {k: v for k, v in statistics.items() if v is not None and v == v},
        "assumptions": ["voxel spacing taken as 0.5 mm: the file gives none"] if case.simulated_only else [],
        "warnings": ["roll is unknown and was taken as 0"] if case.failed else [],
        "wire": {"name": "micro014", "radius_mm": 0.18, "bending_stiffness_N_mm2": [[0, 0.5], [30, 5.0]]},
        "catheter": {"bending_stiffness_N_mm2": 60.0, "radius_mm": 0.9, "insertion_mm": 12.0},
        "down": [0.0, 1.0, 0.0],
        "chosen": {"segment_mm": "0.5: half as long ones lie within 0.03 mm"},
        "wall": {"stiffness_N_mm2": 2.0, "friction": 0.0},
        "geometry": {"shape": list(SHAPE), "spacing_mm": SPACING.tolist(), "origin_mm": ORIGIN.tolist()},
        "inputs": [
            {"key": f"frames[{i}]", "path": f"frames/{i:03d}.mha", "sha256": f"{i:02x}" * 32, "bytes": 33554432}
            for i in range(30)
        ],
        "counters": {"segment": {"voxels_visited": 81234, "voxels_total": 16777216}, "simulate": {"skipped": 1200}},
        "config": _config(),
        "provenance": _provenance(),
    }
    (folder / "result.json").write_text(json.dumps(result, indent=1), encoding="utf-8")


def _timings(case: FakeCase) -> Iterator[dict[str, Any]]:
    rng = np.random.default_rng(case.seed + 2)
    seconds = {"load_s": 0.2, "trace_s": 0.25, "simulate_s": 0.04, "compare_s": 0.01}
    yield {"case": case.name, "segment_s": 2.4, **{name: case.frames * s for name, s in seconds.items()}}
    for frame in range(case.frames):
        yield {"case": case.name, "frame": frame, **{name: s * rng.uniform(0.8, 1.2) for name, s in seconds.items()}}


def _frame_status(case: FakeCase, row: dict[str, Any]) -> dict[str, Any]:
    failure = _failure(case, row["frame"]) if row["status"] == "no_wire" else {}
    kept = {key: failure.get(key, "") for key in ("sentence", "stage", "message")}
    return {"frame": row["frame"], "status": row["status"], **kept}


def _frames(case: FakeCase) -> Iterator[FrameArrays]:
    rng = np.random.default_rng(case.seed + 1)
    vessel = _tube(siphon(110.0), 1.6, 90.0)
    for frame, depth in enumerate(_depths(case)):
        true = siphon(float(depth))
        bow = np.sin(np.linspace(0, 3, len(true)) + 0.3 * frame) ** 2
        simulated = true + bow[:, None] * [1.4, -1.0, 0.0] * case.error_mm * 1.5
        error = np.linalg.norm(simulated - true, axis=1)
        force = np.where(bow > 0.9, 0.01 * depth / 70, 0.0)
        arc = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(simulated, axis=0), axis=1))])
        if case.simulated_only:
            yield FrameArrays(frame, simulated_mm=simulated, arc_mm=arc, contact_force_N=force)
            continue
        noise = gaussian_filter(rng.normal(0, 25, SHAPE), 0.7) * 2
        scan = vessel + noise + _tube(true, 0.0, 160.0)
        mips = {a: np.clip(scan.max(axis=a) + 20, 0, 255).astype(np.uint8) for a in range(3)}
        if frame in case.failed:
            yield FrameArrays(frame, mips=mips)
            continue
        traced = true + rng.normal(0, 0.02, true.shape)
        truth = true if case.truth else None
        straight = straightened(Volume(scan, SPACING, ORIGIN), traced, (0.0, 255.0))
        sigma = np.full(len(true), 0.02)
        yield FrameArrays(frame, traced, simulated, error, arc, force, truth, sigma, mips=mips, straightened=straight)


def _tube(curve: np.ndarray, radius: float, grey: float) -> np.ndarray:
    volume = np.zeros(SHAPE)
    index = np.rint((curve - ORIGIN) / SPACING).astype(int)
    index = index[np.all((index >= 0) & (index < SHAPE), axis=1)]
    volume[tuple(index.T)] = 1.0
    wide = gaussian_filter(volume, max(radius, 0.35) / SPACING[0])
    level = np.percentile(wide[tuple(index.T)], 30)
    return np.clip(wide / level, 0, 1) * grey if radius == 0 else (wide > 0.35 * level) * grey


def _scan(case: FakeCase) -> ScanCrop:
    if not case.simulated_only:
        return ScanCrop(SPACING, ORIGIN, np.eye(3), SHAPE)
    mask = _tube(siphon(110.0), 1.6, 1.0) > 0
    pictures = {axis: mask.max(axis=axis).astype(np.uint8) for axis in range(3)}
    return ScanCrop(SPACING, ORIGIN, np.eye(3), SHAPE, pictures)


def _points(frames: list[FrameArrays]) -> dict[str, np.ndarray]:
    kept = [f for f in frames if f.simulated_mm is not None]
    nothing = [np.full(len(f.arc_mm), np.nan) for f in kept]  # type: ignore[arg-type]
    xyz = np.concatenate([f.simulated_mm for f in kept])  # type: ignore[misc]
    return {
        "frame": np.concatenate([np.full(len(n), f.frame) for f, n in zip(kept, nothing, strict=True)]),
        "arc_mm": np.concatenate([f.arc_mm for f in kept]),  # type: ignore[misc]
        "x_mm": xyz[:, 0],
        "y_mm": xyz[:, 1],
        "z_mm": xyz[:, 2],
        "error_mm": np.concatenate(
            [n if f.error_mm is None else f.error_mm for f, n in zip(kept, nothing, strict=True)]
        ),
        "contact_force_N": np.concatenate([f.contact_force_N for f in kept]),  # type: ignore[misc]
    }


def _write_view(folder: Path, wire: np.ndarray) -> None:
    from skimage.measure import marching_cubes

    vessel = gaussian_filter(_tube(siphon(110.0), 1.6, 1.0), 1.0)
    vertices, faces, *_ = marching_cubes(vessel, 0.5)
    export.write_surface_vtp(folder / "lumen.vtp", vertices * SPACING + ORIGIN, faces)
    export.write_segmentation_nrrd(folder / "lumen.seg.nrrd", vessel > 0.5, SPACING, ORIGIN, np.eye(3))
    export.write_markups_curve(folder / "wire_simulated_029.mrk.json", wire, "simulated")


def _sweep(cases: tuple[FakeCase, ...]) -> Iterator[dict[str, Any]]:
    for case in cases:
        yield {"parameter": "(plain)", "value": "", "case": case.name, "rms_mm": case.error_mm}
    grid = {"simulate.bending_scale": (0.8, 1.2), "simulate.wall_scale": (0.333, 3.0)}
    grid["simulate.roll_offset_deg"] = (-15.0, 15.0)
    for parameter, values in grid.items():
        for value in values:
            for case in cases:
                if not case.simulated_only:
                    rms = case.error_mm * (1 + 0.4 * (value == values[1]))
                    yield {
                        "parameter": parameter,
                        "value": f"{value:g}",
                        "unchanged": "0" if "roll" in parameter else "1",
                        "case": case.name,
                        "rms_mm": rms,
                        "tip_median_mm": 2 * rms,
                        "truth_rms_mm": 0.95 * rms,
                        "skill": 0.9 - rms,
                        "frames_ok": case.frames - len(case.failed),
                    }


def _config() -> dict[str, Any]:
    return {
        "segment": {"threshold": {"value": 0.6, "source": "default"}},
        "solver": {
            "segment_mm": {"value": 0.5, "source": "command line"},
            "method": {"value": "newton", "source": "default"},
        },
        "simulate": {"depth": {"value": "traced", "source": "file"}},
    }


def _provenance() -> dict[str, Any]:
    return {
        "wireval": "0.1.0",
        "git_commit": "0" * 40,
        "versions": {"numpy": "2.4.6", "SimpleITK": "2.5.7"},
        "host": "host",
        "cpu": "some processor",
        "threads": 1,
        "seed": 100,
    }


EVERY_KIND = (
    FakeCase("cow-seed-100", truth=True),
    FakeCase("phantom <run> 2", seed=3, failed=(11, 12), error_mm=0.35),
    FakeCase("calibration", frames=12, seed=5, role="calibration", error_mm=0.15),
    FakeCase("aneurysm", frames=12, seed=7, simulated_only=True),
)

if __name__ == "__main__":
    write_run(Path(sys.argv[1]), EVERY_KIND, sweep=True)
