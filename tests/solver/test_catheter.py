"""A catheter over the wire: series and parallel springs in closed form, energy and work; nothing where it is not."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from solver import Catheter, GuideWire, Insertion, Status, VesselWall
from tests.later import later
from tests.solver.scenes import Array, bend_grid, same_bits, tube_grid

TUBE = Catheter(60.0, 0.9)
HOOK = GuideWire(1.0, 0.18, [[0, 1.0], [30, 8.0]], [[0, 0.06], [12, 0.06], [12, 0.0]])


def free(wire: GuideWire, catheter: Catheter | None, **how: Any) -> Insertion:
    return Insertion(wire, None, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0], catheter=catheter, **how)


def in_bend(wire: GuideWire = HOOK, catheter: Catheter | None = TUBE, **how: Any) -> Insertion:
    wall = VesselWall(bend_grid(), 1.0)
    return Insertion(wire, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0], catheter=catheter, **how)


def deflection(length: float, covered: float, own: float, pair: float, force: float) -> float:
    """Tip of a cantilever, mm, by the unit load: F ∫ s²/EI ds, s from the tip."""
    edge = length - covered
    return force * (edge**3 / own + (length**3 - edge**3) / pair) / 3.0


@pytest.mark.parametrize("covered", [0.0, 3.3, 20.0, 39.9, 40.0])
def test_a_cantilever_with_a_jump_bends_as_its_two_parts_at_second_order(covered: float) -> None:
    force, errors = 1e-6, []
    for segment in (2.0, 1.0, 0.5):
        insertion = free(GuideWire(segment, 0.18, 4.0), TUBE, tip_load_N=[force, 0, 0], tolerance=1e-14)
        solution = list(insertion.to_depths([40.0], catheter_mm=covered))[-1]
        assert solution.converged
        errors.append(solution.joints_mm[-1, 0] / deflection(40.0, covered, 4.0, 64.0, force) - 1.0)
    assert abs(errors[-1]) < 1e-3
    assert abs(errors[-1]) < 0.6 * abs(errors[0])
    assert insertion.catheter_mm == covered


def test_a_hook_in_a_catheter_is_straightened_by_its_share() -> None:
    """No load: up to the catheter's tip an arc of κ EI/(EI + EIc), the wire's own beyond."""
    wire = GuideWire(0.25, 0.18, 6.0, 0.05)
    for covered in (0.0, 7.1, 20.0):
        solution = list(free(wire, Catheter(18.0, 0.5)).to_depths([20.0], catheter_mm=covered))[-1]
        turned = np.arctan2(solution.frames[-1, 0, 2], solution.frames[-1, 2, 2])
        # the last half segment has no joint
        edge = 20.0 - covered
        own, pair = max(edge - 0.125, 0.0), covered - max(0.125 - edge, 0.0)
        assert turned == pytest.approx(0.05 * own + 0.05 * 6.0 / 24.0 * pair, rel=1e-9)
        stored = 0.5 * 6.0 * 18.0 / 24.0 * 0.05**2 * covered
        assert solution.energy_N_mm == pytest.approx(stored, rel=1e-9, abs=1e-15)
        assert solution.bending_energy_N_mm == solution.energy_N_mm


def test_stiffness_that_rises_along_a_curved_tip() -> None:
    """Rest bend of the pair: ∫ κ EI/(EI + EIc) ds, added up in 1e5 pieces."""
    wire = GuideWire(0.5, 0.18, [[0, 1.0], [10, 30.0]], [[0, 0.1], [10, 0.02]])
    solution = list(free(wire, Catheter(10.0, 0.5)).to_depths([10.0], catheter_mm=10.0))[-1]
    s = np.linspace(0.25, 10.0, 100_001)
    own, rest = np.interp(s, [0, 10], [1, 30]), np.interp(s, [0, 10], [0.1, 0.02])
    turned = np.arctan2(solution.frames[-1, 0, 2], solution.frames[-1, 2, 2])
    assert turned == pytest.approx(np.trapezoid(rest * own / (own + 10.0), s), rel=1e-3)


@pytest.mark.parametrize("rise", [0.0, 0.01, 4.0])
@pytest.mark.parametrize("end", [0.0, -0.15, 0.15], ids=["fading", "turning over", "constant"])
def test_a_rest_curvature_that_changes_along_the_wire_is_stored_whole(rise: float, end: float) -> None:
    """No load: the pair holds ∫ ½ EI EIc / (EI + EIc) κ² ds of the covered length, the hand the difference of its ends.

    With a constant EI what is stored went straight between the ends of the stretch: 1.5 to 6 times the energy.
    """
    wire = GuideWire(0.25, 0.18, [[0, 5.0], [20, 5.0 * (1 + rise)]], [[0, 0.15], [20, end], [20, 0]])

    def stored(s: Array) -> Array:
        own = np.interp(s, [0, 20], [5.0, 5.0 * (1 + rise)])
        return 0.5 * own * 60.0 / (own + 60.0) * np.interp(s, [0, 20], [0.15, end]) ** 2

    line = np.linspace(0.0, 20.0, 401)
    for covered in (4.0, 9.0, 14.0):
        solution = list(free(wire, TUBE).to_depths([19.0], catheter_mm=covered))[-1]
        s = np.linspace(19.0 - covered, 19.0, 4001)
        # a parabola in 32 pieces lies h² f'' / 12 too high, at most h² f'' / 8; f'' with room for an EI that changes
        high = (20.0 / 32) ** 2 * float(np.abs(np.gradient(np.gradient(stored(line), line), line)).max())
        assert solution.energy_N_mm == pytest.approx(np.trapezoid(stored(s), s), rel=1e-6, abs=covered * high / 11)
        ends = stored(s[[0, -1]])
        assert solution.push_force_N == pytest.approx(float(ends[1] - ends[0]), rel=1e-3, abs=high / 8 + 1e-9)


def test_the_wire_in_a_bend_straightens_as_the_catheter_advances() -> None:
    """A soft wall gives way to the pair: it turns less, presses more and holds more energy the further it covers."""
    insertion = Insertion(GuideWire(1.0, 0.18, 2.0), VesselWall(bend_grid(), 0.02), [0, 0, 0], [0, 0, 1], catheter=TUBE)
    found = list(insertion.to_depths([60.0] * 5, catheter_mm=[0.0, 15.0, 30.0, 45.0, 58.0]))
    assert all(s.converged for s in found)
    bare, covered = (s.frames[:, :, 2] for s in (found[0], found[-1]))
    turned = [float(np.arccos(np.clip(np.sum(a[:-1] * a[1:], 1), -1, 1)).sum()) for a in (bare, covered)]
    assert turned[1] < 0.85 * turned[0]
    pressed = [float(np.linalg.norm(s.contact_force_N, axis=1).sum()) for s in found]
    assert pressed[-1] > 3.0 * pressed[0]
    # as far as the inlet is straight the catheter changes nothing
    assert np.all(np.diff([s.energy_N_mm for s in found[2:]]) > 0.0)


@pytest.mark.parametrize("method", ["newton", "closed_form"])
def test_a_catheter_without_stiffness_is_none(method: str) -> None:
    depths = np.arange(2.0, 41.0, 4.0)
    limp = in_bend(catheter=Catheter(0.0, 0.2), method=method, tolerance=1e-12)
    bare = in_bend(catheter=None, method=method, tolerance=1e-12)
    for a, b in zip(limp.to_depths(depths, 10.0, 0.7 * depths), bare.to_depths(depths, 10.0), strict=True):
        assert a.status is b.status
        # the same chain to rounding; where the iterations stop is another matter
        for one, other in zip(limp._work.problem.chain[:4], bare._work.problem.chain[:4], strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-15)
        np.testing.assert_allclose(a.joints_mm, b.joints_mm, rtol=0.0, atol=2e-6 if method == "newton" else 1e-4)
        assert a.push_force_N == pytest.approx(b.push_force_N, rel=1e-4, abs=1e-8)


def test_a_catheter_that_stays_outside_is_none() -> None:
    depths = np.arange(2.0, 61.0, 2.0)
    for a, b in zip(in_bend().to_depths(depths), in_bend(catheter=None).to_depths(depths), strict=True):
        np.testing.assert_array_equal(a.joints_mm, b.joints_mm)
        assert a.push_force_N == pytest.approx(b.push_force_N, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(("depth", "tip", "roll"), [(45.3, 20.2, 0.0), (45.3, 40.0, 60.0), (52.6, 51.0, -35.0)])
def test_push_force_is_the_slope_of_the_energy(depth: float, tip: float, roll: float) -> None:
    """Of the wire's hand, the catheter held; and together with the catheter's the work is the change of energy."""
    h = 1e-3
    insertion = in_bend(tolerance=1e-13, finest_mm=1.0)
    ways = [*np.arange(2.0, depth, 2.0), depth - h, depth, depth + h]
    tips = [*(tip * np.arange(2.0, depth, 2.0) / depth), tip, tip, tip]
    low, middle, high = list(insertion.to_depths(ways, roll, tips))[-3:]
    slope = (high.energy_N_mm - low.energy_N_mm) / (2 * h)
    assert middle.push_force_N == pytest.approx(slope, rel=1e-3, abs=1e-6)
    back, on = list(insertion.to_depths([depth, depth], roll, [tip - h, tip + h]))
    pull = (on.energy_N_mm - back.energy_N_mm) / (2 * h)
    assert float(insertion._work.place["pull"][0]) == pytest.approx(pull, rel=2e-3, abs=1e-6)


def test_work_of_both_hands_is_the_energy() -> None:
    """In and out and the catheter after the wire: what the steps miss is the trapezium rule's."""
    found = list(in_bend(finest_mm=1.0, step_mm=0.1).to_depths([20.0, 45.0, 45.0, 50.0], 0.0, [10.0, 10.0, 40.0, 20.0]))
    assert all(s.converged for s in found)
    for s in found:
        assert abs(s.dissipated_N_mm) < 1e-2 * max(x.energy_N_mm for x in found)
        assert not s.snaps


