"""Is the curve right? What the grey along it says, what it leaves unexplained, and what the manifest expected."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Array, arc_length
from pipeline.status import FrameStatus
from pipeline.trace.attempt import Attempt
from pipeline.trace.ends import (
    TIP_BESIDE,
    Objection,
    beside_itself,
    of_a_pair,
    of_its_width,
    of_the_ends,
    of_the_frame,
    of_the_lumen,
    of_the_way,
    of_the_whole,
)
from pipeline.trace.link import extended, resampled
from pipeline.trace.profile import LEAST_LEVEL
from pipeline.trace.section import (
    Section,
    as_sharp,
    paired,
    paired_in_part,
    places_around,
    read_around,
    second_harmonic,
    section_along,
)
from pipeline.trace.sharpness import blur_by_axis
from pipeline.trace.steps import Steps
from pipeline.trace.strands import DOUBLE, STRANDS_VOXELS, doubled, of_one_strand
from pipeline.trace.subtraction import CREST_VOXELS, Subtraction
from pipeline.trace.tube import Tube
from pipeline.trace.width import as_fitted

LEAST_CNR = 2.5
"""Contrast over noise below which a frame alone does not give a curve."""
SURE_LINE = 10.0
"""The same times the root of the voxels that a curve is long. Of 284 frames without a wire lines have up to 9.6 (4.0
noises over 5.8 voxels), wires of a contrast of 4 have 8 at 1 mm (3.3 voxels), 10 to 12 at 2 mm; of 5, 10 at 1 mm."""
LEAST_WITH_PRIOR = 1.5
"""The same with a previous curve, which does not help below that: the frame no longer shows where the wire ends."""
NARROWEST = 0.7
"""Least width of a faint line over the scanner's blur: only noise is narrower."""
LEAST_SEEN = 2.0
"""Least contrast over noise where that counts as it disturbs the fit: correlated over 0.8 voxel it counts 2.4-fold.
Below it the wire is followed in pieces (on tuning seeds, right curves had 2.1 and more, wrong ones 1.9 and less)."""
SURE_CNR = 5.0
"""Contrast over noise from which crests at the finest blur are enough."""
FAINT = 0.35
"""Share of the usual crest grey below which there is no wire to be seen: a gap."""
LEFTOVER_MM = 2.5
"""Length of crests that run elsewhere from which the curve may be the wrong one."""
FAINT_LEFTOVER_MM = 4.0
"""The same (and a tenth of the curve) below SURE_CNR: crests are looked for lower there, and noise makes some."""
MOST_FAINT_MM = 5.0
"""Length without a bright line that a curve may have if that is less than a quarter of it (a gap is 3 mm)."""
MOST_DOUBLE_MM = 2.0
"""Length of line that may be two strands (a crossing is 1 mm) from which a frame alone does not decide."""
MOST_OUTSIDE = 0.03
"""Share of the curve that may lie over two voxels outside the lumen."""
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


def note_of(got: str, allowed: str, do: str) -> str:
    """What the report says of a curve that does not stand."""
    return f"trace: wire: got {got}; expected {allowed}; {do}"


def _averaged(values: Array, width: int) -> Array:
    """Running mean; the ends see a shorter window."""
    kernel = np.ones(min(width, len(values)))
    return np.asarray(np.convolve(values, kernel, "same") / np.convolve(np.ones(len(values)), kernel, "same"))


def shares_of(tube: Tube, points: Array) -> Array:
    """Shares (n,) of the tube's length at which points (n, 3) lie, the last at its end."""
    arc = arc_length(points)
    return np.asarray(1.0 - (arc[-1] - arc) / max(tube.length_mm, arc[-1]))


def _crest_share(image: Subtraction, attempt: Attempt, points: Array, step_mm: float) -> tuple[Array, Array]:
    """Grey on the curve (n,) over its usual height along the wire, averaged over MEAN_OVER_MM, and its noise (sd).

    The usual height is the stated one, where one is stated. The blur in which grey is read leaves 0.36 of the noise,
    the mean the rest.
    """
    grey, steps = image.along(points), attempt.tube.steps
    height = steps.at(shares_of(attempt.tube, points)) if steps.stated else np.ones(len(points))
    usual = float(np.median(grey / height)) if steps.stated else _usual(grey, steps)
    share = _averaged(grey / height, max(1, round(MEAN_OVER_MM / step_mm))) / max(usual, 1e-9)
    count = max(1.0, MEAN_OVER_MM / max(step_mm, 1.5 * image.voxel))
    gain = 1.0 + (CREST_VOXELS * image.voxel / attempt.tube.sigma) ** 2
    cnr = attempt.cnr(image)
    return share, 0.4 * gain / cnr / float(np.sqrt(count)) / height if cnr > 0.0 else np.full(len(points), np.inf)


