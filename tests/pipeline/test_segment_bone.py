"""Bone or plaque at the wall is flagged with its place; a wire in the lumen and bone at a distance are not."""

from __future__ import annotations

import json

import numpy as np
import pytest

from pipeline.model import Volume
from pipeline.segment import segment
from tests.later import later
from tests.studies.seeing import render
from tests.studies.seeing.scenes import Draft

H = 0.3


def flags(vessels, wires=(), seed=0, noise=60.0, said="touches its wall"):
    """Warnings of bone for a vessel along z with more beside it: (axis, radius, level)."""
    rng = np.random.default_rng(seed)
    z = np.arange(0.0, 30.0, 0.05)
    axis = np.stack([0.0 * z, 0.0 * z, z], axis=1)
    lattice = render.Lattice((50, 50, 90), np.full(3, H), np.array([-7.0, -7.0, 1.5]))
    grey = 100.0 + 900.0 * np.max(
        [level * render.vessel(lattice, a, r) for a, r, level in [(axis, 1.8, 1.0), *vessels]], axis=0
    )
    for curve in wires:
        grey = grey + render.METAL * render.wire(lattice, curve, 0.2)
    lumen = segment(Volume(render.noisy(grey, noise, rng), lattice.spacing, lattice.origin), [[0.0, 0.0, 5.0]])
    return [text for text in lumen.warnings if said in text]


def lump(x, size, level):
    return np.stack([np.full(21, x), np.zeros(21), np.linspace(14.0, 16.0, 21)], axis=1), size, level


@pytest.mark.parametrize(("x", "size", "level"), [(4.2, 2.5, 1.6), (2.2, 1.2, 2.0)], ids=["bone", "plaque"])
def test_what_touches_the_wall_is_flagged_with_its_place(x, size, level):
    said = flags([lump(x, size, level)])
    assert len(said) == 1
    place = np.array(json.loads(said[0].split("largest at ")[1].split(" mm (")[0]))
    assert abs(place[2] - 15.0) < 1.5
    assert 0.5 < place[0] < 3.5


@pytest.mark.slow
def test_bone_at_a_distance_a_wire_and_a_plain_vessel_are_not():
    z = np.arange(2.0, 25.0, 0.05)
    wire = np.stack([1.2 * np.sin(0.2 * z), 1.2 * np.cos(0.2 * z), z], axis=1)
    assert flags([]) == []
    assert flags([lump(5.5, 2.5, 1.6)]) == []
    assert flags([], [wire]) == []
    scene = Draft(np.random.default_rng(3)).scan(16, reference=False)
    assert not any("touches its wall" in text for text in segment(scene.frame, scene.entry[None]).warnings)


@pytest.mark.quick(1)
@pytest.mark.parametrize("noise", [0.0, 110.0, *later(60.0)])
def test_bone_hardly_brighter_than_the_vessel_is_told_by_the_two_greys_of_its_depth(noise):
    wide = np.linspace(9.0, 21.0, 241)
    bone = np.stack([np.full(241, 4.3), np.zeros(241), wide], axis=1), 2.6, 1.15
    said = flags([bone], noise=noise, said="two greys")
    assert len(said) == 1
    assert "15 % brighter" in said[0] or "14 % brighter" in said[0]
    x, _, z = json.loads(said[0].split("rest, at ")[1].split(" mm")[0])
    assert 2.5 < x < 6.0
    assert 9.0 < z < 21.0


@pytest.mark.quick(1)
@pytest.mark.parametrize("noise", [0.0, 220.0, *later(60.0)])
def test_a_vessel_of_one_grey_has_one_around_a_wire_too(noise):
    z = np.arange(2.0, 25.0, 0.05)
    wire = np.stack([1.2 * np.sin(0.2 * z), 1.2 * np.cos(0.2 * z), z], axis=1)
    assert flags([], noise=noise, said="two greys") == []
    assert flags([], [wire], noise=noise, said="two greys") == []
