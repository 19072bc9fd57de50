"""The command line: argparse, never interactive; a command's imports happen inside it, so that --help is instant."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Sequence
from pathlib import Path

OK, BAD_INPUT, INTERRUPTED = 0, 2, 130


def _run_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "manifest", type=Path, metavar="MANIFEST", help="manifest.toml, or a folder of scans (one case)"
    )
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="OUT", help="output folder")
    _settings_arguments(parser)
    parser.add_argument("-j", "--jobs", type=int, default=1, metavar="N", help="cases at once (default 1)")
    parser.add_argument(
        "--shard", metavar="I/N", help="only the I-th of N parts of the cases; merge with cp -r"
    )
    parser.add_argument(
        "--only", action="append", default=[], metavar="ID", help="only this case; may be repeated"
    )
    parser.add_argument(
        "--until", default="report", metavar="STAGE", help="load, segment, trace, simulate, compare"
    )
    parser.add_argument(
        "--executor", default="", metavar="ADDRESS", help="tcp://host:port of a dask scheduler"
    )
    parser.add_argument(
        "--resume", action="store_true", help="go on in an OUT made from another manifest or settings"
    )
    parser.add_argument("--fresh", action="store_true", help="compute every case again")
    parser.add_argument("--dry-run", action="store_true", help="say what would be done, and do nothing")
    parser.add_argument(
        "--sweep",
        action="append",
        default=[],
        metavar="TABLE.KEY=V1,V2",
        help="also run with each of these values",
    )
    parser.add_argument(
        "--junit", type=Path, metavar="FILE", help="write a JUnit summary, one test per frame"
    )
    parser.add_argument(
        "--embed", action="store_true", help="put the pictures into the pages: one file a page"
    )
    parser.add_argument("--no-cache", action="store_true", help="neither read nor write the stage store")
    folder = parser.add_argument_group("where MANIFEST is a folder of scans")
    folder.add_argument("--entry", metavar="X,Y,Z", help="LPS mm, where the wire enters the lumen")
    folder.add_argument("--direction", metavar="X,Y,Z", help="where the wire points at the entry")
    folder.add_argument("--wire-radius", type=float, metavar="MM", help="outer radius of the wire")


def _settings_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-c", "--config", type=Path, action="append", default=[], metavar="CFG", help="settings (TOML)"
    )
    parser.add_argument(
        "--set", action="append", default=[], dest="settings", metavar="TABLE.KEY=VALUE", help="one setting"
    )


def _check_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("manifest", type=Path, metavar="MANIFEST")
    _settings_arguments(parser)


def _report_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("out", type=Path, metavar="OUT")
    parser.add_argument(
        "--embed", action="store_true", help="put the pictures into the pages: one file a page"
    )


def _diff_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("first", type=Path, metavar="OUT_A", help="the baseline")
    parser.add_argument("second", type=Path, metavar="OUT_B", help="the candidate")
    parser.add_argument(
        "--tolerance", type=Path, metavar="T", help="TOML, column = allowed increase; a default ships"
    )


def _synth_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", nargs="?", metavar="NAME", help="a scene of the catalogue; --list names them")
    parser.add_argument("-o", "--out", type=Path, metavar="DIR")
    parser.add_argument("--list", action="store_true", help="name the scenes, each with its reason")
    parser.add_argument(
        "--anatomy", type=Path, metavar="FILE", help="vessel tree, .swc or .mrk.json with radii"
    )
    parser.add_argument("--background", type=Path, metavar="VOLUME", help="paint a wire into this real scan")
    parser.add_argument("--format", default="mha", choices=("mha", "nrrd", "nii.gz", "dicom", "h5"))
    parser.add_argument("--frames", type=int, metavar="N")
    parser.add_argument("--size", type=int, metavar="N", help="voxels along each axis")
    parser.add_argument("--voxel-mm", type=float, metavar="V")
    parser.add_argument("--seed", type=int, default=0, metavar="S")
    parser.add_argument("--scanner", default="psf", choices=("psf", "conebeam"))


def _cache_arguments(parser: argparse.ArgumentParser) -> None:
    action = parser.add_mutually_exclusive_group(required=True)
    action.add_argument("--info", action="store_true", help="where the stage store lies and how large it is")
    action.add_argument("--prune", action="store_true", help="empty it")


def _bench_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "manifest", nargs="?", type=Path, metavar="MANIFEST", help="time the solver on your own cases instead"
    )
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="OUT", help="output folder")
    parser.add_argument(
        "--peers", action="store_true", help="other simulators from PyPI on the same work (extra [peers])"
    )
    parser.add_argument(
        "--stress", action="store_true", help="thousands of random scenes, each outcome judged"
    )
    parser.add_argument("--quick", action="store_true", help="few settings, one repeat, 200 stress scenes")
    parser.add_argument(
        "--seed", type=int, default=100, metavar="S", help="of the random scenes (default 100)"
    )
    parser.add_argument(
        "--scenes", type=int, default=0, metavar="N", help="number of stress scenes (default 5000)"
    )


COMMANDS = {
    "check": ("list every problem of a manifest at once; reads headers only", _check_arguments),
    "run": ("the whole pipeline: scans in, errors and a report out", _run_arguments),
    "report": ("rebuild tables, figures and pages from result files", _report_arguments),
    "diff": ("paired differences of two outputs; exit 1 on a regression", _diff_arguments),
    "synth": ("write a synthetic study with truth, as real files", _synth_arguments),
    "bench": ("run time against error; rivals; a stress study", _bench_arguments),
    "cache": ("the stage store", _cache_arguments),
}


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="wireval",
        description="Validate simulated guide wires against 3D scans.",
        epilog="Exit codes: 0 all ok; 1 some case failed or regressed; 2 input wrong, nothing run; 130 interrupted.",
    )
    parser.add_argument("--version", action="store_true", help="print the version")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    for name, (text, add_arguments) in COMMANDS.items():
        add_arguments(commands.add_parser(name, help=text, description=text))
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    parser = _parser()
    args = parser.parse_args(argv)
    if args.version:
        from pipeline.run.provenance import package_version

        print(f"wireval {package_version()}")
        return OK
    if not args.command:
        parser.print_help()
        return BAD_INPUT
    try:
        return int(importlib.import_module(f"pipeline.commands.{args.command}").main(args))
    except KeyboardInterrupt:
        print("\ninterrupted; what is finished is kept, the same command goes on from there", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # the reader of a pipe (head, less) has gone: not an error of ours
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return OK


if __name__ == "__main__":
    sys.exit(main())
