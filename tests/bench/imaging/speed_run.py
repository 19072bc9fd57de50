"""The timed and weighed run of the speed table, a fresh process: python -m tests.bench.imaging.speed_run FOLDER SMALL.

FOLDER holds frame_NN.mha, reference.mha and entry.json; SMALL the same for a tiny study that loads the kernels first.
Prints one line of JSON: seconds, and MiB above what the program holds once imported and warm.
"""

from __future__ import annotations

import json
import re
import resource
import sys
import time
from pathlib import Path

import numpy as np
import SimpleITK as sitk

from pipeline.arrays.grids import corners_mm
from pipeline.load import load, read_header
from pipeline.load.config import LoadConfig
from pipeline.segment import segment
from pipeline.trace import trace


def resident(name):
    """VmRSS or VmHWM (its peak) in MiB."""
    return int(re.search(rf"{name}:\s+(\d+)", Path("/proc/self/status").read_text(encoding="utf-8"))[1]) / 1024


class Peak:
    """Peak resident memory above now, MiB: the kernel's own high-water mark, set back at the start."""

    def __init__(self):
        try:
            Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")
            self.base, self.how = resident("VmRSS"), "VmHWM, reset"
        except OSError:
            self.base, self.how = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, "ru_maxrss"

    def so_far(self):
        now = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        return (resident("VmHWM") if self.how.startswith("Vm") else now) - self.base


def read_all(files, read):
    """Seconds to read every file and nothing else."""
    start = time.process_time()
    for file in files:
        read(file)
    return time.process_time() - start


def work_all(folder, peak=None):
    """What a case does: the reference is segmented whole, then frames are read and traced on the lumen's box."""
    entry, direction = (np.array(a) for a in json.loads((folder / "entry.json").read_text(encoding="utf-8")))
    seconds = dict.fromkeys(("load", "segment", "trace"), 0.0)
    peaks, found = {}, []

    def timed(stage, action):
        start = time.process_time()
        out = action()
        seconds[stage] += time.process_time() - start
        if peak is not None:
            peaks[stage] = peak.so_far()
        return out

    config, header = LoadConfig(), read_header(folder / "reference.mha")
    reference = timed("load", lambda: load(header))
    lumen = timed("segment", lambda: segment(reference, entry[None]))
    box = header.box_of(corners_mm(lumen.distance))
    reference = timed("load", lambda: load(header, box, config))
    previous = None
    for file in sorted(folder.glob("frame_*.mha")):
        frame = timed("load", lambda f=file: load(read_header(f), box, config))
        curve = timed(
            "trace", lambda f=frame, p=previous: trace(f, lumen, entry, direction, reference=reference, previous=p)
        )
        previous = curve if len(curve.points_mm) else previous
        found.append(curve.status.name)
    counters = {"segment": dict(lumen.counters), "trace": dict(curve.counters)}
    share = float(np.prod(np.subtract(*box[::-1])) / np.prod(header.shape))
    return {"seconds": seconds, "peaks": peaks, "status": found, "counters": counters, "crop": share}


def main():
    folder, small = map(Path, sys.argv[1:3])
    work_all(small)
    files = sorted(folder.glob("*.mha"))
    read_all(files, Path.read_bytes)  # into the file cache
    peak = Peak()
    result = work_all(folder, peak)
    result |= {"peak": peak.so_far(), "base": peak.base, "how": peak.how}
    again = work_all(folder)
    result["seconds"] = min(result["seconds"], again["seconds"], key=lambda s: sum(s.values()))
    plain = [read_all(files, lambda f: sitk.GetArrayFromImage(sitk.ReadImage(str(f)))) for _ in range(2)]
    ours = [read_all(files, lambda f: load(read_header(f))) for _ in range(2)]
    result |= {"read": min(ours), "read_sitk": min(plain)}
    print(json.dumps(result))


if __name__ == "__main__":
    main()
