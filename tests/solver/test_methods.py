"""Newton, the seed's closed form and a slow oracle that shares no code reach the same minimum."""

from __future__ import annotations

import numpy as np
import pytest

from solver import GuideWire, Insertion, VesselWall, relax
from solver.relax import base_frame
from tests.later import later
from tests.naive import chain as naive
from tests.solver.scenes import Array, bend_grid, plane_grid

RADIUS, WALL = 0.3, 2.0
CURVED = [[0, 0.06], [6, 0.06], [6, 0.01]]


def oracle_minimum(wire: GuideWire, depth: float, load: Array, tilt: float, height: float) -> tuple[Array, float]:
    """Joints and energy of the oracle's minimum from the rest shape, in a plane wall."""
    k, first = wire.segments_at(depth)
    length = np.full(k, wire.segment_mm)
    length[0] = first
    cell = 0.5 * (length + np.concatenate([[0.0], length[:-1]]))
    edges = depth - np.concatenate([[0.0], np.cumsum(cell)])
    # EI is constant and the rest curvature piecewise constant: both integrals by a fine midpoint rule
    rest = np.zeros(k)
    for j in range(k):
        s = np.linspace(edges[j + 1], edges[j], 20001)
        middle = 0.5 * (s[1:] + s[:-1])
        rest[j] = np.mean(np.interp(middle, *np.array(CURVED).T)) * cell[j]
    stiffness = float(np.asarray(wire.bending_stiffness_N_mm2))
    twists = np.isfinite(wire.torsional_stiffness_N_mm2)
    twist = wire.torsional_stiffness_N_mm2 / cell if twists else np.zeros(k)
    base = base_frame(np.array([0.0, 0.0, 1.0]), [1, 0, 0], 25.0)

    def wall(p: Array) -> Array:
        return p[:, 2] * np.cos(tilt) + p[:, 0] * np.sin(tilt) - height

    def total(u: Array) -> float:
        return naive.energy(
            u, stiffness / cell, twist, rest, length, base, (0, 0, 0), wall, WALL, RADIUS, load
        )  # fmt: skip

    controls, energy = naive.minimum(k, 3 if twists else 2, total, np.zeros((k, 3)))
    return naive.joints_of(controls, rest, length, base, (0, 0, 0)), energy


@pytest.mark.parametrize(("depth", "torsion"), [(9.0, np.inf), (9.0, 3.0), (10.4, np.inf), *later((10.4, 3.0))])
def test_newton_meets_the_oracle(depth: float, torsion: float) -> None:
    wire = GuideWire(1.5, RADIUS, 4.0, CURVED, torsional_stiffness_N_mm2=torsion)
    k, _ = wire.segments_at(depth)
    load = np.zeros((k + 1, 3))
    load[-1] = [0.01, 0.02, 0.0]
    expected, energy = oracle_minimum(wire, depth, load, 0.5, 8.0)
    solution = relax(
        wire, VesselWall(plane_grid(8.0, 0.5), WALL), depth_mm=depth, material_axis=[1, 0, 0], roll_deg=25.0,
        load_N=load, quadrature="joints", tolerance=1e-13,
    )  # fmt: skip
    assert solution.converged
    assert solution.max_penetration_mm > 0.01, "the scene must touch the wall"
    assert solution.energy_N_mm == pytest.approx(energy, rel=1e-6)
    np.testing.assert_allclose(solution.joints_mm, expected, rtol=0.0, atol=1e-4)


@pytest.mark.parametrize("rest", [0.0, [[0, 0.05], [10, 0.05], [10, 0.0]]])
def test_both_methods_reach_the_same_minimum(rest: object) -> None:
    wall = VesselWall(bend_grid(), 0.2)
    wire = GuideWire(2.0, 0.18, 10.0, rest)  # type: ignore[arg-type]
    ways = [
        list(Insertion(wire, wall, [0, 0, 0], [0, 0, 1], method=m, tolerance=1e-9).to_depths(np.arange(2.0, 47.0, 2.0)))
        for m in ("newton", "closed_form")
    ]
    both = [way[-1] for way in ways]
    assert both[1].energy_N_mm == pytest.approx(both[0].energy_N_mm, rel=1e-8)
    np.testing.assert_allclose(both[1].joints_mm, both[0].joints_mm, rtol=0.0, atol=2e-3)
    assert sum(s.iterations for s in ways[1]) > 10 * sum(s.iterations for s in ways[0])


def test_printed_equation_10_goes_uphill_and_the_derived_one_down() -> None:
    """One segment, one joint on each side, a linear wall term; 200 random states (sign and factor as printed)."""
    rng = np.random.default_rng(0)
    length, uphill, downhill = 1.0, 0, 0
    for _ in range(200):
        before, here, ahead = (unit(rng.normal(size=3) * 0.3 + [0, 0, 1]) for _ in range(3))
        c0, c1 = rng.uniform(0.5, 2.0, size=2)
        pull = rng.normal(size=3) * 0.2

        def energy(
            t: Array, c0: float = c0, c1: float = c1, b: Array = before, n: Array = ahead, g: Array = pull
        ) -> float:
            return float(c0 * (1 - b @ t) + c1 * (1 - t @ n) + length * g @ t)

        across = np.eye(3) - np.outer(here, here)
        upsilon = across @ (c0 * before + c1 * ahead) / length
        rho = (c0 * before + c1 * ahead) @ here / length
        g_across, g_along = across @ pull, pull @ here
        derived = -(g_across - upsilon) * length / (rho - g_along)
        # as printed: a = |G - cΥ| λ / (2 G^P - c ρ), along β + π, Υ and ρ components of the two neighbours' sum
        bracket = g_across - upsilon
        printed = -bracket * length / (2 * g_along - rho)
        start = energy(here)
        downhill += energy(unit(here + derived / length)) < start
        uphill += energy(unit(here + 1e-3 * printed / length)) > start
    assert downhill == 200
    assert uphill > 190


def unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v))
