"""One way of explaining a frame: a path, the tube fitted along it, and how well that explains the grey."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from pipeline.arrays.polyline import turns_deg
from pipeline.model import Array, Curve, arc_length
from pipeline.trace.crests import BEND, Tracklet, find_crests
from pipeline.trace.knots import FIRST_BLUR, IN_HOOKS, first_tube
from pipeline.trace.link import Path, first_ahead, link, resampled, with_doubles
from pipeline.trace.onward import beyond
from pipeline.trace.profile import LEAST_LEVEL, ended
from pipeline.trace.stated import Opacity, ended_as_stated
from pipeline.trace.steps import EVEN
from pipeline.trace.subtraction import Subtraction, numbered
from pipeline.trace.tube import Tube, fit_tube, predicted, weights

ENTRY_REACH_MM = 4.0
"""How far from the manifest's entry the wire may pass."""
PREFIX_MM = 3.0
"""Length of wire before the entry that is fitted as well, so that its end does not disturb the fit at the entry."""
STREAK_SHARE = 0.2
"""Crest grey, as a share of the wire's peak, below which a bright line is a streak of the wire: a second wire's crest
has 0.6 to 0.9 of it, streaks of steel in a cone-beam scan reach a few hundredths."""
MOST_SHARP_DEG = 60.0
"""Angle within a voxel beyond which a fit has folded: right curves turn by up to 27 (a J tip), folds by 60 to 170."""
SETTLED = (80, 1e-3)
"""Iterations and tolerance of fits with knots IN_HOOKS apart: the prior's weights follow the bend slowly (10 to 50
steps). Stopped at 0.02 voxel, after 3 to 6, tips of 2.7 to 4.3 voxels lay 0.1 to 0.2 voxel from where the fit leads."""
NEAR_VOXELS = 2.5
"""Crests nearer than this to the curve belong to it."""


@dataclass(frozen=True, eq=False)
class EntryPose:
    """The point (3,) at which the wire enters and its direction there (3,), in kernel coordinates; and its depth.

    expected_mm, opacity : insertion depth, mm, and brightness that the manifest gives; None where it gives none.
    """

    point: Array
    direction: Array
    expected_mm: float | None = None
    opacity: Opacity | None = None


@dataclass(frozen=True, eq=False)
class Attempt:
    """A fitted tube with the path that led to it. off : what it does not explain of the crests, see ``_off``.

    pieces : all crests that were seen; known : points (n, 3) that count as explained besides the tube's.
    behind_mm : length of the line before the path's first point, outside the entry.  goes_on : whether something faint
    is seen past its tip.  missing_mm : what it lacks of the depth that the manifest states, NaN for none stated.
    short : whether it is hardly any of that depth, agrees : whether it is that depth.  late_mm : wire missing at the
    entry.
    """

    tube: Tube
    path: Path
    off: list[tuple[Array, float]]
    pieces: list[Tracklet]
    known: Array
    from_previous: bool = False
    behind_mm: float = 0.0
    goes_on: bool = False
    short: bool = False
    agrees: bool = False
    late_mm: float = 0.0
    missing_mm: float = float("nan")

    @property
    def leftover_mm(self) -> float:
        """How much of the crests it does not explain."""
        return sum(length for _, length in self.off)

    @property
    def elsewhere(self) -> Array:
        """Points (m, 3) of the crests that it does not explain."""
        return np.concatenate([np.zeros((0, 3)), *(points for points, _ in self.off)])

    @property
    def depth_stated(self) -> bool:
        """Whether the manifest states a depth."""
        return not np.isnan(self.missing_mm)

    @property
    def cut(self) -> bool:
        """Wire goes on before the path's first point."""
        return self.behind_mm > 0.0

    def cnr(self, image: Subtraction) -> float:
        """Median peak above the background over the noise of one voxel."""
        return self.tube.peak / image.noise

    def brightness(self, image: Subtraction) -> str:
        """Its ``cnr`` in words: a peak below the background, which a fit may reach, says nothing as a number."""
        cnr = self.cnr(image)
        return f"{cnr:.1f} noises bright" if cnr > 0 else "no brighter than what is around it"


