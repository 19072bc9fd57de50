"""``wireval run MANIFEST -o OUT``: the whole pipeline over every case."""

import argparse
import math
import os
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.commands import add_gates, add_settings, add_verbosity, aside, resolved_settings, say, settings_of
from pipeline.commands.given import INFERRED, add_calibrated, add_manifest, assumed_in, given

if TYPE_CHECKING:
    from collections.abc import Sequence, Set

    from pipeline.run.aggregate import Totals
    from pipeline.run.gate import Gate
    from pipeline.run.launch import Plan
    from pipeline.run.workers import Limits
    from pipeline.study.manifest import Case, Manifest
    from pipeline.study.settings import Resolved

ADDRESS = re.compile(r"(\w+://)?[^/\s]+:\d+")
"""Of a scheduler; dask takes tcp:// where none is said."""

HELP = "the whole pipeline: scans in, errors and a report out"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    add = parser.add_argument
    add_manifest(parser)
    add("-o", "--out", type=Path, required=True, metavar="OUT", help="output folder")
    add_settings(parser)
    add(
        "-j", "--jobs", type=int, default=1, metavar="N", help="cores: cases at once, then frames of a case (default 1)"
    )
    add("--case-timeout", type=float, default=math.inf, metavar="S", help="seconds that a case may take")
    add("--case-memory", type=float, default=math.inf, metavar="MIB", help="MiB of memory that a case may take")
    add("--shard", default="", metavar="I/N", help="only the I-th of N parts of the cases; merge with cp -r")
    add("--only", action="append", default=[], metavar="ID", help="only this case; may be repeated")
    says = "load, segment, trace, simulate, compare (draws no pages) or report (default)"
    add("--until", default="report", metavar="STAGE", help=says)
    add("--executor", default="", metavar="ADDRESS", help="tcp://host:port of a dask scheduler")
    add("--skip-bad", action="store_true", help="leave out and name cases whose files cannot be used; exit 1")
    add("--resume", action="store_true", help="go on in an OUT made from another manifest or with other settings")
    add("--fresh", action="store_true", help="compute every case again")
    add("--dry-run", action="store_true", help="say what would be done, and do nothing")
    add("--sweep", action="append", default=[], metavar="TABLE.KEY=V1,V2", help="also run with each of these values")
    add_calibrated(parser)
    add_gates(parser)
    add("--embed", action="store_true", help="put the pictures into the pages: one file a page")
    add("--no-cache", action="store_true", help="neither take lumens and traces of earlier runs nor keep them")
    add_verbosity(parser)


def main(args: argparse.Namespace) -> int:
    """Exit 0 all ok, 1 some case failed or a gate closed; raises InputError where the input is wrong."""
    from pipeline.run.gate import gate

    # first of all: what the run itself imports takes seconds
    return _run(args, [gate(text) for text in args.fail_if])


def _run(args: argparse.Namespace, gates: "Sequence[Gate]") -> int:
    from pipeline.run.aggregate import write_tests
    from pipeline.run.batch import require_cluster
    from pipeline.run.last_words import last_line
    from pipeline.run.launch import intention, launch
    from pipeline.study.plausible import doubts

    plan = _plan(args)
    if not plan.cases:
        if args.junit and not args.dry_run:
            write_tests(args.junit, {}, {})  # a build server expects the file
        say(_nothing(args.shard, plan))
        return 0
    plan = replace(_sound(plan, args.skip_bad), gates=tuple(gates))
    if args.dry_run:
        doubtful = doubts(plan.cases, plan.template.settings.config)
        for line in [*(f"warning: {text}" for text in doubtful), *intention(plan)]:
            say(line)
        return 0
    require_cluster(plan.address)  # before OUT is claimed
    totals, index = launch(plan)
    if args.junit:
        write_tests(args.junit, {"": plan.out}, totals.gates)
    _tell(plan, totals)
    for line in () if plan.template.quiet else totals.opened:
        say(f"PASS: {line}")
    say(last_line(totals, index))
    return 0 if totals.all_ok and not totals.closed else 1


def _sound(plan: "Plan", skip_bad: bool) -> "Plan":
    """The plan, less its bad cases where these are to be left out; raises InputError with every problem."""
    from pipeline.run.launch import without
    from pipeline.status import InputError
    from pipeline.study.check import check
    from pipeline.study.coarse import too_coarse
    from reports.case_files import counted
    from reports.inside import misleading_links

    config, problems = plan.template.settings.config, misleading_links(plan.out)
    bad = [case for case in plan.cases if check([case], config, whole=False)]
    faults, count = {case.id: check([case], config) for case in bad}, len(plan.cases)
    if skip_bad:
        plan = without(plan, faults)
    else:
        problems += [text for found in faults.values() for text in found]
    problems += [text for point in plan.points for text in too_coarse(plan.cases, point.cheap.config)]
    if problems:
        error = InputError(list(dict.fromkeys(problems)))
        if 0 < len(faults) < count and not skip_bad:
            error.then += f"; --skip-bad runs the {counted(count - len(faults), 'other case')}"
        raise error
    return plan


def _tell(plan: "Plan", totals: "Totals") -> None:
    """What went wrong, on stderr, and what to bear in mind; warnings are not among the result, which -q prints."""
    from pipeline.run.last_words import failure_lines
    from reports.doubts import caveats_in
    from reports.verdict import remarks
    from reports.what_next import warned

    sys.stderr.writelines(f"{line}\n" for line in (*failure_lines(plan), *(f"FAIL: {why}" for why in totals.closed)))
    aside(warned(plan.out), quiet=plan.template.quiet)
    for text in remarks(totals.pooled, caveats=caveats_in(plan.out)):
        say(f"warning: {text}")


