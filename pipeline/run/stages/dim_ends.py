"""Dim ends of traced wires that frames at several depths agree on: those are the wire's own, and no catheter's."""

from collections.abc import Sequence

import numpy as np

from pipeline.run.stages.known import Frame, trusted
from pipeline.trace import DIM_FROM_TIP, FAINT_BEYOND, GOES_ON
from reports.case_files import frames_named, listed

FEWEST = 3
"""Frames that must agree."""
AGREE_VOXELS = 3.0
"""How much the lengths of their dim ends may differ: the step in brightness is located to 1 voxel, the tip to 1.75."""
MOVED_MM = 5.0
"""By how much the wire must have been pushed between the first and the last of them."""
GO_ON, MOST_OTHERS = 2, 2.0
"""Frames in which a line goes on beyond the tip, and how many times as many others, from which these are doubted."""


def own_dim_ends(frames: Sequence[Frame], voxel_mm: float) -> tuple[list[Frame], list[str]]:
    """The frames, cleared of the doubt about a dim end where they agree on it; and what was assumed.

    A catheter that stays where it is shows less of itself the further the wire is pushed. A frame that is refused for
    something else, or a copy of another, does not agree with any.
    """
    out = list(frames)
    seen = {n: curve for n, frame in enumerate(frames) if (curve := frame.open_curve) is not None}
    found = {n: curve for n, curve in seen.items() if any(doubt.of == DIM_FROM_TIP for doubt in curve.doubts)}
    if not found:
        return out, []
    doubted, curves = [*found], [*found.values()]
    dim, length = (np.array(v) for v in zip(*((c.levels[DIM_FROM_TIP], c.length_mm) for c in curves), strict=True))
    usual = float(np.median(dim))
    agreed = np.abs(dim - usual) < AGREE_VOXELS * voxel_mm
    if agreed.sum() < max(FEWEST, len(dim) / 2) or np.ptp(length[agreed]) < MOVED_MM:
        return out, []
    usual = float(np.median(dim[agreed]))
    for n in np.flatnonzero(agreed):
        out[doubted[n]] = out[doubted[n]].cleared(curves[n].without(DIM_FROM_TIP))
    said = (
        f"the last {usual:.1f} mm of the wire are dimmer than the rest in {int(agreed.sum())} frames, at depths of "
        f"{length[agreed].min():.1f} to {length[agreed].max():.1f} mm: taken for the wire's own end; were it a "
        "catheter's that was pushed with the wire, the tip would lie there"
    )
    return out, [said]


def faint_ends(frames: Sequence[Frame]) -> list[str]:
    """A warning where lines went on beyond the tips of some frames, and those of others may be too faint to be seen."""
    go_on = [str(f.index) for f in frames if f.stage == "trace" and f.curve is not None and GOES_ON in f.curve.note]
    others = [str(f.index) for f in frames if f.trusted_curve is not None and np.isnan(f.expected_mm)]
    if len(go_on) < GO_ON or not 0 < len(others) <= MOST_OTHERS * len(go_on):
        return []
    return [
        f"in {frames_named(go_on)} a line goes on {GOES_ON}: the wire's end may be too faint in {listed(others)}, "
        "too, whose traces then end short of it, with a sigma that does not say so; state insertion_mm (mm) of each "
        "frame, or the wire's opacity"
    ]


def barely_seen(frames: Sequence[Frame]) -> list[str]:
    """A warning where something as faint as a streak goes on beyond traced tips whose depths nobody stated."""
    unstated = [frame for frame in frames if np.isnan(frame.expected_mm)]
    shares = {n: c.levels[FAINT_BEYOND] for n, c in trusted(unstated).items() if FAINT_BEYOND in c.levels}
    if not shares:
        return []
    return [
        f"beyond the traced tip of {frames_named([*shares])} something goes on, "
        f"{max(shares.values()):.2g} times as bright as the wire "
        "at most: a streak of it, or an end that is so faint, without which the trace is short; look there, and state "
        "insertion_mm (mm) of each frame, or the wire's opacity"
    ]
