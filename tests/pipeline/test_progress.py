"""Progress: a line per finished frame where there is no terminal, everything in the log."""

from __future__ import annotations

import io
import json
import re
import time
from dataclasses import replace
from pathlib import Path

import pytest

import solver
from pipeline.run import case as case_module
from pipeline.run.case import Job, load_kernels
from pipeline.run.log import CaseProgress
from pipeline.run.watch import EVERY_S, Watch, share_done
from pipeline.study.manifest import Case
from pipeline.study.settings import resolve


class Terminal(io.StringIO):
    """A stream that says that it is a terminal."""

    def isatty(self) -> bool:
        return True


def test_lines_elsewhere_and_everything_in_the_log(tmp_path: Path) -> None:
    stream = io.StringIO()
    progress = CaseProgress("a", tmp_path / "log.txt", stream)
    progress("trace", 1, 2, "ok 12.0 mm")
    progress("simulate", 1, 2, "converged")
    progress.warn("compiling")
    assert stream.getvalue() == "[a] trace 1/2  ok 12.0 mm\n[a] compiling\n"
    log = (tmp_path / "log.txt").read_text(encoding="utf-8")
    assert "simulate 1/2  converged" in log
    assert "compiling" in log


def test_the_first_run_says_that_it_compiles_with_quiet_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With -q, or below a bar, the minute that machine code takes passed without a word."""
    stream = io.StringIO()
    monkeypatch.setattr(case_module, "_kernels_loaded", lambda: 0.0)
    monkeypatch.setattr(solver, "__file__", str(tmp_path / "empty" / "__init__.py"))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    load_kernels(CaseProgress("a", tmp_path / "log.txt", stream, quiet=True))
    assert stream.getvalue().startswith("[a] compiling the solver, once per installation")


def test_an_empty_folder_for_machine_code_is_not_taken_for_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Any NUMBA_CACHE_DIR was, so that a fresh one of a build server took its minute without a word."""
    monkeypatch.setattr(case_module, "_kernels_loaded", lambda: 0.0)
    store = tmp_path / "numba"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(store))
    for name, said in (("", True), ("_kernels_1a2b/tube.py311.nbi", True), ("_kernels_3c4d/newton.py311.nbi", False)):
        if name:
            (store / name).parent.mkdir(parents=True)
            (store / name).touch()
        stream = io.StringIO()
        load_kernels(CaseProgress("a", tmp_path / "log.txt", stream, quiet=True))
        assert ("compiling the solver" in stream.getvalue()) is said, name


def jobs(tmp_path: Path, count: int) -> list[Job]:
    cases = [Case.model_construct(id=f"c{n}") for n in range(count)]
    return [Job(case, resolve([]), tmp_path) for case in cases]


def test_one_bar_over_all_cases_on_a_terminal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On forty columns, too, where long names had pushed share, time and bar off."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setenv("NO_COLOR", "1")
    stream, batch = Terminal(), jobs(tmp_path, 2)
    watch = Watch(batch, stream=stream)
    batch[0].folder.mkdir(parents=True)
    with watch.shown():
        CaseProgress("c0", batch[0].folder / "log.txt", quiet=watch.bar)("trace", 3, 3, "ok 12.0 mm")
        done, heard = watch.now()
        assert 0 < done < 1
        assert heard == "[c0] trace 3/3  ok 12.0 mm"
        time.sleep(3 * EVERY_S)
        watch.finished(batch[0])
        assert watch.now()[0] == 1.0
        time.sleep(3 * EVERY_S)
    assert "0/2 [c0]" in stream.getvalue(), "the name of a case is no markup"
    assert re.search(r"\d\d%.* \d s left.* 1/2", stream.getvalue()), "share, time left and count"
    assert "1/2" in stream.getvalue()


