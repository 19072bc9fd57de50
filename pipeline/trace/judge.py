"""Is the curve right? What the grey along it says, what it leaves unexplained, and what the manifest expected."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.jets import values_at
from pipeline.model import Array
from pipeline.status import FrameStatus
from pipeline.trace.attempt import Attempt
from pipeline.trace.scene import Scene
from pipeline.trace.tip import extended, resampled

LEAST_CNR = 2.5
"""Contrast over noise below which a frame alone does not give a curve."""
LEAST_WITH_PRIOR = 1.5
"""and below which a previous curve does not help either: the frame no longer shows where the wire ends."""
LEAST_SEEN = 2.0
"""The same over what noise does to the fit: noise correlated over 0.8 voxel counts 2.4-fold. Below it the wire is
followed in pieces (on tuning seeds, right curves had 2.1 and more, wrong ones 1.9 and less)."""
SURE_CNR = 5.0
"""and from which crests at the finest blur are enough."""
FAINT = 0.35
"""Share of the usual crest grey below which there is no wire to be seen: a gap."""
DOUBLE = 1.6
"""Share above which two strands lie on one crest."""
LEFTOVER_MM = 4.0
"""Length of crests that run elsewhere from which the curve may be the wrong one."""
MOST_FAINT_MM = 5.0
"""Length without a bright line that a curve may have if that is less than a quarter of it (a gap is 3 mm)."""
MOST_DOUBLE_MM = 3.0
"""Length of line too bright for one strand (a crossing is 1 mm) from which a frame alone does not decide."""
TIP_VOXELS = 4.0
"""Length on either side of the tip over which a faint wire must be seen to end: the noise of its mean is a fifth."""
TIP_AHEAD = 0.4
"""Share of the usual crest grey beyond the tip from which the wire seems to go on."""
MEAN_OVER_MM = 1.5
"""Length over which crest grey is averaged before it is called faint or double."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """status and note of a curve (OK and empty when it stands), and the flags of its points."""

    status: FrameStatus
    note: str
    flagged: NDArray[np.bool_]
    faint_mm: float
    double_mm: float

    @property
    def doubts(self) -> float:
        """How much speaks against the curve, mm of it."""
        return self.faint_mm + self.double_mm


def _averaged(values: Array, width: int) -> Array:
    """Running mean; the ends see a shorter window."""
    kernel = np.ones(min(width, len(values)))
    return np.asarray(np.convolve(values, kernel, "same") / np.convolve(np.ones(len(values)), kernel, "same"))


def crest_share(scene: Scene, points: Array, step_mm: float) -> Array:
    """Grey on the curve (n,) over its median along the wire, averaged over MEAN_OVER_MM. points : (n, 3) local."""
    grey = values_at(
        scene.grey, scene.spacing, 0.7 * float(scene.spacing.min()), np.ascontiguousarray(points)
    )
    usual = float(np.median(grey))
    return _averaged(grey, max(1, round(MEAN_OVER_MM / step_mm))) / max(usual, 1e-9)


def _noise_of_share(scene: Scene, attempt: Attempt, step_mm: float) -> float:
    """Standard deviation of :func:`crest_share` from noise: the blur leaves 0.36 of it, the mean the rest."""
    count = max(1.0, MEAN_OVER_MM / max(step_mm, 1.5 * float(scene.spacing.min())))
    gain = 1.0 + (0.7 * float(scene.spacing.min()) / attempt.tube.sigma) ** 2
    return 0.4 * gain / attempt.cnr(scene) / float(np.sqrt(count))


def depth_at(scene: Scene, points: Array) -> NDArray[Any]:
    """Signed distance to the wall (n,) at the voxels nearest to points (n, 3); the box's edge stands for beyond."""
    box = scene.region.box
    index = np.clip(np.rint(points / scene.spacing).astype(int), 0, np.array(box.shape) - 1)
    return np.asarray(box.values[tuple(index.T)])


def _outside(scene: Scene, points: Array) -> NDArray[np.bool_]:
    """Points in the box whose nearest voxel is further than two voxels outside the wall."""
    index = np.rint(points / scene.spacing).astype(int)
    inside = np.all((index >= 0) & (index < np.array(scene.region.box.shape)), axis=1)
    return np.asarray(inside & (depth_at(scene, points) > 2.0 * float(scene.spacing.min())))


