"""What is said of a clamp that was estimated: how far it is from the stated one, and which frames do not fit it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from pipeline.arrays.polyline import angle_deg, resample
from pipeline.model import Clamp, Curve
from reports.case_files import frames_named

REACH_MM = 10.0
"""Length of wire behind the entry that is fitted: a trace's error of 0.02 mm turns it by a tenth of a degree."""
FARTHEST_MM, LARGEST_TURN_DEG = 1.0, 10.0
IF_AS_MODELLED = "if the wire behaves as the model does"
"""When the clamp is as well known as its fit says. Of wires that were no solutions of the model it was 0.9 to 1.7
degrees off, where 0.2 was said: the tilt takes up the misfit, and 0.5 to 1.1 of the expected square is left."""
STEP_MM, DENSE_MM, FROM_OTHERS_MM = 0.5, 0.05, 0.1
"""Steps at which traces are compared, and the rms distance between them that noise does not make: near the entry sound
ones lie within 0.02 to 0.06 mm of each other."""


def clamp_told(given: Clamp, found: Clamp, left: str, used: Sequence[int], contradiction: str) -> Clamp:
    """The clamp that was found with a note; the given one with a warning where it lies too far off.

    left : see ``left_out``.     used : the numbers of the frames that were fitted.     contradiction : see
    ``departures.departed``.
    """
    shift, turned = float(np.linalg.norm(found.entry_mm - given.entry_mm)), angle_deg(found.direction, given.direction)
    offset = f"{shift:.2f} mm and {turned:.1f} degrees from the manifest's"
    if shift > FARTHEST_MM or turned > LARGEST_TURN_DEG:
        warning = (
            f"the simulated wire fits the first {REACH_MM:g} mm of the traces from a clamp {offset} (accepted: "
            f"{FARTHEST_MM} mm and {LARGEST_TURN_DEG} degrees): the manifest's entry was kept. Check entry_mm and "
            "entry_direction, and where these are right roll, material_axis and the wire's tip and stiffness; the "
            f"clamp is entry_mm = {found.entry_mm.round(2).tolist()}, "
            f"entry_direction = {found.direction.round(4).tolist()}"
        )
        return replace(given, warning=warning)
    if not used:
        return replace(found, warning="no frame tells where the wire is held: the manifest's entry was kept")
    note = (
        f"the clamp was estimated from {frames_named(used)}: the solver's wire fitted to the first {REACH_MM:g} mm "
        f"of the traces, weighed with the manifest's entry; {offset}, known to {found.sigma_mm:.3f} mm across the "
        f"wire and {found.sigma_deg:.2f} degrees {IF_AS_MODELLED}, which a good fit does not show (one standard "
        "deviation along each axis; simulate.entry = manifest switches this off); along the wire, where a straight "
        "wire shows nothing, it stays in the manifest's plane"
    )
    return replace(found, note=note, warning="; ".join(filter(None, (left, contradiction))))


def left_out(curves: Mapping[int, Curve], out: Sequence[int], used: int) -> str:
    """A warning that names the frames that were left ``out``, and what may be wrong; empty where none was.

    curves : the traces of all frames that were to be fitted, by number.     used : how many of them were.
    """
    if not out:
        return ""
    what = f"the first {REACH_MM:g} mm of the traces of {frames_named(out)}"
    if len(out) < used:
        apart = _apart_mm([curve for n, curve in curves.items() if n not in out], [curves[n] for n in out])
        return (
            f"the simulated wire, held as the other {used} frames show, does not fit {what}: left out of the clamp. "
            f"Traced, they lie within {apart:.2f} mm of the others: look at {_first(curves, out, apart)}"
        )
    return (
        f"the simulated wire fits {what} from no clamp that also fits the other {used}: left out of it; check entry_mm "
        "first (beyond the real clamp a wire moves from frame to frame: an entry that is stated some mm too deep fits "
        "none of them together), then roll, material_axis and the wire's tip and stiffness, before the traces"
    )


def _first(curves: Mapping[int, Curve], out: Sequence[int], apart_mm: float) -> str:
    """What to look at first. apart_mm : how far the traces that were left out lie from the others.

    The least deep frames have the wire's tip nearest to the fitted length, where the others have its shaft: a tip that
    is stated straight, or turned, puts them apart without anything wrong with a trace.
    """
    if apart_mm <= FROM_OTHERS_MM:
        return "the wire's tip, stiffness, roll and friction first"
    if max(curves[n].length_mm for n in out) < min(curve.length_mm for n, curve in curves.items() if n not in out):
        return (
            "the wire's tip first (curve, roll, stiffness), since these frames are the least deep, then at these traces"
        )
    return "these traces first, then at the wire's tip, stiffness and roll"


def _apart_mm(others: Sequence[Curve], curves: Sequence[Curve]) -> float:
    """How far the first millimetres of curves lie from the nearest of others, mm: the worst of their rms distances."""
    near = cKDTree(np.concatenate([resample(curve.points_mm, DENSE_MM) for curve in others]))
    starts = [resample(curve.points_mm, STEP_MM)[: int(REACH_MM / STEP_MM)] for curve in curves]
    return max(float(np.sqrt(np.mean(near.query(start)[0] ** 2))) for start in starts)
