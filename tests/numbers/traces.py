"""Lumens and wires of the tempting scenes (``tests.studies.seeing``, a renderer of its own), found or refused."""

from __future__ import annotations

from functools import partial

import numpy as np

from pipeline.model import Curve, Lumen
from pipeline.status import FrameStatus
from tests.numbers.kept import Numbers, Scene, digest
from tests.studies.seeing.known import FIRST
from tests.studies.seeing.scenes import CASES
from tests.studies.seeing.table import found

SEED = 7
RELATIVE = 1e-4
"""Single precision (6e-8) is summed over voxels there, and fits end where they change little."""
SLOW = ("0.9 mm wire, 0.1 mm voxels",)
"""As long as all others."""


def traced(name: str) -> Numbers:
    """The numbers of a case's scene."""
    _, lumen, curve = found(name, FIRST.get(name, SEED))
    return numbers_of(lumen, curve)


def numbers_of(lumen: Lumen, curve: Curve) -> Numbers:
    """The lumen of a scene, its wire, and all that was noticed on the way."""
    noticed = {**curve.levels, **{f"n_{name}": count for name, count in curve.counters.items()}}
    # a refused curve may hang on the last digit of a fit that did not end
    ok = curve.status is FrameStatus.OK
    return {
        "lumen": [*digest(lumen.distance.values), lumen.wall_level, len(lumen.warnings)],
        "status": [list(FrameStatus).index(curve.status), len(curve.points_mm) > 0],
        "wire": [*digest(curve.points_mm), curve.length_mm, curve.tip_sigma_mm] if ok else [0.0],
        "sigma": [*digest(curve.sigma_mm), float(np.count_nonzero(curve.flagged))] if ok else [0.0],
        "noticed": [noticed[key] for key in sorted(noticed)] if ok else [0.0],
    }


def word(name: str) -> str:
    """A case's name without what would end it in a file of kept numbers."""
    return "".join(letter if letter.isalnum() else "-" for letter in name)


SCENES: dict[str, Scene] = {word(name): partial(traced, name) for name in CASES if name not in SLOW}
ALONE = [word(name) for name in CASES if name not in (*SLOW, *FIRST)]
"""Those that ``tests.pipeline.test_seeing`` does not look at, where the others are compared."""
