"""May a curve begin and end where it does? Lines that go on, folds, the ends of the lumen and of the scan."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.arrays.grids import spelt
from pipeline.arrays.polyline import turns_deg
from pipeline.model import Array
from pipeline.status import FrameStatus
from pipeline.trace.ahead import dark_ahead, hidden_ahead
from pipeline.trace.attempt import MOST_SHARP_DEG, Attempt, sharpest_deg
from pipeline.trace.config import MOST_APART
from pipeline.trace.onward import GOES_ON
from pipeline.trace.outside import seen_outside, thread_outside
from pipeline.trace.reach import end_range
from pipeline.trace.section import STRETCH_MM, fills_vessel
from pipeline.trace.subtraction import Subtraction
from pipeline.trace.tube import Tube
from pipeline.trace.width import OUT_OF_ROUND, WIDE, oblong_end, wide_end

EDGE_VOXELS, OUTSIDE_VOXELS = 2.0, -1.0
"""Distance from the scan's end within which a curve's end is no tip: traces of wires that leave the scan end 1.0 inside
it at most (100 traces at 5 to 90 degrees, CNR 4 to 30; nearly all outside); tips in the scan are right to 0.4. And how
far outside a curve may lead: what lies there is bridged, not seen."""
PADDED = 0.03
"""Share of flat voxels around a curve's end (4 of 123) from which it ends at the padding around the reconstruction."""
_AROUND = np.array([p for p in np.ndindex(7, 7, 7) if np.linalg.norm(np.subtract(p, 3)) <= 3.0], float) - 3.0
ENDS_OUTSIDE_VOXELS = 3.0
"""How far outside the lumen a curve may end: grey is read up to HALO_VOXELS of it, and wires that went on through a
wall, or beyond the end of the contrast medium, were cut off there, ok (2 to 5 mm of them, 26 of 62)."""
LATE_MM, LATE_VOXELS = 1.0, 2.0
"""Their sum: a curve that begins further than that beyond the plane of entry lacks wire (3 mm in correlated noise)."""
END_VOXELS, EVEN_END_VOXELS, STATED_END_VOXELS = 1.75, 3.0, 1.5
"""How far (voxel) from a curve's end the wire's may lie, at three standard deviations: where steps were found, in an
even wire, and where steps are stated. Of 277 dim ends on tuning seeds 103 were ok with 2.0, one of them 2.6 voxels off
and one 2.0; with 1.75 it is 74, the worst 1.2 off. An even wire in correlated noise is refused for other reasons, too.
A stated step shows the end to half a voxel: what is further off than the third contradicts it."""
HAIRPIN_DEG, HAIRPIN_VOXELS = 140.0, 7.0
"""A turn, and the length (voxel) within which no wire makes it: two wires 3 voxels apart were traced as one, there and
back."""
J_MM = 6.0
"""A curve that goes on for no longer than this after such a turn is the hook of a J tip, of 1 mm radius and less."""
HALO, HALO_CNR, SHARP = 0.1, 5.0, 1.05
"""Grey over its peak that a fit needs all around a line, from which that is no still wire; the contrast from which that
is sure; and the most that the line is blurred, over the scanner's blur. A wire that lay 1.2 or 1.6 voxels aside half
of the time had 0.12 to 0.17, still ones 0.06 at most, and 0.09 with a third of the scanner's blur 2.5 times as wide."""
TIP_BESIDE = 3.5
"""Distance (voxel) of another strand of the wire within which nobody sees where its tip ends: two blurs of each."""


def beside_itself(points: Array, step: float, near: float) -> NDArray[np.bool_]:
    """Which points (n,) lie within ``near`` mm of another stretch of the curve, over 3 ``near`` away along it."""
    apart = round(3.0 * near / max(step, 1e-9))
    pairs = cKDTree(points).query_pairs(near, output_type="ndarray")
    out = np.zeros(len(points), bool)
    out[pairs[np.abs(pairs[:, 0] - pairs[:, 1]) > apart].ravel()] = True
    return out


