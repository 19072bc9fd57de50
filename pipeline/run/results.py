"""result.json: the outcome of a case, written after its other data files and before its ledger."""

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, TypeAdapter, ValidationError

from pipeline.load import Header
from pipeline.register.frames import record
from pipeline.run import ledger
from pipeline.run.calibrated import data_of
from pipeline.run.inputs import contents_of, described, keys_of, stated
from pipeline.run.log import Log, early_end
from pipeline.run.occupied import owner_of
from pipeline.run.outputs import failure_rows, message_of
from pipeline.run.stages import Known
from pipeline.run.stages.known import Frame
from pipeline.run.store import digest
from pipeline.status import FrameStatus
from pipeline.study.manifest import Case
from reports import result_file, tables
from reports.atomic import write_text
from reports.case_files import GOOD, find_cases
from reports.records import AGAIN
from reports.schema import ERRORS, POINTS

LOST = {
    "crashed": "the case ended in an unexpected error; its log has the traceback",
    "worker_lost": "the worker process was killed, twice; its log tells where it was",
    "scheduler_lost": "the dask scheduler went away while the case ran or waited; give the same command again",
    "outdated": "the result is of other files, or of another manifest, than the plain one; give the command with "
    "--sweep again",
    "over_limit": "the case took more time or memory than it may; raise --case-timeout or --case-memory",
    "refused": "the case was left out, as its files cannot be used; mend what the message names, then run it",
    "removed": "the case's result was removed while the run went on; give the same command again",
    "damaged": "a result file cannot be read; run the case again",
    "not_run": "the manifest names the case, and it has no result here",
}
"""Statuses of a case that has no result of its own, each with its sentence."""

STATED = "stated: "
"""How the name of a phantom begins that the manifest states."""
COMPLETE = (ledger.RESULT, ledger.FILE)
"""Either file says that a run of the case has ended; a ledger without a result: result.json was removed since."""

Row = dict[str, Any]


def has(*names: str) -> AfterValidator:
    """Refuses a row that lacks one of these values."""

    def checked(row: Row) -> Row:
        lacking = [name for name in names if row.get(name) is None]
        if lacking:
            raise ValueError(f"a row lacks {', '.join(lacking)}")
        return row

    return AfterValidator(checked)


@dataclass(frozen=True)
class Result:
    """A case as result.json holds it.

    frames : status, sentence, stage and message of each.     failures, summary : rows of those tables.
    key : of everything that the result depends on; empty where it is to be computed again.     phantom : of the file
    that the vessel was taken from, empty without one.     scans : of the contents of each frame or trace, and of the
    voxels of each frame.     names : of the phantom, see ``names_of``.     stated, contents : see ``inputs``.
    details : settings, inputs, counters, assumptions and what else the pages show.
    """

    case: str
    role: str
    group: str
    status: str
    sentence: str
    frames: list[Annotated[Row, has("frame", "status", "sentence", "message")]]
    failures: list[Annotated[Row, has("case", "status", "sentence", "message")]]
    summary: Annotated[Row, has("case", "frames", "frames_ok", "status")]
    key: str = ""
    phantom: str = ""
    scans: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    stated: str = ""
    contents: str = ""
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """Whether every frame is ok, or simulated where there is nothing to compare with."""
        return self.status in GOOD

    @property
    def vessel(self) -> set[str]:
        """Insertions into one phantom have some of these in common."""
        return {self.phantom, *self.names} - {""}

    def same_inputs(self, other: "Result") -> bool:
        """Whether both are of one case as it was stated, with the same files, as far as they tell."""
        told = ((self.stated, other.stated), (self.contents, other.contents))
        return all(a == b for a, b in told if a and b)

    @property
    def frame_count(self) -> int:
        """Number of frames that were planned."""
        return int(self.summary["frames"])

    def write(self, folder: Path) -> None:
        """Write it into the case's folder."""
        own = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "details"}
        write_json(folder / "result.json", {"schema": 1, **own, **self.details})


RESULT = TypeAdapter(Result)


def read_result(path: Path) -> Result:
    """Read a result.json, without its details; ValueError where it is not one."""
    return RESULT.validate_python(result_file.read_result(path))