def _fitted(
    image: Subtraction, points: Array, cut: bool, entry: EntryPose, find_tip: bool = True, knots: float | None = None
) -> Tube | None:
    """The tube along a path; None where the path is so wrong that its equations have no solution.

    cut : wire goes on before the path's first point.  knots : voxels from one to the next, see ``first_tube``.
    """
    h = image.voxel
    try:
        line, steps = resampled(points, 0.5 * h), EVEN
        if find_tip and entry.opacity is None:
            line, steps = ended(image, line, FIRST_BLUR * h)
        elif find_tip and entry.opacity is not None:
            line, steps = ended_as_stated(image, line, FIRST_BLUR * h, entry.opacity)
        plane = (line[0] + 2.0 * h * entry.direction, entry.direction) if cut else None
        limits = SETTLED if knots == IN_HOOKS else ()
        return fit_tube(image, replace(first_tube(image, line, steps, knots), start_plane=plane), *limits)
    except (np.linalg.LinAlgError, ValueError):
        return None


def dense(tube: Tube, step: float) -> Array:
    """Points of the tube's curve about ``step`` mm apart."""
    return tube.at(np.linspace(0, tube.intervals, max(3, round(tube.length_mm / step) + 1)))


def sharpest_deg(image: Subtraction, tube: Tube) -> float:
    """Largest angle by which the tube's curve turns within a voxel."""
    line = resampled(dense(tube, 0.1 * image.voxel), 0.5 * image.voxel)
    return float(turns_deg(line, 2).max(initial=0.0))


def _off(image: Subtraction, tube: Tube, pieces: list[Tracklet], known: Array) -> list[tuple[Array, float]]:
    """What of the pieces lies off the tube and off ``known`` points (n, 3): points (m, 3) and length (mm) of each.

    Pieces that are off by less than 1.5 NEAR_VOXELS are noise, and pieces fainter than a share of the wire are its own
    streaks, not another device.
    """
    near = NEAR_VOXELS * image.voxel
    tree = cKDTree(np.concatenate([known, dense(tube, image.voxel)]))
    levels = tube.steps.levels
    dimmest = float(levels[levels > LEAST_LEVEL].min(initial=1.0))  # what is dimmer yet is no wire, but a gap
    least = STREAK_SHARE * tube.peak * min(1.0, 2.0 * dimmest + 0.1)
    found = []
    for piece in pieces:
        if piece.grey >= least:
            points = piece.points[::2]
            far = ~np.isfinite(tree.query(points, distance_upper_bound=near)[0])
            off = float(np.mean(far)) * piece.length
            if off > 1.5 * near:
                found.append((points[far], off))
    return found


def _attempt(
    image: Subtraction, path: Path, entry: EntryPose, pieces: list[Tracklet], known: Array, behind_mm: float = 0.0
) -> Attempt | None:
    """The tube along a path, and what it leaves of the pieces; None where there is no such tube."""
    tube = _fitted(image, path.points, behind_mm > 0.0, entry)
    if tube is None:
        return None
    return Attempt(tube, path, _off(image, tube, pieces, known), pieces, known, behind_mm=behind_mm)


def _left_beyond(image: Subtraction, attempt: Attempt, tube: Tube) -> bool:
    """Whether a tube fitted along what goes on beyond an attempt's tip has left it there.

    One that is hardly longer has not where nothing is left beyond its own tip: the attempt had missed the end by a
    voxel or two, and the rest of it looked like another line.
    """
    more = tube.length_mm - attempt.tube.length_mm
    if more > 3.0 * image.voxel:
        return False
    path, stray = beyond(image, tube, dense(tube, 0.5 * image.voxel), attempt.known)
    return more <= 0.0 or path is not None or stray


def prolonged(image: Subtraction, attempt: Attempt, entry: EntryPose) -> Attempt | None:
    """The attempt with what goes on beyond its tip; None where nothing does.

    The same attempt, marked as going on, where something is seen that no fit reaches.
    """
    line = dense(attempt.tube, 0.5 * image.voxel)
    path, stray = beyond(image, attempt.tube, line, attempt.known)
    if path is None and stray:
        return replace(attempt, goes_on=True)
    if path is None:
        # a dim end is looked for straight ahead; once more from where it was found, as wires bend
        found = again(image, attempt, entry) if len(attempt.tube.steps.edges) else attempt
        return found if found.tube.length_mm > attempt.tube.length_mm + image.voxel else None
    tube = _fitted(image, path.points, attempt.cut, entry)
    if tube is None or _left_beyond(image, attempt, tube):
        # noise leads one straight piece on at 2 of 250 tips; taken for it, 18 of 615 short faint ends were cut off
        return replace(attempt, goes_on=True)
    gaps = attempt.path.points[attempt.path.bridged]
    points = np.concatenate([gaps, path.points])
    path = Path(points, np.concatenate([np.ones(len(gaps), bool), path.bridged]), attempt.path.bridges + path.bridges)
    known = np.concatenate([attempt.known, path.points])
    return replace(attempt, tube=tube, path=path, known=known, off=_off(image, tube, attempt.pieces, known))