def test_a_long_way_of_the_catheter_is_taken_in_steps_that_do_not_matter() -> None:
    ways = []
    for step in (1.0, 0.2):
        insertion = in_bend(step_mm=step, tolerance=1e-13)
        found = list(insertion.to_depths([50.0, 50.0], 0.0, [0.0, 45.0]))
        assert all(s.converged for s in found)
        ways.append(found[-1])
    # the work of a depth shows that it was no single step
    assert ways[0].iterations > 45
    np.testing.assert_allclose(ways[0].joints_mm, ways[1].joints_mm, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize(("rest", "depth", "share"), [(0.2, 25.8, 0.525), (0.1, 24.8, 0.595)])
def test_a_joint_more_is_no_snap(rest: float, depth: float, share: float) -> None:
    """Where joints become more the one at the entry has no partner: a snap of 0.25 mm, and then uncertain depths."""
    wire = GuideWire(0.5, 0.18, [[0, 0.16], [15, 6.6]], [[0, rest], [8, rest], [8, 0]])
    insertion = Insertion(
        wire, VesselWall(bend_grid(), 9.0), [0, 0, 22], [0, 0, 1], material_axis=[1, 0, 0],
        catheter=Catheter(30.0, 0.4), step_mm=0.1,
    )  # fmt: skip
    depths = np.array([depth - 1.0, depth])
    assert not any(one.snaps or one.uncertain for one in insertion.to_depths(depths, catheter_mm=share * depths))


def test_branches_and_checkpoints() -> None:
    insertion = in_bend()
    list(insertion.to_depths([30.0], 0.0, 12.0))
    twins = [insertion, insertion.clone(), pickle.loads(pickle.dumps(insertion))]
    ends = [list(i.to_depths([40.0, 40.0, 36.0], 15.0, [20.0, 35.0, 0.0])) for i in twins]
    assert twins[2].catheter_mm == 0.0
    for others in ends[1:]:
        for a, b in zip(ends[0], others, strict=True):
            same_bits(a, b)


def _refusals() -> list[tuple[str, Any]]:
    return [
        ("catheter", lambda: in_bend(catheter=0.9)),
        ("bending_stiffness_N_mm2", lambda: Catheter(-1.0, 0.9)),
        ("bending_stiffness_N_mm2", lambda: Catheter("60", 0.9)),  # type: ignore[arg-type]
        ("radius_mm", lambda: Catheter(60.0, float("nan"))),
        ("more than the wire's", lambda: in_bend(catheter=Catheter(60.0, 0.18))),
        ("catheter_mm", lambda: in_bend().to_depths([10.0], 0.0, 10.5)),
        ("inside the catheter", lambda: in_bend().to_depths([10.0, 5.0], 0.0, [8.0, 8.0])),
        ("catheter_mm", lambda: in_bend().to_depths([10.0], 0.0, -1.0)),
        ("catheter_mm", lambda: in_bend().to_depths([10.0, 12.0], 0.0, [1.0])),
        ("catheter_mm", lambda: in_bend().to_depths([10.0], 0.0, "5")),  # type: ignore[arg-type]
        ("0 without a catheter", lambda: in_bend(catheter=None).to_depths([10.0], 0.0, 5.0)),
    ]


@pytest.mark.parametrize("number", range(11))
def test_what_cannot_be_is_refused_by_name(number: int) -> None:
    name, call = _refusals()[number]
    with pytest.raises(ValueError, match=name):
        call()


def test_a_depth_that_fails_keeps_wire_and_catheter_together() -> None:
    insertion = in_bend(max_iterations=1)
    found = list(insertion.to_depths([70.0], 0.0, 35.0))[-1]
    assert found.status is not Status.CONVERGED
    assert insertion.catheter_mm == pytest.approx(0.5 * insertion.depth_mm, abs=1e-9)
    joints: Array = np.asarray(found.joints_mm)
    assert np.all(np.isfinite(joints))


@pytest.mark.parametrize("hull", ["offset", "samples:8"])
@pytest.mark.parametrize("tip", [20.0, 49.0, *later(40.0)])
def test_the_wall_rubs_on_the_catheter_where_it_covers_the_wire(tip: float, hull: str) -> None:
    """A wire that lies on the bottom of a tube: μ w of the length beyond the tip to push it, that times r to turn it.

    The wall rubbed the wire through the catheter: a push of 0.0124 N where 1.5 mm lay bare, 0.00045 N.
    """
    weight, coefficient, radius = 1e-3, 0.3, 0.18
    wall = VesselWall(tube_grid(0.4), 20.0, friction=coefficient, hull=hull)
    wire, where = GuideWire(0.5, radius, 3.0, weight_N_per_mm=weight), ([0, -1.82, 0], [0, 0, 1])
    insertion = Insertion(wire, wall, *where, down=[0, -1, 0], catheter=Catheter(20.0, 0.9))
    *_, pushed = insertion.to_depths([50.0, 50.5], 0.0, tip)
    rubs = coefficient * weight * (50.5 - tip)
    assert pushed.converged
    assert pushed.push_force_N == pytest.approx(rubs, rel=0.03)
    if hull == "offset":
        # it rolls up the wall before it slides; a hull of eight points rolls over its edges, which takes more than rubs
        *_, turned = insertion.to_depths([50.5] * 2, [80.0, 160.0], tip)
        assert turned.converged
        assert turned.reaction_torque_N_mm == pytest.approx(rubs * radius, rel=0.05)
    # over the wire that lies still its catheter goes back and forth for nothing: the wire does not go with it
    moved = list(insertion.to_depths([50.5] * 2, insertion.roll_deg, [10.0, tip]))
    assert sum(s.friction_energy_N_mm for s in moved) < 1e-3 * coefficient * weight * 50.5 * (tip - 10.0)


@pytest.mark.parametrize("coefficient", [0.1, 0.3])
def test_what_a_catheter_covers_and_uncovers_keeps_the_books(coefficient: float) -> None:
    """In a bend, wire and catheter in and out, one over the other: the work of both hands is energy and friction."""
    wall = VesselWall(bend_grid(), 1.0, friction=coefficient)
    insertion = Insertion(HOOK, wall, [0, 0, 0], [0, 0, 1], material_axis=[1, 0, 0], catheter=Catheter(6.0, 0.9))
    depths, tips = [20.0, 45.0, 55.0, 55.0, 60.0, 60.0, 63.0, 40.0, 50.0], [10.0, 20, 20, 50, 50, 15, 15, 15, 49.5]
    found = list(insertion.to_depths(depths, 0.0, tips))
    assert all(s.converged for s in found)
    assert not any(s.snaps for s in found)
    lost, rubbed = (sum(getattr(s, name) for s in found) for name in ("dissipated_N_mm", "friction_energy_N_mm"))
    assert rubbed > 0.2 * coefficient * max(s.energy_N_mm for s in found)
    assert lost == pytest.approx(rubbed, rel=0.01)