def found_results(out: Path) -> list[Result]:
    """The result of every case below an output folder, by id; a damaged one is reported and hides no other."""
    return [found_in(folder) for folder in find_cases(out) if has_ended(folder)]


def has_ended(folder: Path) -> bool:
    """Whether a run of the case has ended, however."""
    return any((folder / name).exists() for name in COMPLETE)


def found_in(folder: Path, *, mine: bool = False) -> Result:
    """The result of a case that has ended; a damaged one, whose failure says why, where it is not to be believed.

    mine : whether the caller is at work on the case; then all of its data are looked at, not just what is scored.
    """
    path, written = folder / ledger.RESULT, ledger.read(folder)
    names = dict.fromkeys((*ledger.DATA, *written.data)) if written and mine else ledger.SCORED
    wrong = written.amiss(folder, names) if written else ""
    altered = f"{folder}: {wrong}; run the case again" * bool(wrong)
    try:
        result = read_result(path)
    except ValueError as error:
        what = f"{path}: it is missing, or a key of it; {AGAIN}" if isinstance(error, ValidationError) else str(error)
        return lost(folder.name, "damaged", altered or what, frames=_planned(folder, written))
    why = altered or _unbelieved(folder, result, written, mine=mine)
    return lost(folder.name, "damaged", why, result) if why else result


def _unbelieved(folder: Path, result: Result, written: ledger.Ledger | None, *, mine: bool) -> str:
    """Why a result whose files are as they were written is none of this case; empty where it is one."""
    if result.case != folder.name:
        return f"{folder}: holds the result of case {result.case!r}; run the case again, or remove this folder"
    # what went through the stages has a key, and a ledger, which may be missing while a run is still at work on it
    if not result.key and result.status not in LOST:
        return f"{folder}: {ledger.RESULT} has no key; run the case again"
    if written is None and result.key and (mine or not owner_of(folder)):
        return f"{folder}: {ledger.FILE} is missing or cannot be read; run the case again"
    if written and POINTS.file not in written.files and result.summary.get("rms_mm") is not None:
        return f"{folder}: {ledger.FILE} does not name {POINTS.file}; run the case again"
    return ""


def _planned(folder: Path, written: ledger.Ledger | None) -> int:
    """Number of frames of a case whose result cannot be read: rows of its errors.csv, if that is as it was written."""
    whole = written is not None and ERRORS.file in written.files and not written.amiss(folder, (ERRORS.file,))
    return len(tables.read(folder / ERRORS.file, ERRORS)) if whole else 0


def names_of(case: Case, known: Known) -> tuple[str, ...]:
    """What tells a vessel beside its file: its stated name, and the voxels of the reference, whatever file holds them.

    Nothing of the latter where the vessel was segmented from a scan with the wire in it.
    """
    seen = "" if case.reference is None or known.lumen is None else known.lumen.of_scan
    return (*[f"{STATED}{case.phantom}"] * bool(case.phantom), *[seen] * bool(seen))


def result_of(case: Case, known: Known, summary: dict[str, Any], key: str, details: dict[str, Any]) -> Result:
    """The result of a case that went through the stages."""
    early = early_end(details["until"])
    frames = [
        {
            "status": f.status,
            "sentence": early if early and f.status == FrameStatus.OK.identifier else f.sentence,
            "stage": f.stage,
            "message": message_of(f, known),
        }
        | {"frame": f.index, "registration": record(f.registration), "trace": _marked(f)}
        | _events(f)
        for f in known.frames
    ]
    good = early or ("every frame has a result" if case.compared else FrameStatus.SIMULATED.value)
    worst = next((f.sentence for f in known.frames if not f.ok), good)
    sentence = str(known.failure) if known.failure else worst
    head = (case.id, case.role, case.group, summary["status"], sentence)
    scans = (*data_of(case), *(frame.voxels for frame in known.frames if frame.voxels))
    source = case.lumen or case.reference
    phantom = "" if source is None else digest(source)
    inputs = scans, names_of(case, known), stated(case), contents_of(details["inputs"])
    return Result(*head, frames, failure_rows(case.id, known), summary, key, phantom, *inputs, details)


