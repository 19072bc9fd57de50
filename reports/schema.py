"""The columns of every table that a run writes: their names, order, units and meaning, defined once.

A name carries its unit (``_mm``, ``_deg``, ``_N``, ``_s``); one without is a count, a fraction or a text.
A value that does not apply is an empty field, never 0.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Column:
    """One column of a result table."""

    name: str
    """The header, exactly as written."""
    unit: str
    """mm, deg, N, s, MiB, 1 (a number without unit) or - (a text)."""
    meaning: str
    """One line for the reader."""
    kind: str = "float"
    """float, integer, boolean or text."""
    better: str = ""
    """low or high where a comparison of two runs has a direction, else empty."""


def _text(name: str, meaning: str) -> Column:
    return Column(name, "-", meaning, "text")


def _integer(name: str, meaning: str, better: str = "") -> Column:
    return Column(name, "1", meaning, "integer", better)


def _mm(name: str, meaning: str, better: str = "low") -> Column:
    return Column(name, "mm", meaning, "float", better)


def _fraction(name: str, meaning: str) -> Column:
    return Column(name, "1", meaning, "float", "high")


def _seconds(stage: str) -> Column:
    return Column(f"{stage}_s", "s", f"wall time of the stage `{stage}`", "float", "low")


_STAGE_SECONDS = tuple(_seconds(stage) for stage in ("load", "segment", "trace", "simulate", "compare"))

_NULLS = (
    ("centreline", "the lumen's centreline to the same depth"),
    ("shortest", "the shortest path inside the lumen"),
    ("min_bending", "the path of least bending inside the lumen"),
    ("previous", "the traced wire of the previous frame, extended to the new depth"),
)

ERRORS_COLUMNS: tuple[Column, ...] = (
    _integer("frame", "zero-based index of the frame"),
    _text("status", "ok, or the identifier of what went wrong; its sentence is in result.json"),
    _mm("insertion_mm", "arc length from the entry to the tip at which this frame was simulated", ""),
    Column("roll_deg", "deg", "roll of the wire about the entry direction, right-handed"),
    _mm("rms_mm", "root mean square distance, simulated wire to the traced curve"),
    _mm("mean_mm", "mean distance, simulated wire to the traced curve"),
    _mm("p95_mm", "95th percentile of the distance, simulated wire to the traced curve"),
    _mm("max_mm", "largest distance, simulated wire to the traced curve"),
    _mm("back_rms_mm", "root mean square distance the other way, traced curve to the simulated wire"),
    _mm("hausdorff_mm", "largest distance either way"),
    _mm("arc_rms_mm", "root mean square distance between points at equal arc length from the entry"),
    _mm("arc_max_mm", "largest distance between points at equal arc length from the entry"),
    _mm("tip_mm", "distance between the two tips"),
    Column("tip_angle_deg", "deg", "angle between the two tangents at the tip", "float", "low"),
    Column("branch_ok", "1", "both tips lie in the same branch of the lumen", "boolean", "high"),
    *(_mm(f"null_{name}_rms_mm", f"rms_mm of a trivial predictor: {what}", "") for name, what in _NULLS),
    _fraction(
        "skill", "1 - rms_mm^2 / null_centreline_rms_mm^2; 1 is perfect, 0 no better than the centreline"
    ),
    _fraction("coverage", "fraction of the traced curve that the comparison used"),
    _mm("trace_sigma_mm", "standard deviation of the traced curve across the wire: the floor of the errors"),
    _mm("max_penetration_mm", "deepest overlap of the simulated wire with the soft wall"),
    Column("push_force_N", "N", "axial force at the introducer"),
    _integer("joints", "number of joints of the simulated wire"),
    _integer("iterations", "iterations of the relaxation at this depth", "low"),
    *_STAGE_SECONDS,
    _mm("trace_mean_mm", "with truth: mean distance, traced curve to the true wire"),
    _mm("trace_max_mm", "with truth: largest distance, traced curve to the true wire"),
    _mm("trace_tip_mm", "with truth: distance of the traced tip from the true tip"),
    _mm("truth_rms_mm", "with truth: root mean square distance, simulated wire to the true wire"),
    _mm("truth_tip_mm", "with truth: distance of the simulated tip from the true tip"),
)

POINTS_COLUMNS: tuple[Column, ...] = (
    _integer("frame", "zero-based index of the frame"),
    _mm("arc_mm", "arc length from the entry along the simulated wire", ""),
    _mm("x_mm", "LPS coordinate, towards the patient's left", ""),
    _mm("y_mm", "LPS coordinate, towards the patient's back", ""),
    _mm("z_mm", "LPS coordinate, towards the patient's head", ""),
    _mm("error_mm", "distance of this point to the traced curve"),
    _mm("foot_arc_mm", "arc length of the nearest place on the traced curve", ""),
    Column("contact_force_N", "N", "magnitude of the wall's force on the wire here"),
)

SUMMARY_COLUMNS: tuple[Column, ...] = (
    _text("case", "identifier of the case"),
    _text("group", "the insertion or phantom that the case belongs to, the unit of the bootstrap"),
    _text("role", "validation or calibration"),
    _text("status", "ok, or the identifier of what went wrong"),
    _integer("frames", "number of frames", "high"),
    _integer("frames_ok", "frames that were traced, simulated, converged and compared", "high"),
    _integer("frames_failed", "frames with any other status", "low"),
    _mm("rms_mm", "root mean square over all points of all frames (pooled, never averaged)"),
    _mm("rms_low_mm", "lower end of the 95 % block-bootstrap interval of rms_mm", ""),
    _mm("rms_high_mm", "upper end of the 95 % block-bootstrap interval of rms_mm", ""),
    _mm("mean_mm", "mean over all points of all frames"),
    _mm("p95_mm", "95th percentile over all points of all frames"),
    _mm("max_mm", "largest distance of any point of any frame"),
    _mm("tip_median_mm", "median over frames of the distance between the tips"),
    _mm("tip_low_mm", "lower end of the 95 % block-bootstrap interval of tip_median_mm", ""),
    _mm("tip_high_mm", "upper end of the 95 % block-bootstrap interval of tip_median_mm", ""),
    _mm("arc_rms_mm", "root mean square distance at equal arc length, pooled"),
    *(_mm(f"null_{name}_rms_mm", f"pooled rms of a trivial predictor: {what}", "") for name, what in _NULLS),
    _fraction("skill", "1 - rms_mm^2 / null_centreline_rms_mm^2, pooled"),
    Column("skill_low", "1", "lower end of the 95 % block-bootstrap interval of skill"),
    Column("skill_high", "1", "upper end of the 95 % block-bootstrap interval of skill"),
    _fraction("branch_ok_fraction", "fraction of frames whose tips lie in the same branch"),
    _fraction("coverage", "fraction of the traced curves that the comparison used"),
    _mm("trace_mean_median_mm", "with truth: median over frames of trace_mean_mm"),
    _mm("trace_tip_median_mm", "with truth: median over frames of trace_tip_mm"),
    _mm("truth_rms_mm", "with truth: pooled root mean square distance, simulated to true wire"),
    _mm("max_penetration_mm", "deepest overlap of the simulated wire with the soft wall, over all frames"),
    Column("push_force_max_N", "N", "largest axial force at the introducer, over all frames"),
    *_STAGE_SECONDS,
    Column("total_s", "s", "wall time of the case", "float", "low"),
    Column("peak_memory_MiB", "MiB", "largest resident memory of the process", "float", "low"),
)

FAILURES_COLUMNS: tuple[Column, ...] = (
    _text("case", "identifier of the case"),
    _integer("frame", "zero-based index of the frame; empty where the whole case failed"),
    _text("stage", "load, segment, trace, simulate, compare or report"),
    _text("status", "identifier of what went wrong"),
    _text("sentence", "what the status means"),
    _text("message", "what, where, got, allowed, do this"),
    _text("log", "path of the log, relative to the output folder"),
)

SWEEP_COLUMNS: tuple[Column, ...] = (
    _text("parameter", "the setting that was varied, table.key"),
    _text("value", "its value in this run"),
    _text("case", "identifier of the case"),
    _mm("rms_mm", "pooled root mean square distance, simulated wire to the traced curve"),
    _mm("tip_median_mm", "median over frames of the distance between the tips"),
    _mm("truth_rms_mm", "with truth: pooled root mean square distance, simulated to true wire"),
    _fraction("skill", "1 - rms_mm^2 / null_centreline_rms_mm^2, pooled"),
    _integer("frames_ok", "frames that were traced, simulated, converged and compared", "high"),
)


def names(columns: Iterable[Column]) -> tuple[str, ...]:
    """Headers in order."""
    return tuple(column.name for column in columns)


def check_names(given: Iterable[str], columns: Iterable[Column], where: str) -> None:
    """Refuse a name that the schema does not have; ``where`` (a file) goes into the message."""
    allowed = names(columns)
    unknown = sorted(set(given) - set(allowed))
    if unknown:
        near = difflib.get_close_matches(unknown[0], allowed, n=1)
        hint = f"did you mean {near[0]}?" if near else f"known columns: {', '.join(allowed)}"
        msg = f"unknown column {unknown[0]!r} in {where}; {hint}"
        raise ValueError(msg)
