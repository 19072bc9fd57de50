"""Vessels, true wires and scans of the synthetic catalogue, small."""

from __future__ import annotations

from dataclasses import astuple
from functools import partial

import numpy as np

from data_synthetic import catalogue
from data_synthetic.anatomy.centrelines import Tree
from data_synthetic.anatomy.from_tree import way_through
from data_synthetic.anatomy.iso_wall import iso_wall
from data_synthetic.anatomy.tubes import Anatomy, sweep
from data_synthetic.anatomy.vessel_in_scan import find_vessel, find_way
from data_synthetic.anatomy.willis import WillisPlan, circle_of_willis
from data_synthetic.catalogue.painted_vessel import paint_vessel
from data_synthetic.catalogue.study import Study
from data_synthetic.geometry import ScanGrid
from data_synthetic.rod.replay import TrueInsertion, replay
from data_synthetic.rod.rod import TrueWire
from data_synthetic.scanner.coverage import lumen_coverage
from tests.numbers.kept import Numbers, Scene, digest

GRID = ScanGrid((34, 30, 60), np.array([0.6, 0.7, 0.6]), np.array([-10.0, -10.0, -18.0]), np.eye(3))
CUBE = ScanGrid((40, 40, 40), np.full(3, 1.0), np.zeros(3), np.eye(3))


def distances(anatomy: Anatomy) -> Numbers:
    """Distance and gradient at places about each tube, in it and beside it."""
    rng = np.random.default_rng(7)
    near = [
        t.points_mm[rng.integers(0, len(t.points_mm), 12)] + 2.0 * rng.standard_normal((12, 3)) for t in anatomy.tubes
    ]
    distance, gradient = anatomy.distance_and_gradient(np.concatenate(near))
    sizes = [[t.length_mm, t.step_mm, *digest(t.radii_mm)] for t in anatomy.tubes]
    return {"distance": digest(distance), "gradient": digest(gradient), "tubes": sizes}


def planned() -> Numbers:
    """What is planned of every scene of the catalogue, with its vessels, and how it is scanned."""
    found = {}
    for name in catalogue.names():
        scene = catalogue.describe(name)
        setup = scene.setup(np.random.default_rng([0, 1]), 3)
        place = [*setup.entry_mm, *setup.direction, *setup.material_axis, *setup.centre_mm]
        plan = [*setup.depths_mm, *setup.rolls_deg, setup.stiffness_N_mm2, setup.friction, len(setup.others)]
        shown = [] if setup.motion_mm is None else setup.motion_mm.ravel()
        scan = [scene.fov_mm, scene.size, scene.frames, scene.voxels_across, *setup.spacing_ratio]
        wires = [digest(points) + [radius] for points, radius in setup.others]
        wire = [setup.wire.radius_mm, setup.wire.bending_N_mm2, setup.wire.rest_curvature_per_mm]
        found[f"{name}-scanned"] = [*scan, *astuple(setup.greys), *np.ravel(wires), *np.hstack([*map(np.ravel, wire)])]
        if setup.bone is not None:
            bone = distances(setup.bone)
            found[f"{name}-bone"] = [*np.ravel(bone["distance"]), *np.ravel(bone["tubes"])]
        vessels = distances(setup.anatomy)
        found[name] = [*place, *plan, *shown, *np.ravel(vessels["distance"]), *np.ravel(vessels["gradient"])]
    return found


def built(study: Study) -> Numbers:
    """Scans, true wires and what is written down of them."""
    last, case = study.truth[-1], study.manifest["case"]
    return {
        "reference": digest(study.reference),
        "frames": [digest(scan) for scan in study.frames()],
        "truth": [digest(frame.points_mm) for frame in study.truth],
        "tip": last.points_mm[-3:],
        "contact": digest(last.contact_N),
        "anchor": digest(last.anchor_mm - last.points_mm),
        "case": [v for key in ("entry_mm", "entry_direction", "insertion_mm") for v in np.ravel(case.get(key, []))],
    }


def scanned(name: str, size: int = 60) -> Numbers:
    """Two frames of a scene on a coarse grid."""
    return built(catalogue.build(name, frames=2, size=size, truth_step_mm=0.8, seed=4))


def replayed(friction: float = 0.0) -> Numbers:
    """A true wire that is pushed, rolled and pulled along a curved tube."""
    z = np.linspace(0.0, 24.0, 25)
    tube = sweep("v", np.column_stack([0.02 * z**2, 1.0 * np.sin(z / 6.0), z]), 1.5 + 0.01 * z)
    wire = TrueWire()
    clamp = tube.points_mm[2] + [0.2, 0.1, 0.0], tube.tangents[2], np.array([1.0, 0.0, 0.0])
    insertion = TrueInsertion(wire, Anatomy((tube,)), 2.0, *clamp, step_mm=0.8, friction=friction)
    frames = list(replay(insertion, [5.0, 11.3, 9.0], [0.0, 12.0, 30.0]))
    found = {f"points{n}": [*frame.points_mm[-1], *digest(frame.points_mm)] for n, frame in enumerate(frames)}
    return found | {"contact": [digest(f.contact_N) for f in frames], "jump": [f.jump_mm for f in frames]}


