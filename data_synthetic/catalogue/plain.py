"""Vessels that can be drawn on paper: what they should show is known beforehand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from data_synthetic.anatomy import shapes
from data_synthetic.anatomy.tubes import Anatomy
from data_synthetic.catalogue.scene import Scene, Setup, enter, spread
from data_synthetic.rod.wire import TrueWire

ENTRY_ARC_MM = 4.0
"""The entry lies this far inside the vessel's beginning, clear of its rounded end."""


def plain_setup(
    anatomy: Anatomy,
    frames: int,
    last_mm: float,
    *,
    roll_deg: float = 0.0,
    wire: TrueWire | None = None,
    first_mm: float = 8.0,
) -> Setup:
    """Enter the first tube, push to ``last_mm`` with one roll."""
    entry, direction = enter(anatomy.tubes[0], ENTRY_ARC_MM)
    points = np.concatenate([t.points_mm for t in anatomy.tubes])
    return Setup(
        anatomy,
        entry,
        direction,
        spread(first_mm, last_mm, frames),
        (roll_deg,) * frames,
        0.5 * (points.min(axis=0) + points.max(axis=0)),
        wire=wire or TrueWire(),
    )


def _straight(_rng: np.random.Generator, frames: int) -> Setup:
    return plain_setup(shapes.straight(), frames, 36.0)


def _bend(_rng: np.random.Generator, frames: int) -> Setup:
    return plain_setup(shapes.bend(), frames, 38.0)


def _s_curve(_rng: np.random.Generator, frames: int) -> Setup:
    return plain_setup(shapes.s_curve(), frames, 36.0)


def _helix(_rng: np.random.Generator, frames: int) -> Setup:
    return plain_setup(shapes.helix(), frames, 50.0, roll_deg=90.0)


def _fork_right(_rng: np.random.Generator, frames: int) -> Setup:
    return plain_setup(shapes.bifurcation(), frames, 30.0)


def _fork_left(_rng: np.random.Generator, frames: int) -> Setup:
    return plain_setup(shapes.bifurcation(), frames, 30.0, roll_deg=180.0)


def _rolled(_rng: np.random.Generator, frames: int) -> Setup:
    setup = plain_setup(shapes.bend(angle_deg=60.0), frames, 30.0, first_mm=20.0)
    return replace(setup, rolls_deg=spread(0.0, 150.0, frames))


def _short(_rng: np.random.Generator, frames: int) -> Setup:
    return plain_setup(shapes.straight(length_mm=20.0), frames, 4.0, first_mm=1.6)


def _stenosis(_rng: np.random.Generator, frames: int) -> Setup:
    return plain_setup(shapes.stenosed(), frames, 30.0)


def _neck(_rng: np.random.Generator, frames: int) -> Setup:
    # the hook points away from the neck: towards it, it would fall in
    return plain_setup(shapes.side_aneurysm(), frames, 36.0)


def _loop(_rng: np.random.Generator, frames: int) -> Setup:
    return plain_setup(shapes.end_aneurysm(), frames, 38.0, first_mm=14.0)


def _kissing(_rng: np.random.Generator, frames: int) -> Setup:
    return plain_setup(shapes.kissing(), frames, 36.0)


def _rough(rng: np.random.Generator, frames: int) -> Setup:
    return replace(_helix(rng, frames), friction=0.1)


PLAIN = (
    Scene("straight", "a curved tip in a straight vessel: contact without any turn", 57.6, 192, 6, _straight),
    Scene("bend", "one bend in one plane: bending and wall alone decide", 48.0, 160, 6, _bend),
    Scene("s-curve", "two opposite bends: the wire cuts both corners", 48.0, 160, 6, _s_curve),
    Scene("helix", "a curve that no plane holds: roll and torsion of the path matter", 48.0, 160, 6, _helix),
    Scene(
        "rough-wall",
        "the same helix with friction: the wire is left nearly a millimetre from where it would slide to",
        48.0,
        160,
        6,
        _rough,
    ),
    Scene("bifurcation", "the tip takes the branch that it points at", 48.0, 160, 6, _fork_right),
    Scene(
        "bifurcation-left", "the same fork, rolled by half a turn: the other branch", 48.0, 160, 6, _fork_left
    ),
    Scene(
        "rolled",
        "rolled by 150 degrees while it is pushed: the path of the roll is part of the truth",
        48.0,
        160,
        6,
        _rolled,
    ),
    Scene(
        "short-wire",
        "a wire shorter than three segments: nothing may need more joints than there are",
        36.0,
        120,
        4,
        _short,
    ),
    Scene(
        "stenosis", "a lumen hardly wider than the wire: the wall decides everything", 48.0, 160, 6, _stenosis
    ),
    Scene(
        "aneurysm-neck",
        "past the neck of a sidewall aneurysm: the wall gives way to one side",
        48.0,
        160,
        6,
        _neck,
    ),
    Scene(
        "aneurysm-loop",
        "pushed on into a wide sac: the wire curls and touches where it will",
        48.0,
        160,
        6,
        _loop,
    ),
    Scene(
        "kissing-vessels",
        "two vessels that share a wall in the image: the wire must stay in its own",
        48.0,
        160,
        6,
        _kissing,
    ),
)