def _usual(grey: Array, steps: Steps) -> float:
    """The usual crest grey (n,): its median, over the longest piece where there are steps."""
    if len(steps.levels) == 1:
        return float(np.median(grey))
    piece = np.searchsorted(steps.edges, np.linspace(0.0, 1.0, len(grey)))
    length = np.bincount(piece, minlength=len(steps.levels)) * (steps.levels > LEAST_LEVEL * steps.levels.max())
    return float(np.median(grey[piece == int(np.argmax(length))]))


def _outside(image: Subtraction, points: Array) -> NDArray[np.bool_]:
    """Points in the box whose nearest voxel is further than two voxels outside the wall."""
    index = np.rint(points / image.spacing).astype(int)
    inside = np.all((index >= 0) & (index < np.array(image.region.box.shape)), axis=1)
    return np.asarray(inside & (image.depth_at(points) > 2.0 * image.voxel))


def _ends_there(image: Subtraction, points: Array) -> bool:
    """Whether the crest is above half its usual height over the last TIP_VOXELS, and below TIP_AHEAD of it beyond.

    A previous curve says where the wire lay, not how far it has been pushed since: only the frame can show that.
    """
    h = image.voxel
    grey = image.along(resampled(extended(points, TIP_VOXELS * h, h), h))
    count = round(TIP_VOXELS)
    usual = float(np.median(grey[:-count]))
    behind, ahead = float(np.mean(grey[-2 * count : -count])), float(np.mean(grey[-count:]))
    return behind > 0.5 * usual and ahead < TIP_AHEAD * usual


def seen_steps(steps: Steps, share: Array) -> NDArray[np.bool_]:
    """Points, at shares (n,) of the length, of a dimmer part of the wire that reaches one of its ends.

    What is dim between two bright parts is a gap; what is dim up to an end is a shaft beside a coil, or a plastic tip.
    """
    piece = np.searchsorted(steps.edges, share)
    levels = steps.levels / max(float(np.max(steps.levels)), 1e-9)
    dim = (levels > 0.6 * LEAST_LEVEL) & (levels < 2.0 * FAINT)
    last = len(dim) - 1
    from_start, to_end = np.logical_and.accumulate(dim), np.logical_and.accumulate(dim[::-1])[::-1]
    return np.asarray((from_start | to_end)[piece] & (last > 0) & (not steps.stated))


def judge(image: Subtraction, attempt: Attempt, points: Array, bridged: NDArray[np.bool_], length_mm: float) -> Verdict:
    """The verdict on a curve, points (n, 3) local."""
    step = length_mm / max(1, len(points) - 1)
    share, noise = _crest_share(image, attempt, points, step)
    ends = np.minimum(np.arange(len(points)), np.arange(len(points))[::-1]) * step
    known = seen_steps(attempt.tube.steps, shares_of(attempt.tube, points))
    faint = (share < FAINT + noise) & (ends > MEAN_OVER_MM) & ~known
    places = places_around(points, attempt.tube.sigma)
    read = read_around(image, places)
    fitted = as_fitted(image, attempt.tube, places)
    double, pair = beside_itself(points, step, STRANDS_VOXELS * image.voxel), 0.0
    if not image.thick_slices:
        section = section_along(image, points, read)
        pair = _pair(image, section, attempt.tube, second_harmonic(fitted[0]), points)
        alone = share / of_one_strand(share, (ends > MEAN_OVER_MM) & ~bridged & ~faint)
        double |= doubled(alone, section.oblong, np.maximum(DOUBLE, 1.0 + 4.0 * noise), section.noise)
    outside = _outside(image, points)
    faint_mm, double_mm = (float(np.count_nonzero(m)) * step for m in (faint & ~bridged, double))
    objections = of_the_frame(image) + of_the_way(attempt, length_mm)
    objections += _of_the_line(image, attempt, points, (share, noise, outside), (faint_mm, double_mm, length_mm))
    folded = bool(beside_itself(points, step, TIP_BESIDE * image.voxel)[-1])
    objections += of_a_pair(pair, attempt)
    objections += of_the_ends(image, attempt, points, length_mm, folded=folded) + of_the_lumen(image, attempt, points)
    objections += of_its_width(image, attempt, points, (read, fitted), folded=folded)
    objections += of_the_whole(image, attempt, points, length_mm)
    first = next(((status, note_of(*why)) for holds, status, *why in objections if holds), (FrameStatus.OK, ""))
    return Verdict(*first, bridged | faint | double | outside, faint_mm, double_mm)


