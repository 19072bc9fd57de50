"""Studies that cannot be meant are refused, by name and with the smallest that can; those in use stay allowed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from data_synthetic import catalogue
from data_synthetic.catalogue import Wanted
from data_synthetic.catalogue.limits import largest_voxel, width_of_way
from data_synthetic.catalogue.study import scan_grid
from data_synthetic.geometry import arc_lengths
from tests.studies.catalogue import size_of


@pytest.mark.parametrize(
    ("wanted", "expected"),
    [
        (Wanted(frames=0), "frames: got 0; allowed: 1 or more"),
        (Wanted(frames=-2), "frames: got -2"),
        (Wanted(size=0), "size: got 0"),
        (Wanted(size=-8), "size: got -8"),
        (Wanted(voxel_mm=0.0), "voxel-mm: got 0; allowed: above 0"),
        (Wanted(voxel_mm=-0.3), "voxel-mm: got -0.3"),
        (Wanted(voxel_mm=float("nan")), "voxel-mm: got nan"),
        (Wanted(voxel_mm=float("inf")), "voxel-mm: got inf"),
        (Wanted(seed=-1), "seed: got -1; allowed: 0 or more"),
        (Wanted(size=10**6), "size: got 1000000; allowed: up to 1500"),
        (Wanted(size=10**4000), "size: got a number of more than 20 digits; allowed: up to 1500"),
        (Wanted(frames=10**4000), "frames: got a number of more than 20 digits; allowed: up to 10000"),
        (Wanted(seed=10**4000), "seed: got a number of more than 20 digits"),
    ],
)
def test_numbers_that_cannot_be_meant(wanted: Wanted, expected: str) -> None:
    for problems in (wanted.problems(), wanted.problems(catalogue.describe("bend"))):
        assert len(problems) == 1
        assert problems[0].startswith(expected)
    given = {"frames": wanted.frames, "size": wanted.size, "voxel_mm": wanted.voxel_mm, "seed": wanted.seed}
    with pytest.raises(ValueError, match=expected.split(";")[0]):
        catalogue.build("bend", **given)


def test_all_that_is_wrong_is_said_at_once() -> None:
    assert len(Wanted(frames=0, voxel_mm=-1.0, seed=-1).problems(catalogue.describe("bend"))) == 3


@pytest.mark.parametrize("name", catalogue.names())
def test_the_smallest_size_is_named_and_allowed(name: str) -> None:
    scene = catalogue.describe(name)
    (said,) = Wanted(size=3).problems(scene)
    smallest = int(said.split(f"allowed for {name}: ")[1].split()[0])
    assert Wanted(size=smallest).problems(scene) == []
    assert len(Wanted(size=smallest - 1).problems(scene)) == 1


@pytest.mark.quick(6)
@pytest.mark.parametrize("name", catalogue.names())
def test_natural_sizes_and_those_of_the_golden_tables_are_allowed(name: str) -> None:
    scene = catalogue.describe(name)
    for seed in range(8):
        assert Wanted(seed=seed).problems(scene) == []
        assert Wanted(size=size_of(scene), frames=3, seed=seed).problems(scene) == []


@pytest.mark.parametrize(
    ("name", "size"), [("bend", 48), ("bend", 96), ("oblique", 64), ("short-wire", 72), ("circle-of-willis", 256)]
)
def test_sizes_in_use_are_allowed(name: str, size: int) -> None:
    """Of the warm-up, the tests, the Makefile and README."""
    assert Wanted(size=size).problems(catalogue.describe(name)) == []


@pytest.mark.parametrize(("name", "size"), [("straight", 64), ("circle-of-willis", 64), ("siphon", 66)])
def test_sizes_that_cannot_be_segmented_or_traced_are_not(name: str, size: int) -> None:
    (said,) = Wanted(size=size).problems(catalogue.describe(name))
    assert said.startswith(f"size: got {size}, voxels of ")


def test_small_voxels_need_a_scan_that_holds_the_way() -> None:
    scene = catalogue.describe("helix")
    (said,) = Wanted(size=96, voxel_mm=0.2).problems(scene)
    assert said.startswith("size: got 96")
    assert "holds the wire's way" in said
    assert Wanted(size=96, voxel_mm=0.4).problems(scene) == []
    (said,) = Wanted(size=96, voxel_mm=1.0).problems(scene)
    assert said.startswith("voxel-mm: got 1; allowed for helix: up to 0.72")


@pytest.mark.parametrize("name", ["helix", "oblique", "siphon"])
def test_a_scan_as_wide_as_the_way_holds_it_and_no_narrower_one_does(name: str) -> None:
    setup = catalogue.describe(name).plan(np.random.default_rng(0), 2)
    way = setup.tube.points_mm[setup.ahead]
    way = way[arc_lengths(way) <= max(setup.depths_mm)]
    held = []
    for share in (1.02, 0.8):
        grid = scan_grid(setup, round(share * width_of_way(setup) / 0.1), 0.1)
        index = grid.to_index(way)
        held.append(bool(np.all((index > -0.5) & (index < np.array(grid.shape) - 0.5))))
    assert held == [True, False]


def test_bone_asks_for_voxels_that_a_wire_is_seen_in() -> None:
    scene = catalogue.describe("siphon")
    setup = scene.plan(np.random.default_rng(0), 2)
    with_bone, without = largest_voxel(scene, setup)[0], largest_voxel(scene, replace(setup, bone=None))[0]
    assert with_bone == pytest.approx(1.8 * 0.36)
    assert without > with_bone


def test_a_tree_from_a_file_is_measured_before_rolls_are_tried(tmp_path: Path) -> None:
    points = [{"position": [0.0, 0.0, float(z)]} for z in range(60)]
    radii = [{"name": "Radius", "controlPointValues": [1.5] * 60}]
    markup = {"coordinateSystem": "LPS", "controlPoints": points, "measurements": radii}
    (tmp_path / "a.mrk.json").write_text(json.dumps({"markups": [markup]}), encoding="utf-8")
    scene = replace(catalogue.from_anatomy(tmp_path / "a.mrk.json"), steer=None)
    assert Wanted(size=64).problems(scene) == []
    (said,) = Wanted(size=32).problems(scene)
    assert "for 2.5 voxels across a lumen of 3.0 mm" in said
