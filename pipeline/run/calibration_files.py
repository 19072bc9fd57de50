"""The files of a calibration: parameters.toml for runs, calibration.json for its page, design.json for a plan."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.calibrate.design import Predicted
from pipeline.calibrate.estimates import Calibration, Estimate
from pipeline.calibrate.insertions import ROLL as STATED_ROLL
from pipeline.calibrate.insertions import beyond_their_priors, moved_of, stated_as_exact
from pipeline.calibrate.unknowns import BENDING, FRICTION, REST, ROLL, TAPER, WALL, Unknown, bent, lacking, wall_factor
from pipeline.model import Wire
from pipeline.run.calibrated import data_of
from pipeline.run.calibrated_wire import wire_rows
from pipeline.run.calibration import Gathered, depth_offset
from pipeline.run.provenance import code_state
from pipeline.run.results import write_json
from pipeline.study.parameters import Parameters, read_parameters
from reports.atomic import write_text

DEPTH = Unknown("depth_offset_mm", 0.0, 5.0, -np.inf, np.inf, 0.0, 0.25, "mm added to stated depths")
"""What is not fitted, but taken from the depths that a fit leaves."""
MISFIT = 2.0
IF_RIGHT = "what is seen holds only if all else is right, which the misfit denies: see the warnings"
"""Above what is seen where the wires do not meet the traces: of a shaft stated as soft as the tip a wall was 0.06."""
APART = "the insertions want no common one: see the warning"
ADVICE = {
    ROLL: "a tip with a curve, seen free of the wall; a frame whose tip does not touch tells the roll best",
    REST: "frames in which the tip lies free; a tip that is pressed straight shows little of its curve",
    TAPER: "deeper insertions, so that tip and shaft bend in the same frame, and a bend wherever the stiffness changes",
    WALL: "a softer wall or a sharper bend: the wire must press in by several times what the wall is known to",
    FRICTION: "the same depths once pushed and once pulled: friction changes sides",
    BENDING: "push_force_N of every frame, or a sag scan: a free overhang of a wire with weight_N_per_mm",
    DEPTH.name: "insertion_mm of every frame, in three insertions or more",
}
"""What to measure so that a parameter is seen, by its name."""


def _advice(name: str, wire: Wire) -> str:
    """What to measure so that a parameter is seen, or what to state where the wire as stated does not have it."""
    none = lacking(wire)
    return none[name][1] if name in none else ADVICE[name.split(":")[0]]


def estimates_of(found: Gathered, fit: Calibration) -> list[dict[str, Any]]:
    """Rows of all parameters, the depth offset among them."""
    why = {name: {"why": told} for name, (told, _) in lacking(found.cases[0].wire).items()}
    if fit.apart:
        why[ROLL] = {"why": APART}
    rows = [_row(e) | why.get(e.unknown.name, {}) for e in (*fit.estimates, _depth(found, fit))]
    off = float(np.mean([_too_flat(voxels) for voxels in _thickness(found).values()] or [0.0]))
    return [row | {"sd": float(np.hypot(row["sd"], off))} if row["name"] == REST else row for row in rows]


def _depth(found: Gathered, fit: Calibration) -> Estimate:
    value, sd = depth_offset(found, fit)
    why = "no depths are stated" if np.isnan(sd) else f"known to {sd:.2g} mm only" if sd > DEPTH.enough else ""
    known = float(np.nan_to_num(value))
    return Estimate(DEPTH, known, sd if np.isfinite(sd) else DEPTH.sd, 0.0 if why else known, not why, why, ())


def _row(e: Estimate) -> dict[str, Any]:
    u = e.unknown
    row = {"name": u.name, "value": u.shown(e.value), "sd": e.sd, "logarithmic": u.logarithmic}
    at_end = f"{u.shown(e.used):g} is the end of what is possible: at most {u.shown(e.used + e.sd):.2g}, to one side"
    return row | {"seen": e.seen, "used": u.shown(e.used), "why": e.why or at_end * (e.seen and u.one_sided(e.used))}


def write_parameters(path: Path, found: Gathered, fit: Calibration) -> Parameters:
    """Write parameters.toml, then read it back as a run does: a file that a run cannot read is an error here."""
    rows, values, first = estimates_of(found, fit), fit.values, found.cases[0]
    wire, by_name = bent(first.wire, values), {row["name"]: row for row in rows}
    walls = sorted({case.wall.stiffness_N_mm2 for case in found.cases})
    lines = [
        "# written by wireval calibrate; taken by `parameters` in a case or by --parameters FILE",
        *(f"# {text}" for text in reservation(fit)),
        "schema = 1",
        f"wire = {json.dumps(wire.name)}",
        f"bending_stiffness_N_mm2 = {_text(wire.bending_stiffness_N_mm2)}",
        f"rest_curvature_per_mm = {_text(wire.rest_curvature_per_mm)}",
        f"friction = {_text(values[FRICTION])}",
        f"roll_offset_deg = {_text(values[ROLL])}",
        f"depth_offset_mm = {_text(by_name[DEPTH.name]['used'])}",
        f"absolute_stiffness = {json.dumps(_weighed(by_name))}",
    ]
    lines += ["", "[stated]", f"bending_stiffness_N_mm2 = {_text(first.wire.bending_stiffness_N_mm2)}"]
    lines.append(f"rest_curvature_per_mm = {_text(first.wire.rest_curvature_per_mm)}")
    for stated in walls:
        # in full: a run knows a wall by it
        lines += ["", "[[wall]]", f"stated_N_mm2 = {json.dumps(stated)}"]
        lines.append(f"stiffness_N_mm2 = {_text(stated * wall_factor(stated, values))}")
    for row in rows:
        lines += ["", "[[estimate]]", *(f"{key} = {_text(value)}" for key, value in row.items())]
    for used, traces in zip(_used_by(found), found.traced_mm, strict=True):
        lines += ["", "[[used]]", *(f"{key} = {_text(value)}" for key, value in used.items())]
        lines += ["traced_mm = [", *(f"  {_text(points.round(4).tolist())}," for points in traces), "]"]
    write_text(path, "\n".join(lines) + "\n")
    return read_parameters(path)


def _weighed(rows: Mapping[str, Mapping[str, Any]]) -> bool:
    """Whether stiffness is known in N mm2, by forces or the weight, and not in its ratios alone."""
    return bool(rows.get(BENDING, {}).get("seen"))


def _text(value: Any) -> str:
    """A value as TOML, which writes numbers, texts and nested lists as JSON does; floats have six digits."""
    if isinstance(value, float):
        return json.dumps(float(f"{value:.6g}"))
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_text, value))}]"
    return json.dumps(value, ensure_ascii=False)


def misfit(fit: Calibration) -> list[str]:
    """A warning where the wires lie farther from the traces than these are uncertain: something else is wrong."""
    times = float(np.sqrt(fit.scale))
    if times < MISFIT:
        return []
    held = stated_as_exact(fit.fit)
    exact = [f"{name} of {', '.join(cases)} (stated as exact)" for name, cases in held.items()]
    trials = [one.trial for one in fit.fit.problem.evidence]
    rolls = "other stated rolls" if STATED_ROLL in held else "stated rolls"
    rolled = [rolls] * any(trial.turned and not trial.roll_free for trial in trials)
    return [
        f"the calibrated wires lie {times:.1f} times as far from the traces as these are taken to be off: "
        f"{', '.join([*exact, 'lumen', *rolled])}, the wire's profile or a trace is wrong; standard deviations "
        "are widened, values may be off beyond them"
    ]


def reservation(fit: Calibration) -> list[str]:
    """What is said once, above all parameters."""
    return [IF_RIGHT] * bool(misfit(fit))


def no_common_roll(fit: Calibration) -> list[str]:
    """A warning where each insertion wants a roll of its own."""
    return [f"{ROLL}: {fit.apart}"] * bool(fit.apart)


def contradicted(fit: Calibration) -> list[str]:
    """A warning of each parameter of which the traces tell little, but more than what is stated."""
    todo = "mend what the misfit names first" if misfit(fit) else "state it nearer to that, and calibrate again"
    return [
        f"{e.unknown.name}: {e.why}; {e.unknown.shown(e.used):.3g} is taken with its standard deviation: {todo}"
        for e in fit.contradicted
    ]


def warnings_of(found: Gathered, fit: Calibration) -> list[str]:
    """What speaks against the parameters or their standard deviations."""
    doubt = filter(None, [fit.segments.doubt])
    moved = beyond_their_priors(fit.fit)
    own = [*misfit(fit), *moved, *no_common_roll(fit), *contradicted(fit)]
    return [*own, *flattened(found), *doubt, *found.warnings]


def segments_said(fit: Calibration) -> str:
    """How long the segments of the fit were, and why."""
    return f"segments of {fit.segments.mm:g} mm: {fit.segments.reason}"


def _together(found: Gathered) -> list[str]:
    """A note of each insertion that is several cases."""
    cases: dict[str, list[str]] = {}
    for case in found.cases:
        cases.setdefault(case.group, []).append(case.id)
    return [
        f"cases {', '.join(ids)} are one insertion (group {group!r}): clamp, roll and depth offset are common to them"
        for group, ids in cases.items()
        if len(ids) > 1
    ]


def _walls_known(found: Gathered) -> list[str]:
    """A note of each case that states how well its lumen is known."""
    stated = [
        (t.name, [f"{key} = {mm:g}" for key in ("lumen_bias_mm", "lumen_mm") if (mm := getattr(t, key)) is not None])
        for t in found.trials
    ]
    return [f"{name}: the wall is known as stated: {', '.join(each)}" for name, each in stated if each]


THINNEST_VOXELS, FLATTENING_VOXELS = 0.48, 0.9
"""Diameters of a wire in voxels: the thinnest that was measured, and that below which its curved tip is traced too
flat."""


def _thickness(found: Gathered) -> dict[str, float]:
    """The wire's diameter in voxels in every case that was traced here."""
    pairs = zip(found.cases, found.trials, strict=True)
    # rounded: 0.36 mm over 0.4 mm is 0.9, and no less by its last bit
    return {c.id: round(2.0 * t.wire.radius_mm / t.voxel_mm, 6) for c, t in pairs if c.frames and not c.traces}


