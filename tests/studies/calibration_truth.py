"""Studies for ``calibrate`` with truth by the independent rod: true insertions, and the files that show them.

No scans: a lumen as a closed surface of the analytic anatomy, and the true wires with noise drawn as traces have it.
The manifest states wire, walls, roll, friction and entry wrongly.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from skimage.measure import marching_cubes

from data_synthetic.anatomy import shapes
from data_synthetic.anatomy.tubes import Anatomy, Tube
from data_synthetic.anatomy.willis import WillisPlan, circle_of_willis
from data_synthetic.geometry import at_arc, ends_of, normal_to, rotate, unit
from data_synthetic.rod.replay import TrueFrame, TrueInsertion
from data_synthetic.rod.rod import Profile, TrueWire, edge_lengths
from data_synthetic.rod.truth import at_step, cached_replay
from reports.export import write_surface_vtp

Array = NDArray[np.float64]
NOMINAL = TrueWire()
STIFF, SOFT = 2.0, 0.03
TRACE_SIGMA_MM, TRACE_BELL_MM, TIP_SIGMA_MM = 0.02, 1.3, 0.06
"""As traces of 0.3 mm voxels are off (README): across, per axis; correlated over; at the tip."""
ENTRY_ERROR_MM, DIRECTION_ERROR_DEG, FORCE_SIGMA_N = 0.15, 2.0, 1e-3
FRICTION = 0.05


@dataclass(frozen=True)
class Physics:
    """What is true, relative to what the manifest states."""

    roll_deg: float
    rest: float
    taper: float
    soft: float
    stiff: float
    bending: float
    friction: float = FRICTION

    @staticmethod
    def drawn(seed: int) -> Physics:
        u = np.random.default_rng([seed, 14]).uniform(-1.0, 1.0, 6)
        roll, rest, taper, soft, stiff, bending = u
        factors = np.exp([0.25 * rest, 0.6 * taper, 0.6 * soft, 0.6 * stiff, 0.4 * bending])
        return Physics(25.0 * roll, *map(float, factors))

    @property
    def wire(self) -> TrueWire:
        """The shaft against the tip by ``taper``: the knots between follow in proportion on a logarithmic scale."""
        at, ei = np.array(NOMINAL.bending_N_mm2).T
        share = np.log(ei / ei[0]) / np.log(ei[-1] / ei[0])
        bending: Profile = tuple(zip(at.tolist(), (self.bending * ei * self.taper**share).tolist(), strict=True))
        curved: Profile = tuple((s, self.rest * value) for s, value in NOMINAL.rest_curvature_per_mm)
        return replace(NOMINAL, bending_N_mm2=bending, rest_curvature_per_mm=curved)


@dataclass(frozen=True, eq=False)
class Way:
    """An insertion: into which vessel, from where, how deep, at what stated roll, against which stated wall."""

    name: str
    role: str
    anatomy: Anatomy
    tube: Tube
    entry_arc_mm: float
    depths_mm: tuple[float, ...]
    roll_deg: float
    wall: float = STIFF

    @property
    def start(self) -> tuple[Array, Array]:
        i = round(self.entry_arc_mm / self.tube.step_mm)
        return np.array(self.tube.points_mm[i]), unit(np.array(self.tube.tangents[i]))


def _depths(first: float, last: float, count: int, back: float | None = None, fewer: int = 0) -> tuple[float, ...]:
    there = np.linspace(first, last, count)
    home = [] if back is None else np.linspace(last, back, fewer + 1)[1:]
    return tuple(np.round(np.concatenate([there, home]), 3).tolist())


def ways(seed: int) -> list[Way]:
    """Three insertions to calibrate with, six blind ones in two other anatomies."""
    rng = np.random.default_rng([seed, 15])
    helix, curve = shapes.helix(), shapes.s_curve()
    bend = shapes.bend(angle_deg=110.0, turn_mm=12.0)
    found = [
        Way("c-helix", "calibration", helix, helix.tubes[0], 4.0, _depths(10, 54, 9, 18, 5), 90.0),
        Way("c-bend", "calibration", bend, bend.tubes[0], 4.0, _depths(12, 44, 8, 18, 4), -40.0),
        Way("c-soft", "calibration", curve, curve.tubes[0], 4.0, _depths(12, 50, 20, 20, 9), 30.0, SOFT),
    ]
    siphon = circle_of_willis(rng, WillisPlan(aneurysm="none"))
    carotid = Anatomy((siphon.tube("right.ICA"),))
    fork = shapes.bifurcation()
    for number in range(3):
        turn, moved = rng.uniform(-45, 45, 2), rng.uniform(-0.5, 0.5)
        last = carotid.tubes[0].length_mm - 17.0 - 4.0 + moved
        found.append(
            Way(f"b-siphon-{number}", "validation", carotid, carotid.tubes[0], 17.0, _depths(10, last, 8), 95 + turn[0])
        )
        side = 180.0 * (number == 1)
        found.append(
            Way(
                f"b-fork-{number}",
                "validation",
                fork,
                fork.tubes[0],
                4.0,
                _depths(9, 30 + moved, 8),
                side + 0.5 * turn[1],
            )
        )
    return found


def truth(way: Way, physics: Physics, step_mm: float = 0.2) -> tuple[TrueFrame, ...]:
    """The true wires of an insertion; its push forces stand beside, see ``push_force``."""
    wall = way.wall * (physics.soft if way.wall == SOFT else physics.stiff) * physics.bending
    entry, direction = way.start
    axis = normal_to(np.array([1.0, 0.0, 0.0]), direction)
    insertion = TrueInsertion(physics.wire, way.anatomy, wall, entry, direction, axis, friction=physics.friction)
    rolls = [way.roll_deg + physics.roll_deg] * len(way.depths_mm)
    return cached_replay(at_step(insertion, step_mm), way.depths_mm, rolls)


def push_force(frame: TrueFrame, way: Way, physics: Physics, step_mm: float = 0.2) -> float:
    """The hand's force: the first edge's compression, less what the bend at the clamp takes off it, EI kappa^2 / 2."""
    edge = frame.points_mm[1] - frame.points_mm[0]
    length, rest = float(np.linalg.norm(edge)), float(edge_lengths(frame.depth_mm, step_mm)[0])
    wire, direction = physics.wire, way.start[1]
    angle = np.arctan2(np.linalg.norm(np.cross(direction, edge)), direction @ edge)
    at, ei = np.array(wire.bending_N_mm2).T
    stiffness = float(np.interp(frame.depth_mm, at, ei))
    return wire.axial_N * (1.0 - length / rest) - 0.5 * stiffness * float(angle / (0.5 * rest)) ** 2


def surface(anatomy: Anatomy, path: Path) -> None:
    """The analytic wall as a closed surface, vertices 0.25 mm apart."""
    tables, step = anatomy.tables, 0.25
    margin = tables.radii.max() + 1.0
    axes = [
        np.arange(a, b, step) for a, b in zip(tables.points.min(0) - margin, tables.points.max(0) + margin, strict=True)
    ]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = anatomy.distance(places.reshape(-1, 3)).reshape(places.shape[:3])
    points, triangles, *_ = marching_cubes(values, 0.0, spacing=(step,) * 3)
    write_surface_vtp(path, points.astype(float) + [axis[0] for axis in axes], triangles)


def traced(points: Array, rng: np.random.Generator) -> Array:
    """A true wire with a trace's noise, which is correlated along it, and a tip that is missed a little."""
    arc = ends_of(np.linalg.norm(np.diff(points, axis=0), axis=1))
    length = arc[-1] + rng.normal(0.0, TIP_SIGMA_MM)
    places = np.linspace(0.0, length, int(length / 0.25) + 2)
    reach = 30
    white = rng.normal(size=(len(places) + 2 * reach, 3))
    bell = np.exp(-((np.arange(-reach, reach + 1) * 0.25 / TRACE_BELL_MM) ** 2))
    bell /= np.sqrt(np.sum(bell**2))
    noise = np.stack([np.convolve(white[:, a], bell, "valid") for a in range(3)], axis=1)
    found = at_arc(np.minimum(places, arc[-1]), arc, points)
    beyond = np.maximum(places - arc[-1], 0.0)[:, None] * unit(points[-1] - points[-2])
    return np.asarray(found + beyond + TRACE_SIGMA_MM * noise)


