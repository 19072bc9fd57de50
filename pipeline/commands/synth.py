"""``wireval synth NAME -o DIR``: a study with truth, written as real files."""

from __future__ import annotations

import sys
from argparse import Namespace
from time import perf_counter

from pipeline.commands.common import complain, say
from pipeline.suggest import did_you_mean


def _progress(done: int, total: int) -> None:
    """One line per written frame, on stderr, so that stdout holds the result alone."""
    end = "\r" if sys.stderr.isatty() and done < total else "\n"
    sys.stderr.write(f"frame {done}/{total}{end}")
    sys.stderr.flush()


def main(args: Namespace) -> int:
    """Exit 0 when the study is written, 2 on wrong input."""
    from data_synthetic import catalogue
    from data_synthetic.write import write_study

    if args.list:
        for name in catalogue.names():
            say(f"{name:24s} {catalogue.describe(name).why}")
        return 0
    if args.name not in catalogue.names():
        problem = f"no scene {args.name!r}; {did_you_mean(str(args.name), catalogue.names())}"
        return complain([problem], "the command line")
    if args.out is None:
        return complain(["-o DIR is missing: where shall the study be written?"], "the command line")
    clock = perf_counter()
    wanted = {"frames": args.frames, "size": args.size, "voxel_mm": args.voxel_mm, "seed": args.seed}
    study = catalogue.build(args.name, **{k: v for k, v in wanted.items() if v is not None})
    manifest = write_study(study, args.out, format=args.format, progress=_progress)
    say(f"{args.name}: written in {perf_counter() - clock:.0f} s.  manifest: {manifest}")
    return 0
