"""Run one case and leave its folder complete; top level and picklable, so that any executor can take it."""

import functools
import os
import shutil
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import solver
from pipeline.compare.metrics import METRICS
from pipeline.compare.nulls import NULLS
from pipeline.run import outputs, results
from pipeline.run.log import CaseProgress, Log, Stage
from pipeline.run.provenance import collect, package_version, peak_memory_mib
from pipeline.run.stages import Context, Known, run_stages
from pipeline.run.store import Store, code_of, digest
from pipeline.study.manifest import Case
from pipeline.study.settings import Resolved
from reports import tables
from reports.html import render_case
from reports.schema import ERRORS, POINTS
from solver import warm_up
from solver._compile import hash_of


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
    verbose: bool = False
    pictures: bool = True

    @property
    def folder(self) -> Path:
        """Where the case's files go."""
        return self.out / "cases" / self.case.id

    @property
    def key(self) -> str:
        """What the result depends on: the case, its files' contents, the settings, the code, what is registered."""
        code = (package_version(), hash_of(Path(__file__)))
        # who registers a metric or a predictor gives its column
        registered = [*map(code_of, METRICS.values()), *map(code_of, NULLS.values())]
        return digest((self.case, self.settings.config, self.until, code, ERRORS.columns, registered))


def clear(folder: Path) -> None:
    """Make a case's folder, and take out of it what an earlier run wrote: it belongs to another result."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("result.json", ERRORS.file, POINTS.file, "frames.h5", "report.html", "scene3d.html"):
        (folder / name).unlink(missing_ok=True)
    for name in ("view", "figures"):
        shutil.rmtree(folder / name, ignore_errors=True)


def finished(job: Job, key: str) -> bool:
    """Whether the result on disk is complete, ok and made from the same."""
    path = job.folder / "result.json"
    if job.fresh or not path.exists():
        return False
    try:
        result = results.read_result(path)
    except ValueError:
        return False
    return result.key == key and result.ok


def run_case(job: Job) -> None:
    """Run one case. Whatever happens to it is in its folder, never an exception (but bugs)."""
    key = job.key
    progress = CaseProgress(job.case.id, job.folder / "log.txt", quiet=job.quiet, verbose=job.verbose)
    if finished(job, key):
        progress("compare", 1, 1, "unchanged since the last run, kept")
        if job.embed and job.pictures:
            render_case(job.folder, embed=True)
        return
    clear(job.folder)
    if job.until in ("simulate", "compare", "report"):
        load_kernels(progress)
    clock = perf_counter()
    log = Log(progress)
    known = run_stages(Context(job.case, job.settings.config, Store(job.cache), log), job.until)
    _write(job, known, log, key, clock)
    if job.pictures and job.until == "report":
        render_case(job.folder, embed=job.embed)
    progress.write(f"done in {perf_counter() - clock:.2f} s")


def _write(job: Job, known: Known, log: Log, key: str, clock: float) -> None:
    """Every file of the case; result.json last, since it says that the case is complete."""
    errors = [outputs.error_row(frame, log) for frame in known.frames]
    summary = outputs.summary_row(job.case, known, errors, log)
    tables.write(job.folder / ERRORS.file, ERRORS, outputs.with_strongest(errors, summary))
    points = outputs.point_columns(known.frames)
    if points:
        tables.write(job.folder / POINTS.file, POINTS, points)
    outputs.write_frames(job.folder / "frames.h5", known)
    if job.pictures:
        outputs.write_view(job.folder / "view", known)
    details = results.details_of(job.case, known, log)
    details |= {"config": job.settings.as_dict(), "provenance": collect()}
    summary |= {"total_s": perf_counter() - clock, "peak_memory_MiB": peak_memory_mib()}
    results.result_of(job.case, known, summary, key, details).write(job.folder)


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
