"""Pooled statistics of frames, and their intervals over insertions. Points are pooled, RMSEs never averaged."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.compare import intervals
from pipeline.compare.metrics import DISTAL_MM, OF_POINTS, distal, rms
from pipeline.compare.nulls import ANOTHER, rivals
from pipeline.model import Array
from pipeline.status import FrameStatus
from reports.schema import ERRORS

Row = Mapping[str, Any]
"""A row of errors.csv: values by the names of its columns; what does not apply is NaN, None or absent."""


class Scored(NamedTuple):
    """A frame that counts: its row of errors.csv, its point errors (n,) in mm and the insertion that it belongs to.

    arc_mm : (n,) where the points lie along the wire, from the entry.     guesses : for a frame of which the predictor
    ``another`` has a guess: by the insertion from which the guess was made, its sum of squares in mm^2 and the number
    of points.     case : the case of the frame; one insertion may be in several cases.
    """

    row: Row
    error_mm: Array
    arc_mm: Array
    insertion: str
    guesses: Mapping[str, tuple[float, int]] = {}
    case: str = ""


def is_pooled(row: Row, error_mm: Array | None) -> bool:
    """Whether a frame counts: it is ok and compared.

    This is the one population: summary.csv, the last line, ``overall`` in run.json and every figure of a case pool over
    these frames and no others.
    """
    return row["status"] == FrameStatus.OK.identifier and error_mm is not None and len(error_mm) > 0


def skill_of(rms_mm: float, null_mm: float) -> float:
    """Mean-square skill score 1 - (rms / null)^2 (Murphy 1988); NaN without a null."""
    return 1.0 - (rms_mm / null_mm) ** 2 if null_mm > 0 else float("nan")


def pooled(frames: Sequence[Scored], judged: Sequence[Scored] | None = None) -> dict[str, Any]:
    """Values of summary.csv over frames that count; empty where there are none.

    judged : those of them that skill_strongest is over; None is all.
    """
    if not frames:
        return {}
    points = np.array([len(frame.error_mm) for frame in frames], dtype=float)
    everything = np.concatenate([frame.error_mm for frame in frames])
    result: dict[str, Any] = {}
    for column in ERRORS:
        if column.name in OF_POINTS:
            result[column.pooled_name] = OF_POINTS[column.name](everything)
        elif column.name in DISTAL_MM:
            ends = [distal(frame.error_mm, frame.arc_mm, DISTAL_MM[column.name]) for frame in frames]
            result[column.pooled_name] = rms(np.concatenate(ends))
        elif column.pooled in POOLING:
            values = numbers(frames, column.name)
            result[column.pooled_name] = _over_frames(POOLING[column.pooled], values, points)
    result["tip_max_mm"] = _over_frames(POOLING["max"], numbers(frames, "tip_mm"), points)
    # by Pythagoras: one offset common to all frames is taken off, the part of the error along the wire that it explains
    left = result["arc_rms_mm"] ** 2 - result["depth_offset_mm"] ** 2
    result["arc_offset_rms_mm"] = float(np.sqrt(max(left, 0.0))) if np.isfinite(left) else float("nan")
    return result | _releases(frames) | _with_intervals(frames, frames if judged is None else judged, result)


def _releases(frames: Sequence[Scored]) -> dict[str, Any]:
    """How often tips let go, and the error without the frames in which they may have; empty without a budget."""
    if not np.isfinite(numbers(frames, "u_input_mm")).any():
        return {}
    calm = [frame for frame, p in zip(frames, numbers(frames, "release"), strict=True) if not np.isfinite(p)]
    told = [frame.row.get("released") for frame in frames]
    return {
        "release_frames": len(frames) - len(calm),
        "rms_calm_mm": rms(np.concatenate([np.zeros(0), *(frame.error_mm for frame in calm)])),
        **{f"releases_{word}": told.count(word) for word in RELEASED},
    }


RELEASED = ("both", "missed", "spurious")
"""What may become of a release: simulated and real, real alone, simulated alone."""


WITHIN_MM = 1.0
"""Largest 95th percentile of a frame that counts for ``within_1mm``."""


def within(rows: Iterable[Row], planned: int) -> float:
    """Share of ``planned`` frames with a result and a 95th percentile of at most 1 mm: a frame that fails adds none.

    NaN where frames have a result and none was compared.
    """
    found = [row.get("p95_mm") for row in rows if row["status"] == FrameStatus.OK.identifier]
    known = [float(mm) for mm in found if mm is not None]
    if not planned or (found and not known):
        return float("nan")
    return sum(mm <= WITHIN_MM for mm in known) / planned


def numbers(frames: Sequence[Scored], name: str) -> Array:
    """A column's values (frames,), NaN where a frame has none."""
    values = (frame.row.get(name) for frame in frames)
    return np.array([float("nan") if value is None else float(value) for value in values])