def untold(name: str) -> Result:
    """A stand-in for the result of a case of which only the tables are kept, as in a baseline."""
    return Result(name, "validation", "", "ok", "", [], [], {"case": name, "frames": 0, "frames_ok": 0, "status": "ok"})


def lost(
    name: str, status: str, reason: str, case: Case | Result | None = None, stage: str = "", frames: int = 0
) -> Result:
    """The result of a case that could not be finished, or of whose result a file cannot be read (see LOST).

    case : what is known of it, so that its frames are not missing among those that were planned; else ``frames``.
    """
    sentence = LOST[status]
    role, group, frames = (case.role, case.group, case.frame_count) if case else ("", "", frames)
    summary: dict[str, Any] = {"case": name, "group": group, "role": role, "status": status}
    summary |= {"frames": frames, "frames_ok": 0, "frames_failed": frames}
    summary |= {"within_1mm": 0.0} if frames else {}
    failure = {"case": name, "status": status, "sentence": sentence, "message": reason}
    failure |= {"log": f"cases/{name}/log.txt"} | ({"stage": stage} if stage else {})
    return Result(name, role, group, status, sentence, [], [failure], summary)


def details_of(case: Case, known: Known, log: Log) -> dict[str, Any]:
    """What the pages show beside the tables."""
    stated = "entry_mm", "entry_direction", "material_axis", "roll_deg", "insertion_mm"
    clamp: dict[str, Any] = {name: getattr(case, name) for name in stated}
    if known.clamp is not None:
        clamp |= {"used_mm": known.clamp.entry_mm, "used_direction": known.clamp.direction}
        clamp |= {"sigma_mm": known.clamp.sigma_mm, "sigma_deg": known.clamp.sigma_deg}
        clamp["covariance"] = known.clamp.covariance
    return {
        "assumptions": log.assumptions,
        "warnings": log.warnings,
        "warnings_of_wires": log.of_wires,
        "wire": case.wire,
        "wall": case.wall,
        "entry": clamp,
        "manifest_keys": keys_of(case),
        **{name: value for name in ("down", "catheter") if (value := getattr(case, name)) is not None},
        "geometry": _geometry(known.scans.first),
        "inputs": described(case),
        "counters": log.counters,
        "chosen": log.chosen,
    }


def _events(frame: Frame) -> dict[str, Any]:
    """Snaps of the simulated wire since the frame before, and the work that was dissipated, N mm."""
    wire = frame.solved
    if wire is None:
        return {}
    return {"snaps": [snap._asdict() for snap in wire.snaps], "dissipated_N_mm": wire.dissipated_N_mm}


def _marked(frame: Frame) -> dict[str, float]:
    """Shares of a frame's traced points that are flagged, and that run nearly in the plane of rotation; and whether the
    trace was given."""
    if frame.curve is None or len(frame.curve.points_mm) == 0:
        return {}
    marks = {"flagged": frame.curve.flagged, "in_plane": frame.curve.in_plane}
    shares = {name: float(np.mean(np.asarray(values))) for name, values in marks.items()}
    return shares | {"given": bool(frame.curve.source)}


def _geometry(scan: Header | None) -> dict[str, Any]:
    """Geometry of the first scan; all share it."""
    names = ("shape", "spacing_mm", "origin_mm", "direction", "pixel_type") if scan is not None else ()
    return {name: getattr(scan, name) for name in names}


def jsonable(value: Any) -> Any:
    """Plain JSON: NaN becomes null and infinities texts, arrays lists, paths texts."""
    if is_dataclass(value) and not isinstance(value, type):
        return jsonable(asdict(value))
    if isinstance(value, Mapping):
        return {str(k): jsonable(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, np.ndarray)):
        return [jsonable(v) for v in value]
    if isinstance(value, np.generic):
        return jsonable(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else str(value)
    return value if isinstance(value, (str, int, float, bool, type(None))) else str(value)


def write_json(path: Path, value: Any) -> None:
    """Write indented JSON, atomically."""
    write_text(path, json.dumps(jsonable(value), indent=1, ensure_ascii=False) + "\n")