def _pair(image: Subtraction, section: Section, tube: Tube, fitted: NDArray[np.complex128], points: Array) -> float:
    """How far out of round the line is, all along or in part, over what one wire's may be; fitted : the tube's own.

    A line that is further out than that is looked at once more without what the scanner makes of any wire.
    """
    found = _out_of_round(image, section, fitted, points)
    blur = blur_by_axis(image, points, tube.sigma) if found > 1.0 else None
    if blur is None:
        return found
    left = section.without(as_sharp(image, points, tube.sigma, blur))
    return _out_of_round(image, left, fitted, points)


def _out_of_round(image: Subtraction, section: Section, fitted: NDArray[np.complex128], points: Array) -> float:
    """The larger of that of the whole line, and of the worst part of it."""
    length_mm = section.step_mm * (len(points) - 1)
    return max(paired(image, section, length_mm), paired_in_part(image, section, fitted, points))


def _of_the_line(
    image: Subtraction,
    attempt: Attempt,
    points: Array,
    seen: tuple[Array, Array, NDArray[np.bool_]],
    lengths: tuple[float, float, float],
) -> tuple[Objection, ...]:
    """What may be wrong along a curve (n, 3)."""
    (share, noise, outside), (faint_mm, double_mm, length_mm) = seen, lengths
    left_mm, cnr, prior = attempt.leftover_mm, attempt.cnr(image), attempt.from_previous
    least_cnr = max(LEAST_CNR, SURE_LINE / np.sqrt(max(1.0, length_mm / image.voxel)))
    most_mm = LEFTOVER_MM if cnr > SURE_CNR else max(FAINT_LEFTOVER_MM, 0.1 * length_mm)
    # a previous curve is confirmed where the crest along it stands 3 sd above nothing, nearly everywhere
    confirmed = prior and cnr > LEAST_WITH_PRIOR and not np.mean(share < 3.0 * noise) > 0.05
    thin = attempt.tube.sigma < NARROWEST * image.wall_blur_mm and not image.thick_slices
    return (
        (thin and cnr < SURE_CNR, FrameStatus.TRACE_LOW_CONTRAST,
         f"a line of blur {attempt.tube.sigma:.2f} mm, {attempt.brightness(image)}",
         f"no less than {NARROWEST:g} of the scanner's own blur, {image.wall_blur_mm:.2f} mm",
         "check that the frame shows a wire; scan with more dose; an ok frame of a smaller depth before it helps, too"),
        (cnr < least_cnr and not (confirmed and _ends_there(image, points)), FrameStatus.TRACE_LOW_CONTRAST,
         f"{length_mm:.1f} mm of line, {attempt.brightness(image)}",
         f"{least_cnr:.1f} where it is so long, or the curve of the frame before, confirmed by this one",
         "check that the frame shows a wire; scan with more dose; an ok frame of a smaller depth before it helps, too"),
        (outside.mean() > MOST_OUTSIDE, FrameStatus.TRACE_LEFT_LUMEN,
         f"{100 * outside.mean():.3g} % of the curve over 2 voxels outside the lumen",
         f"{100 * MOST_OUTSIDE:.0f} % at most", "check the lumen, and whether the phantom moved between the scans"),
        (left_mm > most_mm, FrameStatus.TRACE_AMBIGUOUS,
         f"{left_mm:.1f} mm of bright line off the curve", f"{most_mm:.1f} mm at most",
         "look for a second device or a wrong turn at a crossing"),
        (faint_mm > MOST_FAINT_MM and faint_mm > 0.25 * length_mm, FrameStatus.TRACE_FAILED,
         f"{faint_mm:.1f} mm of {length_mm:.1f} mm of curve without a bright line", "a quarter at most",
         "look at the picture"),
        (double_mm > MOST_DOUBLE_MM and not prior, FrameStatus.TRACE_AMBIGUOUS,
         f"{double_mm:.1f} mm of line too bright or too wide for one strand", f"{MOST_DOUBLE_MM} mm at most",
         "list a frame of a smaller depth before it, whose curve tells strands apart, or look for a second wire"),
    )  # fmt: skip
