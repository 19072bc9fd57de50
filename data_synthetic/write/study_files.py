"""A study as files that any other tool can read: volumes, manifest.toml, truth.json."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from data_synthetic.catalogue.scene import Study
from data_synthetic.write.volumes import FORMATS, VolumeWriter, volume_writer

Progress = Callable[[int, int], None]


def write_study(
    study: Study, folder: str | Path, format: str = "mha", progress: Progress | None = None
) -> Path:
    """Write reference, frames, manifest.toml and truth.json into ``folder``; returns the manifest's path.

    format : one of FORMATS.     progress : called with (frames done, frames in all).
    """
    if format not in FORMATS:
        msg = (
            f"synthetic study {study.name}: format: got {format!r}; allowed: {', '.join(FORMATS)}; choose one"
        )
        raise ValueError(msg)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    writer = volume_writer(folder, format, study.grid)
    writer.reference(study.reference)
    for i, frame in enumerate(study.frames()):
        writer.frame(i, frame)
        if progress is not None:
            progress(i + 1, len(study.truth))
    _write_truth(study, folder / "truth.json")
    manifest = folder / "manifest.toml"
    manifest.write_text(manifest_text(study, writer), encoding="utf-8")
    return manifest


def _write_truth(study: Study, path: Path) -> None:
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
        # points_mm lie in the phantom as the reference scan shows it; in the frame's own scan they are shifted by this
        for frame, shift in zip(frames, study.setup.motion_mm, strict=True):
            frame["phantom_shift_mm"] = [round(float(s), 6) for s in shift]
    record = {
        "scene": study.name,
        "why": study.why,
        "entry_mm": study.setup.entry_mm.round(6).tolist(),
        "entry_direction": study.setup.direction.round(9).tolist(),
        "expected_status": list(study.expected),
        "quality": dict(study.quality),
        "frames": frames,
    }
    path.write_text(json.dumps(record), encoding="utf-8")


def manifest_text(study: Study, writer: VolumeWriter) -> str:
    """The manifest of a study as TOML."""
    case = dict(study.manifest["case"])
    wall = case.pop("wall")
    case |= {"reference": writer.reference_name, "frames": writer.frames_name, "truth": "truth.json"}
    lines = [f"# {study.why}", "schema = 1", ""]
    for name, wire in study.manifest["wires"].items():
        lines += [f"[wires.{name}]", *_table(wire), ""]
    lines += ["[[case]]", *_table(case), "", "[case.wall]", *_table(wall), ""]
    return "\n".join(lines)


def _table(values: Mapping[str, Any]) -> list[str]:
    return [f"{key} = {toml_value(value)}" for key, value in values.items()]


def toml_value(value: Any) -> str:
    """A number, text, flag or nested list as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, Sequence):
        return f"[{', '.join(toml_value(v) for v in value)}]"
    if isinstance(value, float) and not math.isfinite(value):
        return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")
    return repr(value)