def squares_of(frames: Sequence[Scored]) -> Array:
    """Sums of squared point errors (frames,), mm^2."""
    return np.array([float(np.sum(frame.error_mm**2)) for frame in frames])


def by_insertion(frames: Sequence[Scored], *values: Array) -> list[Array]:
    """Sums (insertions,) of values (frames,) over the frames of each insertion, in the order of the insertions."""
    names = [frame.insertion for frame in frames]
    chosen = [np.array([name == one for name in names]) for one in dict.fromkeys(names)]
    return [np.array([float(of[rows].sum()) for rows in chosen]) for of in values]


def _with_intervals(frames: Sequence[Scored], judged: Sequence[Scored], values: Row) -> dict[str, Any]:
    """The intervals of two statistics (rms, median tip), skill with its own, and what these rest on.

    values : of the statistics.
    """
    points = np.array([len(frame.error_mm) for frame in frames], dtype=float)
    squares, nulls = squares_of(frames), points * numbers(frames, "null_centreline_rms_mm") ** 2
    names = list(dict.fromkeys(frame.insertion for frame in frames))
    parts = [[frame for frame in frames if frame.insertion == name] for name in names]
    ends = np.exp(0.5 * np.array(intervals.of_log_ratio(*by_insertion(frames, squares, points, points))))
    rms_ends = intervals.holding(values["rms_mm"], *map(float, ends))
    tips = intervals.of_medians([numbers(part, "tip_mm") for part in parts])
    mean_squares = [np.array([float(np.mean(f.error_mm**2)) for f in part]) for part in parts]
    found = {
        "insertions": len(names),
        "effective_frames": intervals.effective_frames(mean_squares),
        "rms_low_mm": rms_ends.low,
        "rms_high_mm": rms_ends.high,
        "tip_low_mm": tips.low,
        "tip_high_mm": tips.high,
    }
    if own_skill := skill(frames, squares, nulls):
        found |= own_skill | {"skill_frames": int(np.isfinite(nulls).sum())}
    best, said = strongest(judged) if judged else ({}, "")
    own = intervals.note(len(names))
    row, told = intervals.fields(found | best, own if said in ("", own) else f"{own}; {SKILL_STRONGEST} {said}")
    return row | {"interval": told}


SKILL_STRONGEST = "skill_strongest"


def skill(frames: Sequence[Scored], squares: Array, nulls: Array, rival: str = "") -> dict[str, float]:
    """Skill, with its interval, against a predictor's sums of squares (frames,), over the frames that have one.

    rival : the strongest predictor's name; empty: the centreline.  Empty where these frames hold less than LEAST_SHARE
    of all points: a skill of the few says nothing of the others' errors, which stand beside it.
    """
    known, points = np.isfinite(nulls), np.array([len(frame.error_mm) for frame in frames], dtype=float)
    if not nulls[known].sum() > 0 or points[known].sum() < LEAST_SHARE * points.sum():
        return {}
    kept = [frame for frame, is_known in zip(frames, known, strict=True) if is_known]
    squares, nulls, points = squares[known], nulls[known], points[known]
    rest = without_each(kept, squares, nulls) if rival == ANOTHER else None
    ends = intervals.of_log_ratio(*by_insertion(kept, squares, nulls, points), rest=rest)
    name, value = SKILL_STRONGEST if rival else "skill", 1.0 - float(squares.sum() / nulls.sum())
    # less error is more skill: the ends change places
    low, high = intervals.holding(value, 1.0 - float(np.exp(ends.high)), 1.0 - float(np.exp(ends.low)))
    return {name: value, f"{name}_low": low, f"{name}_high": high}


def without_each(frames: Sequence[Scored], squares: Array, nulls: Array) -> Array:
    """Sums (2, insertions) of the squares and of those of ``another``, leaving out each insertion in turn.

    The guesses that were made from the one that is left out are left out, too. Insertions serve each other as
    predictors, and an interval that takes them for independent covers in 76 to 78 % (Arvesen, Ann. Math. Stat. 40,
    1969, on U-statistics).
    """
    number = {name: n for n, name in enumerate(dict.fromkeys(frame.insertion for frame in frames))}
    sums = np.array(by_insertion(frames, squares, nulls))
    rest: Array = sums.sum(axis=1, keepdims=True) - sums
    for frame, square, null in zip(frames, squares, nulls, strict=True):
        whole, count = np.sum([*frame.guesses.values()], axis=0) if frame.guesses else (0.0, 0)
        for name in frame.guesses.keys() & number:
            its, points = frame.guesses[name]
            if count > points:
                rest[1, number[name]] += len(frame.error_mm) * (whole - its) / (count - points) - null
            else:  # without this insertion the frame has no guess
                rest[:, number[name]] -= square, null
    if one := all_guesses_of(frames):
        rest[:, number[one]] = np.nan
    return rest