def tree() -> Numbers:
    """The way through a tree with a branch."""
    z = np.arange(0.0, 30.0, 1.5)
    trunk = np.column_stack([3.0 * np.sin(z / 9.0), 0.01 * z**2, z])
    side = trunk[8] + np.outer(np.arange(1.0, 9.0), [1.0, 0.2, 0.6])
    points, radii = np.concatenate([trunk, side]), np.concatenate([2.2 - 0.03 * z, np.full(len(side), 1.1)])
    edges = [[n, n + 1] for n in range(len(z) - 1)] + [[8, len(z)]]
    edges += [[len(z) + n, len(z) + n + 1] for n in range(len(side) - 1)]
    return distances(way_through(Tree(points, radii, np.array(edges))))


def grown() -> Numbers:
    """The way through a trunk with many random branches, of which some lie too far away, and two parts apart."""
    rng, z = np.random.default_rng(11), np.arange(0.0, 60.0, 1.5)
    parts, radii = [np.column_stack([4.0 * np.sin(z / 9.0), 0.004 * z**2, z])], [np.linspace(3.6, 0.9, len(z))]
    edges = [[n, n + 1] for n in range(len(z) - 1)]
    for branch in range(26):
        points, first = np.concatenate(parts), sum(map(len, parts))
        start, count = int(rng.integers(len(points))), int(rng.integers(1, 25))
        away = rng.standard_normal(3)
        # both parts apart begin beside the tree
        begin = points[start] + (4.0 if branch > 23 else 0.0) * away
        parts.append(begin + np.outer(np.arange(1, count + 1), 1.5 * away / np.linalg.norm(away)))
        radii.append(rng.uniform(0.6, 1.4) * np.linspace(1.0, 0.8, count))
        edges += [[start, first]] * (branch < 24) + [[n, n + 1] for n in range(first, first + count - 1)]
    return distances(way_through(Tree(np.concatenate(parts), np.concatenate(radii), np.array(edges))))


def in_a_scan() -> Numbers:
    """A vessel that is found in a scan, one that is painted into it, and the wall of the first."""
    rng = np.random.default_rng(5)
    line = sweep("v", np.column_stack([np.linspace(-3, 3, 9), np.linspace(2, -2, 9), np.linspace(-20, 20, 9)]), 2.0)
    values = 1000.0 * lumen_coverage(Anatomy((line,)), GRID) + 20.0 * rng.standard_normal(GRID.shape)
    values = values.astype(np.float32)
    vessel = find_vessel(values, GRID)
    wall = iso_wall(values, GRID, vessel.threshold)
    places = line.points_mm[::6] + rng.uniform(-2.5, 2.5, (len(line.points_mm[::6]), 3))
    distance, gradient = wall.distance_and_gradient(places)
    way = find_way(vessel.voxels, GRID)
    painted, tube = paint_vessel((20.0 * rng.standard_normal(CUBE.shape)).astype(np.float32), CUBE)
    even = np.zeros(CUBE.shape, np.float32)
    even[:3, :3, :3] = 1000.0  # no noise, and too little to be its brightest part
    return {
        "found": [vessel.grey, vessel.background, vessel.voxels.sum()],
        "distance": distance,
        "gradient": digest(gradient),
        "way": [way.length_mm, *digest(way.points_mm), *digest(way.radii_mm)],
        "painted": [*digest(painted), tube.length_mm, *digest(tube.points_mm)],
        "painted_evenly": digest(paint_vessel(even, CUBE)[0]),
    }


def circle(aneurysm: str) -> Numbers:
    """The circle of Willis, with an aneurysm."""
    return distances(circle_of_willis(np.random.default_rng(2), WillisPlan(aneurysm=aneurysm)))


SCENES: dict[str, Scene] = {
    "planned": planned,
    "bend": lambda: scanned("bend"),
    "moved": lambda: scanned("moved-phantom"),
    "bone": lambda: scanned("bone-wall", 72),
    "replayed": replayed,
    "rubbing": partial(replayed, 0.2),
    "tree": tree,
    "grown": grown,
    "in_a_scan": in_a_scan,
    "circle_terminus": lambda: circle("terminus"),
    "circle_acoa": lambda: circle("acoa"),
    "circle_sidewall": lambda: circle("sidewall"),
}
