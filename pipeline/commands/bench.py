"""``wireval bench [MANIFEST] -o OUT``: run time against error; --peers the rivals, --stress the stress study."""

import argparse
from pathlib import Path

from pipeline.commands import complain, say
from pipeline.commands.given import file_of

HELP = "run time against error; rivals; a stress study"
MOST_SCENES = 10**6
"""Of a stress study, which takes weeks of a core for so many."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What may follow the verb."""
    add = parser.add_argument
    own = "time the solver on your own cases instead"
    add("manifest", nargs="?", type=Path, metavar="MANIFEST", help=own)
    add("-o", "--out", type=Path, required=True, metavar="OUT", help="output folder")
    add("--peers", action="store_true", help="other simulators from PyPI on the same work (extra [peers])")
    add("--stress", action="store_true", help="thousands of random scenes, each outcome judged")
    add("--snaps", action="store_true", help="200 random insertions against steps of 0.05 mm")
    add("--resolution", action="store_true", help="segments chosen by themselves against much shorter ones")
    add("--quick", action="store_true", help="few settings, one repeat, 200 stress scenes")
    add("--seed", type=int, default=100, metavar="S", help="of the random scenes (default 100)")
    add("--scenes", type=int, default=0, metavar="N", help="number of stress scenes (default 5000)")


def main(args: argparse.Namespace) -> int:
    """Exit 0; 1 where a claim or a stress scene failed; 2 on wrong input."""
    problems = _wrong(args)
    return complain(problems, "the command line") if problems else _measured(args)


def _measured(args: argparse.Namespace) -> int:
    """Measure, write and say; the exit code, as ``main``."""
    from pipeline.benchmark import page, scenes
    from pipeline.benchmark.claims import STUDIES, measure_claims
    from pipeline.benchmark.cost import measure_cost
    from pipeline.benchmark.friction import friction
    from pipeline.benchmark.own_case import NoScene, scene_of
    from pipeline.benchmark.peers.run import measure_peers
    from pipeline.benchmark.resolution import study_of_resolution
    from pipeline.benchmark.snaps import study_of_steps
    from pipeline.benchmark.stress.run import QUICK_SCENES, SCENES, measure_stress
    from pipeline.load import LoadError
    from pipeline.study.manifest import ManifestError, read_manifest
    from pipeline.study.settings import Config

    plain = not (args.stress or args.peers or args.snaps or args.resolution)
    random = {"snaps": study_of_steps, "resolution": study_of_resolution}
    studies = [make(args.seed, quick=args.quick) for name, make in random.items() if plain or getattr(args, name)]
    try:
        cases = read_manifest(file_of(args.manifest)).cases if plain and args.manifest is not None else []
        chosen = [scene_of(case, Config()) for case in cases]
    except (ManifestError, NoScene, LoadError) as error:
        return complain(getattr(error, "problems", [str(error)]), str(args.manifest))
    args.out.mkdir(parents=True, exist_ok=True)
    say(f"machine: {page.machine()}\n{_takes(args)}")
    sound = True
    if args.stress:
        count = args.scenes or (QUICK_SCENES if args.quick else SCENES)
        sound &= measure_stress(args.out, say, args.seed, count)
    if args.peers:
        measure_peers(args.out, say, quick=args.quick)
    if plain:
        if args.manifest is None:
            chosen = [scenes.bend(), scenes.siphon()]
            chosen += [] if args.quick else [scenes.willis(args.seed), scenes.cantilever()]
        measure_cost(chosen, args.out, say, quick=args.quick)
    if args.manifest is None and (plain or studies):
        sound &= measure_claims(args.out, say, [*STUDIES, friction, *studies] if plain else studies)
    say(f"report: {page.write_page(args.out)}")
    return 0 if sound else 1


def _takes(args: argparse.Namespace) -> str:
    """How long the measurements take, as far as it is known before."""
    if args.manifest is not None:
        return "this takes minutes for each case, with short segments most of all: a line for each setting that is done"
    slow = "" if args.quick else "; --quick is the shorter way"
    return f"this takes minutes, from five on with two free cores: a line for each measurement that is done{slow}"


def _wrong(args: argparse.Namespace) -> list[str]:
    """What of the command line cannot be carried out."""
    problems = [f"--seed {args.seed}: expected 0 or more"] * (args.seed < 0)
    if not 0 <= args.scenes <= MOST_SCENES:
        shown = args.scenes if abs(args.scenes) < MOST_SCENES**2 else "of more than 12 digits"
        problems.append(f"--scenes {shown}: expected 1 to {MOST_SCENES}, or leave it out")
    studies = [f"--{name}" for name in ("stress", "peers", "snaps", "resolution") if getattr(args, name)]
    if args.manifest is not None and studies:
        problems.append(f"{args.manifest}: {', '.join(studies)} make scenes of their own; leave the manifest out")
    return problems
