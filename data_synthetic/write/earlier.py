"""What lies already in the folder of a study: an earlier study of ours is replaced, nothing else is touched."""

import contextlib
import json
import tomllib
from pathlib import Path

from data_synthetic.write.volumes import FORMATS, HDF5_FILE, manifest_names, volume_names

MANIFEST, TRUTH = "manifest.toml", "truth.json"


def earlier_files(folder: Path) -> list[Path]:
    """Every file that an earlier study in this folder was written to, as its manifest and its truth name them.

    Empty where there is none, and where the manifest is not, or no longer, one that we wrote.
    """
    try:
        (case,) = tomllib.loads((folder / MANIFEST).read_text(encoding="utf-8"))["case"]
        frames = len(json.loads((folder / TRUTH).read_text(encoding="utf-8"))["frames"])
    except (OSError, ValueError, KeyError, TypeError):
        return []
    named = {key: case.get(key) for key in ("reference", "frames", "truth")}
    format = next((f for f in FORMATS if {**manifest_names(f, frames), "truth": TRUTH} == named), None)
    if format is None:
        return []
    paths = [folder / HDF5_FILE] if format == "h5" else [folder / n for n in volume_names(format, frames)]
    # a DICOM series is a folder of slices: those that are numbered as we number them
    slices = [p for path in paths for p in ([path] if path.is_file() else sorted(path.glob("[0-9]" * 4 + ".dcm")))]
    return [*slices, folder / TRUTH, folder / MANIFEST]


def in_the_way(folder: Path, format: str, frames: int) -> list[str]:
    """A sentence for what else in the folder a study would overwrite, or would be read together with."""
    if folder.is_file():
        return [f"{folder}: is a file; give a folder"]
    ours, manifest = set(earlier_files(folder)), folder / MANIFEST
    if manifest.exists() and manifest not in ours:
        return [f"{manifest}: is not a manifest that synth wrote; give another folder"]
    names = volume_names(format, frames)
    there = {*folder.glob(f"frames/*.{format}"), *(p for name in names for p in folder.glob(f"{name}/*"))}
    strange = sorted(there - ours - {folder / name for name in names})
    what = "would be read as a part of the study; remove it or give another folder"
    return [f"{path}: {what}" for path in strange[:1]]


def remove_earlier(folder: Path) -> None:
    """Remove the files of an earlier study, and the folders that this leaves empty."""
    for path in earlier_files(folder):
        path.unlink()
        for parent in path.relative_to(folder).parents[:-1]:
            with contextlib.suppress(OSError):  # not empty
                (folder / parent).rmdir()
