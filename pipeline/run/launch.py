"""The whole run: every case of a manifest, and of every point of a sweep, into one output folder."""

import gc
import math
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from pipeline.run import ledger
from pipeline.run.aggregate import Totals, aggregate
from pipeline.run.batch import elsewhere, run_all
from pipeline.run.cache import Store, forget_lumen
from pipeline.run.case import Job, clear, each_on, run_case, why_again
from pipeline.run.earlier import remove_arrays, remove_others, remove_records
from pipeline.run.gate import Gate
from pipeline.run.guards import guard_own
from pipeline.run.hashing import file_hash
from pipeline.run.inputs import stated
from pipeline.run.log import last_stage
from pipeline.run.occupied import owner_of
from pipeline.run.outcome import Outcome
from pipeline.run.own import refuse_scripts, registered, with_own
from pipeline.run.provenance import code_state, this_run
from pipeline.run.results import lost, write_json
from pipeline.run.sweep import SweepPoint, found_heads, heads_of, lost_points, write_sweep
from pipeline.run.watch import Watch
from pipeline.run.workers import NO_LIMITS, Limits
from pipeline.status import UsageError, did_you_mean
from pipeline.study.check import frames_of
from pipeline.study.manifest import Case, Manifest
from pipeline.study.plausible import among
from pipeline.study.settings import to_toml
from reports.atomic import WriteError, remove_files, remove_leftovers, write_text, writing
from reports.case_files import counted, provenance_of
from reports.doubts import AMONG
from reports.gates import GATES
from reports.records import read_json
from reports.run_page import render_index
from reports.schema import FAILURES, OVERALL_FILE, SUMMARY, SWEEP, TIMINGS
from reports.sweep import not_run

OVER_ALL = (
    *(SUMMARY.file, OVERALL_FILE, FAILURES.file, TIMINGS.file, SWEEP.file),
    *(AMONG, GATES, "index.html", "summary.pdf"),
)
"""Files over all cases. They go before the first case is computed: a run that is ended would leave those of an earlier
one, all ok, beside cases of its own."""


@dataclass(frozen=True)
class Plan:
    """What to run and how. template : settings and output of every case; workers, address : where it runs.

    limits : the most time and memory that a case may take.
    shard : I/N where only a part of the cases is run, else empty.     assumptions : what was inferred.
    left_out : ids of the manifest's cases that --only does not name.
    inferred_from : the folder of scans that the manifest was inferred from; None where there is a manifest.
    refused : cases that are not computed, with what is wrong with each.     gates : conditions on the whole run.
    """

    manifest: Manifest
    cases: tuple[Case, ...]
    template: Job
    points: tuple[SweepPoint, ...] = ()
    workers: int = 1
    address: str = ""
    limits: Limits = NO_LIMITS
    shard: str = ""
    assumptions: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    inferred_from: Path | None = None
    refused: tuple[tuple[Case, str], ...] = ()
    gates: tuple[Gate, ...] = ()

    @property
    def out(self) -> Path:
        """The output folder."""
        return self.template.out

    @property
    def jobs(self) -> list[Job]:
        """One per case; with several workers the longest first, so that no long case is left for the end."""
        several = self.workers > 1 or self.address
        longest = sorted(self.cases, key=lambda case: -case.frame_count) if several else self.cases
        return [replace(self.template, case=case) for case in longest]

    @property
    def ids(self) -> set[str]:
        """Of the cases to compute."""
        return {case.id for case in self.cases}

    @property
    def sweep_jobs(self) -> list[Job]:
        """The jobs of every point of the sweep; they come last, when lumen and traces are in the store.

        All points of a case follow each other: a worker then reads its lumen and prepares its wall once.
        """
        return [
            replace(job, settings=point.cheap, out=self.out / point.folder, pictures=False, quiet=True)
            for job in self.jobs
            for point in self.points
        ]

    @property
    def elsewhere(self) -> bool:
        """Whether cases run in other processes than this one."""
        return elsewhere(len(self.jobs) + len(self.sweep_jobs), self.workers, self.address, self.limits)


