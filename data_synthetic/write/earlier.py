"""What lies already in the folder of a study: an earlier study of ours is replaced, nothing else is touched."""

from __future__ import annotations

import contextlib
import json
import tomllib
from pathlib import Path

from data_synthetic.write.volumes import (
    FORMATS,
    HDF5_FILE,
    frame_name,
    frames_name,
    reference_name,
    volume_files,
)

MANIFEST, TRUTH = "manifest.toml", "truth.json"


def earlier_files(folder: Path) -> list[Path]:
    """Every file that an earlier study in this folder was written to, as its manifest and its truth name them.

    Empty where there is none, and where the manifest is not, or no longer, one that we wrote.
    """
    try:
        (case,) = tomllib.loads((folder / MANIFEST).read_text(encoding="utf-8"))["case"]
        frames = len(json.loads((folder / TRUTH).read_text(encoding="utf-8"))["frames"])
        format = {reference_name(f): f for f in FORMATS}[case["reference"]]
        if case["truth"] != TRUTH or case["frames"] != frames_name(format, frames):
            return []
    except (OSError, ValueError, KeyError, TypeError):
        return []
    return [*volume_files(folder, format, frames), folder / TRUTH, folder / MANIFEST]


def in_the_way(folder: Path, format: str, frames: int) -> list[str]:
    """A sentence for everything else in the folder that a study would overwrite or be read together with."""
    if folder.is_file():
        return [f"{folder}: is a file; give a folder"]
    ours = set(earlier_files(folder))
    manifest = folder / MANIFEST
    if manifest.exists() and manifest not in ours:
        return [f"{manifest}: is not a manifest that synth wrote; give another folder"]
    if format == "h5":
        kept = {folder / HDF5_FILE}
        there = set()
    elif format == "dicom":
        kept = set()
        there = {p for i in range(frames) for p in (folder / frame_name(format, i)).glob("*")}
        there |= set((folder / reference_name(format)).glob("*"))
    else:
        kept = {folder / frame_name(format, i) for i in range(frames)}
        there = set(folder.glob(f"frames/*.{format}"))
    strange = sorted(there - kept - ours)
    return (
        [f"{strange[0]}: would be read as a part of the study; remove it or give another folder"]
        if strange
        else []
    )


def remove_earlier(folder: Path) -> None:
    """Remove the files of an earlier study, and the folders that this leaves empty."""
    for path in earlier_files(folder):
        path.unlink()
        for parent in path.parents:
            if parent == folder:
                break
            with contextlib.suppress(OSError):  # not empty
                parent.rmdir()
