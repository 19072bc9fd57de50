"""Insertions into one phantom of which nobody says so: their wires lie in one place, or have one shape.

Without that the others' wires are no guess for one (``another``), and any simulator looks better than it is.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from pipeline.arrays.polyline import at_arc, samples
from pipeline.compare.metrics import point_to_curve, rms
from pipeline.model import Array, arc_length
from pipeline.run.overall import Found, phantoms_of
from pipeline.run.results import STATED
from pipeline.run.traced import traces_of
from reports.case_files import listed

SAME_ENTRY_MM = 2.0
"""Traces that begin farther apart count their depths from different places and are not compared."""
LEAST_MM = 20.0
"""Shorter wires lie alike wherever they enter: an introducer is straight."""
SAME_PLACE_MM, SAME_SHAPE_MM = 1.0, 0.5
"""Distance (rms) between two wires of one phantom, as they lie, and after the motion that lays one on the other: less
than a lumen of 2 mm leaves to a wire."""
BENT_MM = 2.0
"""Wires that lie nearer to a straight line have all one shape."""
STEP_MM = 1.0
PLACED = "lies where "
"""How the name of a phantom begins that is known by where its wires lie."""
MOST = 60
"""The most phantoms that are held against each other: 1,770 pairs take half a second."""


class Placed(NamedTuple):
    """The deepest wire (n, 3) traced in a phantom, the case that has it, and whether the phantom is named there."""

    wire_mm: Array
    case: str
    named: bool


def with_kin(out: Path, found: Sequence[Found]) -> list[Found]:
    """The cases, those whose wires lie where another one's do with a name for the phantom in common."""
    names: dict[str, list[str]] = {}
    for one, other in _strangers(out, found):
        if in_one_place(one.wire_mm, other.wire_mm):
            for case in (one.case, other.case):
                names.setdefault(case, []).append(f"{PLACED}{one.case} and {other.case} do")
    return [_named(case, (*case.result.names, *names.get(case.result.case, ()))) for case in found]


def _named(case: Found, names: Iterable[str]) -> Found:
    """The case with these names for its phantom."""
    return replace(case, result=replace(case.result, names=tuple(names)))


def told_of_kin(out: Path, found: Sequence[Found]) -> tuple[list[str], list[str]]:
    """Sentences on cases that were taken for one phantom's by where they lie, and doubts of those of one shape.

    found : of ``with_kin``.
    """
    alike = [pair for pair in _strangers(out, found) if of_one_shape(*(placed.wire_mm for placed in pair))]
    shaped = list(dict.fromkeys(placed.case for pair in alike for placed in pair))
    placed = [case.result.case for case in found if any(name.startswith(PLACED) for name in case.result.names)]
    taken = [
        f"the wires of cases {listed(placed)} lie in one place to within {SAME_PLACE_MM:g} mm: they are taken for "
        "insertions into one phantom, and are guesses for each other"
    ]
    doubt = [
        f"the wires of cases {listed(shaped)} have one shape and lie in other places: if they are in one phantom, "
        'put their scans in one place and state it (phantom = "A"), since each is a guess for the others; if not, '
        "state a name for each"
    ]
    bare = [_named(case, [name for name in case.result.names if not name.startswith(PLACED)]) for case in found]
    count = len(by_phantom(bare))
    left_out = [
        f"of {count} phantoms the first {MOST} alone were held against each other: whether wires of others lie in one "
        "place is not known; give cases into one phantom the same name for it (phantom)"
    ]
    return taken * bool(placed) + left_out * (count > MOST), doubt * bool(shaped)


def in_one_place(one: Array, other: Array) -> bool:
    """Whether two wires (n, 3), (m, 3) begin in one place and the shorter lies along the longer."""
    short, long = sorted((one, other), key=lambda wire: float(arc_length(wire)[-1]))
    if np.linalg.norm(short[0] - long[0]) > SAME_ENTRY_MM:
        return False
    return rms(point_to_curve(_points(short, np.inf), long)[0]) < SAME_PLACE_MM


def of_one_shape(one: Array, other: Array) -> bool:
    """Whether a motion lays one wire on the other (Kabsch 1976, doi 10.1107/S0567739476001873), from the entry on."""
    reach = min(float(arc_length(wire)[-1]) for wire in (one, other))
    a, b = (points - points.mean(axis=0) for points in (_points(wire, reach) for wire in (one, other)))
    if min(np.linalg.svd(points, compute_uv=False)[1] / np.sqrt(len(points)) for points in (a, b)) < 0.5 * BENT_MM:
        return False
    return bool(Rotation.align_vectors(a, b)[1] < np.sqrt(len(a)) * SAME_SHAPE_MM)


def _points(wire: Array, reach_mm: float) -> Array:
    """Points (n, 3) of a wire, a millimetre apart, up to an arc length."""
    return at_arc(wire, samples(min(reach_mm, float(arc_length(wire)[-1])), STEP_MM))


def by_phantom(found: Sequence[Found]) -> list[list[Found]]:
    """The cases of each phantom, as far as it is known."""
    phantoms = phantoms_of(case.result for case in found)
    kin: dict[str, list[Found]] = {}
    for case in found:
        kin.setdefault(phantoms.get(case.result.case, case.result.case), []).append(case)
    return [*kin.values()]


def _strangers(out: Path, found: Sequence[Found]) -> list[tuple[Placed, Placed]]:
    """Pairs of phantoms of which one at the least has no name; of MOST phantoms."""
    kin = by_phantom(found)
    if len(kin) < 2:
        return []
    deepest = [placed for cases in kin[:MOST] if (placed := _deepest(out, cases)) is not None]
    return [(one, other) for one, other in combinations(deepest, 2) if not (one.named and other.named)]


def _deepest(out: Path, cases: Sequence[Found]) -> Placed | None:
    """The deepest trace of these cases; None where they have none of LEAST_MM."""
    known = [case for case in cases if case.traced_mm]
    if not known:
        return None
    deepest = max(known, key=lambda case: max(case.traced_mm.values()))
    _, wire = max(traces_of(out, deepest).values(), key=lambda trace: trace[0], default=(0.0, np.zeros((1, 3))))
    named = any(name.startswith(STATED) for case in cases for name in case.result.names)
    return Placed(wire, deepest.result.case, named) if arc_length(wire)[-1] >= LEAST_MM else None