def all_guesses_of(frames: Sequence[Scored]) -> str:
    """The insertion from which all guesses for the others were made; empty if there is none such."""
    names = dict.fromkeys(frame.insertion for frame in frames)
    found = (one for one in names if all(frame.guesses.keys() <= {one} for frame in frames if frame.insertion != one))
    return next(found, "")


LEAST_SHARE = 0.5
"""Share of the points for which a predictor must have a guess to take part, and all that take part must have one
together: the first frame has no previous one, and no path leads to some tips."""


def strongest(frames: Sequence[Scored]) -> tuple[dict[str, Any], str]:
    """Skill against the strongest predictor, its name, and a note on the interval.

    The strongest is the one with the least error among those that are told nothing of the frame. All predictors are
    judged on the same frames, of which ``strongest_frames`` is the number: one that has no guess for the hardest frame
    would look strong for that reason alone.
    """
    points = np.array([len(frame.error_mm) for frame in frames], dtype=float)
    result: dict[str, Any] = {"frame_spacing_mm": frame_spacing(frames)}
    nulls = {name: points * numbers(frames, f"null_{name}_rms_mm") ** 2 for name in rivals()}
    if ANOTHER in nulls and np.isfinite(nulls[ANOTHER]).any():
        known = np.isfinite(nulls[ANOTHER])
        result["null_another_rms_mm"] = float(np.sqrt(nulls[ANOTHER][known].sum() / points[known].sum()))
    names, common = judged({name: np.isfinite(of) for name, of in nulls.items()}, points)
    if not names:
        return result, ""
    best = min(names, key=lambda name: float(nulls[name][common].sum()))
    found = skill(frames, squares_of(frames), np.where(common, nulls[best], np.nan), best)
    if not found:
        return result, ""
    kept = [frame for frame, is_common in zip(frames, common, strict=True) if is_common]
    insertions = len({frame.insertion for frame in kept})
    on = {"strongest_null": best, "strongest_frames": len(kept), "strongest_insertions": insertions}
    return result | on | found, note_of_strongest(kept, best, insertions)


def note_of_strongest(frames: Sequence[Scored], rival: str, insertions: int) -> str:
    """As ``intervals.note``, and why there is none where all guesses hang on one insertion."""
    one = all_guesses_of(frames) if rival == ANOTHER and insertions >= intervals.FEWEST else ""
    return f"interval withheld: without {one} no frame has a guess" if one else intervals.note(insertions)


def frame_spacing(frames: Sequence[Scored]) -> float:
    """Median step in depth, mm, from a frame to the next one of its case; NaN where no case has two."""
    depths = numbers(frames, "insertion_mm")
    follows = [(a.insertion, a.case) == (b.insertion, b.case) for a, b in pairwise(frames)]
    steps = np.abs(np.diff(depths))[follows]
    return float(np.median(steps)) if len(steps) else float("nan")


def judged(known: Mapping[str, NDArray[np.bool_]], points: Array) -> tuple[list[str], NDArray[np.bool_]]:
    """The predictors that are compared with each other, and the frames (frames,) for which all of them have a guess.

    known : by predictor, the frames for which it has a guess.     points : (frames,) number of points. A predictor
    takes part if its frames hold LEAST_SHARE of all points. While the frames that all have in common hold less than
    that, the predictor is dropped that costs most of them.
    """

    def share(names: Sequence[str]) -> float:
        together = np.all([known[name] for name in names], axis=0)
        return float(points[together].sum() / points.sum())

    names = [name for name in known if share([name]) >= LEAST_SHARE]
    while names and share(names) < LEAST_SHARE:
        names.remove(max(names, key=lambda name: share([other for other in names if other != name])))
    return names, np.all([known[name] for name in names], axis=0) if names else np.zeros(len(points), bool)


def _over_frames(rule: Callable[[Array, Array], float], values: Array, points: Array) -> float:
    """A rule over the frames that have a value; NaN where none has."""
    known = np.isfinite(values)
    return rule(values[known], points[known]) if known.any() else float("nan")


POOLING: dict[str, Callable[[Array, Array], float]] = {
    # a frame's mean square times its number of points is a sum of squares
    "rms": lambda values, points: float(np.sqrt(np.sum(points * values**2) / points.sum())),
    "mean": lambda values, _: float(np.mean(values)),
    "weighted": lambda values, points: float(np.sum(points * values) / points.sum()),
    "share": lambda values, _: float(np.mean(values)),
    "median": lambda values, _: float(np.median(values)),
    "max": lambda values, _: float(np.max(values)),
}
"""Rules of ``Column.pooled`` from values of frames (n,) and their numbers of points (n,)."""
