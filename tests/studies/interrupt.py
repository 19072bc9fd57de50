"""Runs that are killed and resumed, against one that was not: ``make interrupt``.

Half of the runs are ended at a random time, half as soon as a random file of the output is there; by SIGINT, SIGTERM
or SIGKILL to the main process alone, or to every process of the terminal, as Ctrl-C sends it; with one worker, two, or
four with a helper each, with and without a stage store. Nobody prints a traceback. The same command again must leave
the tree of the run that was never interrupted, file by file, timing files apart.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from pipeline.cli import main as wireval
from pipeline.run import case
from tests.studies.trees import differences

SIGNALS = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGKILL: -9}
AFTER_S = 2.0


@dataclass(frozen=True)
class Trial:
    """How a run is ended.

    after_s : at a time, or once the file ``there`` is.     all_of_them : every process, not the main one alone.
    """

    number: int
    workers: int
    store: bool
    number_of_signal: int
    after_s: float
    there: str
    all_of_them: bool


def study(folder: Path) -> Path:
    """Two cases of two frames, and their manifest."""
    wireval(["synth", "bifurcation", "-o", str(folder), "--size", "64", "--frames", "2", "--seed", "7"])
    manifest = folder / "manifest.toml"
    text = manifest.read_text(encoding="utf-8")
    one = text[text.index("[[case]]") :]
    manifest.write_text(text + "\n" + one.replace('id = "bifurcation"', 'id = "second"'), encoding="utf-8")
    return manifest


def started(words: list[str], said: Path) -> int:
    """``wireval`` in a process of its own, in a session of its own; everything is imported already.

    said : the file that its stderr goes to.
    """
    process = os.fork()
    if process:
        return process
    os.setsid()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell has what it starts with & ignore it
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
    code = 99
    try:
        code = wireval(words)
    finally:
        os._exit(code)


def ended(process: int) -> int:
    """Wait for a process; its exit code, or minus the signal that ended it."""
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def parents() -> dict[int, int]:
    """The parent of every process that has not ended."""
    found = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
        except OSError:
            continue
        if fields[0] != "Z":
            found[int(path.parent.name)] = int(fields[1])
    return found


def workers_of(process: int) -> set[int]:
    """The workers of a run, children of the process that they are forked from, which is a child of the run's; and
    their helpers.
    """
    known = parents()
    found = {worker for worker, parent in known.items() if known.get(parent) == process}
    return found | {helper for helper, parent in known.items() if parent in found}


def outlived(workers: set[int]) -> float:
    """Seconds until none of these processes is left."""
    clock = time.monotonic()
    while workers & parents().keys() and time.monotonic() - clock < 60.0:
        time.sleep(0.02)
    return time.monotonic() - clock


def words_of(manifest: Path, out: Path, workers: int, store: bool) -> list[str]:
    words = ["run", str(manifest), "-o", str(out), "-j", str(workers), "--sweep", "simulate.wall_scale=2"]
    return words if store else [*words, "--no-cache"]


def is_due(trial: Trial, out: Path, seconds: float) -> bool:
    """Whether a run is to be ended now."""
    return (out / trial.there).exists() if trial.there else seconds > trial.after_s


def run_trial(trial: Trial, manifest: Path, root: Path, reference: Path) -> tuple[bool, str]:
    """Whether it went well, and a line on it."""
    out = root / "out"
    shutil.rmtree(out, ignore_errors=True)
    os.environ["WIREVAL_CACHE"] = str(root / "store")
    shutil.rmtree(root / "store", ignore_errors=True)
    words = words_of(manifest, out, trial.workers, trial.store)
    said = root / "stderr"
    process, clock = started(words, said), time.monotonic()
    while not is_due(trial, out, time.monotonic() - clock):
        if os.waitid(os.P_PID, process, os.WEXITED | os.WNOHANG | os.WNOWAIT):
            break
        time.sleep(0.002)
    workers = workers_of(process)
    (os.killpg if trial.all_of_them else os.kill)(process, trial.number_of_signal)
    code, left_s = ended(process), outlived(workers)
    state = hashlib.sha256("".join(sorted(str(p) for p in out.rglob("*"))).encode()).hexdigest()[:6]
    # a signal that comes when all is written finds nothing to interrupt
    as_said = code == SIGNALS[signal.Signals(trial.number_of_signal)] or not differences(reference, out)
    traced_back = b"Traceback" in said.read_bytes()
    again = ended(started(words, said))
    wrong = differences(reference, out)
    good = as_said and again == 0 and not wrong and left_s < AFTER_S and not traced_back
    how = (
        "all " * trial.all_of_them
        + f"{signal.Signals(trial.number_of_signal).name} "
        + (trial.there or f"after {trial.after_s:.2f} s")
    )
    line = f"{trial.number:3d}  -j {trial.workers}  {how:55s} exit {code:4d}  "
    line += f"{len(workers)} workers gone after {left_s:.2f} s  files {state}  "
    return good, line + ("equal" if good else f"WRONG: exit {again}, {wrong[:3]}" + ", traceback" * traced_back)


def trials(count: int, seed: int, files: list[str], lasts_s: dict[int, float]) -> list[Trial]:
    draw = random.Random(seed)
    return [
        Trial(
            number,
            workers := draw.choice((1, 2, 8)),
            draw.random() < 0.5,
            draw.choice(list(SIGNALS)),
            draw.uniform(0.0, lasts_s[workers]),
            draw.choice(files) if number % 2 else "",
            draw.random() < 0.5,
        )
        for number in range(count)
    ]


def main() -> int:
    """Print a line a trial; exit 0 where all are well."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=60)
    parser.add_argument("--seed", type=int, default=101)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        manifest = study(root / "study")
        case._kernels_loaded()
        reference, lasts_s = root / "reference", {}
        for workers in (8, 2, 1):
            shutil.rmtree(reference, ignore_errors=True)
            clock = time.monotonic()
            if ended(started(words_of(manifest, reference, workers, store=False), root / "stderr")):
                return 1
            lasts_s[workers] = time.monotonic() - clock
        # the path of the output stands in no file
        files = sorted(p.relative_to(reference).as_posix() for p in reference.rglob("*") if p.is_file())
        good = 0
        for trial in trials(given.trials, given.seed, files, lasts_s):
            fine, line = run_trial(trial, manifest, root, reference)
            good += fine
            print(line, flush=True)
        print(f"{good} of {given.trials} equal to the run that was not interrupted (seed {given.seed})")
    return 0 if good == given.trials else 1


if __name__ == "__main__":
    sys.exit(main())
