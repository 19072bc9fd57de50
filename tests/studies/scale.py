"""How a run scales: ``make scale``. Every figure is a ratio of times measured in turn in the same minutes.

One large case on two cores against one. Many small cases with a sweep on two workers against one, beside what a busy
loop gains from a second process; the same command again against the first time; what a case takes beside its stages;
memory from the first case to the last; the time until a worker answers.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path

from pipeline.cli import main as wireval
from pipeline.run import workers
from pipeline.run.log import TIMED
from reports.schema import TIMINGS
from reports.tables import read


def study(folder: Path, cases: int) -> Path:
    """So many cases of two frames each, all of the same scans."""
    said(["synth", "bifurcation", "-o", str(folder), "--size", "64", "--frames", "2", "--seed", "7"])
    text = (folder / "manifest.toml").read_text(encoding="utf-8")
    head, case = text.split("[[case]]")
    each = [case.replace('id = "bifurcation"', f'id = "case-{i:03d}"') for i in range(cases)]
    (folder / "manifest.toml").write_text(head + "".join(f"[[case]]{one}\n" for one in each), encoding="utf-8")
    return folder / "manifest.toml"


IMPORTED = (
    "pipeline.commands.run", "pipeline.commands.synth", workers.PRELOADED,
    "pipeline.run.aggregate", "pipeline.run.last_words", "pipeline.run.launch",
)  # fmt: skip
"""What a command imports before it begins."""


def start_s() -> float:
    """Seconds until a command has imported what it needs, which is done on one core."""
    clock = time.perf_counter()
    subprocess.run([sys.executable, "-c", f"import {', '.join(IMPORTED)}"], check=True)
    return time.perf_counter() - clock


def said(words: list[str]) -> float:
    """Seconds of a command, in a process of its own that has everything imported; its words are nobody's."""
    clock = time.perf_counter()
    process = os.fork()
    if not process:
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 1)
        os.dup2(null, 2)
        os._exit(wireval(words))
    if os.waitpid(process, 0)[1]:
        raise SystemExit(f"{words} failed")
    return time.perf_counter() - clock


def busy(seconds: float) -> int:
    """How far a loop counts in so much processor time."""
    count, end = 0, time.process_time() + seconds
    while time.process_time() < end:
        count += 1
    return count


def busy_s(processes: int) -> float:
    """Seconds that two loops of two processor seconds take, in one process or in two."""
    context, clock = get_context("fork"), time.perf_counter()
    each = [context.Process(target=busy, args=(4.0 / processes,)) for _ in range(processes)]
    for process in each:
        process.start()
    for process in each:
        process.join()
    return time.perf_counter() - clock


def nothing(_: int) -> None:
    """A job that takes no time."""


def worker_s() -> float:
    """Seconds until a new worker has done nothing, once the server that it is forked from is there."""
    workers._start_server()
    list(workers.in_processes([0], nothing, 1))
    clock = time.perf_counter()
    list(workers.in_processes([0], nothing, 1))
    return time.perf_counter() - clock


def one_case(root: Path, frames: int, size: int, pairs: int) -> tuple[list[float], list[float]]:
    """How much faster one case is on two cores than on one, and a busy loop in two processes, pair by pair."""
    words = ["synth", "circle-of-willis", "-o", str(root / "big"), "--frames", str(frames), "--size", str(size)]
    said([*words, "--seed", "101"])
    words = ["run", str(root / "big" / "manifest.toml"), "-o", str(root / "out"), "--no-cache", "--fresh", "-j"]
    gains, loops = [], []
    for _ in range(pairs):
        one, two = said([*words, "1"]), said([*words, "2"])
        gains.append(one / two)
        loops.append(busy_s(1) / busy_s(2))
    return gains, loops


def main() -> int:
    """Print a line a figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--points", type=int, default=6)
    parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--frames", type=int, default=30, help="of the one case")
    parser.add_argument("--size", type=int, default=256, help="of its scans, voxels")
    parser.add_argument("--one-case", action="store_true", help="that row alone")
    given = parser.parse_args()
    if os.environ.get("OMP_NUM_THREADS") != "1":
        # the command sets it before it imports anything; here everything is imported before the command
        raise SystemExit("set OMP_NUM_THREADS=1 first, or -j 1 has BLAS on several cores")
    for module in IMPORTED:
        import_module(module)
    with tempfile.TemporaryDirectory() as name:
        gains, loops = one_case(Path(name), given.frames, given.size, given.pairs)
    print(
        f"one case of {given.frames} frames of {given.size}^3, {given.pairs} pairs, -j 2 against -j 1: {spread(gains)}"
    )
    print(f"a busy loop in two processes: {spread(loops)}")
    print(f"the start of a command, which is not in these: {start_s():.1f} s", flush=True)
    if not given.one_case:
        many_cases(given)
    return 0


def many_cases(given: argparse.Namespace) -> None:
    """Many small ones, with a sweep."""
    values = ",".join(f"{0.5 + 0.25 * i:g}" for i in range(given.points))
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        words = ["run", str(study(root / "study", given.cases)), "--sweep", f"simulate.wall_scale={values}", "-o"]
        gains, loops, again, beside = [], [], [], []
        for _ in range(given.pairs):
            took = {}
            for count in (1, 2):
                os.environ["WIREVAL_CACHE"] = str(root / "store")
                for folder in ("store", "out"):
                    shutil.rmtree(root / folder, ignore_errors=True)
                took[count] = said([*words, str(root / "out"), "-j", str(count)])
                loops.append(busy_s(count))
                if count == 1:
                    times = read(root / "out" / TIMINGS.file, TIMINGS)
                    again.append(said([*words, str(root / "out")]) / took[1])
                    stages = sum(times[f"{s}_s"].sum() for s in TIMED)
                    beside.append(1.0 - stages / times["total_s"].sum())
            gains.append(took[1] / took[2])
        loop = [one / two for one, two in zip(loops[::2], loops[1::2], strict=True)]
        ratios = [gain / most for gain, most in zip(gains, loop, strict=True)]
        print(f"{given.cases} cases x {given.points} points, {given.pairs} pairs")
        print(f"two workers against one: {spread(gains)}; a busy loop: {spread(loop)}; ratio: {spread(ratios)}")
        print(f"the same command again, of the first time: {spread(again)}")
        print(f"of a case's time outside its stages, pages apart: {spread(beside)}")
        peaks = times["peak_memory_MiB"]
        print(f"peak memory after the first case {peaks.iloc[0]:.0f} MiB, after the last {peaks.iloc[-1]:.0f} MiB")
        print(f"a worker answers after {worker_s():.2f} s")


def spread(values: list[float]) -> str:
    return f"{statistics.median(values):.3f} ({min(values):.3f} to {max(values):.3f})"


if __name__ == "__main__":
    sys.exit(main())