def without(plan: Plan, faults: Mapping[str, Sequence[str]]) -> Plan:
    """The plan with the cases of these ids refused. faults : what is wrong with each, lines that name the case."""

    def why(case: Case) -> str:
        return "; ".join(line.removeprefix(f"case {case.id!r}: ") for line in faults[case.id])

    refused = tuple((case, why(case)) for case in plan.cases if case.id in faults)
    return replace(plan, cases=tuple(case for case in plan.cases if case.id not in faults), refused=refused)


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
    found = re.fullmatch(r"([0-9]{1,6})/([0-9]{1,6})", text)  # both are in the name of a file
    if found and 1 <= int(found[1]) <= int(found[2]):
        return int(found[1]), int(found[2])
    raise UsageError([f"--shard {text!r}: expected I/N with 1 <= I <= N, as in 3/20"])


@contextmanager
def imports_set_aside() -> Iterator[None]:
    """Let the garbage collector pass over all that is in memory now, until the block ends.

    That is 300 000 objects of imported modules, of which none becomes garbage: a round over them takes 0.2 s, and the
    collector made one when the truth was read, and one more for the pages.
    """
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


@imports_set_aside()
def launch(plan: Plan) -> tuple[Totals, Path]:
    """Run all cases and write the files about the whole run; returns the totals and the path of its page."""
    if plan.elsewhere:
        refuse_scripts(registered())
    out, settings, manifest, cases = plan.out, plan.template.settings, plan.manifest.path, plan.manifest.cases
    info: dict[str, Any] = {"manifest": str(manifest), "manifest_sha256": file_hash(manifest)}
    heads = heads_of(settings, plan.cases, plan.points)
    info |= {"sweep": heads, "swept": sorted(plan.ids) if heads else [], "until": plan.template.until}
    info |= {"stated": {case.id: stated(case) for case in cases}, "planned": [case.id for case in cases]}
    info |= {"to_score": {case.id: case.frames_to_score for case in cases if case.frames_to_score}}
    info |= {"fail_if": [gate.text for gate in plan.gates], **({"own": own} if (own := registered()) else {})}
    # the numbers: 1/02 is the shard 1/2
    name = "run.{}-{}.json".format(*_shard(plan.shard)) if plan.shard else "run.json"
    left_out = _never_asked(out / name, plan.left_out)
    info |= {"left_out": left_out, "doubts": among(cases, left_out), "config": settings.as_dict()}
    swept = (out / SWEEP.file).exists()
    guard_own(out, OVER_ALL, (job.folder for job in (*plan.jobs, *plan.sweep_jobs)))
    try:
        remove_arrays(out, name)
        write_json(out / name, info | {"cases": []})
        write_text(out / "config.resolved.toml", to_toml(settings))
        write_json(provenance_of(out / name), this_run())
        remove_files(*(out / file for file in OVER_ALL))
    except WriteError as error:
        raise UsageError([str(error)]) from error
    remove_leftovers(out)
    if plan.template.fresh:
        remove_others(out, info["manifest_sha256"])
    elif not plan.shard and not plan.left_out:
        remove_records(out, info["manifest_sha256"])
    _refuse(plan)
    run_cases(plan, [*plan.jobs, *plan.sweep_jobs])
    if removed := write_sweep(out, found_heads(out), earlier=swept):  # points of other shards so far included
        sys.stderr.write(f"{removed}\n")
    info |= {"provenance": code_state(), "assumptions": plan.assumptions}
    Store(plan.template.cache).trim()
    totals = replace(aggregate(out, info, name), sweep_lost=len(lost_points(out, heads)))
    # another shard may be at work on the others'
    totals = replace(totals, sweep_missing=len(not_run(out, plan.ids)[0]) if heads else 0)
    return totals, render_index(out, plan.template.embed, each_on(1 if plan.address else plan.workers))


