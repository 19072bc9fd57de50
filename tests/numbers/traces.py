"""Lumens and wires of the tempting scenes (``tests.studies.seeing``, a renderer of its own), found or refused."""

from __future__ import annotations

from functools import partial

import numpy as np

from pipeline.segment import segment
from pipeline.status import FrameStatus
from pipeline.trace import trace
from tests.numbers.kept import Numbers, Scene, digest
from tests.studies.seeing.scenes import CASES

SEED = 7
SLOW = ("0.9 mm wire, 0.1 mm voxels",)
"""As long as all others."""


def traced(name: str) -> Numbers:
    """The lumen of a scene, its wire, and all that was noticed on the way."""
    scene = CASES[name](np.random.default_rng([SEED, list(CASES).index(name)]), SEED)
    radius = None if scene.reference else scene.wire_radius
    lumen = segment(scene.reference or scene.frame, scene.entry[None], wire_radius_mm=radius)
    curve = trace(scene.frame, lumen, scene.entry, scene.direction, reference=scene.reference, **scene.stated)
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


def _word(name: str) -> str:
    return "".join(letter if letter.isalnum() else "-" for letter in name)


SCENES: dict[str, Scene] = {_word(name): partial(traced, name) for name in CASES if name not in SLOW}
