"""Whether the frames' traced lengths agree: a trace that was cut short or led astray is out of step.

Stated depths are off by the errors of the hand's scale and of the entry, which neighbouring frames share.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import bdtrc, ndtr, ndtri, stdtrit

from pipeline.arrays.grids import spread
from pipeline.budget.inputs import INSERTION_MM
from pipeline.model import Array, Clamp, Doubt
from pipeline.run.stages.known import Frame
from pipeline.simulate.clamp import TIP_VOXELS, depth_from
from pipeline.status import FrameStatus
from pipeline.trace import hardly_begun
from reports.case_files import frames_named

AROUND = 5
"""Number of neighbouring frames whose median difference of traced length and stated depth is the usual one."""
FEWEST, FEWEST_ALIKE = 4, 3
"""Fewest frames, or stated depths, for a check, and depths for that of what all are off by alike."""
ALIKE = 0.8
"""Share of the frames that are off to one side, from which depths are counted from elsewhere."""
SURE = 5.0
"""First limit on how far a difference may be off the usual one: so many standard deviations of all frames."""
SURE_TIP = 4.0
"""Second limit: so many standard deviations of the frame's own tip."""
LEAST_VOXELS = 3.0
"""Third limit, voxels: a length is out of step beyond all three. Also the least shrinking that gets a warning."""
APART = 2.0
"""Standard deviations of two tips from which their distance is not the stated one: by chance one step in 44."""
SURELY = 6.0
"""Standard deviations from which a single such step is told: two frames of thirty that are exchanged are 9 apart."""
CHANCE = 1e-3
"""How often right depths may seem wrong."""
NEAR_ONE = 0.2
"""How near to -1 a slope of traced lengths over stated depths is that of lengths left outside."""
WIDE_MM = 2.5
"""Range of stated depths from which that slope is looked at: of traces that are noisy by 0.5 mm, as long as stated or
all alike, it is near -1 in 4 to 9 % over 0.5 mm, in 0.2 % over this."""
OUTSIDE = "are these the lengths left outside (insertion_mm is beyond entry_mm), or are frames in opposite order?"
TURNED = "or entry_direction points back along the wire: turn it round"
APART_MM = 0.01
"""Distance of two depths that are two readings."""
LEAST_MM, OF_MEDIAN = 0.5, 1.25
"""By how much the zero of depths must be off to be told, and a median's standard deviation over a mean's."""


