"""``python -m tests.fuzz --count 2000 --seed 1``: every input, and a table of how they ended."""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
from collections import Counter
from pathlib import Path

from pipeline.cli import main as wireval
from tests.fuzz.examples import EXAMPLES
from tests.fuzz.harness import Ending, Input, judged
from tests.fuzz.inputs import all_inputs

VERDICTS = (
    "well",
    "traceback",
    "crashed",
    "python",
    "code",
    "written",
    "died",
    "hang",
    "memory",
    "believed",
    "harness",
)


def base_study(folder: Path) -> Path:
    """A small sound study, run once so that everything is loaded."""
    study = folder / "base"
    made = wireval(["synth", "bifurcation", "-o", str(study), "--size", "56", "--frames", "1", "--seed", "7"])
    done = wireval(
        ["run", str(study / "manifest.toml"), "-o", str(folder / "warm"), "--no-cache", "--until", "compare"]
    )
    assert (made, done) == (0, 0)
    return study


def chosen(args: argparse.Namespace) -> list[Input]:
    """What is tried."""
    inputs = [i for i in all_inputs(args.seed, args.count) if args.only in (i.kind, "") or args.only in i.name]
    sample = dict.fromkeys(inputs[:: args.every])
    if args.examples:
        by_name = {(i.kind, i.name): i for i in inputs}
        sample |= dict.fromkeys(by_name[kind, name] for kind, names in EXAMPLES.items() for name in names)
    return list(sample)


def main() -> int:
    """Exit 1 where an input does not end well."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="of this kind alone, or with this in their names")
    parser.add_argument("--every", type=int, default=1, help="only every N-th")
    parser.add_argument("--examples", action="store_true", help="and those of tests/fuzz/examples.py")
    args = parser.parse_args()
    table: Counter[tuple[str, str]] = Counter()
    slowest, largest = Ending("well"), Ending("well")
    with tempfile.TemporaryDirectory() as place:
        base = base_study(Path(place))
        for given in chosen(args):
            ending = judged(given, base, Path(place) / "tried")
            table[given.kind, ending.verdict] += 1
            slowest = max(slowest, ending, key=lambda e: e.seconds)
            largest = max(largest, ending, key=lambda e: e.extra_bytes)
            if ending.verdict != "well":
                print(
                    f"{given.kind}: {given.name}: {ending.verdict}: {' '.join(ending.detail.split())[-700:]}",
                    flush=True,
                )
    print(f"{'':10s}" + "".join(f"{v:>10s}" for v in VERDICTS))
    for kind in dict.fromkeys(kind for kind, _ in table):
        print(f"{kind:10s}" + "".join(f"{table[kind, v]:10d}" for v in VERDICTS))
    print(
        f"{sum(table.values())} inputs, seed {args.seed}; slowest {slowest.seconds:.1f} s of wall time, most memory "
        f"{largest.extra_bytes / 2**20:.0f} MiB over {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f}"
    )
    return int(any(n for (_, verdict), n in table.items() if verdict != "well"))


if __name__ == "__main__":
    sys.exit(main())