def _from_entry(path: Path, entry: EntryPose) -> Path:
    """The path from at most PREFIX_MM before the entry plane."""
    away = np.linalg.norm(path.points - entry.point, axis=1)
    along = (path.points - entry.point) @ entry.direction
    # only what comes before the point nearest the entry is prefix: the wire may come back past the plane
    nearest = int(np.argmin(away))
    too_far = (along[:nearest] < -PREFIX_MM) | (away[:nearest] > ENTRY_REACH_MM + PREFIX_MM)
    start = int(np.flatnonzero(too_far)[-1]) + 1 if too_far.any() else 0
    return Path(path.points[start:], path.bridged[start:], path.bridges)


def cold(
    image: Subtraction, entry: EntryPose, sigma_voxel: float, seed_sigmas: float, gap_mm: float, bend: float = BEND
) -> Attempt | None:
    """From the frame alone: crests, linked from the entry, ended at the tip, fitted."""
    crests = find_crests(image, sigma_voxel, seed_sigmas, bend)
    shortest = 3.0 * sigma_voxel * image.voxel
    pieces = with_doubles([p for p in crests if p.length > shortest] or crests)
    whole = link(pieces, entry.point, entry.direction, gap_mm, ENTRY_REACH_MM)
    if whole is None:
        return None
    path = _from_entry(whole, entry)
    if arc_length(path.points)[-1] < 3 * image.voxel:
        return None
    behind = len(whole.points) - len(path.points)
    behind_mm = float(arc_length(whole.points[: behind + 1])[-1]) if behind else 0.0
    return _attempt(image, path, entry, pieces, whole.points, behind_mm)


def beside(image: Subtraction, attempt: Attempt, pieces: list[Tracklet]) -> Attempt:
    """The attempt with its leftover by the crests of another one, which may be apart where its own have merged."""
    return replace(attempt, pieces=pieces, off=_off(image, attempt.tube, pieces, attempt.known))


def again(image: Subtraction, attempt: Attempt, entry: EntryPose, knots: float | None = None) -> Attempt:
    """The attempt fitted anew, tip and all, to another image of the same frame or with other knots; itself where that
    has no solution.  knots : voxels from one to the next, see ``first_tube``.
    """
    tube = _fitted(image, dense(attempt.tube, 0.5 * image.voxel), attempt.cut, entry, knots=knots)
    return attempt if tube is None else replace(attempt, tube=tube)


def warm(image: Subtraction, entry: EntryPose, previous: Curve, crests_voxel: float, gap_mm: float) -> Attempt | None:
    """From the curve of the frame before: refit it, take its grey away, and follow what is left on from its tip.

    The only way through strands that lie in contact, whose crests have merged into one.
    """
    h = image.voxel
    old = image.local(previous.points_mm)
    tube = _fitted(image, old, False, entry, find_tip=False) if len(old) >= 8 else None
    if tube is None:
        return None
    line = dense(tube, 0.5 * h)
    voxels, model = predicted(image, tube)
    with image.showing(voxels, image.grey.reshape(-1)[voxels] - model.astype(np.float32)):
        rest = find_crests(image, crests_voxel)
    heading = line[-1] - line[-max(2, min(8, len(line) // 2))]
    path = Path(line, np.zeros(len(line), bool), 0)
    onward = link(rest, line[-1], heading / np.linalg.norm(heading), gap_mm, 5.0 * h)
    if onward is not None:
        first = first_ahead(onward.points, line[-1], heading)
        points = np.concatenate([line, onward.points[first:]])
        path = Path(points, np.concatenate([path.bridged, onward.bridged[first:]]), onward.bridges)
    found = _attempt(image, path, entry, rest, np.zeros((0, 3)))
    return None if found is None else replace(found, from_previous=True)


def misfit(image: Subtraction, attempts: list[Attempt]) -> list[float]:
    """Sum of squares of what each attempt leaves, over the voxels that any of them claims, in noise variances.

    Those before one's start plane count for none: else the attempt that reaches further out of the entry wins.
    """
    radius = 3.0 * max(a.tube.sigma for a in attempts)
    curve = np.concatenate([dense(a.tube, image.voxel) for a in attempts])
    out = []
    with numbered(image, curve, radius) as (voxels, slot):
        weight = np.prod([weights(image, a.tube, voxels) for a in attempts], axis=0)
        for attempt in attempts:
            left = image.grey.reshape(-1)[voxels].astype(float)
            own, model = predicted(image, attempt.tube)
            at = slot.reshape(-1)[own] - 1
            left[at[at >= 0]] -= model[at >= 0]
            out.append(float(weight @ left**2) / image.noise**2)
    return out
