"""Compile every kernel once by running a tiny study (``python -m pipeline.warm_up``); later runs load them.

The solver compiles in two processes of its own beside the imaging kernels: the longest of the three takes a third of
the time of all.
"""

import contextlib
import io
import subprocess
import sys
import tempfile
from time import perf_counter

from pipeline.cli import main
from solver.warm import no_collection

SOLVER = "from solver import warm_up; warm_up(beside=True)"


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
