"""The whole run: every case of a manifest, and of every point of a sweep, into one output folder.

A sweep is the same cases with one setting changed at a time, beside the plain result. Segmentation and tracing do not
depend on the solver's settings, so the stage store answers them: a sweep costs simulation and comparison only. An
agreement that no parameter moves is suspicious.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.run.aggregate import Totals, aggregate, write_junit
from pipeline.run.batch import run_all
from pipeline.run.case import Job, clear, finished, run_case
from pipeline.run.provenance import collect
from pipeline.run.results import LOST, Result, found_results, lost, write_json
from pipeline.run.store import file_hash
from pipeline.run.sweep import SweepPoint, write_sweep
from pipeline.run.watch import Watch
from pipeline.status import InputError, did_you_mean
from pipeline.study.manifest import Case, Manifest
from pipeline.study.settings import Resolved, differing, to_toml
from reports.atomic import write_text
from reports.html import render_index


class UsageError(InputError):
    """A command line that cannot be carried out."""

    place = "the command line"


def _lost_points(plan: "Plan") -> list[tuple[SweepPoint, Result]]:
    """Cases of which a sweep has no result, and at which point."""
    return [(p, r) for p in plan.points for r in found_results(plan.out / p.folder) if r.status in LOST]


@dataclass(frozen=True)
class Plan:
    """What to run and how. template : settings and output of every case; workers, address : where it runs.

    shard : I/N where only a part of the cases is run, else empty.     assumptions : what was inferred.
    """

    manifest: Manifest
    cases: tuple[Case, ...]
    template: Job
    points: tuple[SweepPoint, ...] = ()
    workers: int = 1
    address: str = ""
    shard: str = ""
    assumptions: tuple[str, ...] = ()

    @property
    def out(self) -> Path:
        """The output folder."""
        return self.template.out

    @property
    def jobs(self) -> list[Job]:
        """One per case."""
        return [replace(self.template, case=case) for case in self.cases]


def chosen(cases: Sequence[Case], only: Sequence[str], shard: str) -> tuple[Case, ...]:
    """The cases of the given ids (all where none is given); of these, with shard ``I/N``, every N-th by sorted id."""
    by_id = {case.id: case for case in cases}
    unknown = [name for name in only if name not in by_id]
    if unknown:
        raise UsageError([f"--only {unknown[0]!r}: no such case; {did_you_mean(unknown[0], by_id)}"])
    ids = [name for name in by_id if not only or name in only]
    if shard:
        index, count = _shard(shard)
        ids = sorted(ids)[index - 1 :: count]
    return tuple(by_id[name] for name in ids)


def _shard(text: str) -> tuple[int, int]:
    parts = text.split("/")
    if len(parts) == 2 and all(p.isdigit() for p in parts) and 1 <= int(parts[0]) <= int(parts[1]):
        return int(parts[0]), int(parts[1])
    raise UsageError([f"--shard {text!r}: expected I/N with 1 <= I <= N, as in 3/20"])


def guard_out(out: Path, manifest: Path, settings: Resolved) -> None:
    """Refuse an output folder that holds something else than a run of the same manifest with the same settings."""
    if not out.exists() or not any(out.iterdir()):
        return
    info = out / "run.json"
    try:
        known = json.loads(info.read_text(encoding="utf-8")).get("manifest_sha256") if info.exists() else None
    except ValueError:
        raise UsageError([f"{info} is damaged; say --resume (keep what fits) or --fresh (compute again)"]) from None
    if not info.exists() and (list(out.glob("run.*.json")) or (out / "manifest.inferred.toml").exists()):
        return
    if known != file_hash(manifest):
        what = "was made from another manifest" if known else "is not empty and holds no run"
        allowed = "name another folder, or say --resume (keep what fits) or --fresh (compute again)"
        raise UsageError([f"{out} {what}; {allowed}"])
    others = differing(out / "config.resolved.toml", settings)
    if others:
        allowed = "name another folder, or say --fresh (compute again) or --resume (keep what fits)"
        raise UsageError([f"{out} was run with other settings: {others}; {allowed}"])


def launch(plan: Plan, *, junit: Path | None = None) -> tuple[Totals, Path]:
    """Run everything and write what is about the whole; the totals and the path of the page."""
    out, jobs = plan.out, plan.jobs
    settings, manifest = plan.template.settings, plan.manifest.path
    info: dict[str, Any] = {"manifest": str(manifest), "manifest_sha256": file_hash(manifest)}
    info |= {"provenance": collect(), "assumptions": plan.assumptions, "config": settings.as_dict()}
    name = f"run.{plan.shard.replace('/', '-')}.json" if plan.shard else "run.json"
    write_text(out / "config.resolved.toml", to_toml(settings))
    write_json(out / name, {"manifest_sha256": info["manifest_sha256"], "cases": []})
    of_points = [_jobs_at(plan, point) for point in plan.points]
    everything = [*jobs, *(job for some in of_points for job in some)]
    watch = Watch(everything, silent=plan.template.quiet, lines=plan.template.verbose)
    with watch.shown():
        for some in ([replace(job, quiet=job.quiet or watch.bar) for job in jobs], *of_points):
            run_cases(plan, some, watch)
    if plan.points:
        write_sweep(out, plan.template.settings, plan.cases, plan.points)
    totals = replace(aggregate(out, info, name), sweep_lost=len(_lost_points(plan)))
    if junit:
        write_junit(junit, found_results(out))
    return totals, render_index(out, embed=plan.template.embed)


def _jobs_at(plan: Plan, point: SweepPoint) -> list[Job]:
    """The cases at a point of the sweep, whose errors alone are of interest."""
    here = replace(plan.template, settings=point.cheap, out=plan.out / point.folder, pictures=False)
    return [replace(here, case=case, quiet=True, verbose=False) for case in plan.cases]


def run_cases(plan: Plan, jobs: Sequence[Job], watch: Watch) -> None:
    """Run jobs, the longest first, so that no long case is left for the end; a crash becomes that case's result."""
    several = plan.workers > 1 or plan.address
    longest = sorted(jobs, key=lambda job: -job.case.frame_count) if several else jobs
    for outcome in run_all(longest, run_case, plan.workers, plan.address):
        if outcome.error:
            _write_crash(outcome.job, outcome.error, outcome.log)
        watch.finished(outcome.job, outcome.error)


