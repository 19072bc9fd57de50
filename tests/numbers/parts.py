"""The parts of the package whose numbers are kept, and how exactly they are compared."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from tests.numbers import benchmark, fits, imaging, pages, runs, sentences, solver, synthetic, traces
from tests.numbers.kept import Scene


class Part(NamedTuple):
    """Scenes, and how far a number may move, relative to the largest of its quantity."""

    scenes: Mapping[str, Scene]
    relative: float


PARTS = {
    # another processor fuses other products and sums: 1e-14, which a wire near a snap makes larger
    "solver": Part(solver.SCENES, 1e-6),
    "benchmark": Part(benchmark.SCENES, 1e-6),
    "synthetic": Part(synthetic.SCENES, 1e-6),
    # single precision (6e-8) is summed over voxels there, and fits end where they change little
    "imaging": Part(imaging.SCENES, 1e-4),
    # with eight members a budget's scores move by 2e-4 from one processor to another
    "runs": Part(runs.SCENES, 1e-3),
    "traces": Part(traces.SCENES, traces.RELATIVE),
    # the numbers of a sentence have two or three digits
    "sentences": Part(sentences.SCENES, 1e-4),
    # what hardly shows in the traces hangs on their last digits
    "fits": Part(fits.SCENES, 1e-3),
    # sizes and places are what they are set to, but for points of a convergence study that are rounding alone
    "pages": Part(pages.SCENES, 1e-5),
}
