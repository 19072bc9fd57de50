"""Run one case and leave its folder complete; top level and picklable, so that any executor can take it."""

import functools
import os
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import solver
from pipeline.load.wires import result_beside
from pipeline.run import ledger, outputs, results
from pipeline.run.cache import Store
from pipeline.run.hashing import hashing
from pipeline.run.helpers import nothing, shared
from pipeline.run.inputs import Inputs, times_of
from pipeline.run.log import CaseProgress, Log, Stage
from pipeline.run.occupied import held
from pipeline.run.provenance import COMPUTING, code_state, package_version, peak_memory_mib, this_run, versions
from pipeline.run.stages import Context, Known, run_stages
from pipeline.run.store import digest
from pipeline.run.view import LumenFiles, write_view
from pipeline.study.manifest import Case
from pipeline.study.settings import Resolved
from reports import tables
from reports.atomic import WriteError, remove_files, writing
from reports.case_files import listed
from reports.case_page import render_case
from reports.page import Each, compiled
from reports.schema import BUDGET, ENTRIES, ERRORS, POINTS, TIMINGS
from solver import warm_up
from solver._compile import hash_of


@dataclass(frozen=True)
class Job:
    """Everything that a worker needs for one case. simulator : who made the wires, where several are compared."""

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
    cores: int = 1
    simulator: str = ""

    @property
    def label(self) -> str:
        """The case's name in lines of progress."""
        return f"{self.simulator}: {self.case.id}" if self.simulator else self.case.id

    @property
    def folder(self) -> Path:
        """Where the case's files go."""
        return self.out / "cases" / self.case.id

    @property
    def wants_pages(self) -> ledger.Pages:
        """Which pages are asked for."""
        if not self.pictures or self.until != "report":
            return ""
        return "embedded" if self.embed else "linked"

    @property
    def key(self) -> str:
        """Cache key of what the result depends on: case, contents of files, settings, code, libraries, columns."""
        code = (package_version(), hash_of(Path(__file__)), versions(COMPUTING))
        given = self.settings.calibrated and self.settings.calibrated[0]
        named = (self.simulator,) if self.simulator else ()  # the page names the simulator
        wires = () if self.case.simulated is None else self.case.simulated.files
        # a wire is that of the frame whose number its file is named by
        beside = result_beside(wires), [file.path.name for file in wires]
        return digest((self.case, self.settings.config, given, self.until, code, ERRORS.columns, *beside, *named))


def clear(folder: Path) -> str:
    """Create a case's folder, or remove the files of an earlier result; a sentence on what else is among them."""
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    known = ledger.read(folder)
    kept = [name for part in (ledger.VIEW, ledger.FIGURES) for name in ledger.remove(folder / part, known)]
    remove_files(*(folder / name for name in ledger.TOP))
    remove_files(*folder.glob(".tmp-*"))  # of a run that was killed here: nobody else is at work in this folder
    return f"not of a run, and kept: {listed(kept)}" * bool(kept)


def why_again(job: Job, hashed: Callable[[], None] = nothing) -> str | None:
    """Why a case must be computed: None where it need not be, empty where the reason needs no words.

    It need not be where the result on disk is ok, has this key, and its data files are unchanged; pages may be missing.
    hashed : called where there is a ledger, since the key needs all scans hashed.
    """
    known = None if job.fresh else ledger.read(job.folder)
    if job.fresh or not results.has_ended(job.folder):
        return ""
    if known is not None:
        hashed()
        if known.key != job.key:
            return ""
    found = results.found_in(job.folder, mine=True)
    if found.status == "damaged":
        wrong, _, _ = str(found.failures[0]["message"]).rpartition("; ")
        return f"{wrong}: computed again"
    own = [column.name for column in ERRORS if column.module]
    if found.ok and own:  # of a function we know neither what it closes over nor which modules it calls
        return f"results of functions of your own ({listed(own)}) are never kept: computed again"
    return None if found.ok else ""


def run_case(job: Job) -> None:
    """Run one case. Failures are recorded in its folder; only a bug or a full disk raises an exception."""
    progress = CaseProgress(job.label, job.folder / "log.txt", quiet=job.quiet, verbose=job.verbose)
    inputs = Inputs.of(job.case)
    with hashing(_files(job.case), job.cores) as hashed, held(job.folder, progress.warn):
        again = why_again(job, hashed)
        if again is None:
            _heal(job, progress)
            return
        kept = clear(job.folder)
        progress.start()
        for said in filter(None, (kept, again)):
            progress.warn(said)
        _compute(job, hashed, inputs, progress)


def _files(case: Case) -> list[Path]:
    """Paths of the case's scans, whose hashes are part of the cache keys."""
    sources = (case.reference, *case.frames)
    return list(dict.fromkeys(s.path for s in sources if s is not None and s.path.exists()))