def _write_crash(job: Job, error: str, log: str) -> None:
    """A result for a job that could not be finished; files of an earlier run, which belong to another one, go."""
    clear(job.folder)
    with (job.folder / "log.txt").open("a", encoding="utf-8") as handle:
        handle.write(log + "\n")
    case = job.case
    result = lost(case.id, "crashed", error, role=case.role, group=case.group, frames=case.frame_count)
    result.write(job.folder)


def intention(plan: Plan) -> list[str]:
    """What a run would do, a line each."""
    lines = []
    for job in plan.jobs:
        known = "kept, nothing changed" if finished(job, job.key) else f"to run until {job.until}"
        lines.append(f"{job.case.id}: {job.case.frame_count} frames, {known} -> {job.folder}")
    lines += [
        f"sweep {point.parameter} = {point.value}: {len(plan.cases)} case(s) -> {plan.out / point.folder}"
        for point in plan.points
    ]
    return [*lines, "dry run: nothing was computed"]


def failure_lines(plan: Plan) -> list[str]:
    """What went wrong, a line each: every frame or case that is not ok, and what crashed at points of a sweep."""
    lines = []
    for result in found_results(plan.out):
        for row in result.failures:
            frame = f" frame {row['frame']}" if row.get("frame") is not None else ""
            lines.append(f"{row['case']}{frame}: {row['status']}: {row['message'] or row['sentence']}")
    return lines + [
        f"{point.folder}: {result.case}: {result.status}: {result.failures[0]['message']}"
        for point, result in _lost_points(plan)
    ]


def last_line(totals: Totals, index: Path) -> str:
    """Counts, median error, solver time and where the report lies."""
    parts = [f"{totals.cases} case{'s' * (totals.cases != 1)}, {totals.frames} frames: {totals.frames_ok} ok"]
    if totals.frames_ok < totals.frames:
        parts.append(f"{totals.frames - totals.frames_ok} not ok (failures.csv)")
    if totals.sweep_lost:
        parts.append(f"{totals.sweep_lost} crashed in the sweep")
    if np.isfinite(totals.median_mm):
        parts.append(f"median point error {totals.median_mm:.3f} mm (p95 {totals.p95_mm:.3f})")
        parts.append(_with_interval(totals.pooled))
    if totals.frames:
        parts.append(f"solver {1000.0 * totals.solver_s / totals.frames:.1f} ms/frame")
    return ".  ".join(parts) + f".  report: {index}"


def _with_interval(pooled: Mapping[str, Any]) -> str:
    """The pooled error with its interval, or why there is none."""
    ends = f"95 %: {pooled['rms_low_mm']:.3f} to {pooled['rms_high_mm']:.3f}, "
    known = ends if np.isfinite(pooled["rms_low_mm"]) else ""
    return f"rms {pooled['rms_mm']:.3f} mm ({known}{pooled['interval']})"