def in_step(frames: Sequence[Frame], voxel_mm: float) -> list[Frame]:
    """The frames; one whose length is out of step with insertion_mm and the frames around it is not to be trusted."""
    known = [i for i, f in enumerate(frames) if f.trusted_curve is not None and np.isfinite(f.expected_mm)]
    out = list(frames)
    if len(known) < FEWEST:
        return out
    curves = [curve for i in known if (curve := frames[i].trusted_curve) is not None]
    apart = np.array([curve.length_mm - frames[i].expected_mm for i, curve in zip(known, curves, strict=True)])
    first = np.clip(np.arange(len(apart)) - AROUND // 2, 0, max(0, len(apart) - AROUND))
    usual = np.array([np.median(apart[n : n + AROUND]) for n in first])
    tips = np.nan_to_num([curve.tip_sigma_mm for curve in curves])
    limit = np.maximum(max(LEAST_VOXELS * voxel_mm, SURE * spread(apart - usual)), SURE_TIP * tips)
    for n in np.flatnonzero(np.abs(apart - usual) > limit):
        note = (
            f"trace: length: got {curves[n].length_mm:.2f} mm, {apart[n]:+.2f} mm off insertion_mm; expected "
            f"{usual[n]:+.2f} mm to within {limit[n]:.2f} mm, as in the frames around it; look at the picture: the "
            "trace may be cut short or lead astray; or correct insertion_mm"
        )
        out[known[n]] = frames[known[n]].failed("trace", FrameStatus.LENGTH_MISMATCH, note)
    return out


def in_common(apart: Array, least: float) -> float:
    """The median (n,) of what frames are off by, where it is more than ``least`` and most are to one side; else 0."""
    usual = float(np.median(apart))
    return usual if abs(usual) > least and np.mean(apart * usual > 0) >= ALIKE else 0.0


def traced_depths(frames: Sequence[Frame], entry_mm: ArrayLike, direction: ArrayLike) -> dict[int, float]:
    """By number, how deep the traced wire is where its depth is stated, mm from the plane of entry: its length, and how
    far beyond that plane it begins. With those that are refused for their length alone.
    """
    clamp = Clamp(np.asarray(entry_mm, float), np.asarray(direction, float), None)
    wrong = FrameStatus.LENGTH_MISMATCH.identifier
    seen = [f for f in frames if f.curve is not None and f.traced and (f.trusted_curve or f.status == wrong)]
    return {f.index: depth_from(clamp, f.curve) for f in seen if f.curve is not None and np.isfinite(f.expected_mm)}


def by_stated_depth(frames: Sequence[Frame], depths_mm: Mapping[int, float]) -> tuple[Array, Array]:
    """Each stated depth (n,), and the median (n,) of the traced ones there: scans of one depth share one reading.

    depths_mm : of ``traced_depths``.
    """
    seen = sorted((f for f in frames if f.index in depths_mm), key=lambda f: f.expected_mm)
    read, traced = np.array([f.expected_mm for f in seen]), np.array([depths_mm[f.index] for f in seen])
    # depths that rounding tells apart are one: no line and no parabola goes through them
    of = np.cumsum(np.diff(read, prepend=read[:1]) > APART_MM)
    each = [of == n for n in np.unique(of)]
    return np.array([np.median(read[one]) for one in each]), np.array([np.median(traced[one]) for one in each])


def to_depth(frames: Sequence[Frame], depths_mm: Mapping[int, float], tolerance_mm: float) -> list[Frame]:
    """The frames; one that is deeper than stated, since its trace begins beyond the entry, is not to be trusted."""
    out = list(frames)
    for n, f in enumerate(frames):
        off = depths_mm.get(f.index, f.expected_mm) - f.expected_mm
        if f.trusted_curve is not None and abs(off) > tolerance_mm:
            note = (
                f"trace: depth: got {f.expected_mm + off:.2f} mm from entry_mm to the tip, as the traced wire begins "
                f"{off + f.expected_mm - f.trusted_curve.length_mm:.2f} mm beyond it; expected {f.expected_mm:.2f} mm "
                f"(insertion_mm) to within {tolerance_mm} mm; move entry_mm to where the wire enters, or look whether "
                "it is hidden there"
            )
            out[n] = f.failed("trace", FrameStatus.LENGTH_MISMATCH, note)
    return out


def stated_elsewhere(
    frames: Sequence[Frame], depths_mm: Mapping[int, float], common_mm: float, read_mm: float | None
) -> list[str]:
    """A warning where all wires are about as much shallower, or deeper, than insertion_mm states.

    depths_mm : of ``traced_depths``.     common_mm : standard deviation of what all depths share: the entry, and the
    traced tips.     read_mm : of each stated depth by itself; None where the manifest does not state it.
    """
    seen = [f for f in frames if f.index in depths_mm]
    stated, traced = by_stated_depth(seen, depths_mm)
    known = traced - stated
    if len(known) < FEWEST_ALIKE:
        return []
    tips = np.nan_to_num([0.0 if f.curve is None else f.curve.tip_sigma_mm for f in seen])
    limit = float(np.hypot(-ndtri(0.5 * CHANCE) * common_mm, _median_within(known, tips, read_mm)))
    usual = in_common(known, max(LEAST_MM, limit))
    if not usual:
        return []
    late = float(np.median([depths_mm[f.index] - f.curve.length_mm for f in seen if f.curve is not None]))
    begins = f" and begin {late:.1f} mm beyond entry_mm" if late > LEAST_MM else ""
    faint = "" if usual > 0 else ", and whether traces end where the wire gets faint (a plastic tip: state opacity)"
    return [
        f"the traced wires are {abs(usual):.1f} mm {'longer' if usual > 0 else 'shorter'} than insertion_mm states"
        f"{begins} (median of {len(known)} stated depths; chance explains {limit:.1f} mm): check from where depths "
        f"were counted, and entry_mm{faint}; the simulated wires go as deep as the traced ones, unless simulate.depth "
        f"is manifest: then they end as much too {'shallow' if usual > 0 else 'deep'}"
    ]


def _median_within(apart: Array, tips_mm: Array, read_mm: float | None) -> float:
    """By how much the median of differences (n,) is off 0 by chance, once in 1 / CHANCE: by what each is known to.

    Where nobody states how well depths were read, that they differ alike shows it, too.
    """
    stated = INSERTION_MM if read_mm is None else read_mm
    off = float(-ndtri(0.5 * CHANCE) * np.hypot(stated, np.median(tips_mm)))
    if read_mm is None:
        off = min(off, float(stdtrit(len(apart) - 1, 1.0 - 0.5 * CHANCE) * np.std(apart, ddof=1)))
    return OF_MEDIAN * off / float(np.sqrt(len(apart)))


def runs_down(stated: Array, traced: Array) -> bool:
    """Whether traced lengths (n,) fall by as much as stated depths (n,) grow: no scale does that."""
    known = len(stated) >= FEWEST_ALIKE and np.ptp(stated) > WIDE_MM
    return bool(known and abs(np.polyfit(stated, traced, 1)[0] + 1.0) < NEAR_ONE)


def perhaps_turned(frames: Sequence[Frame]) -> list[Frame]:
    """The frames; one that is refused for its length, and whose trace has hardly begun, may run the wrong way."""
    out = list(frames)
    wrong = FrameStatus.LENGTH_MISMATCH.identifier
    known = [(f.expected_mm, f.curve.length_mm) for f in frames if f.curve is not None and np.isfinite(f.expected_mm)]
    why = OUTSIDE if runs_down(*np.array(known).reshape(-1, 2).T) else TURNED
    for n, f in enumerate(frames):
        if f.status == wrong and f.curve is not None and hardly_begun(f.curve.length_mm, f.expected_mm):
            out[n] = replace(f, message=f"{f.message}; {why}")
    return out


def turned_round(frames: Sequence[Frame]) -> list[Frame]:
    """The frames; where no trace is trusted and most run the wrong way, all that were looked at say so, and it once.

    Along a direction that is turned round the other frames met noise, or another vessel: their advice leads astray.
    """
    back = [f for f in frames if f.status == FrameStatus.TRACE_WRONG_WAY.identifier]
    if any(f.trusted_curve is not None for f in frames) or 2 * len(back) <= len(frames):
        return list(frames)
    note = (
        f"trace: wire: got more of it behind the entry than beyond it in {len(back)} of {len(frames)} frames; expected "
        "more beyond it; entry_direction seems to be reversed: it points the way the wire is pushed; turn it round"
    )
    why = (Doubt(FrameStatus.TRACE_WRONG_WAY, note),)
    return [f if f.curve is None else f.cleared(replace(f.curve, doubts=why)) for f in frames]


def shrinking(frames: Sequence[Frame], voxel_mm: float) -> list[str]:
    """A warning where a traced wire gets shorter from one frame to the next and no depths are stated."""
    seen = [(f.index, c.length_mm) for f in frames if (c := f.trusted_curve) is not None and np.isnan(f.expected_mm)]
    odd = [
        f"{b} ({after - before:+.1f} mm)"
        for (_, before), (b, after) in pairwise(seen)
        if after - before < -LEAST_VOXELS * voxel_mm
    ]
    if not odd:
        return []
    return [
        f"{frames_named(odd)}: the traced wire is shorter than in the frame before, allowed "
        "where it was pulled back; are the frames in order? Else look at the picture whether the trace is cut short, "
        "or state insertion_mm"
    ]


def drawn_back(frames: Sequence[Frame], voxel_mm: float) -> list[str]:
    """A warning where traced wires get shorter though stated depths grow, more often than by the errors of tips.

    Frames half a millimetre apart that are exchanged in pairs are off by less than any tolerance of one frame.
    """
    seen = [(f, c) for f in frames if (c := f.trusted_curve) is not None and np.isfinite(f.expected_mm)]
    odd, count, most = [], 0, 0.0
    for (earlier, before), (later, after) in pairwise(seen):
        stated, traced = later.expected_mm - earlier.expected_mm, after.length_mm - before.length_mm
        count += stated > 0.0
        tips = np.hypot(np.nan_to_num([before.tip_sigma_mm, after.tip_sigma_mm]), TIP_VOXELS * voxel_mm)
        apart = (stated - traced) / np.hypot(*tips)
        if traced < 0.0 < stated and apart > APART:
            odd.append(f"{later.index} ({traced:+.2f} mm, stated {stated:+.2f} mm)")
            most = max(most, float(apart))
    if not odd or (most < SURELY and bdtrc(len(odd) - 1, count, ndtr(-APART)) > CHANCE):
        return []
    return [
        f"{frames_named(odd)}: the traced wire is shorter than in the frame before, where insertion_mm is deeper: are "
        "frames and insertion_mm in one order? Else look at the pictures whether traces are cut short"
    ]


def standing(frames: Sequence[Frame], voxel_mm: float) -> list[str]:
    """A warning where no depths are stated and the wire is as long in all frames, though nothing else differs."""
    seen = [(f.roll_deg, c.length_mm) for f in frames if (c := f.trusted_curve) is not None and np.isnan(f.expected_mm)]
    rolls, lengths = {roll for roll, _ in seen}, [length for _, length in seen]
    if len(seen) < FEWEST - 1 or len(rolls) > 1 or np.ptp(lengths) > LEAST_VOXELS * voxel_mm:
        return []
    return [
        f"the traced wire is {np.median(lengths):.1f} mm long in all {len(seen)} frames whose traces are trusted: it "
        "did not advance, or entry_mm lies inside it, or entry_direction points the way that it came from; look at "
        "the picture"
    ]
