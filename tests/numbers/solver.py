"""Wires in small vessels: one scene for each thing that the solver can do, each a few millimetres long.

Relaxed to the end of double precision, so that the numbers are those of the rest shape, not of the way to it.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from solver import Catheter, GuideWire, Insertion, Insertions, Solution, VesselWall, relax
from tests.numbers.kept import Numbers, Scene
from tests.solver.scenes import Array, bend_distance, fork_distance, sampled

HOOK = [[0, 0.1], [4, 0.1], [4, 0.0]]
TAPER = [[0, 0.6], [6, 0.8], [20, 3.0]]
WIRE = GuideWire(1.0, 0.18, TAPER, HOOK)
EXACT: dict[str, Any] = {"tolerance": 1e-14}
CLAMP: tuple[Any, ...] = ([0.1, -0.2, 0.0], [0.05, 0.1, 1.0])


@cache
def bend() -> VesselWall:
    """A bend of 12 mm behind a short inlet."""
    distance = sampled(lambda p: bend_distance(p, radius=12.0, inlet=3.0, lumen=1.6), 0.75, (-4, -4, -4), (20, 4, 19))
    return VesselWall(distance, 2.0)


@cache
def fork() -> VesselWall:
    """A fork 8 mm behind the entry."""
    distance = sampled(lambda p: fork_distance(p, lumen=1.5, angle=0.5, fork=8.0), 0.75, (-10, -4, -4), (10, 4, 22))
    return VesselWall(distance, 5.0)


def numbers_of(solutions: list[Solution]) -> Numbers:
    """What a wire's last place is told by; of the places before, energy and tip alone."""
    last = solutions[-1]
    # below a hundredth of the energy it is the error of the trapezium rule, which rounding decides on with the steps
    lost = last.dissipated_N_mm if last.dissipated_N_mm > 0.01 * last.energy_N_mm else 0.0
    return {
        "status": [list(type(s.status)).index(s.status) for s in solutions],
        "energies": [s.energy_N_mm for s in solutions],
        "tips": [s.joints_mm[-1] for s in solutions],
        "joints": last.joints_mm[1:-1:3],
        "frame": last.frames[-1, :, :2],
        "parts": [last.bending_energy_N_mm, last.wall_energy_N_mm, last.friction_energy_N_mm],
        "contact": np.concatenate([last.contact_force_N.sum(axis=0), np.abs(last.contact_force_N).sum(axis=0)]),
        "reaction": [*last.reaction_force_N, last.push_force_N],
        "torque": last.reaction_torque_N_mm,
        "depth": [last.depth_mm, last.roll_deg, last.max_penetration_mm, last.largest_turn_deg],
        "pivot": last.least_pivot,
        "dissipated": lost,
        "snaps": [value for s in solutions for snap in s.snaps for value in snap[:2]],
        "uncertain": [s.uncertain for s in solutions],
    }


def inserted(
    wire: GuideWire = WIRE, wall: VesselWall | None = None, depths: tuple[float, ...] = (5.0, 13.4), **how: Any
) -> Numbers:
    """A wire pushed to some depths; roll_deg and catheter_mm belong to the way, other options to the insertion."""
    way = {name: how.pop(name) for name in ("roll_deg", "catheter_mm") if name in how}
    return numbers_of(list(Insertion(wire, wall or bend(), *CLAMP, **EXACT, **how).to_depths(list(depths), **way)))


def weighed() -> Numbers:
    """A free wire that sags, with a force at its tip."""
    wire = GuideWire(1.0, 0.18, TAPER, HOOK, weight_N_per_mm=2e-4)
    insertion = Insertion(wire, None, *CLAMP, **EXACT, down=[1.0, 1.0, 0.3], tip_load_N=[0.0, 2e-3, -1e-3])
    return numbers_of(list(insertion.to_depths([11.0], roll_deg=25.0)))


def laid() -> Numbers:
    """Relaxed from a bent start, with a force on each joint."""
    count, _ = WIRE.segments_at(9.3)
    load = 1e-3 * np.sin(np.arange(3.0 * count + 3.0)).reshape(-1, 3)
    start = np.array([[0, 0, 0], [0, 0.3, 3.0], [0.8, 0.2, 6.0], [2.0, 0, 9.0]])
    how: dict[str, Any] = {"load_N": load, "start_mm": start, "quadrature": "segments", "roll_deg": 40.0}
    return numbers_of([relax(WIRE, bend(), depth_mm=9.3, **how, **EXACT)])


def together() -> Numbers:
    """Ten wires in lock-step, no two alike: more than a team."""
    rng, made = np.random.default_rng(3), []
    for n in range(10):
        wire = GuideWire(1.0, 0.15 + 0.01 * n, [[0, 0.5], [12, 1.0 + 0.3 * n]], HOOK if n % 3 else 0.0)
        wall = bend().like(stiffness_N_mm2=0.5 + n)
        made.append(Insertion(wire, wall, 0.2 * rng.standard_normal(3), [0.02 * n, 0.1, 1.0], **EXACT))
    lasts = [ways[-1] for ways in Insertions(made, threads=1).to_depths([4.0, 9.7, 13.0], roll_deg=30.0)]
    return {
        "tips": [s.joints_mm[-1] for s in lasts],
        "energies": [s.energy_N_mm for s in lasts],
        "pushes": [s.push_force_N for s in lasts],
        "reactions": [s.reaction_force_N for s in lasts],
        "pivots": [s.least_pivot for s in lasts],
        "penetrations": [s.max_penetration_mm for s in lasts],
    }


