"""The files of a study: its volumes, what is known of it as truth.json, and the manifest by which it is run."""

import contextlib
import hashlib
import json
import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from data_synthetic.catalogue.study import Study
from data_synthetic.write.volumes import FORMATS, HDF5_FILE, manifest_names, volume_names, write_volume

MANIFEST, TRUTH = "manifest.toml", "truth.json"
ALL_OF_THEM = "insertions into one phantom"
SEAL = "# written by synth, SHA-256 of the lines above: "


def earlier_files(folder: Path) -> list[Path]:
    """Every file that an earlier study in this folder was written to, as its manifest and its truth name them.

    Empty where there is none, and where the manifest is not, or no longer, one that we wrote.
    """
    try:
        (case,) = tomllib.loads(_text(folder / MANIFEST))["case"]
        frames = len(json.loads(_text(folder / TRUTH))["frames"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return []
    named = {key: case.get(key) for key in ("reference", "frames", "truth")}
    format = next((f for f in FORMATS if {**manifest_names(f, frames), "truth": TRUTH} == named), None)
    if format is None:
        return []
    paths = [folder / HDF5_FILE] if format == "h5" else [folder / n for n in volume_names(format, frames)]
    # a DICOM series is a folder of slices: those that are numbered as we number them
    slices = [p for path in paths for p in ([path] if path.is_file() else sorted(path.glob("[0-9]" * 4 + ".dcm")))]
    return [*slices, folder / TRUTH, folder / MANIFEST]


def edited(folder: Path) -> list[str]:
    """A sentence where the manifest in a folder is not as we wrote it: a study would overwrite what was changed."""
    text = _text(folder / MANIFEST)
    what = "was changed since synth wrote it, or an earlier version wrote it; --fresh overwrites it"
    return [f"{folder / MANIFEST}: {what}"] * (bool(text) and text != _sealed(text.rpartition(SEAL)[0]))


def _sealed(text: str) -> str:
    """A manifest with its hash in the last line."""
    return f"{text}{SEAL}{hashlib.sha256(text.encode()).hexdigest()}\n"


def _text(path: Path) -> str:
    """A file's text; empty where it is none, as a pipe, on which nobody would write."""
    return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""


def in_the_way(folder: Path, format: str, frames: int, *, fresh: bool = False) -> list[str]:
    """A sentence for what else in the folder a study would overwrite, or would be read together with.

    fresh : files that have the names of ours may be overwritten, in whatever study they are.
    """
    if folder.is_file():
        return [f"{folder}: is a file; give a folder"]
    ours, manifest = set(earlier_files(folder)), folder / MANIFEST
    if manifest.exists() and manifest not in ours:
        if SEAL not in _text(manifest):
            return [f"{manifest}: is not a manifest that synth wrote; give another folder"]
        if not fresh:
            lost = f"{folder / TRUTH}: is missing, or was changed since synth wrote it; --fresh writes the study anew"
            return edited(folder) or [lost]
    names = volume_names(format, frames)
    meant = {folder / name for name in (HDF5_FILE, TRUTH)} if format == "h5" else {folder / n for n in (*names, TRUTH)}
    there = {*folder.glob(f"frames/*.{format}"), *(p for name in names for p in folder.glob(f"{name}/*"))}
    strange = sorted(there - ours - meant)
    what = "would be read as a part of the study; remove it or give another folder"
    taken = [] if fresh else sorted(path for path in meant - ours if path.is_file())
    whose = "is in no study that synth wrote; give another folder, or --fresh, which overwrites it"
    return [f"{path}: {what}" for path in strange[:1]] or [f"{path}: {whose}" for path in taken[:1]]


def remove_earlier(folder: Path) -> None:
    """Remove the files of an earlier study, and the folders that this leaves empty."""
    for path in earlier_files(folder):
        path.unlink()
        for parent in path.relative_to(folder).parents[:-1]:
            with contextlib.suppress(OSError):  # not empty
                (folder / parent).rmdir()


Progress = Callable[[int, int], None]


def write_study(
    study: Study, folder: str | Path, format: str = "mha", progress: Progress | None = None, *, fresh: bool = False
) -> Path:
    """Write manifest.toml, truth.json, reference and frames into ``folder``; returns the manifest's path.

    format : one of FORMATS.     progress : called with (frames done, frames in all).     fresh : as ``in_the_way``.
    An earlier study in the folder is removed first; ValueError where something else lies in the way.
    """
    folder, frames = Path(folder), len(study.truth)
    if format not in FORMATS:
        allowed = f"allowed: {', '.join(FORMATS)}; choose one"
        raise ValueError(f"synthetic study {study.name}: format: got {format!r}; {allowed}")
    problems = in_the_way(folder, format, frames, fresh=fresh)
    if problems:
        raise ValueError("; ".join(problems))
    remove_earlier(folder)
    folder.mkdir(parents=True, exist_ok=True)
    # first, so that the volumes of a study that was interrupted are known for ours
    manifest = folder / MANIFEST
    (folder / TRUTH).write_text(json.dumps(truth_record(study)), encoding="utf-8")
    manifest.write_text(_sealed(manifest_text(study, format)), encoding="utf-8")
    write_volume(folder, format, 0, study.reference, study.grid)
    for i, frame in enumerate(study.frames(), 1):
        write_volume(folder, format, i, frame, study.grid)
        if progress is not None:
            progress(i, frames)
    return manifest


def write_one_of(study: Study, folder: Path, number: int, format: str = "mha", *, fresh: bool = False) -> str:
    """Write one of several insertions as a study in a folder of its own; returns its part of the manifest of all."""
    write_study(study, folder / str(number), format, fresh=fresh)
    return manifest_text(study, format, f"{number}/", wires=number == 1)


def write_all_of_them(texts: Sequence[str], folder: Path) -> Path:
    """Write the manifest of all insertions into one phantom. texts : of ``write_one_of``, in order."""
    manifest = folder / MANIFEST
    manifest.write_text(_sealed("\n".join([f"# {ALL_OF_THEM}: {len(texts)}", *texts])), encoding="utf-8")
    return manifest


def alone(folder: Path) -> list[str]:
    """A sentence where the folder holds another manifest than one of several insertions."""
    manifest = folder / MANIFEST
    if not manifest.exists() or ALL_OF_THEM in _text(manifest):
        return []
    return [f"{manifest}: is not of several insertions; give another folder"]


def truth_record(study: Study) -> dict[str, Any]:
    """What truth.json holds. points_mm lie in the phantom as the reference scan shows it."""
    frames = [
        {
            "insertion_mm": round(f.depth_mm, 6),
            "roll_deg": f.roll_deg,
            "points_mm": f.points_mm.round(6).tolist(),
            "residual_N": f.residual_N,
            "tip_jump_mm": f.jump_mm,
        }
        for f in study.truth
    ]
    if study.setup.motion_mm is not None:
        for frame, shift in zip(frames, study.setup.motion_mm, strict=True):
            # in the frame's own scan the points are shifted by this
            frame["phantom_shift_mm"] = [round(float(s), 6) for s in shift]
    return {
        "scene": study.name,
        "why": study.why,
        "entry_mm": study.setup.entry_mm.round(6).tolist(),
        "entry_direction": study.setup.direction.round(9).tolist(),
        "expected_status": list(study.expected),
        "quality": dict(study.quality),
        "frames": frames,
    }


def manifest_text(study: Study, format: str, below: str = "", *, wires: bool = True) -> str:
    """The manifest of a study as TOML. below : its folder as seen from there; wires : with their tables."""
    case = dict(study.manifest["case"])
    wall = case.pop("wall")
    names = {**manifest_names(format, len(study.truth)), "truth": TRUTH}
    case |= {key: [below + name for name in n] if isinstance(n, list) else below + n for key, n in names.items()}
    lines = [f"# {study.why}", "schema = 1", ""] * wires
    for name, wire in study.manifest["wires"].items() if wires else ():
        lines += [f"[wires.{name}]", *_table(wire), ""]
    lines += ["[[case]]", *_table(case), "", "[case.wall]", *_table(wall), ""]
    return "\n".join(lines)


def _table(values: Mapping[str, Any]) -> list[str]:
    """Lines of TOML: numbers, texts and nested lists are written there as in JSON, but for an infinite number."""
    return [f"{key} = {'inf' if value == math.inf else json.dumps(value)}" for key, value in values.items()]
