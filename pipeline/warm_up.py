"""Compile every kernel once by running a tiny study (``python -m pipeline.warm_up``); later runs load them.

The solver compiles in a process of its own beside the imaging kernels: on two cores that nearly halves the time.
"""

import contextlib
import io
import os
import subprocess
import sys
import tempfile
from time import perf_counter

from pipeline.cli import main
from solver.warm import no_collection

# with a third core the solver compiles in two processes; on two cores that would take 56 s instead of 46
SOLVER = f"from solver import warm_up; warm_up(beside={(os.cpu_count() or 1) > 2})"


def warm_up() -> float:
    """Compile all kernels; returns the seconds that it took. The tiny study and its output are thrown away."""
    clock = perf_counter()
    silent = io.StringIO()
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.redirect_stdout(silent),
        contextlib.redirect_stderr(silent),
        subprocess.Popen([sys.executable, "-c", SOLVER]) as solver,
        no_collection(),
    ):
        main(["synth", "bend", "-o", f"{folder}/study", "--frames", "2", "--size", "48"])
        run = ["run", f"{folder}/study/manifest.toml", "-o", f"{folder}/out", "--no-cache"]
        main([*run, "--until", "trace"])
        solver.wait()
        main(run)
    return perf_counter() - clock


if __name__ == "__main__":
    sys.stdout.write("compiling the kernels (once)...\n")
    sys.stdout.flush()
    sys.stdout.write(f"compiled in {warm_up():.0f} s\n")
