"""What the benchmark measures with: its vessels, its random scenes, and its own statics."""

from __future__ import annotations

import numpy as np

from pipeline.benchmark import scenes, vessels
from pipeline.benchmark.insert import SolverSetting, insert
from pipeline.benchmark.reference import resampled, shape_error
from pipeline.benchmark.stress.axes import AXES, LUMENS, draw
from pipeline.benchmark.stress.lumens import NEAR, near_vessels
from pipeline.benchmark.stress.plan import entry, lumen_grid
from pipeline.benchmark.stress.scene_run import build
from pipeline.benchmark.stress.statics import assemble
from solver import GuideWire
from tests.numbers.kept import Numbers, Scene, digest
from tests.numbers.solver import HOOK, TAPER, bend


def distances() -> Numbers:
    """Each vessel at places in and around it."""
    points = np.random.default_rng(9).uniform((-4, -4, -6), (34, 6, 66), (60, 3))
    found = {
        "bend": vessels.bend_distance(points),
        "sheath": vessels.sheath_distance(points - [0.0, 0.0, 30.0], 0.3),
        "tube": vessels.bent_tube(points),
    }
    found |= {kind: vessels.lumen_distance(kind, 0.5 * points, 1.3) for kind in LUMENS}
    found |= {kind: near_vessels(kind, 0.5 * points, 1.3, 0.4) for kind in NEAR}
    return {name: digest(values) for name, values in found.items()}


def planned() -> Numbers:
    """Two random scenes for each axis of stress: wires, ways and entries; the walls of a few."""
    found = {}
    for index in range(2 * len(AXES)):
        p = draw(5, index)
        way = [*p.depths, *p.rolls, p.step_mm, p.segment_mm, p.joints, p.wall_stiffness, p.lumen_mm, p.septum_mm]
        wire = [*np.ravel(p.stiffness), *np.ravel(p.rest), *p.load_N, p.friction]
        found[f"scene{index}"] = [*way, *wire, *np.concatenate(entry(p))]
    # whole walls, noisy ones, and those with a value that is none
    walls = [lumen_grid(draw(5, index)) for index in (*range(4), 10, 13, 18, 26, 40, 43, 45, 48)]
    places = [[np.argmin(np.isfinite(w.values)), *w.origin_mm, *w.spacing_mm] for w in walls]
    return found | {"walls": [np.resize(digest(w.values), 4) for w in walls], "places": places}


def balanced() -> Numbers:
    """Energies and moments of a chain that is not at rest, by the second statics."""
    wire = GuideWire(1.0, 0.18, TAPER, HOOK, 0.7)
    chain = assemble(wire, bend(), 9.3, (0.01, 0.0, -0.02))
    angles = 0.15 * np.sin(np.arange(3.0 * len(chain.length))).reshape(-1, 3)
    nodes, frames = chain.roll_out(angles, np.zeros(3), np.eye(3))
    return {
        "chain": [*chain.bend, *chain.twist, *chain.rest],
        "nodes": nodes[-1],
        "energy": chain.energy(nodes, frames),
        "moments": [digest(part) for part in chain.moments(nodes, frames)],
    }


def inserted() -> Numbers:
    """The benchmark's own scenes: what is inserted into them, short."""
    found = {}
    for scene in (scenes.bend(40.0), scenes.cantilever()):
        run = insert(scene, SolverSetting(2.0, tolerance=1e-14))
        found[scene.name] = [*run.last.joints_mm[-1], run.last.energy_N_mm, run.steps, *run.arcs_mm[:2]]
    arcs = np.linspace(0.0, 8.0, 9)
    curve = np.column_stack([np.sin(arcs / 4.0), np.cos(arcs / 4.0), arcs])
    at = [resampled(curve, arcs, arcs[:-1] + 0.5, smooth=smooth) for smooth in (False, True)]
    return found | {"resampled": [digest(points) for points in at], "apart": shape_error(*at)}


def willis() -> Numbers:
    """The scenes that are taken of the catalogue."""
    found = {}
    for scene in (scenes.siphon(), scenes.willis(1)):
        wall = scene.wall(voxel_mm=1.2)
        assert wall is not None
        place = [*scene.entry_mm, *scene.direction, *np.ravel(scene.box), scene.depth_mm, *scene.depths()[:2]]
        found[scene.name] = [*place, *digest(wall.distance.values)]
    return found


def built() -> Numbers:
    """Wires of random scenes."""
    wires = [build(draw(5, index))[0] for index in range(3, 9)]
    return {"wires": [[w.segment_mm, *digest(w.profile.stiffness), *digest(w.profile.rest)] for w in wires]}


SCENES: dict[str, Scene] = {
    "distances": distances,
    "planned": planned,
    "balanced": balanced,
    "inserted": inserted,
    "willis": willis,
    "built": built,
}
