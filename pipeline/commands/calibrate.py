"""``wireval calibrate MANIFEST -o OUT``: parameters from the cases marked role = "calibration"."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.commands import add_quiet, add_settings, aside, resolved_settings, say
from pipeline.commands.given import file_of

if TYPE_CHECKING:
    from pipeline.run.cache import Store
    from pipeline.study.manifest import Case
    from pipeline.study.settings import Config

HELP = 'parameters from the cases marked role = "calibration"'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    add = parser.add_argument
    add("manifest", type=Path, metavar="MANIFEST")
    add(
        "-o",
        "--out",
        type=Path,
        required=True,
        metavar="OUT",
        help="parameters.toml and calibration.html (or design.html) go there",
    )
    add("--design", action="store_true", help="predict from planned lumen, wire, depths and rolls; nothing is fitted")
    add("--no-cache", action="store_true", help="neither take lumens and traces of earlier runs nor keep them")
    add_settings(parser)
    add_quiet(parser)


def main(args: argparse.Namespace) -> int:
    """Exit 0; 1 where some case was left out; raises InputError where the input is wrong."""
    from pipeline.run.cache import Store, default_root
    from pipeline.run.calibration import chosen
    from pipeline.status import InputError
    from pipeline.study.check import check
    from pipeline.study.coarse import too_coarse
    from pipeline.study.manifest import read_manifest

    manifest, settings = read_manifest(file_of(args.manifest)), resolved_settings(args)
    cases, store = chosen(manifest.cases), Store(None if args.no_cache else default_root())
    problems = too_coarse(cases, settings.config, calibrates=True)
    problems += [] if args.design else [p for p in check(cases, settings.config) if p not in problems]
    if problems:
        raise InputError(problems)
    return (_design if args.design else _fit)(args, cases, settings.config, store)


def _fit(args: argparse.Namespace, cases: "tuple[Case, ...]", config: "Config", store: "Store") -> int:
    """Fit, write, and say what was found."""
    from pipeline.calibrate.unknowns import spread_in_words
    from pipeline.run.calibration import calibrate, gathered
    from pipeline.run.calibration_files import reservation, segments_said, warnings_of, write_parameters, write_record
    from reports.calibration import gained, render_calibration, to_its_digits

    found = gathered(cases, config, store, (lambda _: None) if args.quiet else say)
    fit = calibrate(found, config)
    if not args.quiet:
        say(segments_said(fit))
    file = args.out / "parameters.toml"
    before = file.read_bytes() if file.exists() else b""
    written = write_parameters(file, found, fit)
    write_record(args.out / "calibration.json", found, fit)
    for text in reservation(fit):
        say(text)
    for one in written.estimate:
        sd = spread_in_words(one.sd, logarithmic=one.logarithmic)
        fitted, used = (to_its_digits(vars(one), key) for key in ("value", "used"))
        unseen = f"  not seen in these traces, stays as stated; the fit alone gave {fitted}: {one.why}"
        against = f"  {one.why}" if one.why else f"  ({fitted} where all parameters are free)" * (fitted != used)
        verdict = against if one.seen else unseen
        say(f"{one.name:20s} {used if one.seen else f'{one.used:g}':>10s}  +- {sd:8s}{verdict}")
    if said := gained([vars(frame) for frame in fit.frames]):
        say(said)
    warnings = (f"warning: {text}" for text in warnings_of(found, fit))
    aside([*warnings, *found.left_out], quiet=args.quiet)
    if before not in (b"", file.read_bytes()):
        say(f"{file}: that of a calibration before, which said otherwise, is replaced")
    seen = f"{len(written.estimate) - len(written.unseen)} of {len(written.estimate)} parameters seen"
    of = ", ".join(case.id for case in found.cases)
    say(f"calibrated with {of}: {seen}.  parameters: {file}  page: {render_calibration(args.out)}")
    return 1 if found.left_out else 0


def _design(args: argparse.Namespace, cases: "tuple[Case, ...]", config: "Config", store: "Store") -> int:
    """Predict and say."""
    from pipeline.calibrate.unknowns import spread_in_words
    from pipeline.run.calibration import design
    from pipeline.run.calibration_files import write_design
    from reports.calibration import render_design

    rows, notes = design(cases, config, store)
    for note in notes:
        say(f"planned: {note}")
    for row in rows:
        verdict = "seen" if row.seen else "not seen"
        sd, enough = (spread_in_words(s, logarithmic=row.unknown.logarithmic) for s in (row.sd, row.unknown.enough))
        say(f"{row.unknown.name:20s} +- {sd:8s}  ({enough} or less counts as seen)  {verdict}")
    write_design(args.out / "design.json", cases[0].wire, rows, notes)
    say(f"page: {render_design(args.out)}")
    return 0