def _refuse(plan: Plan) -> None:
    """Write for each refused case, in every point of the sweep, too, that it is; an earlier result goes."""
    reasons = {case.id: why for case, why in plan.refused}
    bad = replace(plan, cases=tuple(case for case, _ in plan.refused))
    for job in [*bad.jobs, *bad.sweep_jobs]:
        remove_files(job.folder / "log.txt")  # it tells of stages that this run did not come to
        _write_lost(Outcome(job, None, reasons[job.case.id], reasons[job.case.id], "refused"))


def _never_asked(info: Path, left_out: Sequence[str]) -> list[str]:
    """Those of ``left_out`` that the earlier run, which wrote ``info``, was not asked to compute either."""
    before: Mapping[str, Any] = {}
    with suppress(ValueError):  # damaged: it tells nothing, and is written anew
        before = read_json(info)
    asked = set(before.get("planned") or ()) - set(before.get("left_out") or ())
    return [name for name in left_out if name not in asked]


def cores_each(plan: Plan, jobs: int) -> int:
    """How many cores each case may use: one each, and where there are fewer cases than cores the others are shared.

    Always one with a limit of memory, which is checked for a single process, and on a cluster.
    """
    one = plan.address or plan.limits.memory_mib < math.inf
    return 1 if one else max(1, plan.workers // max(1, jobs))


def run_cases(plan: Plan, jobs: Sequence[Job]) -> None:
    """Run jobs; a case that could not be finished gets a result that says so. Raises WriteError, which ends the run."""
    forget_lumen()
    watch = Watch(jobs, silent=plan.template.quiet, lines=plan.template.verbose)
    cores = cores_each(plan, len(jobs))
    quiet = [replace(job, quiet=job.quiet or watch.bar, cores=cores) for job in jobs]
    work = partial(with_own, registered(), run_case) if plan.elsewhere else run_case
    outcomes = run_all(quiet, work, plan.workers, plan.address, plan.limits)
    with watch.shown(), closing(outcomes):
        for outcome in outcomes:
            if outcome.status == "unwritable":
                raise WriteError(outcome.error)
            if outcome.error:
                _write_lost(outcome)
            watch.finished(outcome.job, outcome.error)
    for job in jobs:
        if not (job.folder / ledger.RESULT).exists():
            why = f"{job.folder}: its result was removed while the run went on"
            _write_lost(Outcome(job, None, why, why, "removed"))


def _write_lost(outcome: Outcome[Job, None]) -> None:
    """Write a result for a job that could not be finished, and remove files of an earlier result.

    A case that another run is at work on is left alone; a line on stderr says so.
    """
    job, log = outcome.job, outcome.job.folder / "log.txt"
    owner = owner_of(job.folder)
    if owner:
        sys.stderr.write(f"{job.case.id}: {outcome.error}; left to {owner}, which is at work on it\n")
        return
    kept = clear(job.folder)
    stage = last_stage(log) or "run"
    with writing(log), log.open("a", encoding="utf-8") as file:
        file.writelines(f"{said}\n" for said in (kept, outcome.log) if said)
    lost(job.case.id, outcome.status, outcome.error, job.case, stage).write(job.folder)


def intention(plan: Plan) -> list[str]:
    """What a run would do, a line each."""
    lines = []
    for job in plan.jobs:
        known = "kept, nothing changed" if why_again(job) is None else f"to run until {job.until}"
        frames = counted(frames_of(job.case, job.settings.config), "frame")
        lines.append(f"{job.case.id}: {frames}, {known} -> {job.folder}")
    lines += [f"{case.id}: left out: {why}" for case, why in plan.refused]
    lines += [
        f"sweep {point.parameter} = {point.value}: {counted(len(plan.cases), 'case')} -> {plan.out / point.folder}"
        for point in plan.points
    ]
    return [*lines, "dry run: nothing was computed"]
