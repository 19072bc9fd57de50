"""``wireval bench [MANIFEST] -o OUT``: run time against error; --peers the rivals, --stress the stress study."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Callable, Sequence
from time import perf_counter

import pandas as pd

from pipeline.benchmark import outputs, scenes
from pipeline.benchmark.own_case import NoScene, scenes_of
from pipeline.benchmark.scenes import BenchScene
from pipeline.benchmark.stress.scene_run import Outcome
from pipeline.benchmark.study import SEGMENTS_MM, settings, study
from pipeline.commands.common import complain, say
from pipeline.load import LoadError
from pipeline.study.config import Config
from pipeline.study.manifest import ManifestError

QUICK_SEGMENTS_MM = (5.0, 2.0, 1.0, 0.5)
QUICK_SCENES = 200


def main(args: Namespace) -> int:
    """Exit 0; 1 where a claim or a stress scene failed; 2 on wrong input."""
    try:
        chosen = _scenes(args)
    except (ManifestError, NoScene, LoadError) as error:
        return complain(getattr(error, "problems", [str(error)]), str(args.manifest))
    args.out.mkdir(parents=True, exist_ok=True)
    say(f"machine: {outputs.machine()}")
    sound = True
    if args.stress:
        sound &= run_stress_study(args)
    if args.peers:
        run_peers(args)
    if not (args.stress or args.peers):
        run_study(args, chosen)
        if args.manifest is None:
            sound &= run_claims(args)
    say(f"report: {outputs.write_page(args.out)}")
    return 0 if sound else 1


def _scenes(args: Namespace) -> Sequence[BenchScene]:
    if args.stress or args.peers:
        return ()
    if args.manifest is not None:
        return scenes_of(args.manifest, Config())
    if args.quick:
        return (scenes.bend(), scenes.siphon())
    return (scenes.bend(), scenes.siphon(), scenes.willis(seed=args.seed), scenes.cantilever())


def run_study(args: Namespace, chosen: Sequence[BenchScene]) -> None:
    """Run time against error."""

    def tick(row: dict[str, object]) -> None:
        say(
            f"{row['scene']:18s} {row['method']:12s} {row['segment_mm']:5g} mm {row['hull']:11s} {row['quadrature']:9s}"
            f" {row['tolerance']:6g}  {row['ms_per_mm']:9.4f} ms/mm  shape {row['shape_error_mm']:.5f}"
            f"  tip {row['tip_error_mm']:.5f} mm  {row['iterations']:6.2f} it/mm  {row['status']}"
        )

    segments = QUICK_SEGMENTS_MM if args.quick else SEGMENTS_MM
    rows = study(chosen, settings(segments, quick=args.quick), 1 if args.quick else 3, tick=tick)
    rows.to_csv(args.out / outputs.SOLVER_CSV, index=False)
    for line in outputs.advice(rows):
        say(line)


def run_claims(args: Namespace) -> bool:
    """What the solver promises, measured; False where a promise is broken."""
    from pipeline.benchmark.claim import Claim
    from pipeline.benchmark.claims import claims

    def tick(claim: Claim) -> None:
        verdict = {None: "", True: "met", False: "NOT MET"}[claim.met]
        say(
            f"{claim.claim}: {claim.value:.4g} {claim.unit if claim.unit != '1' else ''} [{claim.aim}] {verdict}"
        )

    found = claims(tick=tick)
    outputs.write_claims(found, args.out)
    return all(claim.met is not False for claim in found)


def run_stress_study(args: Namespace) -> bool:
    """Thousands of random scenes; False where one ended otherwise than it may."""
    from pipeline.benchmark.stress import run_stress, stress_table
    from pipeline.benchmark.stress.study import SCENES

    count = args.scenes or (QUICK_SCENES if args.quick else SCENES)
    path = args.out / outputs.SCENES_CSV
    jobs = min(2, os.cpu_count() or 1)
    rows = run_stress(args.seed, range(count), jobs, tick=_progress(count), path=path)
    rows.to_csv(path, index=False)
    table = stress_table(rows)
    table.to_csv(args.out / outputs.STRESS_CSV, index=False)
    _say_table(table)
    faults = int((rows["fault"] != "").sum())
    say(f"{count - faults} of {count} scenes ended as they may (seed {args.seed}), {faults} did not")
    return faults == 0


def _progress(count: int) -> Callable[[Outcome], None]:
    """A line for every fault, and one for every 250 scenes with their rate."""
    done, began = iter(range(1, count + 1)), perf_counter()

    def tick(outcome: Outcome) -> None:
        number = next(done)
        if outcome.fault:
            say(f"scene {outcome.index}: {outcome.fault}: {outcome.detail}")
        if number % 250 == 0:
            rate = number / (perf_counter() - began)
            say(f"scene {outcome.index} of {count}: {number} run now, {rate:.3g} a second")

    return tick


def _say_table(table: pd.DataFrame) -> None:
    wide = table.pivot_table(index="axis", columns="outcome", values="count", fill_value=0, sort=False)
    say(wide.astype(int).to_string())
    whole = table[table["axis"] == "all"]
    say(whole.drop(columns="axis").to_string(index=False, float_format=lambda v: f"{v:.3g}"))


def run_peers(args: Namespace) -> None:
    """Rivals from PyPI on scenes A and B, and this solver in the same run."""
    from pipeline.benchmark.peers import run_peers as run
    from pipeline.benchmark.peers.table import sentences

    rows = run(quick=args.quick, say=say)
    rows.to_csv(args.out / outputs.PEERS_CSV, index=False)
    for line in sentences(rows):
        say(line)
