"""With friction, do shorter steps lead elsewhere? ``python -m tests.studies.rubbing --seed 9``.

Random vessels of the stress study before anything in them is made extreme, with friction 0.1 and 0.3 in turn, every two
millimetres of depth: in the default's steps, which friction keeps to 0.1 mm, and in steps as long as others asked for,
against steps of 0.05 mm and rolls of 1 degree.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np

import solver.insertion
from pipeline.benchmark.snaps import SHORT_MM, apart_mm
from pipeline.benchmark.stress.axes import moderate
from pipeline.benchmark.stress.plan import entry
from pipeline.benchmark.stress.scene_run import build
from solver import Insertion, Solution

FRICTIONS = (0.1, 0.3)
OFF_MM = 0.03


def pushed(seed: int, index: int, step_mm: float) -> list[Solution]:
    """The wire of a scene every two millimetres, in steps of at most ``step_mm``."""
    plan = replace(moderate(np.random.default_rng([seed, index]), seed, index), friction=FRICTIONS[index % 2])
    wire, wall = build(plan)
    at, direction, axis = entry(plan)
    insertion = Insertion(wire, wall, at, direction, material_axis=axis, step_mm=step_mm, quadrature=plan.quadrature)
    return list(insertion.to_depths(np.arange(2.0, plan.length_mm, 2.0), roll_deg=plan.rolls[0]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=9)
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--steps", type=float, nargs="+", default=[1.0, 0.25, solver.insertion.RUBBING_STEP_MM])
    given = parser.parse_args()
    short = [pushed(given.seed, index, SHORT_MM) for index in range(given.scenes)]
    for longest in given.steps:
        solver.insertion.RUBBING_STEP_MM = longest
        clock = time.process_time()
        found = [pushed(given.seed, index, longest) for index in range(given.scenes)]
        took = time.process_time() - clock
        pairs = [pair for mine, true in zip(found, short, strict=True) for pair in zip(mine, true, strict=True)]
        rest = [(one, apart_mm(one, other)) for one, other in pairs if one.converged and other.converged]
        off = [mm for one, mm in rest if mm > OFF_MM and not one.uncertain]
        flagged = np.mean([one.uncertain for one, _ in rest])
        said = f"steps of {longest:g} mm: {len(off)} of {len(rest)} depths are over {OFF_MM} mm off and not uncertain, "
        said += f"the worst by {max(off, default=0.0):.2f} mm; uncertain {100 * flagged:.1f} %; "
        print(said + f"{len(pairs) - len(rest)} not at rest; {took:.1f} s", flush=True)


if __name__ == "__main__":
    main()
