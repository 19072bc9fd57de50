"""Machine code that is loaded while a vessel is segmented, so that no process loads it for its first frame."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli import main
from pipeline.run.stages import segment as stage

SCRIPT = """
import sys
from numba.core.dispatcher import Dispatcher
from pipeline.cli import main
from pipeline.run.warm import warm_up


def loaded():
    modules = [m for name, m in [*sys.modules.items()] if name.startswith(("pipeline.segment", "pipeline.trace"))]
    kernels = {id(k): k for m in modules for k in vars(m).values() if isinstance(k, Dispatcher)}
    return sum(len(k.signatures) for k in kernels.values())


reference, study, out = sys.argv[1:]
warm_up("int16", reference=reference == "True", traced=True)
before = loaded()
assert main(["run", study, "-o", out, "--until", "trace", "--no-cache", "-q"]) == 0
print(before, loaded())
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("warm")
    assert main(["synth", "bend", "-o", str(folder / "study"), "--frames", "2", "--size", "80", "--seed", "4"]) == 0
    return folder


@pytest.mark.slow  # what is not loaded costs time alone
@pytest.mark.parametrize("reference", [True, False])
def test_a_tiny_wire_loads_what_frames_need(folder, reference):
    manifest = folder / "study" / "manifest.toml"
    if not reference:
        lines = manifest.read_text(encoding="utf-8").splitlines(keepends=True)
        manifest = manifest.with_name("without.toml")
        manifest.write_text("".join(s for s in lines if not s.startswith("reference")), encoding="utf-8")
    words = [sys.executable, "-c", SCRIPT, str(reference), str(manifest), str(folder / f"out-{reference}")]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert not done.returncode, done.stderr
    before, after = map(int, done.stdout.split()[-2:])
    # kernels for doubtful frames alone are not met in so clear a scan
    assert after > 10
    assert before >= 0.8 * after


@pytest.mark.quick(1)
@pytest.mark.parametrize(("cores", "until"), [(2, "trace"), (2, "segment"), (1, "trace")])
def test_code_is_loaded_beside_segmentation_where_there_are_cores(folder, tmp_path, monkeypatch, cores, until):
    """Of the scan's own grey values, and with a reference as it has one; what goes wrong there costs nothing."""
    seen = []

    def fails(kind, *, reference, traced):
        seen.append((np.dtype(kind).name, reference, traced))
        raise ValueError("no matter")

    monkeypatch.setattr(stage, "warm_up", fails)
    manifest, out = folder / "study" / "manifest.toml", tmp_path / "out"
    assert main(["run", str(manifest), "-o", str(out), "--until", until, "--no-cache", "-q", "-j", str(cores)]) == 0
    assert seen == ([("int16", True, until == "trace")] if cores > 1 else [])
    assert ("loaded later" in (out / "cases" / "bend" / "log.txt").read_text(encoding="utf-8")) == (cores > 1)
