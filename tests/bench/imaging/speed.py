"""Reading alone against load + segment + trace, and against scikit-image chains, in one run; and peak memory."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import SimpleITK as sitk

from pipeline.load import load, read_header
from pipeline.segment import segment
from tests.bench.imaging import scenes
from tests.bench.imaging.rivals import RIVALS
from tests.pipeline import phantoms

RIVAL_FRAMES = 2
"""Frames that the rivals are timed on; what they would take for all is their mean times the number of frames."""


def write_study(folder: Path, side: int, frames: int):
    """Frames with the wire at growing depth, the reference, as int16 .mha files, and where the wire enters."""
    folder.mkdir()
    s = scenes.scene(100, side)
    length = len(s.wire)
    for n in range(frames):
        part = s.wire[: int(length * (0.35 + 0.65 * (n + 1) / frames))]
        wired = phantoms.add_wire(s.empty.copy(), part[::6], scenes.RADIUS, phantoms.WIRE, scenes.VOXEL, s.origin)
        _write(folder / f"frame_{n:02d}.mha", phantoms.scan(wired, scenes.PSF, scenes.PEAK / 8, n), s.origin)
    _write(folder / "reference.mha", phantoms.scan(s.empty, scenes.PSF, scenes.PEAK / 8, 999), s.origin)
    (folder / "entry.json").write_text(json.dumps([s.entry.tolist(), s.direction.tolist()]), encoding="utf-8")
    return s


def _write(path, values, origin):
    image = sitk.GetImageFromArray(values.transpose(2, 1, 0))
    image.SetSpacing([scenes.VOXEL] * 3)
    image.SetOrigin(origin.tolist())
    sitk.WriteImage(image, str(path))


def rivals(folder, s, frames):
    """Seconds per frame of each rival, and the mean distance (voxels) of its curve on the last, deepest frame."""
    lumen = segment(load(read_header(folder / "reference.mha")), s.entry[None])
    files = sorted(folder.glob("frame_*.mha"))[-frames:]
    out = {}
    for name, chain in RIVALS.items():
        start = time.perf_counter()
        for file in files:
            points = chain(s, load(read_header(file)), lumen)
        seconds = (time.perf_counter() - start) / len(files)
        out[name] = (seconds, scenes.errors(points, s)[0] if points is not None else np.nan)
    return out


def report(quick):
    """Print the table."""
    side, frames = (128, 6) if quick else (256, 30)
    with tempfile.TemporaryDirectory() as name:
        folder, small = Path(name) / "study", Path(name) / "small"
        s = write_study(folder, side, frames)
        write_study(small, 64, 2)
        command = [sys.executable, "-m", "tests.bench.imaging.speed_run", str(folder), str(small)]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        r = json.loads(done.stdout.splitlines()[-1])
        others = rivals(folder, s, RIVAL_FRAMES)
    parts, total = r["seconds"], sum(r["seconds"].values())
    print(f"\n## {frames} frames of {side}^3 as int16 .mha, warm files, registration skipped; one process, processor s")
    good, share = r["status"].count("OK"), 100 * r["crop"]
    print(f"   {good} of {frames} frames OK; read on the lumen's box, {share:.0f} % of them")
    spent = " + ".join(f"{stage} {seconds:.2f}" for stage, seconds in parts.items())
    print(f"   {spent} = {total:.2f}; only reading the files whole {r['read']:.2f} (SimpleITK's ReadImage and an "
          f"array: {r['read_sitk']:.2f})")  # fmt: skip
    print(f"   {total / r['read']:.1f} times reading (bar 6); {total / r['read_sitk']:.1f} times SimpleITK's")
    print(f"   scikit-image in the lumen's box, mean of {RIVAL_FRAMES} frames for each of {frames}:")
    for rival, (seconds, error) in others.items():
        ratio = (seconds * frames + parts["load"]) / total
        bar = "(bar 10)" if "ridge" in rival else "(no bar: cheap and off)"
        print(f"     {rival:22s} {seconds:6.2f} s a frame, {ratio:5.1f} times as long {bar}, error {error:.2f} voxel")
    frame = side**3 * 2 / 2**20
    print(f"   peak resident memory over the imported, warm program ({r['base']:.0f} MiB; {r['how']}): "
          f"{r['peak']:.0f} MiB = {r['peak'] / frame:.2f} int16 frames (bar 4)")  # fmt: skip
    print("   highest by the end of " + ", ".join(f"{k} {v:.0f}" for k, v in r["peaks"].items()) + " MiB")
    for stage, counters in r["counters"].items():
        shown = {k: v for k, v in counters.items() if k.startswith("voxels")}
        print(f"   {stage}: " + ", ".join(f"{k} {v:.0f}" for k, v in shown.items()))
