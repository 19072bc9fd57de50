"""The pages beside those of a run, from invented numbers: two runs, simulators, a calibration, a benchmark."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np

from pipeline.cli import main
from pipeline.run import ledger
from pipeline.run.aggregate import aggregate
from pipeline.run.simulators import write_comparison
from reports import tables
from reports.bench import render_bench
from reports.calibration import render_calibration, render_design
from reports.records import ALWAYS
from reports.schema import CLAIMS, ERRORS
from reports.simulators import render_simulators
from tests.pipeline.test_simulators import even, write_tree
from tests.reports.test_bench import fake_bench


def write_pages(run: Path, folder: Path) -> list[Path]:
    """Write them into a folder; ``run`` is a run's output."""
    made = [_diff(run, folder), _simulators(folder / "score"), _calibration(folder / "cal"), _bench(folder / "bench")]
    return [*made, _design(folder / "plan")]


def _diff(run: Path, folder: Path) -> Path:
    worse = shutil.copytree(run, folder / "worse")
    for path in worse.glob("cases/*/errors.csv"):
        rows = tables.read(path, ERRORS)
        tables.write(path, ERRORS, rows.assign(rms_mm=3.0 * rows["rms_mm"]))
    for out in (run, worse):
        _finished(out)
    assert main(["diff", str(run), str(worse), "--html", str(folder / "diff.html")]) == 1
    return folder / "diff.html"


def _finished(out: Path) -> None:
    """Give invented results the key and the ledger without which they are not believed."""
    for path in out.glob("cases/*/result.json"):
        result = json.loads(path.read_text(encoding="utf-8"))
        path.write_text(json.dumps(result | {"key": "key"}), encoding="utf-8")
        for name in ALWAYS:
            if not (path.parent / name).exists():
                (path.parent / name).write_bytes(b"")
        ledger.write(path.parent, "key")


def _simulators(folder: Path) -> Path:
    places = {"soft": folder, "wireval": folder / "simulators" / "wireval"}
    made = {name: write_tree(out, even(level)) for (name, out), level in zip(places.items(), (0.3, 0.2), strict=True)}
    for own in made.values():
        _finished(own)
    write_comparison(folder, made)
    for own in made.values():
        aggregate(own)
    return render_simulators(folder)


def _calibration(folder: Path) -> Path:
    folder.mkdir()
    told = {"why": "known to 1.5 only", "advice": "a sharper bend", "what": "a factor", "prior_sd": 1.5, "used": 1.0}
    told |= {"prior": 1.0, "bounds": [0.01, 100.0], "logarithmic": True}
    estimates = [{"name": n, "value": 1.1, "sd": s, "seen": s < 1, **told} for n, s in (("taper", 0.1), ("wall", 1.5))]
    profile = [[0.5, 8.0], [0.9, 2.0], [1.4, 2.0], [4.0, 9.0]]
    frame = {"case": "a", "before_mm": 0.2, "after_mm": 0.1, "as_given_mm": 0.15, "weight": 1.0}
    frame["turned"] = "in_both"
    wall = {"insertion": "a", "of": "wall_mm", "how": "to the wall", "value": -0.14, "sd": 0.012, "prior_sd": 0.045}
    exact = {"insertion": "a", "of": "roll_deg", "how": "turned", "value": 0.0, "sd": 0.0, "prior_sd": 0.0}
    frames = [{"depth_mm": 10.0, "frame": n, **frame} for n in range(4)]
    record = {
        "estimates": estimates,
        "correlation": {"names": ["taper", "wall"], "values": np.eye(2).tolist()},
        "profiles": {"taper": profile, "wall": profile},
        "frames": frames,
        "insertions": [wall | {"beyond": True}, exact | {"beyond": False}],
        "starts": [[0.5, 57.0]],
        "reservations": ["what is seen holds only if all else is right"],
        "scale": 1.0,
        "used": [{"case": "a", "group": "a"}],
        "warnings": ["the calibrated wires lie 3.0 times as far from the traces as these are taken to be off"],
        "notes": ["a: nothing is known of the wall"],
        "provenance": {"wireval": "0.1.0"},
    }
    (folder / "calibration.json").write_text(json.dumps(record), encoding="utf-8")
    return render_calibration(folder)


def _design(folder: Path) -> Path:
    folder.mkdir()
    told = {"enough": 0.25, "logarithmic": True, "what": "a factor", "advice": "a sharper bend"}
    rows = [{"name": n, "sd": s, "seen": s < 1, **told} for n, s in (("taper", 0.1), ("wall", 1.5))]
    record = {"predicted": rows, "notes": ["a: 4 frames, voxels of 0.30 mm"], "provenance": {"wireval": "0.1.0"}}
    (folder / "design.json").write_text(json.dumps(record), encoding="utf-8")
    return render_design(folder)


def _bench(folder: Path) -> Path:
    folder.mkdir()
    rows, stress = fake_bench(folder)
    claim = "40 random scenes, 1419 depths: 0.01 mm from steps of 0.05 mm, and not flagged"
    told = {"claim": claim, "value": 1.0, "unit": "1", "aim": "0", "met": False}
    tables.write(folder / CLAIMS.file, CLAIMS, [told])
    return render_bench(rows, folder, stress, folder / CLAIMS.file, note="Machine: invented.")