def sharpest_turn_deg(points: Array, step: float, reach: float) -> float:
    """Largest angle by which a curve (n, 3), points ``step`` mm apart, turns within ``reach`` mm."""
    return float(turns_deg(points, max(1, round(reach / max(step, 1e-9)))).max(initial=0.0))


def named(image: Subtraction, point: Array) -> str:
    """A place in LPS mm, for a message."""
    return spelt(image.world(point[None])[0])


def _at_edge(image: Subtraction, points: Array) -> bool:
    """Whether a curve (n, 3) leads out of the scan, or ends within EDGE_VOXELS of its end or of what it shows."""
    index, inside = image.in_scan(points), image.from_side(points)
    if inside[-1] < EDGE_VOXELS or inside.min() < OUTSIDE_VOXELS:
        return True
    # a scan without any noise is flat beside the rest of the wire, too
    return _flat_near(image, index[-1]) > PADDED and _flat_near(image, index[len(index) // 2]) <= PADDED


def _flat_near(image: Subtraction, index: Array) -> float:
    """Share of the voxels about a place of the scan that are to the last bit what all six beside them are.

    Noise makes none; outside the cylinder that a scanner reconstructs there is one grey.
    """
    grey, around = image.scan.values, np.rint(index + _AROUND).astype(int)
    around = np.clip(around, 1, np.array(image.scan.shape) - 2)
    beside = (grey[tuple((around + step).T)] for step in (*np.eye(3, dtype=int), *-np.eye(3, dtype=int)))
    return float(np.mean(np.all([one == grey[tuple(around.T)] for one in beside], axis=0)))


def _end_range(image: Subtraction, attempt: Attempt) -> tuple[float, float, float]:
    """How much further back and further on the wire may end, and the most that is allowed of either, mm.

    Both are 0 for a wire without steps of brightness in white noise.
    """
    stepped = len(attempt.tube.steps.edges) > 0
    least = STATED_END_VOXELS if attempt.tube.steps.stated else END_VOXELS
    most_mm = (least if stepped else EVEN_END_VOXELS) * image.voxel
    if not stepped and not image.correlated:
        return 0.0, 0.0, most_mm
    return *end_range(image, attempt.tube), most_mm


Look = tuple[Array, Array]
"""Grey on rings about a curve's points and on its axis, as of ``read_around``."""
Objection = tuple[bool, FrameStatus, str, str, str]
"""Whether it holds, the status that it gives, what was found, what is allowed and what to do."""


def _against_dim_ends(attempt: Attempt) -> str:
    if attempt.tube.steps.stated:
        return "correct the wire's opacity, whose steps lie elsewhere, or scan with more dose"
    return "state the wire's opacity, whose steps tell where its end is, or scan with more dose"


def of_the_ends(
    image: Subtraction, attempt: Attempt, points: Array, length_mm: float, *, folded: bool
) -> tuple[Objection, ...]:
    """What may be wrong with where a curve (n, 3) begins and ends. folded : its tip lies beside another strand."""
    missing_mm = attempt.tube.steps.missing_mm
    back_mm, on_mm, sure_mm = _end_range(image, attempt)
    return (
        (missing_mm > 0.0, FrameStatus.TRACE_AMBIGUOUS,
         f"a line that ends {missing_mm:.1f} mm before the tip, by the wire's opacity", "one that goes to the tip",
         "look whether the picture shows more of it, or correct opacity in the manifest"),
        (_at_edge(image, points), FrameStatus.TRACE_LEFT_SCAN,
         f"a curve of {length_mm:.1f} mm that ends at the edge of the scan, or of what it shows (padding, saturated "
         "voxels), or leads out of it and back", "a wire inside it", "leave this frame out, or scan a larger field"),
        (hidden_ahead(image, points), FrameStatus.TRACE_AMBIGUOUS,
         "a line that goes on where the reference has one, too", "a reference without a wire, or any piece of one",
         "look at the reference; name another one, or none"),
        (dark_ahead(image, points), FrameStatus.TRACE_AMBIGUOUS,
         "a dark line ahead of the curve's end", "a tip with nothing beyond it",
         "look whether the wire goes on, less dense than the contrast medium: its end is not seen then"),
        (max(back_mm, on_mm) > sure_mm, FrameStatus.TRACE_AMBIGUOUS,
         f"a faint end that may lie {back_mm:.1f} mm further back or {on_mm:.1f} mm further on",
         f"{sure_mm:.1f} mm", _against_dim_ends(attempt)),
        (attempt.late_mm > LATE_MM + LATE_VOXELS * image.voxel, FrameStatus.TRACE_AMBIGUOUS,
         f"a line that begins {attempt.late_mm:.1f} mm beyond the entry",
         f"{LATE_MM + LATE_VOXELS * image.voxel:.1f} mm at most",
         "look whether the wire is hidden there, or move entry_mm to where it begins"),
        (attempt.goes_on, FrameStatus.TRACE_AMBIGUOUS,
         f"a line {GOES_ON}, from {named(image, points[-1])} mm on", "a tip with nothing beyond it",
         "look whether the wire's end is fainter than the rest"),
        (folded and not attempt.from_previous, FrameStatus.TRACE_AMBIGUOUS,
         "a tip beside another strand of the wire", f"{TIP_BESIDE} voxels between them",
         "list a frame of a smaller depth before it, or look where the wire ends"),
    )  # fmt: skip


def of_the_lumen(image: Subtraction, attempt: Attempt, points: Array) -> tuple[Objection, ...]:
    """Why a curve (n, 3) may end where the lumen does, and not the wire."""
    beyond_wall = float(image.depth_at(points[-1:])[0]) / image.voxel
    return (
        (seen_outside(image, points), FrameStatus.TRACE_LEFT_LUMEN,
         f"a lumen that ends at {named(image, points[-1])} mm, and something bright beyond it",
         "a lumen that holds the tip",
         "look whether the vessel goes on there (segment.threshold, lumen), or bone touches it"),
        (beyond_wall > ENDS_OUTSIDE_VOXELS, FrameStatus.TRACE_LEFT_LUMEN,
         f"a curve that ends {beyond_wall * image.voxel:.1f} mm outside the lumen, at {named(image, points[-1])} mm, "
         "where no more of the scan is read", f"{ENDS_OUTSIDE_VOXELS * image.voxel:.1f} mm at most",
         "look whether the wire leaves the vessel there, or the vessel goes on (segment.threshold, lumen)"),
        (thread_outside(image, points, attempt.tube.sigma), FrameStatus.TRACE_LEFT_LUMEN,
         f"a line as thin and as bright as the wire that leads on through tissue from {named(image, points[-1])} mm, "
         "where the curve ends", "a lumen that holds the tip",
         "look whether the wire leaves the vessel there; if that is a thin vessel, give a reference scan "
         "without wire, or one with less noise"),
    )  # fmt: skip


def of_its_width(
    image: Subtraction, attempt: Attempt, points: Array, looks: tuple[Look, Look], *, folded: bool
) -> tuple[Objection, ...]:
    """Why a curve's (n, 3) end may be something else than the wire's. Beside another strand nobody sees its width.

    looks : of ``read_around`` and ``as_fitted``.     folded : as in ``of_the_ends``.
    """
    wide = oblong = 0.0
    if not (image.thick_slices or folded):
        wide, oblong = wide_end(image, attempt.tube, points, *looks), oblong_end(image, points, *looks)
    return (
        (wide > 0.0, FrameStatus.TRACE_AMBIGUOUS,
         f"an end {wide:.2f} times as wide as the line before it", f"{WIDE[0]:g} times at most",
         "look whether something else is at the tip (a bead, an air bubble of the reference, contrast medium that it "
         "lacks); if the wire's own end is so thick, give its curve (traces)"),
        (oblong > 0.0, FrameStatus.TRACE_AMBIGUOUS,
         f"an end {oblong:.1f} times as far out of round as the line before it", f"{OUT_OF_ROUND[1]:g} times at most",
         "look whether the tip is folded back beside the wire, or another device lies there; give its curve (traces)"),
    )  # fmt: skip


def of_the_frame(image: Subtraction) -> tuple[Objection, ...]:
    """Why a frame shows no wire as it was, whatever is traced in it."""
    copied = image.levels.get("copied", 0.0)
    return (
        (copied > 0.0, FrameStatus.TRACE_AMBIGUOUS,
         f"{100 * copied:.0f} % of the lumen's voxels as the reference has them, to the last bit", "a scan of its own",
         "look whether the frame was written whole; export it again"),
    )  # fmt: skip


def of_the_way(attempt: Attempt, length_mm: float) -> tuple[Objection, ...]:
    """Why a curve may run the wrong way: said before all else, since what else is odd of it follows from that."""
    return (
        (attempt.behind_mm > length_mm and (attempt.short or not attempt.depth_stated), FrameStatus.TRACE_WRONG_WAY,
         f"{length_mm:.1f} mm of wire beyond the entry and {attempt.behind_mm:.1f} mm behind it", "more beyond it",
         "turn entry_direction round" + ", or state insertion_mm if this is right" * (not attempt.depth_stated)),
    )  # fmt: skip


def of_a_pair(pair: float, attempt: Attempt) -> tuple[Objection, ...]:
    """Why a curve may be two wires in contact: evenly bright like one, but its line lies midway."""
    return (
        (pair > 1.0 and not attempt.from_previous, FrameStatus.TRACE_AMBIGUOUS,
         f"a line that is out of round over {STRETCH_MM:g} mm and more, {pair:.1f} times as much as one wire may be",
         "a round one",
         "look for a second wire in contact with it, midway to which the line lies, or list a frame with one before"),
    )  # fmt: skip


def _haloed(image: Subtraction, tube: Tube) -> bool:
    """Whether a line as sharp as the scanner allows lies in a halo: a wire that was elsewhere for a part of the scan.

    A faint catheter of 2 mm makes one, too, but its wire is fitted wider.
    """
    sharp = tube.sigma < SHARP * image.wall_blur_mm and not image.modelled and not image.thick_slices
    return sharp and tube.offset > HALO * max(tube.peak, 1e-9) and tube.peak > HALO_CNR * image.noise


def of_the_whole(image: Subtraction, attempt: Attempt, points: Array, length_mm: float) -> tuple[Objection, ...]:
    """Why a curve (n, 3) may be no wire, or not one."""
    step = length_mm / max(1, len(points) - 1)
    sharpest = sharpest_deg(image, attempt.tube)
    turn = sharpest_turn_deg(points[: -max(1, round(J_MM / max(step, 1e-9)))], step, HAIRPIN_VOXELS * image.voxel)
    return (
        (image.edges_mm[0] / image.edges_mm[1] >= MOST_APART, FrameStatus.TRACE_AMBIGUOUS,
         "slices of {:.3g} mm and pixels of {:.3g} mm".format(*image.edges_mm),
         f"less than {MOST_APART:g} times as far apart",
         "reconstruct thinner slices: in these a wire and its ends are off by more than its uncertainty says"),
        (sharpest > MOST_SHARP_DEG, FrameStatus.TRACE_AMBIGUOUS,
         f"a curve that turns by {sharpest:.0f} degrees within a voxel", f"{MOST_SHARP_DEG:g} at most",
         "look where it doubles back; list a frame of a nearer depth before it, or give its curve (traces)"),
        (_haloed(image, attempt.tube), FrameStatus.TRACE_AMBIGUOUS,
         f"a sharp line in a halo of {attempt.tube.offset / max(attempt.tube.peak, 1e-9):.2f} of its brightness",
         f"{HALO:g} at most", "look whether the wire moved during the scan, or another one lies beside it: scan again"),
        (turn > HAIRPIN_DEG and not attempt.depth_stated, FrameStatus.TRACE_AMBIGUOUS,
         f"a turn by {turn:.0f} degrees within {HAIRPIN_VOXELS * image.voxel:.1f} mm", f"{HAIRPIN_DEG:g} at most",
         "look whether two wires lie side by side; state insertion_mm if the wire is folded"),
        (fills_vessel(image, points, attempt.tube.sigma), FrameStatus.TRACE_AMBIGUOUS,
         "a line as thick as its vessel", "a wire, which is thinner",
         "check that the frame shows a wire, and that the reference has the frame's contrast"),
    )  # fmt: skip
