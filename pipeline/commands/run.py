"""``wireval run MANIFEST -o OUT``: the whole pipeline over every case."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.commands.common import complain, resolved_settings, say, settings_of
from pipeline.load import LoadError
from pipeline.run import sweep
from pipeline.run.aggregate import Totals, aggregate, found_results
from pipeline.run.batch import run_jobs, shard_of
from pipeline.run.cache import default_root, file_hash
from pipeline.run.case import Job, finished, job_key
from pipeline.run.junit import write_junit
from pipeline.run.provenance import collect
from pipeline.run.stages import STAGES
from pipeline.study.check import check
from pipeline.study.infer import infer_manifest
from pipeline.study.manifest import Case, Manifest, ManifestError, read_manifest
from pipeline.study.settings import Resolved, SettingsError, to_toml
from pipeline.study.suggest import did_you_mean
from reports.atomic import write_text
from reports.html import render_index


class UsageError(Exception):
    """A command line that cannot be carried out."""


def main(args: Namespace) -> int:
    """Exit 0 all ok, 1 some case failed, 2 input wrong."""
    try:
        manifest, assumptions = _manifest(args)
        settings = resolved_settings(args)
        jobs = _jobs(args, manifest, settings)
        points = sweep.points_of(args.sweep, settings_of(args))
        _guard_out(args, manifest)
    except (ManifestError, SettingsError) as error:
        return complain(error.problems, str(args.manifest))
    except (LoadError, UsageError) as error:
        return complain([str(error)], "the command line")
    problems = check(manifest, settings.config, [job.case.id for job in jobs])
    if problems:
        return complain(problems, str(args.manifest))
    if args.dry_run:
        return _dry_run(jobs, points)
    return _run(args, manifest, settings, jobs, points, assumptions)


def _run(
    args: Namespace,
    manifest: Manifest,
    settings: Resolved,
    jobs: list[Job],
    points: list[sweep.Point],
    assumptions: tuple[str, ...],
) -> int:
    info: dict[str, Any] = {"manifest": str(manifest.path), "manifest_sha256": file_hash(manifest.path)}
    info |= {"provenance": collect(), "assumptions": assumptions, "config": settings.as_dict()}
    write_text(args.out / "config.resolved.toml", to_toml(settings))
    name = "run.json" if not args.shard else f"run.{args.shard.replace('/', '-')}.json"
    write_text(args.out / name, json.dumps({"manifest_sha256": info["manifest_sha256"], "cases": []}))
    run_jobs(jobs, args.jobs, args.executor)
    for point in points:
        run_jobs(sweep.jobs_of(point, jobs), args.jobs, args.executor)
    if points:
        sweep.write_sweep(args.out, points)
    totals = aggregate(args.out, info, name)
    index = render_index(args.out, embed=args.embed)
    if args.junit:
        write_junit(args.junit, found_results(args.out))
    _say_failures(args.out)
    say(last_line(totals, index))
    return 0 if totals.all_ok else 1


def _manifest(args: Namespace) -> tuple[Manifest, tuple[str, ...]]:
    """The manifest as given, or inferred from a folder of scans and printed."""
    path: Path = args.manifest
    if path.is_dir() and (path / "manifest.toml").exists():
        path = path / "manifest.toml"
    if not path.is_dir():
        return read_manifest(path), ()
    entry, direction = _vector(args.entry, "--entry"), _vector(args.direction, "--direction")
    inferred = infer_manifest(path, entry, direction, args.wire_radius, resolved_settings(args).config.load)
    say(inferred.text)
    for note in inferred.assumptions:
        say(f"assumed: {note}")
    written = args.out / "manifest.inferred.toml"
    write_text(written, inferred.text)
    return read_manifest(written), inferred.assumptions


def _vector(text: str | None, name: str) -> Any:
    if text is None:
        return None
    try:
        values = np.array([float(part) for part in text.split(",")])
    except ValueError:
        values = np.zeros(0)
    if values.shape != (3,):
        msg = f"{name} {text!r}: expected three numbers X,Y,Z in LPS mm"
        raise UsageError(msg)
    return values


def _jobs(args: Namespace, manifest: Manifest, settings: Resolved) -> list[Job]:
    if args.until not in STAGES:
        msg = f"--until {args.until!r}: {did_you_mean(args.until, STAGES)}"
        raise UsageError(msg)
    if args.jobs < 1:
        msg = f"-j {args.jobs}: expected 1 or more"
        raise UsageError(msg)
    cache = None if args.no_cache else default_root()
    template = Job(manifest.cases[0], settings, args.out, args.until, cache, args.fresh, args.embed)
    return [replace(template, case=case) for case in _chosen(args, manifest)]


def _chosen(args: Namespace, manifest: Manifest) -> list[Case]:
    by_id = {case.id: case for case in manifest.cases}
    unknown = [name for name in args.only if name not in by_id]
    if unknown:
        msg = f"--only {unknown[0]!r}: no such case; {did_you_mean(unknown[0], by_id)}"
        raise UsageError(msg)
    ids = [name for name in by_id if not args.only or name in args.only]
    if args.shard:
        ids = shard_of(ids, *_shard(args.shard))
    return [by_id[name] for name in ids]


def _shard(text: str) -> tuple[int, int]:
    parts = text.split("/")
    if len(parts) == 2 and all(p.isdigit() for p in parts) and 1 <= int(parts[0]) <= int(parts[1]):
        return int(parts[0]), int(parts[1])
    msg = f"--shard {text!r}: expected I/N with 1 <= I <= N, as in 3/20"
    raise UsageError(msg)


def _guard_out(args: Namespace, manifest: Manifest) -> None:
    """An output folder is empty or from the same manifest; anything else needs a word from the user."""
    info = args.out / "run.json"
    if args.resume or args.fresh or not args.out.exists() or not any(args.out.iterdir()):
        return
    mine = file_hash(manifest.path)
    if not info.exists() and (
        list(args.out.glob("run.*.json")) or (args.out / "manifest.inferred.toml").exists()
    ):
        return
    found = json.loads(info.read_text(encoding="utf-8")).get("manifest_sha256") if info.exists() else None
    if found != mine:
        what = "was made from another manifest" if found else "is not empty and holds no run"
        msg = f"{args.out} {what}; name another folder, or say --resume (keep what fits) or --fresh (compute again)"
        raise UsageError(msg)


def _dry_run(jobs: list[Job], points: list[sweep.Point]) -> int:
    for job in jobs:
        known = "kept, nothing changed" if finished(job, job_key(job)) else f"to run until {job.until}"
        say(f"{job.case.id}: {job.case.frame_count} frames, {known} -> {job.folder}")
    for point in points:
        say(
            f"sweep {point.parameter} = {point.value}: {len(jobs)} case(s) -> {jobs[0].out / 'sweep' / point.folder}"
        )
    say("dry run: nothing was computed")
    return 0


def _say_failures(out: Path) -> None:
    for result in found_results(out):
        for row in result["failures"]:
            frame = f" frame {row['frame']}" if row.get("frame") is not None else ""
            sys.stderr.write(f"{row['case']}{frame}: {row['status']}: {row['message'] or row['sentence']}\n")


def last_line(totals: Totals, index: Path) -> str:
    """Counts, median error, solver time and where the report lies."""
    parts = [f"{totals.cases} case{'s' * (totals.cases != 1)}, {totals.frames} frames: {totals.frames_ok} ok"]
    if totals.frames_ok < totals.frames:
        parts.append(f"{totals.frames - totals.frames_ok} not ok (failures.csv)")
    if np.isfinite(totals.median_mm):
        parts.append(f"median point error {totals.median_mm:.3f} mm (p95 {totals.p95_mm:.3f})")
    if totals.frames:
        parts.append(f"solver {1000.0 * totals.solver_s / totals.frames:.1f} ms/frame")
    return ".  ".join(parts) + f".  report: {index}"