def write_study(seed: int, folder: Path, *, forces: bool = False, blind: bool = True) -> Physics:
    """Write lumens, traces, truth and manifest.toml; what is true."""
    physics, rng, blocks = Physics.drawn(seed), np.random.default_rng([seed, 16]), []
    wire = {
        "radius_mm": NOMINAL.radius_mm,
        "bending_stiffness_N_mm2": NOMINAL.bending_N_mm2,
        "rest_curvature_per_mm": NOMINAL.rest_curvature_per_mm,
    }
    for way in (way for way in ways(seed) if blind or way.role == "calibration"):
        frames, below = truth(way, physics), folder / way.name
        (below / "traces").mkdir(parents=True, exist_ok=True)
        surface(way.anatomy, below / "lumen.vtp")
        for n, frame in enumerate(frames):
            points = traced(frame.points_mm, rng)
            header = "x_mm,y_mm,z_mm"
            np.savetxt(below / "traces" / f"{n:03d}.csv", points, delimiter=",", header=header, comments="", fmt="%.6f")
        record = [{"points_mm": f.points_mm.tolist(), "insertion_mm": f.depth_mm} for f in frames]
        (below / "truth.json").write_text(json.dumps({"frames": record}), encoding="utf-8")
        blocks.append(_case(way, physics, frames, rng, forces=forces and way.role == "calibration"))
    lines = ["schema = 1", "[wires.wire]", *(f"{k} = {json.dumps(v)}" for k, v in wire.items()), *blocks]
    (folder / "manifest.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return physics


def _case(way: Way, physics: Physics, frames: Sequence[TrueFrame], rng: np.random.Generator, *, forces: bool) -> str:
    """A case as its user would write it down, entry, direction, depths and all physics not quite right."""
    entry, direction = way.start
    offset = rng.normal(size=3)
    offset *= ENTRY_ERROR_MM / np.linalg.norm(offset)
    tilted = rotate(direction, normal_to(rng.normal(size=3), direction), np.radians(DIRECTION_ERROR_DEG))
    noise = rng.normal(0.0, FORCE_SIGMA_N, len(frames))
    push = [push_force(frame, way, physics) for frame in frames]
    case = {
        "id": way.name,
        "role": way.role,
        "lumen": f"{way.name}/lumen.vtp",
        "traces": f"{way.name}/traces/*.csv",
        "truth": f"{way.name}/truth.json",
        "wire": "wire",
        "entry_mm": (entry + offset).tolist(),
        "entry_direction": tilted.tolist(),
        "material_axis": normal_to(np.array([1.0, 0.0, 0.0]), direction).tolist(),
        "roll_deg": way.roll_deg,
        "roll_sigma_deg": 1.0,
        "insertion_mm": (np.array(way.depths_mm) - 0.4 + rng.normal(0.0, 0.2, len(frames))).round(3).tolist(),
    }
    case |= {"push_force_N": (push + noise).tolist()} if forces else {}
    lines = ["", "[[case]]", *(f"{key} = {json.dumps(value)}" for key, value in case.items())]
    return "\n".join([*lines, "[case.wall]", f"stiffness_N_mm2 = {way.wall}"])
