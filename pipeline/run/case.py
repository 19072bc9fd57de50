"""Run one case and leave its folder complete; top level and picklable, so that any executor can take it."""

from __future__ import annotations

import functools
import hashlib
import json
import os
from dataclasses import dataclass, fields
from pathlib import Path
from time import perf_counter
from typing import Any

import solver
from pipeline.compare.pooled import case_row
from pipeline.run import results
from pipeline.run.cache import WHOLE, Store, code_of, file_hash
from pipeline.run.progress import CaseProgress
from pipeline.run.provenance import collect, package_version, peak_memory_mib
from pipeline.run.stages import CaseRun, Stage, run_stages
from pipeline.study.manifest import Case
from pipeline.study.settings import Resolved
from reports.html import render_case
from solver import warm_up

PATHS = ("reference", "frames", "lumen", "traces", "parameters", "truth")


@dataclass(frozen=True)
class Job:
    """Everything that a worker needs for one case."""

    case: Case
    settings: Resolved
    out: Path
    until: Stage = "report"
    cache: Path | None = None
    fresh: bool = False
    embed: bool = False
    quiet: bool = False
    pictures: bool = True

    @property
    def folder(self) -> Path:
        """Where the case's files go."""
        return self.out / "cases" / self.case.id


def inputs_of(case: Case) -> list[Path]:
    """Every file or folder that a case reads."""
    sources = [s for s in (case.reference, *case.frames, case.lumen) if s is not None]
    paths = [s.path for s in sources] + [p for p in (*case.traces, case.parameters, case.truth) if p]
    return list(dict.fromkeys(paths))


def job_key(job: Job) -> str:
    """What the result depends on: the case without its paths, the settings, the inputs' contents, the version."""
    described = {f.name: str(getattr(job.case, f.name)) for f in fields(job.case) if f.name not in PATHS}
    contents = [file_hash(p) for p in inputs_of(job.case) if p.exists()]
    text = json.dumps(
        [described, repr(job.settings.config), contents, job.until, package_version(), code_of(WHOLE)],
        sort_keys=True,
    )
    return hashlib.sha256(text.encode()).hexdigest()


def finished(job: Job, key: str) -> dict[str, Any] | None:
    """The result on disk where it is complete and its key is the same; else None."""
    path = job.folder / "result.json"
    if job.fresh or not path.exists():
        return None
    try:
        result: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return None
    return result if result.get("key") == key and result.get("status") == "ok" else None


@functools.cache
def _kernels_loaded() -> float:
    clock = perf_counter()
    warm_up()
    return perf_counter() - clock


def load_kernels(progress: CaseProgress) -> None:
    """Compile or load the solver's kernels before anything is timed; says so where it is the first run."""
    cached = any(Path(solver.__file__).parent.rglob("*.nbi")) or os.environ.get("NUMBA_CACHE_DIR")
    if not cached:
        progress.say("compiling the solver, once per installation: about half a minute")
    progress.write(f"kernels ready in {_kernels_loaded():.2f} s")


def run_case(job: Job) -> str:
    """Run one case; returns its id. Whatever happens to it is in its folder, never an exception (but bugs)."""
    key = job_key(job)
    progress = CaseProgress(job.case.id, job.folder / "log.txt", quiet=job.quiet)
    if finished(job, key) is not None:
        progress("compare", 1, 1, "unchanged since the last run, kept")
        return job.case.id
    (job.folder / "result.json").unlink(missing_ok=True)
    run = CaseRun(job.case, job.settings.config, Store(job.cache), progress, job.until)
    if run.wants("simulate"):
        load_kernels(progress)
    clock = perf_counter()
    run_stages(run)
    progress.close()
    row = case_row(run, perf_counter() - clock, peak_memory_mib())
    results.write_tables(job.folder, run, view=job.pictures)
    extra = {"key": key, "failures": results.failure_rows(run), "summary": row, "provenance": collect()}
    results.write_json(job.folder / "result.json", results.result_of(run, row, job.settings.as_dict(), extra))
    if job.pictures and run.wants("report"):
        render_case(job.folder, embed=job.embed)
    progress.write(f"done in {perf_counter() - clock:.2f} s")
    return job.case.id
