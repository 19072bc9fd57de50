"""Wires of PyElastica in two scenes of the catalogue, by the rivals' own code: what `wireval score` is tried on.

Needs the extra [peers], and a run of the study: its clamp and depths are those that any simulator is to be given.
    python -m tests.studies.peer_curves STUDY/manifest.toml OUT_OF_RUN FOLDER [--straight]
writes FOLDER/wire_NNN.csv. --straight leaves the tip's rest curvature away: a simulator that lacks something.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from data_synthetic import catalogue
from pipeline.benchmark.peers import frame as peers
from pipeline.benchmark.peers.frame import Task
from pipeline.benchmark.peers.rivals import pyelastica
from pipeline.benchmark.scenes import BenchScene
from pipeline.model import Array, Wire
from pipeline.study.manifest import read_manifest

SEGMENT_MM, SHEATH_MM, STEP_MM, MARGIN_MM = 1.25, 0.2, 1.0, 3.0
REPRESENTATIVE_EI = 1.5


class InVessel(Task):
    """The work of a rival: a wire pushed into a vessel that stands upright at the origin."""

    scene_of: BenchScene

    @property
    def set_up(self) -> BenchScene:
        return self.scene_of


def upright(distance, entry: Array, axes: Array, depth_mm: float) -> BenchScene:
    """The vessel seen from the clamp: z along the entry, x along material axis 1; a tight sheath before it."""

    def seen(points: Array) -> Array:
        vessel = distance(points @ axes + entry)
        sheath = np.maximum(np.hypot(points[:, 0], points[:, 1]) - SHEATH_MM, points[:, 2] - 0.5)
        return np.where(points[:, 2] < 0.5, np.where(points[:, 2] < 0.0, sheath, np.minimum(vessel, sheath)), vessel)

    side = depth_mm + MARGIN_MM
    box = ((-side, -8.0, -depth_mm - MARGIN_MM), (side, 8.0, side))
    return BenchScene("in-vessel", depth_mm, wall_stiffness=2.0, distance=seen, box=box)


def profile(value, from_tip_mm: Array) -> Array:
    return np.full(len(from_tip_mm), float(value)) if np.isscalar(value) else np.interp(from_tip_mm, *np.array(value).T)


def rod_of(wire: Wire, scene: BenchScene, straight: bool) -> pyelastica.Wire:
    """The rival's wire with this taper and rest curvature; its rod bends about axis 2 towards axis 1."""
    peers.EI = pyelastica.EI = REPRESENTATIVE_EI
    peers.RADIUS_MM = pyelastica.RADIUS_MM = wire.radius_mm
    peers.MOMENT_MM4 = pyelastica.MOMENT_MM4 = 0.25 * np.pi * wire.radius_mm**4
    InVessel.scene_of = scene
    rival = pyelastica.Wire(InVessel("bend", round(scene.depth_mm / SEGMENT_MM)))
    count = rival.rod.n_elems - 1
    from_tip = rival.segment_mm * np.arange(count, 0, -1)
    stiffness = profile(wire.bending_stiffness_N_mm2, from_tip)
    for axis in (0, 1, 2):
        rival.rod.bend_matrix[axis, axis] = stiffness / (1.0 if axis < 2 else 1.3)
    if not straight:
        rival.rod.rest_kappa[1] = profile(wire.rest_curvature_per_mm, from_tip)
    return rival


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("manifest", type=Path)
    parser.add_argument("run", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--straight", action="store_true")
    args = parser.parse_args()
    (case,) = read_manifest(args.manifest).cases
    found = args.run / "cases" / case.id
    clamp = json.loads((found / "result.json").read_text(encoding="utf-8"))["entry"]
    depths = pd.read_csv(found / "errors.csv")["insertion_mm"].tolist()
    entry, direction = np.array(clamp["used_mm"]), np.array(clamp["used_direction"])
    first = np.array(case.material_axis) - np.dot(case.material_axis, direction) * direction
    first /= np.linalg.norm(first)
    axes = np.array([first, np.cross(direction, first), direction])
    anatomy = catalogue.describe(case.id).setup(np.random.default_rng(0), len(depths)).anatomy
    scene = upright(anatomy.distance, entry, axes, max(depths))
    rival = rod_of(case.wire, replace(scene, wall_stiffness=case.wall.stiffness_N_mm2), args.straight)
    args.folder.mkdir(parents=True, exist_ok=True)
    stops = sorted({*depths, *np.arange(STEP_MM, max(depths), STEP_MM)})
    for depth in stops:
        rival.push(depth)
        if depth in depths:
            points = rival.points() @ axes + entry
            path = args.folder / f"wire_{depths.index(depth):03d}.csv"
            np.savetxt(path, points, "%.4f", ",", header="x_mm,y_mm,z_mm", comments="")
            print(f"{depth:.2f} mm after {rival.steps} steps", flush=True)


if __name__ == "__main__":
    main()
