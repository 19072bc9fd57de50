"""``wireval score MANIFEST --curves DIR -o OUT``: other simulators' wires, judged as the solver's own and beside it."""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.commands import add_gates, add_quiet, add_settings, aside, resolved_settings, say
from pipeline.commands.given import add_calibrated, file_of

if TYPE_CHECKING:
    from pipeline.run.aggregate import Totals
    from pipeline.run.launch import Plan
    from pipeline.study.manifest import Case

HELP = "judge other simulators' wires by the same pipeline, side by side with the solver's own"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    add = parser.add_argument
    add("manifest", type=Path, metavar="MANIFEST", help="manifest.toml")
    what = "folder of one wire a frame (.csv .vtp .vtk .mrk.json), of CASE/ folders, or an output of run; repeatable"
    add("--curves", action="append", required=True, metavar="[NAME=]DIR", help=what)
    add("--space", default="", choices=("LPS", "RAS"), help="of coordinates whose files do not state it")
    add(
        "--unit", default="", choices=("mm", "um", "cm", "m", "inch"), help="of coordinates whose files do not state it"
    )
    add(
        "-o",
        "--out",
        type=Path,
        required=True,
        metavar="OUT",
        help="output folder; of all but the first DIR below simulators/",
    )
    add_settings(parser)
    add("-j", "--jobs", type=int, default=1, metavar="N", help="cases at once (default 1)")
    add_calibrated(parser)
    of = "the overall.csv of any simulator but the solver itself, or of the one that is named,"
    add_gates(parser, of, metavar="[NAME:]COLUMN>VALUE")
    add("--without-own", action="store_true", help="judge these wires alone: the solver's own are not simulated")
    add("--fresh", action="store_true", help="compute every case again")
    add("--embed", action="store_true", help="put the pictures into the pages: one file a page")
    add_quiet(parser)


def main(args: argparse.Namespace) -> int:
    """Exit 0 all ok, 1 some case of any simulator failed or a gate closed; InputError where the input is wrong."""
    from pipeline.run.gate import gate
    from pipeline.run.simulators import side_by_side
    from pipeline.status import InputError
    from pipeline.study.check import check
    from reports.atomic import remove_files
    from reports.inside import misleading_links
    from reports.schema import SIMULATORS, WHERE
    from reports.simulators import PAGE
    from reports.what_next import warned

    gates = [gate(text, _judged_names(args)) for text in args.fail_if]
    plans = {name: replace(p, gates=tuple(g for g in gates if g.asks(name))) for name, p in _plans(args).items()}
    found = {name: check(plan.cases, plan.template.settings.config) for name, plan in plans.items()}
    if problems := [*misleading_links(args.out), *said_once(found)]:
        raise InputError(problems)
    (args.out / "simulators").mkdir(parents=True, exist_ok=True)
    # a score that is ended would leave them
    remove_files(*(args.out / earlier for earlier in (SIMULATORS.file, WHERE.file, PAGE)))
    sys.stderr.writelines(_lost(args.curves, [case.id for case in next(iter(plans.values())).cases]))
    totals = _judged(plans, args.quiet)
    warnings = said_once({name: warned(plan.out) for name, plan in plans.items()})
    aside(warnings, quiet=args.quiet)
    for line in side_by_side(args.out, {name: plan.out for name, plan in plans.items()}, args.embed):
        say(line)
    if args.junit:
        _write_junit(args.junit, plans, totals)
    for line in () if args.quiet else [f"PASS: {name}: {line}" for name, one in totals.items() for line in one.opened]:
        say(line)
    sys.stderr.writelines(f"FAIL: {name}: {why}\n" for name, one in totals.items() for why in one.closed)
    return 0 if all(one.all_ok and not one.closed for one in totals.values()) else 1


def _lost(curves: Sequence[str], cases: Sequence[str]) -> Iterator[str]:
    """A line for each simulator that wrote nothing for some cases: it crashed there, or a folder is misspelt."""
    from pipeline.study.others import lost_in, named
    from reports.case_files import listed

    for name, place in named(curves).items():
        if lost := lost_in(place, cases):
            what = f"no folder CASE/ nor CASE.h5 for {listed(lost)}"
            yield f"warning: {name}: {place} has {what}: every frame of {'it' if len(lost) == 1 else 'them'} fails\n"


def _write_junit(path: Path, plans: "Mapping[str, Plan]", totals: "Mapping[str, Totals]") -> None:
    """The frames of all simulators, and the gates of each."""
    from pipeline.run.aggregate import write_tests

    gates = {
        f"{name}: {asked}": f"{name}: {why}" * bool(why)
        for name, one in totals.items()
        for asked, why in one.gates.items()
    }
    write_tests(path, {f"{name}/": plan.out for name, plan in plans.items()}, gates)