def judge(
    scene: Scene, attempt: Attempt, points: Array, bridged: NDArray[np.bool_], length_mm: float
) -> Verdict:
    """The verdict on a curve, points (n, 3) local."""
    step = length_mm / max(1, len(points) - 1)
    share = crest_share(scene, points, step)
    spread = _noise_of_share(scene, attempt, step)
    ends = np.minimum(np.arange(len(points)), np.arange(len(points))[::-1]) * step
    faint = (share < FAINT + spread) & (ends > MEAN_OVER_MM)
    double = share > max(DOUBLE, 1.0 + 4.0 * spread)
    outside = _outside(scene, points)
    flagged = bridged | faint | double | outside
    faint_mm, double_mm = float(faint.sum()) * step, float(double.sum()) * step
    cnr = attempt.cnr(scene)
    status, note = FrameStatus.OK, ""
    confirmed = attempt.from_previous and cnr > LEAST_WITH_PRIOR and not _weak(share, spread)
    if cnr < LEAST_CNR and not (confirmed and _ends_there(scene, points)):
        status = FrameStatus.TRACE_LOW_CONTRAST
        got, allowed = (
            f"a wire {cnr:.1f} noises bright",
            f"{LEAST_CNR}, or a previous curve that the frame confirms",
        )
        note = _sentence(got, allowed, "scan with more dose or give the frame before")
    elif outside.mean() > 0.03:
        status = FrameStatus.TRACE_LEFT_LUMEN
        got, allowed = (
            f"{100 * outside.mean():.0f} % of the curve over 2 voxels outside the lumen",
            "3 % at most",
        )
        note = _sentence(got, allowed, "check the lumen, and whether the phantom moved between the scans")
    elif attempt.leftover_mm > max(LEFTOVER_MM, 0.1 * length_mm):
        status = FrameStatus.TRACE_AMBIGUOUS
        got, allowed = (
            f"{attempt.leftover_mm:.1f} mm of bright line off the curve",
            f"{LEFTOVER_MM} mm at most",
        )
        note = _sentence(got, allowed, "look for a second device or a wrong turn at a crossing")
    elif faint_mm > MOST_FAINT_MM and faint_mm > 0.25 * length_mm:
        status = FrameStatus.TRACE_FAILED
        got = f"{faint_mm:.1f} mm of {length_mm:.1f} mm of curve without a bright line"
        note = _sentence(got, "a quarter at most", "look at the picture")
    elif double_mm > MOST_DOUBLE_MM and not attempt.from_previous:
        status = FrameStatus.TRACE_AMBIGUOUS
        got, allowed = f"{double_mm:.1f} mm of line too bright for one strand", f"{MOST_DOUBLE_MM} mm at most"
        note = _sentence(
            got, allowed, "give the curve of the frame before, which tells strands in contact apart"
        )
    return Verdict(status, note, flagged, faint_mm, double_mm)


def _sentence(got: str, allowed: str, do: str) -> str:
    return f"trace: wire: got {got}; expected {allowed}; {do}"


def _ends_there(scene: Scene, points: Array) -> bool:
    """Whether the crest is nearer its usual height than nothing over the last TIP_VOXELS, and not so beyond the tip.

    A previous curve says where the wire lay, not how far it has been pushed since: that the frame alone must show.
    """
    h = float(scene.spacing.min())
    line = resampled(extended(points, TIP_VOXELS * h, h), h)
    grey = values_at(scene.grey, scene.spacing, 0.7 * h, np.ascontiguousarray(line))
    count = round(TIP_VOXELS)
    usual = float(np.median(grey[:-count]))
    behind, ahead = float(np.mean(grey[-2 * count : -count])), float(np.mean(grey[-count:]))
    return behind > 0.5 * usual and ahead < TIP_AHEAD * usual


def _weak(share: Array, spread: float) -> bool:
    """A previous curve is confirmed where the crest along it stands 3 standard deviations above nothing, nearly
    everywhere."""
    return bool(np.mean(share < 3.0 * spread) > 0.05)