def _without_budget(cases: "Sequence[Case]") -> list[str]:
    """A line for each case that has no budget though one is asked for."""
    from pipeline.run.stages.budget import no_budget

    return [f"case {case.id!r}: {why}" for case in cases if (why := no_budget(case))]


def _plan(args: argparse.Namespace) -> "Plan":
    """What the command line asks for; raises where it cannot be carried out."""
    from pipeline.run.cache import default_root
    from pipeline.run.case import Job
    from pipeline.run.guards import guard_apart
    from pipeline.run.inputs import named_files
    from pipeline.run.launch import Plan
    from pipeline.run.sweep import points_of

    if args.executor:  # workers elsewhere know nothing of this process's working folder
        args.manifest, args.out = args.manifest.absolute(), args.out.absolute()
    guard_apart(args.out, [args.manifest / INFERRED])  # before an inferred manifest is written there
    manifest = given(args, None if args.dry_run else args.out)
    guard_apart(args.out, (path for case in manifest.cases for path in named_files(case).values()))
    settings = resolved_settings(args)
    limits = _limits(args)
    cache = None if args.no_cache else default_root()
    how = {"embed": args.embed, "quiet": args.quiet, "verbose": args.verbose}
    template = Job(manifest.cases[0], settings, args.out, args.until, cache, args.fresh, **how)
    points = tuple(points_of(args.sweep, settings_of(args)))
    manifest, cases, notes = _to_score(args, manifest)
    notes = (*(f"assumed: {text}" for text in assumed_in(cases)), *notes)
    notes += tuple(_without_budget(cases)) if settings.config.budget.members else ()
    for note in () if args.quiet else notes:
        say(note)
    if cases:  # else nothing is written
        _guard(args, manifest, {case.id for case in cases}, settings)
    folder = args.manifest if manifest.path.name == INFERRED else None
    left_out = tuple(case.id for case in manifest.cases if args.only and case.id not in args.only)
    return Plan(
        manifest, cases, template, points, args.jobs, args.executor, limits, args.shard, notes, left_out, folder
    )


def _to_score(args: argparse.Namespace, manifest: "Manifest") -> "tuple[Manifest, tuple[Case, ...], tuple[str, ...]]":
    """The study less what was calibrated with, the cases of it to compute here, and sentences for the report."""
    from pipeline.run.calibrated import as_calibrated
    from pipeline.run.launch import chosen

    picked = chosen(manifest.cases, args.only, args.shard)
    cases, notes = as_calibrated(picked, args.parameters, own=args.score_used, part=bool(args.shard))
    unscored = {case.id for case in picked} - {case.id for case in cases}
    if args.shard:  # what other shards leave out is not missed after the merge
        beside = [case for case in manifest.cases if case.role == "calibration" and case not in picked]
        kept, _ = as_calibrated(beside, args.parameters, own=args.score_used, part=True)
        unscored |= {case.id for case in beside} - {case.id for case in kept}
    return manifest.without(unscored), cases, notes


def _guard(args: argparse.Namespace, manifest: "Manifest", computed: "Set[str]", settings: "Resolved") -> None:
    """Refuse to write into an OUT that holds what the cases to be computed may not stand beside."""
    from pipeline.run.guards import guard_kept, guard_out, guard_stages
    from pipeline.run.own import not_loaded
    from pipeline.status import UsageError

    if not args.fresh and (lost := not_loaded(args.out, "pipeline.cli.main(['run', ...])")):
        raise UsageError([f"{text}, or say --fresh (compute again)" for text in lost])
    if not (args.resume or args.fresh):
        guard_out(args.out, manifest.path, settings)
    others = {case.id: case for case in manifest.cases if case.id not in computed}
    guard_kept(args.out, others, settings, files=bool(args.only) or args.resume or args.fresh)
    if not args.fresh:
        guard_stages(args.out, args.until)


def _nothing(shard: str, plan: "Plan") -> str:
    """The line of a shard that got no case, or only some that were calibrated with."""
    count = len(plan.manifest.cases) - len(plan.left_out)
    of = f"holds none of the {count} cases" if count != 1 else "does not hold the only case"
    return f"shard {shard} {of}: nothing to do"


def _limits(args: argparse.Namespace) -> "Limits":
    """What a case may take; UsageError for this and other numbers and names that are none."""
    from pipeline.run.log import STAGES
    from pipeline.run.workers import Limits, resident_mib
    from pipeline.status import UsageError, did_you_mean

    if args.until not in STAGES:
        raise UsageError([f"--until {args.until!r}: {did_you_mean(args.until, STAGES)}"])
    if args.resume and args.fresh:
        raise UsageError(["--resume and --fresh: keep what fits, or compute again; give one of them"])
    if args.executor and not ADDRESS.fullmatch(args.executor):
        raise UsageError(
            [f"--executor {args.executor!r}: expected the address of a dask scheduler, as tcp://host:8786"]
        )
    limits = Limits(args.case_timeout, args.case_memory)
    for name, value in (("--case-timeout", limits.seconds), ("--case-memory", limits.memory_mib)):
        if not value > 0:
            raise UsageError([f"{name} {value:g}: expected a number over 0"])
    if limits.any and args.executor:
        raise UsageError(["--case-timeout and --case-memory hold on this machine; a cluster's workers have their own"])
    if limits.memory_mib < math.inf and not resident_mib(os.getpid()):
        raise UsageError(["--case-memory: this system does not tell what a process takes (no /proc)"])
    return limits