def _judged(plans: "Mapping[str, Plan]", quiet: bool) -> "dict[str, Totals]":
    """Run every simulator's plan, and say what became of it."""
    from pipeline.run.last_words import failure_lines, last_line
    from pipeline.run.launch import launch
    from reports.doubts import caveats_in
    from reports.schema import OURS
    from reports.verdict import remarks

    done = {}
    for number, (name, plan) in enumerate(plans.items(), start=1):
        if not quiet:
            say(f"simulator {number} of {len(plans)}: {name}")
        totals, page = launch(plan)
        # of wires that were handed in there is no time of a simulation
        done[name] = totals if name == OURS else replace(totals, solver_s=0.0)
        for line in failure_lines(plan, "see to what the messages name, then the same command again"):
            sys.stderr.write(f"{name}: {line}\n")
        say(f"{name}: {last_line(done[name], page)}")
        for text in remarks(totals.pooled, name, caveats_in(plan.out)):
            say(f"{name}: warning: {text}")
    return done


def said_once(said: Mapping[str, Sequence[str]]) -> list[str]:
    """Each warning once: as it is where all simulators have it, as of manifest or scans, else behind their names."""
    owners = {line: [n for n, lines in said.items() if line in lines] for lines in said.values() for line in lines}
    return [line if len(names) == len(said) else f"{', '.join(names)}: {line}" for line, names in owners.items()]


def _plans(args: argparse.Namespace) -> "dict[str, Plan]":
    """A run for each simulator, the solver's own last; raises InputError or, for what was typed, UsageError."""
    from pipeline.run.cache import default_root
    from pipeline.run.calibrated import as_calibrated
    from pipeline.run.case import Job
    from pipeline.run.guards import guard_apart, guard_score
    from pipeline.run.inputs import named_files
    from pipeline.run.launch import Plan
    from pipeline.status import UsageError
    from pipeline.study.manifest import Manifest, read_manifest
    from pipeline.study.others import named
    from reports.simulators import folders_in

    manifest, settings = read_manifest(file_of(args.manifest)), resolved_settings(args)
    if args.out.exists() and any(args.out.iterdir()) and not (args.out / "simulators").is_dir():
        raise UsageError([f"-o {args.out}: it is not empty and holds no score; name another folder"])
    names = named(args.curves)
    guard_apart(args.out, (path for case in manifest.cases for path in named_files(case).values()))
    if not args.fresh and (lost := [name for name in folders_in(args.out) if name not in _judged_names(args)]):
        what = f"it holds a score of {', '.join(lost)}, which would be replaced"
        do = "name another folder, name them again with --curves (wireval: no --without-own), or --fresh"
        raise UsageError([f"-o {args.out}: {what}; {do}"])
    calibrated, notes = as_calibrated(manifest.cases, args.parameters, own=args.score_used)
    manifest = Manifest(manifest.path, calibrated)
    plans: dict[str, Plan] = {}
    for name in _judged_names(args):
        place = names.get(name)
        cases = _with_wires(calibrated, place, args)
        out = args.out / "simulators" / name if plans else args.out
        # of all but the first, lumen and traces are taken again: their steps would be printed once a simulator
        quiet = args.quiet or bool(plans and place)
        how = {"fresh": args.fresh, "embed": args.embed, "quiet": quiet, "simulator": name}
        template = Job(cases[0], settings, out, cache=default_root(), **how)
        plans[name] = Plan(manifest, cases, template, workers=args.jobs, assumptions=notes)
    if not args.fresh:
        guard_score({name: (plan.out, plan.cases) for name, plan in plans.items()}, settings)
    return plans


def _judged_names(args: argparse.Namespace) -> list[str]:
    """The simulators, the solver itself last, where it is not left out."""
    from pipeline.study.others import named
    from reports.schema import OURS

    return [*named(args.curves), *[OURS] * (not args.without_own)]


def _with_wires(cases: "Sequence[Case]", place: Path | None, args: argparse.Namespace) -> "tuple[Case, ...]":
    """The cases with the wires that a place holds for them; with the solver's own where there is no place."""
    from pipeline.load import Source
    from pipeline.study.others import Others, found_for

    if place is None:
        return tuple(case.model_copy(update={"simulated": None}) for case in cases)
    stated, ids, made = Others(space=args.space, unit=args.unit), [case.id for case in cases], []
    for case in cases:
        # not as a manifest writes them: these may lead out of the working folder, and hold a #
        files = tuple(Source(path) for path in found_for(case.id, place, ids))
        made.append(case.model_copy(update={"simulated": stated.model_copy(update={"files": files})}))
    return tuple(made)
