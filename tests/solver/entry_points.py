"""Ways from Python into kernels that have none of their own; kept on disk until a source behind them changes.

Where they can they take a wire's handle, and call what insertions have compiled for it: with the arrays themselves the
kernels would be compiled again, for other types, and unpacking these takes as long as that.
"""

from __future__ import annotations

from typing import Any

from solver._compile import on_disk
from solver._kernels import blocks, closed_form, forces, forks, minimise, newton, rollout, rotation, septum
from solver._kernels import free_body as beyond
from solver._kernels.flags import FAST
from solver._kernels.lanes import field as lane_field
from solver._kernels.lanes.vectors import in_lanes

entry_point = on_disk(**FAST)


@entry_point
def look_again(handle: Any, slot: int, k: int) -> None:
    minimise.look_again(handle.problem, slot, k)


@entry_point
def place(handle: Any, slot: int, k: int) -> None:
    rollout.place(handle.problem.chain, handle.problem.state, slot, k)


@entry_point
def iterate(handle: Any, k: int, now: Any, report: Any) -> int:
    return closed_form.iterate(handle.problem, k, now, 0.0, report)


@entry_point
def sweep(handle: Any, slot: int, k: int, damping: float, report: Any) -> bool:
    return newton.sweep(handle.problem, slot, 0, k, damping, report)


@entry_point
def through_wall(field: Any, x: Any, k: int, margin: float) -> bool:
    return septum.through_wall(field, x, k, margin)


@entry_point
def softest_way(handle: Any, k: int, report: Any) -> bool:
    return forks.softest_way(handle.problem, k, report)


@entry_point
def term_at(rung: int) -> float:
    return forks.term_at(rung)


@entry_point
def sine_terms(q: float) -> Any:
    return rotation.sine_terms(q)


@entry_point
def jacobian_terms(q: float, s: float, a: float) -> Any:
    return rotation.jacobian_terms(q, s, a)


@entry_point
def look_up_eight(field: Any, found: Any, distance_alone: bool) -> None:
    lanes = in_lanes(found)
    if distance_alone:
        lane_field.look_first(field, lanes)
    else:
        lane_field.look_up(field, lanes)


@entry_point
def least_curvature(q: Any, twisting: bool) -> float:
    return blocks.least_curvature(q, twisting)


@entry_point
def solve_stiffened(q: Any, more: float, twisting: bool) -> Any:
    return blocks.solve_block(blocks.stiffened(q, more), twisting)


@entry_point
def outside_by(field: Any, x: Any, k: int) -> float:
    return forces.furthest_outside(field, x, k)


@entry_point
def free_body(handle: Any, slot: int, cut: int, k: int) -> Any:
    return beyond.free_body(handle.problem, slot, cut, k, 0)


@entry_point
def work_on(handle: Any, cut: int, k: int, back: int) -> Any:
    return beyond.work_on(handle.problem, cut, k, back)