def test_a_terminal_that_cannot_draw_a_bar_gets_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With TERM=dumb (an editor's shell) a run of hours had said nothing at all."""
    for term, bar in (("dumb", False), ("xterm", True)):
        monkeypatch.setenv("TERM", term)
        assert Watch(jobs(tmp_path, 2), stream=Terminal()).bar is bar


def test_lines_with_the_rest_elsewhere(tmp_path: Path) -> None:
    stream, batch = io.StringIO(), jobs(tmp_path, 2)
    watch = Watch(batch, stream=stream)
    with watch.shown():
        for job in batch:
            watch.finished(job)
    first, last = stream.getvalue().splitlines()
    assert re.fullmatch(r"1/2 in 0 s, about 0 s left: c0 finished", first)
    assert re.fullmatch(r"2/2 in 0 s: c1 finished", last)
    silent = Watch(batch, silent=True, stream=stream)
    silent.finished(batch[0])
    assert len(stream.getvalue().splitlines()) == 2
    assert not Watch(batch, lines=True, stream=Terminal()).bar


def swept(folder: Path) -> list[Job]:
    """Two cases, each with a point of a sweep."""
    points = [(job, replace(job, out=folder / "sweep" / "a", pictures=False)) for job in jobs(folder, 2)]
    return [job for both in points for job in both]


def test_a_sweep_tells_no_rest_before_one_case_has_all_its_points(tmp_path: Path) -> None:
    """After the first of 48, a whole case, it said an hour; the rest were points of seconds, and took seven minutes."""
    batch = swept(tmp_path)
    stream = io.StringIO()
    watch = Watch(batch, stream=stream)
    for job in batch:
        watch.finished(job)
    assert ["left" in line for line in stream.getvalue().splitlines()] == [False, True, True, False]


@pytest.mark.slow  # the bar of a run is looked at every time
def test_nor_does_the_bar_of_a_sweep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    stream, batch = Terminal(), swept(tmp_path)
    watch = Watch(batch, stream=stream)
    said = []
    with watch.shown():
        for job in batch[:2]:
            watch.finished(job)
            time.sleep(3 * EVERY_S)
            said.append(" left" in stream.getvalue())
    assert said == [False, True]


def test_a_line_says_what_became_of_a_case(tmp_path: Path) -> None:
    """A case without a lumen was "finished", as any other."""
    stream, batch = io.StringIO(), jobs(tmp_path, 5)
    results = (("ok", 2, 2), ("segment_failed", 0, 2), ("no_wire", 1, 2), ("simulated", 0, 0))
    for job, (status, good, frames) in zip(batch, results, strict=False):
        job.folder.mkdir(parents=True)
        result = {"status": status, "summary": {"frames_ok": good, "frames": frames}}
        (job.folder / "result.json").write_text(json.dumps(result), encoding="utf-8")
    watch = Watch(batch, stream=stream)
    for job in batch:
        watch.finished(job)
    said = [
        line.rpartition(": c")[2] if "failed" not in line else line[-27:] for line in stream.getvalue().splitlines()
    ]
    assert said[0] == "0 finished"
    assert said[1].endswith("c1 failed: segment_failed")
    assert said[2:] == ["2 finished, 1 of 2 frames ok", "3 finished", "4 finished"]


def test_lines_name_the_simulator_where_there_are_several(tmp_path: Path) -> None:
    job = jobs(tmp_path, 1)[0]
    assert job.label == "c0"
    assert replace(job, simulator="sofa").label == "sofa: c0"


def test_the_share_that_is_done_only_grows() -> None:
    logs = ["", "0 s  kernels", "[a] segment 1/1  x", "[a] trace 1/4  x", "[a] trace 4/4  x", "[a] compare 2/2  x"]
    shares = [share_done("\n".join(logs[: n + 1])) for n in range(len(logs))]
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    assert shares[-1] <= 1.0


def test_quiet_means_the_log_alone(tmp_path: Path) -> None:
    stream = io.StringIO()
    progress = CaseProgress("a", tmp_path / "log.txt", stream, quiet=True)
    progress("trace", 1, 1, "ok")
    assert stream.getvalue() == ""
    CaseProgress("a", tmp_path / "verbose.txt", stream, verbose=True)("simulate", 1, 1, "converged")
    assert stream.getvalue() == "[a] simulate 1/1  converged\n"
    assert "trace 1/1" in (tmp_path / "log.txt").read_text(encoding="utf-8")