def cut_short() -> Numbers:
    """Wires bent too far, stopped after the first steps: where these lead shows each derivative that rest hides."""
    start = np.array([[0, 0, 0], [0, 0.3, 3.0], [0.8, 0.2, 6.0], [2.0, 0, 9.0]])
    scenes: dict[str, tuple[GuideWire, VesselWall | None]] = {
        "hooked": (WIRE, bend()),
        "straight": (GuideWire(1.0, 0.2, TAPER), bend()),
        "twisting": (GuideWire(1.0, 0.18, TAPER, HOOK, 0.7), bend()),
        "fork": (WIRE, fork()),
        "rubbing": (WIRE, bend().like(friction=0.15)),
        "soft": (GuideWire(1.0, 0.18, 0.02, HOOK, 0.01), bend()),
        "free": (WIRE, None),
    }
    how: dict[str, Any] = {"depth_mm": 9.3, "start_mm": start, "roll_deg": 40.0, "load_N": [0.0, 0.01, -0.002]}
    return {
        f"{name}{count}": [s.energy_N_mm, *s.joints_mm[-1], *s.frames[-1, :, 0], s.iterations, *s.counts]
        for name, (wire, wall) in scenes.items()
        for count in (1, 2, 4)
        for s in [relax(wire, wall, **how, max_iterations=count)]
    }


def effort() -> Numbers:
    """What wires take to come to rest, as far as a run asks for it: steps, look-ups, and what was left out."""
    twisting, rubs = GuideWire(1.0, 0.18, TAPER, HOOK, 0.7), bend().like(friction=0.15)
    aside = [1.3, -0.2, 0.0], [0.3, 0.1, 1.0]
    ways: dict[str, tuple[Insertion, list[float], float]] = {
        "bend": (Insertion(WIRE, bend(), *CLAMP), [5.3, 11.2, 9.1], 0.0),
        "fork": (Insertion(WIRE, fork(), *CLAMP), [5.3, 11.2, 9.1], 0.0),
        "twisting": (Insertion(twisting, bend(), *CLAMP, shaft_mm=200.0), [5.3, 11.2, 9.1], 0.0),
        # steps of 0.1 mm: short, as they take seconds where nothing is compiled
        "rubbing": (Insertion(WIRE, rubs, *aside), [2.3, 5.1, 4.6], 0.0),
        "sheathed": (Insertion(WIRE, rubs, *aside, catheter=Catheter(8.0, 0.5)), [2.3, 5.1, 4.6], 2.2),
    }
    return {
        name: [[s.iterations, *s.counts] for s in way.to_depths(depths, [0.0, 15.0, 30.0], catheter_mm=catheter)]
        for name, (way, depths, catheter) in ways.items()
    }


def ringed(p: Array) -> Array:
    """A tube with a ring on its wall, on which a curved tip catches and turns back."""
    return np.asarray(np.hypot(p[..., 0], p[..., 1]) - 1.8 + 0.9 * np.exp(-(((p[..., 2] - 12.0) / 0.6) ** 2)))


def snapping() -> Numbers:
    """Caught on the ring until the wire buckles, the other way round where it would go on."""
    wall = VesselWall(sampled(ringed, 0.3, (-4, -4, -3), (4, 4, 34), "float32"), 3.0)
    wire = GuideWire(1.0, 0.18, [[0, 0.5], [15, 2.0]], [[0, 0.3], [6, 0.3], [6, 0.0]])
    insertion = Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0], **EXACT)
    return numbers_of(list(insertion.to_depths([10.0, 20.0, 28.0, 29.0, 30.0])))


def looked_up() -> Numbers:
    """The wall itself: its distance, gradient and Hessian at places in, at and beyond its grid."""
    points = np.random.default_rng(1).uniform((-6, -6, -6), (22, 6, 21), (12, 3))
    narrower = bend().shifted(0.05 * np.ones(bend().distance.shape))
    found = zip(("distance", "gradient", "hessian"), bend().look_up(points), strict=True)
    field = bend().field
    return dict(found) | {"narrower": narrower.look_up(points)[0], "field": [field.gap, field.slope, field.spacing]}


SCENES: dict[str, Scene] = {
    "bend": lambda: inserted(depths=(5.0, 9.2, 13.4), roll_deg=35.0),
    "pulled": lambda: inserted(depths=(12.0, 6.5), roll_deg=(50.0, -70.0)),
    "fork": lambda: inserted(wall=fork(), depths=(7.0, 14.3), roll_deg=20.0),
    "translated": lambda: inserted(initial="translate", step_mm=0.7, roll_deg=10.0),
    "closed_form": lambda: inserted(method="closed_form", quadrature="joints", depths=(6.0,)),
    "joints": lambda: inserted(quadrature="joints"),
    "segments": lambda: inserted(quadrature="segments"),
    "straight": lambda: inserted(GuideWire(1.0, 0.2, TAPER)),
    "sampled": lambda: inserted(wall=VesselWall(bend().distance, 2.0, hull="samples:5"), roll_deg=15.0),
    "rubbing": lambda: inserted(wall=bend().like(friction=0.15), depths=(8.0, 11.5, 9.0), roll_deg=20.0),
    "twisting": lambda: inserted(GuideWire(1.0, 0.18, TAPER, HOOK, 0.7), roll_deg=60.0, shaft_mm=200.0),
    "dragged": lambda: inserted(roll_deg=60.0, shaft_mm=300.0, shaft_friction_N=0.02),
    "twisted_by_friction": lambda: inserted(
        GuideWire(1.0, 0.18, TAPER, HOOK, 0.7), bend().like(friction=0.1), (9.0, 10.0), roll_deg=(10.0, 70.0)
    ),
    "sheathed": lambda: inserted(catheter=Catheter(8.0, 0.5), catheter_mm=(2.0, 7.3)),
    "weighed": weighed,
    "laid": laid,
    "snapping": snapping,
    "looked_up": looked_up,
    "together": together,
    "cut_short": cut_short,
    "effort": effort,
}
