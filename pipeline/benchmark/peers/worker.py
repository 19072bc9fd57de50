"""``python -m pipeline.benchmark.peers.worker ADAPTER SCENE N STEPS_PER_MM``: one answer as a line of JSON."""

from __future__ import annotations

import importlib
import json
import math
import sys

from pipeline.benchmark.peers.common import STEPS_B


def main(argv: list[str]) -> None:
    """Answer on the last line of stdout."""
    adapter, scene, n, per_mm = argv[0], argv[1], int(argv[2]), int(argv[3])
    module = importlib.import_module(f"pipeline.benchmark.peers.{adapter}")
    if scene == "cantilever":
        module.cantilever(5)  # compile and load, on nobody's clock
        answer = module.cantilever(n)
    else:
        module.bend(6, STEPS_B, pushes=2)
        answer = module.bend(n, STEPS_B * per_mm)
    result = {
        "name": module.NAME,
        "package": module.PACKAGE,
        "note": answer.note,
        "points": answer.points_mm.tolist(),
        "seconds": answer.seconds.tolist(),
        "callback": None if math.isnan(answer.callback) else answer.callback,
        "energy": answer.energy,
        "status": answer.status,
    }
    sys.stdout.write("\n" + json.dumps(result) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
