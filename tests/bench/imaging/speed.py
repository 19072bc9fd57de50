"""Reading alone against load + segment + trace, and against a scikit-image chain, in one run; and peak memory."""

from __future__ import annotations

import resource
import tempfile
import time
from pathlib import Path

import SimpleITK as sitk

from pipeline.load import load, read_header
from pipeline.segment import segment
from pipeline.trace import trace
from tests.bench.imaging import tracing
from tests.pipeline import phantoms


def write_study(folder: Path, side: int, frames: int):
    """Frames with the wire at growing depth, and the reference, as int16 .mha files."""
    s = tracing.scene(100, side)
    length = len(s.wire)
    for n in range(frames):
        part = s.wire[: int(length * (0.35 + 0.65 * (n + 1) / frames))]
        wired = phantoms.add_wire(
            s.empty.copy(), part[::6], tracing.RADIUS, phantoms.WIRE, tracing.VOXEL, s.origin
        )
        _write(folder / f"frame_{n:02d}.mha", phantoms.scan(wired, 0.8, tracing.PEAK / 8, n), s.origin)
    _write(folder / "reference.mha", phantoms.scan(s.empty, 0.8, tracing.PEAK / 8, 999), s.origin)
    return s


def _write(path, values, origin):
    image = sitk.GetImageFromArray(values.transpose(2, 1, 0))
    image.SetSpacing([tracing.VOXEL] * 3)
    image.SetOrigin(origin.tolist())
    sitk.WriteImage(image, str(path))


def read_all(files):
    """Seconds to read every file and nothing else."""
    start = time.perf_counter()
    for file in files:
        load(read_header(file))
    return time.perf_counter() - start


def work_all(files, reference_file, s):
    """Seconds to load, segment once and trace every frame; and the share of each stage."""
    start = time.perf_counter()
    reference = load(read_header(reference_file))
    loaded = time.perf_counter()
    lumen = segment(reference, s.entry[None])
    segmented = time.perf_counter()
    previous, loads, traces = None, loaded - start, 0.0
    for file in files:
        t0 = time.perf_counter()
        frame = load(read_header(file))
        t1 = time.perf_counter()
        curve = trace(frame, lumen, s.entry, s.direction, reference=reference, previous=previous)
        previous = curve if len(curve.points_mm) else previous
        loads, traces = loads + t1 - t0, traces + time.perf_counter() - t1
    return time.perf_counter() - start, loads, segmented - loaded, traces, lumen


def report(quick):
    """Print the table."""
    side, frames = (128, 6) if quick else (256, 30)
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        s = write_study(folder, side, frames)
        files, reference = sorted(folder.glob("frame_*.mha")), folder / "reference.mha"
        work_all(files[:1], reference, s)
        reading = read_all([*files, reference])
        total, loads, seg, traces, lumen = work_all(files, reference, s)
        frame = load(read_header(files[-1]))
        start = time.perf_counter()
        tracing.path_chain(s, frame, lumen)
        chain = time.perf_counter() - start
    print(f"\n## {frames} frames of {side}^3 as int16 .mha, warm files, one run (wall seconds)")
    print(f"   only reading {reading:.2f}; load {loads:.2f} + segment {seg:.2f} + trace {traces:.2f} = {total:.2f}: "
          f"{total / reading:.1f} times reading (bar 6)")  # fmt: skip
    ratio = (chain * frames + loads) / total
    print(f"   ridge filter + minimal path of scikit-image in the lumen's box: {chain:.2f} a frame, {ratio:.0f} "
          "times as long (bar 10)")  # fmt: skip
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(
        f"   peak resident memory of this process {peak / 1024:.0f} MiB ({base / 1024:.0f} before this table)"
    )