def _compute(job: Job, hashed: Callable[[], None], inputs: Inputs, progress: CaseProgress) -> None:
    log = Log(progress)
    store, files = Store(job.cache, progress.warn), LumenFiles(job.folder / "view")
    begin = files.begin if job.pictures and job.cores > 1 else nothing
    kernels = functools.cache(functools.partial(load_kernels, progress))
    run = Context(job.case, job.settings.config, store, log, job.cores, job.until, hashed, inputs, begin, kernels)
    if run.goes_to("simulate") and (job.cores == 1 or not _compiled()):  # else while helpers trace
        kernels()
    clock = perf_counter()
    try:
        known = run_stages(run)
        hashed()
        result = _written(job, known, log, files, clock)
        changed = inputs.changed()  # asked now that its key is made: that, too, is of the files as they were
        if changed:
            result = _written(job, known.failed("load", changed), log, files, clock)
        result.write(job.folder)
        ledger.write(job.folder, result.key)
    finally:
        files.end()
    if job.wants_pages:
        _draw(job, progress)
    progress.write(f"done in {perf_counter() - clock:.2f} s")


def _heal(job: Job, progress: CaseProgress) -> None:
    """Keep a finished case; pages that are missing, altered or of another kind are drawn again from its data."""
    known = ledger.read(job.folder)
    assert known is not None
    wrong = known.amiss(job.folder, known.drawn)
    if known.pages != job.wants_pages and (job.embed or not known.pages):
        wrong = "they are of another kind" if known.pages else "the run before ended first"
    if job.wants_pages and wrong:
        _draw(job, progress)
        progress("compare", 1, 1, f"unchanged since the last run, kept; its pages were drawn again: {wrong}")
    else:
        progress("compare", 1, 1, "unchanged since the last run, kept")


def each_on(cores: int) -> Each:
    """A function ``(work, count)`` that shares ``count`` calls of ``work`` among cores; pages draw figures with it."""
    return lambda work, count: shared(lambda number, _: work(number), count, cores, compiled)


def _draw(job: Job, progress: CaseProgress) -> None:
    """Draw the pages of a case; a fault in one of them costs the pages, not what was computed."""
    try:
        draw(job.folder, job.wants_pages, job.cores)
    except WriteError:
        raise
    except Exception as error:
        progress.write(traceback.format_exc())
        progress.warn(
            f"its pages cannot be drawn ({type(error).__name__}: {error}); its results stand, and `wireval report` "
            f"tries again; please report this, with {job.folder / 'log.txt'}"
        )


def draw(folder: Path, pages: ledger.Pages, cores: int = 1) -> None:
    """Draw the pages of a case anew, and record them."""
    ledger.remove(folder / ledger.FIGURES, ledger.read(folder))
    render_case(folder, pages == "embedded", each_on(cores))
    ledger.record_pages(folder, pages)


def _write_tables(job: Job, known: Known) -> tuple[dict[str, Any], str]:
    """Write the tables of a case; returns its row of summary.csv, and its key, for which all sources are read."""
    errors = [outputs.error_row(frame, known.clamp) for frame in known.frames]
    summary = outputs.summary_row(job.case, known, errors)
    tables.write(job.folder / ERRORS.file, ERRORS, outputs.with_strongest(errors, summary))
    points = outputs.point_columns(known.frames)
    if points:
        tables.write(job.folder / POINTS.file, POINTS, points)
    for table, rows in ((BUDGET, known.sources), (ENTRIES, known.entries)):
        if rows:
            tables.write(job.folder / table.file, table, rows)
    return summary, job.key


def _written(job: Job, known: Known, log: Log, files: LumenFiles, clock: float) -> results.Result:
    """Write the tables, arrays and views of a case; returns its result.

    files : of the lumen, which may be written already.
    """
    write_tables = functools.cache(lambda: _write_tables(job, known))
    write_arrays = functools.partial(outputs.write_frames, job.folder / ledger.FRAMES, known)
    if job.pictures:
        write_view(job.folder / "view", known, job.cores, write_arrays, files.there, write_tables)
    else:
        write_arrays()
    summary, key = write_tables()
    spent = {"total_s": perf_counter() - clock, "peak_memory_MiB": peak_memory_mib()}
    tables.write(job.folder / TIMINGS.file, TIMINGS, outputs.timing_rows(job.case.id, log, **spent))
    results.write_json(job.folder / ledger.PROVENANCE, this_run() | {"reused": log.reused, "files": times_of(job.case)})
    details = results.details_of(job.case, known, log) | ({"simulator": job.simulator} if job.simulator else {})
    summary |= {"warnings": len(log.warnings)}
    details |= {"until": job.until, "config": job.settings.as_dict(), "provenance": code_state()}
    return results.result_of(job.case, known, summary, key, details)


@functools.cache
def _kernels_loaded() -> float:
    clock = perf_counter()
    warm_up()
    return perf_counter() - clock


def _compiled() -> bool:
    """Whether machine code of the solver is on disk: beside its sources, or where NUMBA_CACHE_DIR says."""
    own, place = Path(solver.__file__).parent, os.environ.get("NUMBA_CACHE_DIR")
    if not place:
        return any(own.rglob("*.nbi"))
    # numba puts code there below the name of the sources' folder and a hash; that of the imaging stages lies beside it
    kernels = {path.stem for path in own.glob("_kernels/**/*.py")}
    return any(path.name.partition(".")[0] in kernels for path in Path(place).rglob("_kernels_*/*.nbi"))


def load_kernels(progress: CaseProgress) -> None:
    """Compile or load the solver's kernels before anything is timed; compiling is announced even with -q or a bar."""
    if not _compiled():
        progress.warn("compiling the solver, once per installation: one to four minutes")
    progress.write(f"compiled code ready in {_kernels_loaded():.2f} s")
