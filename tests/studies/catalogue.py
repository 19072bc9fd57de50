"""Every scene of the catalogue through the command line at small size.

``python -m tests.studies.catalogue`` (make baseline) rewrites the golden tables that its test holds a run against.
"""

from __future__ import annotations

import io
import json
import sys
import tempfile
from collections.abc import Iterable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from time import process_time

import pandas as pd

from data_synthetic import catalogue
from data_synthetic.catalogue.scene import NamedScene
from data_synthetic.write import write_study
from pipeline.cli import main as wireval
from pipeline.run.log import STAGES
from reports import tables
from reports.case_files import GOOD
from reports.schema import ERRORS, TIMINGS

GOLDEN = Path(__file__).resolve().parents[2] / "reports" / "baseline" / "catalogue"
SEED = 100  # nobody tunes on seeds from 100 up
FRAMES = 3
VOXEL_MM = 0.5
WIDE_VOXEL_MM = 0.6
WIDE_MM = 70.0  # the circles of Willis are this wide: coarser voxels keep them within 128^3
TRUTH_STEP_MM = 0.4


@dataclass(frozen=True)
class Outcome:
    """One scene: what was expected of each frame, the case's folder, processor seconds of making and running it."""

    name: str
    expected: tuple[str, ...]
    folder: Path
    made_s: float
    run_s: float  # of the processor: other people's work on the machine is none of ours

    @property
    def errors(self) -> pd.DataFrame:
        return tables.read(self.folder / "errors.csv", ERRORS)

    @property
    def statuses(self) -> tuple[str, ...]:
        return tuple(self.errors["status"])

    def unexpected(self) -> list[str]:
        """One sentence per frame whose status is none of those expected."""
        pairs = enumerate(zip(self.statuses, self.expected, strict=True))
        return [f"{self.name} frame {i}: got {s}, expected {e}" for i, (s, e) in pairs if s not in e.split("|")]


def size_of(scene: NamedScene) -> int:
    """Voxels along an edge."""
    return round(scene.fov_mm / (WIDE_VOXEL_MM if scene.fov_mm > WIDE_MM else VOXEL_MM))


def run_scene(name: str, root: Path) -> Outcome:
    """Make a scene's files, run its manifest, keep its tables under ``root``/out/cases."""
    scene = catalogue.describe(name)
    clock = process_time()
    study = catalogue.build(name, frames=FRAMES, size=size_of(scene), seed=SEED, truth_step_mm=TRUTH_STEP_MM)
    manifest = write_study(study, root / "studies" / name)
    made, clock = process_time() - clock, process_time()
    log = io.StringIO()
    with redirect_stdout(log), redirect_stderr(log):
        out = root / "runs" / name
        words = ["-j", "1", "--no-cache", "--until", "compare", "--set", "compare.simulated_nulls=false"]
        code = wireval(["run", str(manifest), "-o", str(out), *words])
    table = out / "cases" / name / "errors.csv"
    if code not in (0, 1) or not table.exists():
        msg = f"{name}: wireval run ended with {code}: {log.getvalue()[-2000:]}"
        raise RuntimeError(msg)
    folder = root / "out" / "cases" / name
    folder.parent.mkdir(parents=True, exist_ok=True)
    (out / "cases" / name).rename(folder)
    return Outcome(name, study.expected, folder, made, process_time() - clock)


def run_all(root: Path, names: Iterable[str]) -> list[Outcome]:
    """These scenes, one after the other in this process, so that kernels are compiled once."""
    return [run_scene(name, root) for name in names]


def coverage(outcomes: list[Outcome]) -> str:
    """Scene x stage: frames that came out of each stage well, of all; a stage that no frame entered is a dash."""
    lines = [f"{'scene':20s}" + "".join(f"{s:>10s}" for s in STAGES[:-1]) + "   statuses"]
    for o in outcomes:
        result = json.loads((o.folder / "result.json").read_text(encoding="utf-8"))
        spent = tables.read(o.folder / TIMINGS.file, TIMINGS)
        failed = [f["stage"] for f in result["frames"] if f["status"] != "ok"]
        cells, left = [], len(o.expected)
        for stage in STAGES[:-1]:
            entered = bool(spent[f"{stage}_s"].fillna(0.0).iloc[0] > 0)
            left -= failed.count(stage)
            cells.append(f"{left}/{len(o.expected)}" if entered else "-")
        lines.append(f"{o.name:20s}" + "".join(f"{c:>10s}" for c in cells) + "   " + ", ".join(o.statuses))
    return "\n".join(lines)


def times(outcomes: list[Outcome]) -> str:
    made, run = (sum(values) for values in zip(*((o.made_s, o.run_s) for o in outcomes), strict=True))
    sizes = f"{len(outcomes)} scenes of {FRAMES} frames, seed {SEED}"
    return f"{sizes}: made in {made:.0f} s, run in {run:.0f} s of processor time"


def golden(errors: pd.DataFrame) -> pd.DataFrame:
    """What is worth keeping: no numbers of a frame that failed, where only the status is a promise."""
    kept = errors.astype(object).where(errors.notna(), float("nan"))
    for column in ERRORS:
        if column.kind == "float":
            kept[column.name] = kept[column.name].astype(float).round(4)
    failed = ~kept["status"].isin(GOOD)
    kept.loc[failed, [c for c in kept.columns if c not in ("frame", "status", "roll_deg")]] = float("nan")
    return kept


def write_golden(outcomes: list[Outcome], folder: Path) -> None:
    for o in outcomes:
        table = golden(o.errors)
        # the golden status of a frame that ends otherwise is what it should be: the gate stays shut until it is
        table["status"] = [
            s if s in e.split("|") else e.split("|")[0] for s, e in zip(o.statuses, o.expected, strict=True)
        ]
        tables.write(folder / "cases" / o.name / "errors.csv", ERRORS, table.to_dict("records"))


def main(names: list[str]) -> None:
    """Run the named scenes (all of them without a name) and write their golden tables."""
    with tempfile.TemporaryDirectory() as scratch:
        found = run_all(Path(scratch), names or catalogue.names())
        bad = [line for o in found for line in o.unexpected()]
        sys.stdout.write("\n".join([coverage(found), times(found), *bad, ""]))
        write_golden(found, GOLDEN)
    sys.stdout.write("golden tables written; look at what changed before you commit them\n")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main(sys.argv[1:])
