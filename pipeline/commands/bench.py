"""``wireval bench [MANIFEST] -o OUT``: run time against error; --peers the rivals, --stress the stress study."""

from __future__ import annotations

import argparse
from pathlib import Path

HELP = "run time against error; rivals; a stress study"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    add = parser.add_argument
    own = "time the solver on your own cases instead"
    add("manifest", nargs="?", type=Path, metavar="MANIFEST", help=own)
    add("-o", "--out", type=Path, required=True, metavar="OUT", help="output folder")
    add("--peers", action="store_true", help="other simulators from PyPI on the same work (extra [peers])")
    add("--stress", action="store_true", help="thousands of random scenes, each outcome judged")
    add("--quick", action="store_true", help="few settings, one repeat, 200 stress scenes")
    add("--seed", type=int, default=100, metavar="S", help="of the random scenes (default 100)")
    add("--scenes", type=int, default=0, metavar="N", help="number of stress scenes (default 5000)")


def main(args: argparse.Namespace) -> int:
    """Exit 0; 1 where a claim or a stress scene failed; 2 on wrong input."""
    from pipeline.benchmark.command import main as bench

    return bench(args)
