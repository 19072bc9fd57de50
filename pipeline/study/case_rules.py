"""What the keys of a case must be to each other: the catheter to its wire, lists to the frames, borrowed clamps."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pipeline.model import OverWire
from pipeline.status import did_you_mean


def catheter_problems(catheter: OverWire, wire_radius_mm: float, depths_mm: Sequence[float]) -> Iterator[str]:
    """Why a catheter cannot be over the wire, a sentence each: it is wider, and the wire comes out of it.

    depths_mm : of the wire in each frame; empty where none are stated.
    """
    radius = catheter.radius_mm
    if radius <= wire_radius_mm:
        yield f"catheter radius_mm = {radius:g} is no more than the wire's {wire_radius_mm:g}; a catheter goes over it"
    tips = catheter.insertion_mm
    each = tips if isinstance(tips, tuple) else (tips,) * len(depths_mm)
    for frame, (tip, depth) in enumerate(zip(each, depths_mm, strict=False)):
        if tip > depth:
            what = f"catheter insertion_mm = {tip:g} of frame {frame} is deeper than the wire, {depth:g}"
            yield f"{what}; a wire whose tip lies inside the catheter is not modelled"


def borrowing_problems(cases: Mapping[str, tuple[str, bool]]) -> list[str]:
    """A sentence for each case whose clamp is to be taken from where there is none (``entry = "case:ID"``).

    Another insertion of the same fixation has the only blind clamp that scans give.

    cases : by id, the case's ``entry`` and whether it has frames.
    """
    problems = []
    for case, (entry, _) in cases.items():
        name, others = entry.removeprefix("case:"), [other for other in cases if other != case]
        if name and name not in cases:
            todo = did_you_mean(name, others) if others else "this is the only case: leave entry out"
            problems.append(f"case {case!r}: entry = {entry!r}: no such case; {todo}")
        elif name and (cases[name][0] or not cases[name][1]):
            what = "name one with frames of its own and no entry of another"
            problems.append(f"case {case!r}: entry = {entry!r} shows no clamp; {what}")
    return problems


def not_one_per_frame(lists: dict[str, Any], count: int) -> list[str]:
    """A sentence for each list that does not have one entry per frame; a single number and None stand for all."""
    return [
        f"{name} has {len(values)} entries for {count} frames; give one per frame"
        for name, values in lists.items()
        if isinstance(values, Sequence) and len(values) not in (0, count)
    ]