def _too_flat(voxels: float) -> float:
    """The share by which the curve of a tip so thick is traced too flat.

    Measured on bends of three seeds each (docs/howto/calibrate.md): 9 % with a diameter of 0.48 voxels, 2 % with 0.72,
    less than 1 % with 0.96; of thinner ones more, which nobody has measured.
    """
    return 0.02 * (0.72 / max(voxels, THINNEST_VOXELS)) ** 3.7 if voxels < FLATTENING_VOXELS else 0.0


def flattened(found: Gathered) -> list[str]:
    """A warning where a thin wire's curved tip is traced too flat."""
    thin = {case: voxels for case, voxels in _thickness(found).items() if voxels < FLATTENING_VOXELS}
    if not thin:
        return []
    least = min(thin.values())
    return [
        f"{', '.join(thin)}: the wire's diameter is {least:.2f} voxels, and below {FLATTENING_VOXELS} its tip is "
        "traced too flat: the rest curvature came out 2 % too small at 0.72 voxels and 9 % at 0.48, which its standard "
        "deviation includes; scan with smaller voxels"
    ]


def write_record(path: Path, found: Gathered, fit: Calibration) -> None:
    """Write calibration.json: all that the page shows."""
    rows = estimates_of(found, fit)
    names = [e.unknown.name for e in fit.estimates]
    profiles = {e.unknown.name: [[e.unknown.shown(v), rise] for v, rise in e.profile] for e in fit.estimates}
    first, by_name = found.cases[0], {row["name"]: row for row in rows}
    for row, u in zip(rows, (*(e.unknown for e in fit.estimates), DEPTH), strict=True):
        row |= {"what": u.what, "prior": u.shown(u.prior), "prior_sd": u.sd, "enough": u.enough}
        row["bounds"] = [u.shown(end) for end in (u.low, u.high) if np.isfinite(end)]
        row["advice"] = "" if row["seen"] else _advice(u.name, first.wire)
    record = {
        "estimates": rows,
        "wire": wire_rows(first.wire, fit, by_name[REST]),
        "absolute_stiffness": _weighed(by_name),
        "correlation": {"names": names, "values": fit.correlation},
        "profiles": profiles,
        "frames": [vars(frame) for frame in fit.frames],
        "insertions": [vars(one) for one in moved_of(fit.fit)],
        "starts": fit.fit.starts,
        "scale": fit.scale,
        "stated": fit.fit.problem.stated,
        "used": _used_by(found),
        "segment_mm": fit.segments.mm,
        "reservations": reservation(fit),
        "warnings": [*warnings_of(found, fit), *found.left_out],
        "notes": [segments_said(fit), *_together(found), *_walls_known(found), *found.notes],
        "provenance": code_state(),
    }
    write_json(path, {"schema": 1, **record})


def write_design(path: Path, wire: Wire, rows: list[Predicted], notes: tuple[str, ...]) -> None:
    """Write design.json: the predicted standard deviations of a planned study with this wire."""
    found = [
        {"name": (u := p.unknown).name, "sd": p.sd, "enough": u.enough, "seen": p.seen, "logarithmic": u.logarithmic}
        | {"what": u.what, "advice": "" if p.seen else _advice(u.name, wire)}
        for p in rows
    ]
    write_json(path, {"schema": 1, "predicted": found, "notes": notes, "provenance": code_state()})


def _used_by(found: Gathered) -> list[dict[str, Any]]:
    """The cases that were calibrated with, as parameters.toml names them."""
    pairs = zip(found.cases, found.voxels, strict=True)
    return [{"case": case.id, "group": case.group, "data": [*data_of(case), *voxels]} for case, voxels in pairs]
