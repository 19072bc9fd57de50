"""One case on several cores: the same results, whatever becomes of those who help."""

from __future__ import annotations

import hashlib
import json
import math
import multiprocessing
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import SimpleITK as sitk

from pipeline import THREADS
from pipeline.cli import main
from pipeline.model import Curve, Lumen, Volume
from pipeline.run import hashing
from pipeline.run.helpers import Earlier, shared
from pipeline.run.launch import Plan, cores_each
from pipeline.run.stages import simulate as simulating
from pipeline.run.stages import trace as tracing
from pipeline.run.workers import Limits
from pipeline.trace import trace
from reports.schema import TIMINGS
from reports.tables import read
from tests.studies.trees import differences

FRAMES = 4
Place = tuple[int, int]


def who(number: int, _: Earlier[Place]) -> Place:
    """The part and the process that did it."""
    time.sleep(0.02)
    return number, os.getpid()


@pytest.mark.parametrize("cores", [1, 2, 3])
def test_parts_are_done_once_each_by_as_many_processes_as_there_are_cores(cores: int) -> None:
    found = shared(who, 12, cores)
    assert [number for number, _ in found] == list(range(12))
    assert len({process for _, process in found}) == cores


def test_a_part_may_wait_for_an_earlier_one() -> None:
    def added(number: int, earlier: Earlier[int]) -> int:
        time.sleep(0.01 * (number % 3))
        return number + (earlier(number - 1) if number else 0)

    assert shared(added, 15, 3) == list(np.cumsum(range(15)))


def test_what_is_to_be_done_first_is_done_here_and_only_where_somebody_helps_meanwhile() -> None:
    done: list[int] = []
    for cores in (1, 2):
        shared(who, 3, cores, lambda: done.append(os.getpid()))
    assert done == [os.getpid()]


def killed() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.parametrize("end", [killed, lambda: os._exit(3)])
def test_what_a_lost_helper_leaves_is_done_here(end: Any, capfd: pytest.CaptureFixture[str]) -> None:
    """Also where somebody waits for its part; a signal is told."""
    here = os.getpid()

    def deadly(number: int, earlier: Earlier[int]) -> int:
        time.sleep(0.02)
        if os.getpid() != here and number > 2:
            end()
        return number + (earlier(number - 1) if number else 0)

    assert shared(deadly, 12, 3) == list(np.cumsum(range(12)))
    (line,) = capfd.readouterr().err.splitlines()
    assert line.startswith("a process that helped " + ("was ended by SIGKILL" if end is killed else "met 3"))
    assert int(line.split()[-8]) in range(1, 10)
    assert line.endswith(" of 12 parts were done without help")


def test_what_only_a_helper_met_is_told_and_an_error_that_comes_again_speaks_for_itself() -> None:
    here, told = os.getpid(), list[str]()

    def failing(number: int, _: Earlier[int]) -> int:
        time.sleep(0.02)
        if os.getpid() != here or number == never:
            raise MemoryError("no more of it")
        return number

    never = -1
    assert shared(failing, 6, 2, told=told.append) == list(range(6))
    assert len(told) == 1
    assert told[0].startswith("a process that helped met MemoryError('no more of it'): ")
    never = 5
    with pytest.raises(MemoryError):
        shared(failing, 6, 2, told=told.append)
    assert len(told) == 1
    assert shared(failing, 3, 1, told=told.append) == [0, 1, 2]
    assert len(told) == 1


@pytest.mark.slow
def test_what_kept_helpers_from_helping_stands_in_the_log(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    here = os.getpid()

    def elsewhere(*given: Any, **named: Any) -> Curve:
        if os.getpid() != here:
            raise MemoryError("no more of it")
        return trace(*given, **named)

    monkeypatch.setattr(tracing, "trace", elsewhere)
    run(study, tmp_path / "two", "--no-cache", "-j", "2", "--until", "trace")
    assert "bifurcation: a process that helped met MemoryError('no more of it'): " in capfd.readouterr().err
    log = (tmp_path / "two" / "cases" / "bifurcation" / "log.txt").read_text(encoding="utf-8")
    assert "trace  a process that helped met MemoryError('no more of it'): " in log


def test_without_room_for_results_or_another_process_it_is_done_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> None:
        raise OSError("no more of these")

    for name in ("os.fork", "pipeline.run.helpers.TemporaryDirectory", "os.memfd_create"):
        with monkeypatch.context() as patch:
            patch.setattr(name, refused)
            assert {process for _, process in shared(who, 3, 2)} == {os.getpid()}, name


def test_the_error_is_that_of_the_first_part_that_has_one_wherever_it_was_met() -> None:
    def failing(number: int, _: Earlier[int]) -> int:
        time.sleep(0.05 if number == 3 else 0.0)
        if number in (3, 4, 9):
            raise ValueError(f"part {number}")
        return number

    for cores in (1, 2, 3):
        with pytest.raises(ValueError, match="part 3"):
            shared(failing, 12, cores)


def test_results_come_back_read_only_and_refer_to_what_was_inherited() -> None:
    lumen = np.zeros(10)
    here = os.getpid()

    def one(number: int, _: Earlier[Any]) -> Any:
        time.sleep(0.02)
        return os.getpid() != here, lumen, Curve(np.full((3, 3), float(number)), np.zeros(3))

    found = shared(one, 8, 2, inherited=(lumen,))
    assert any(helped for helped, _, _ in found)
    for _, inherited, curve in found:
        assert inherited is lumen
        assert not curve.points_mm.flags.writeable


def test_helpers_end_with_the_process_that_they_help(tmp_path: Path) -> None:
    """Even where it has no chance to end them."""
    code = (
        "import os, sys, time; from pipeline.run.helpers import shared\n"
        "def one(n, _):\n"
        "    open(sys.argv[1] + f'/{os.getpid()}', 'w').close(); time.sleep(60); return n\n"
        "shared(one, 9, 3)"
    )
    process = subprocess.Popen([sys.executable, "-c", code, str(tmp_path)])
    while len(found := [int(path.name) for path in tmp_path.iterdir()]) < 3:
        time.sleep(0.02)
    process.kill()
    process.wait()
    waited = time.monotonic() + 30.0
    while any(Path(f"/proc/{one}/cmdline").exists() and alive(one) for one in found):
        assert time.monotonic() < waited, "a helper outlives the run"
        time.sleep(0.02)


def alive(process: int) -> bool:
    """It is there, and no zombie that nobody asks for."""
    try:
        return Path(f"/proc/{process}/stat").read_text(encoding="ascii").rpartition(") ")[2][0] != "Z"
    except OSError:
        return False


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    words = ["synth", "bifurcation", "-o", str(folder), "--size", "64", "--frames", str(FRAMES), "--seed", "7"]
    assert main(words) == 0
    return folder


def run(study: Path, out: Path, *more: str) -> dict[str, int]:
    """Run it; how many results of which stage came from the store."""
    assert main(["run", str(study / "manifest.toml"), "-o", str(out), "-q", *more]) == 0
    text = (out / "cases" / "bifurcation" / "provenance.json").read_text(encoding="utf-8")
    reused: dict[str, int] = json.loads(text)["reused"]
    return reused


ASKED = "asked"


def curious(
    frame: Volume, lumen: Lumen, entry: Any, direction: Any, *, previous: Curve | None = None, **named: Any
) -> Curve:
    """Traces, and asks every other frame for the curve before: its length stands among the counters."""
    curve = trace(frame, lumen, entry, direction, **named)
    if round(curve.length_mm) % 2 or previous is None:
        return curve
    return replace(curve, counters={**curve.counters, ASKED: previous.length_mm})


def test_a_case_on_two_cores_is_the_case_on_one_file_by_file_and_so_is_what_the_store_has(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where some frames ask for the curve of the frame before, which another process may be at."""
    monkeypatch.setattr(tracing, "trace", curious)
    monkeypatch.setenv("WIREVAL_CACHE", str(tmp_path / "store"))
    run(study, tmp_path / "one", "--no-cache")
    assert run(study, tmp_path / "cold", "-j", "3") == {}
    assert run(study, tmp_path / "warm", "-j", "2") == {"segment": 1, "trace": FRAMES}
    for name in ("cold", "warm"):
        assert differences(tmp_path / "one", tmp_path / name) == [], name
    result = json.loads((tmp_path / "warm" / "cases" / "bifurcation" / "result.json").read_bytes())
    assert result["counters"]["trace"][ASKED] > 0


@pytest.mark.slow  # a promise of time alone
def test_files_are_hashed_by_another_process_while_the_lumen_is_segmented(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Results are the same, and nothing is forked beside a thread."""
    read_here: list[str] = []
    fork, digest, threads = os.fork, hashlib.file_digest, set[int]()

    def reading(handle: Any, name: str) -> Any:
        read_here.append(Path(handle.name).name)
        return digest(handle, name)

    def forked() -> int:
        threads.add(threading.active_count())
        return fork()

    monkeypatch.setattr(hashing.hashlib, "file_digest", reading)
    monkeypatch.setattr(os, "fork", forked)
    alone = threading.active_count()
    scans = {"reference.mha", *(f"frame_{n:03d}.mha" for n in range(FRAMES))}
    for name, cores in ("one", "1"), ("two", "2"), ("four", "4"):
        hashing._hashes.clear()
        read_here.clear()
        run(study, tmp_path / name, "--no-cache", "-j", cores, "--until", "trace")
        assert scans & {*read_here} == (scans if cores == "1" else set()), name
        assert differences(tmp_path / "one", tmp_path / name) == [], name
    assert threads == {alone}


def test_a_process_that_hashes_may_die_or_fail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What it has not said is hashed here, where what is wrong with a file is met."""
    files = [tmp_path / "a", tmp_path / "b"]
    for file in files:
        file.write_text(file.name)
    parent, hashes = os.getpid(), hashing._content_hash

    def lost(path: Path) -> str:
        if os.getpid() != parent:
            os.kill(os.getpid(), signal.SIGKILL)
        return hashes(path)

    monkeypatch.setattr(hashing, "_content_hash", lost)
    with hashing.hashing(files, 3) as hashed:
        hashed()
    assert {path for path, *_ in hashing._hashes} >= {*files}
    monkeypatch.setattr(hashing, "_content_hash", hashes)
    with pytest.raises(FileNotFoundError), hashing.hashing([*files, tmp_path / "gone"], 2) as hashed:
        hashed()
    assert multiprocessing.active_children() == []


@pytest.mark.slow
def test_a_frame_that_asked_is_traced_again_where_the_frame_before_is_another(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All others come from the store."""
    depths: list[float] = []

    def second_asks(*given: Any, expected_mm: float, previous: Curve | None = None, **named: Any) -> Curve:
        curve = trace(*given, expected_mm=expected_mm, **named)
        if previous is None or expected_mm != depths[1]:
            return curve
        return replace(curve, counters={**curve.counters, ASKED: previous.length_mm})

    monkeypatch.setattr(tracing, "trace", second_asks)
    monkeypatch.setenv("WIREVAL_CACHE", str(tmp_path / "store"))
    other = Path(shutil.copytree(study, tmp_path / "study"))
    depths += tomllib.loads((study / "manifest.toml").read_text(encoding="utf-8"))["case"][0]["insertion_mm"]
    run(study, tmp_path / "out", "-j", "2", "--until", "trace")
    first = other / "frames" / "frame_000.mha"
    image = sitk.ReadImage(str(first))
    sitk.WriteImage(image + 1, str(first))
    assert run(other, tmp_path / "other", "-j", "2", "--until", "trace") == {"segment": 1, "trace": FRAMES - 2}


@pytest.mark.slow
def test_the_fit_of_the_clamp_has_a_time_of_its_own(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is most of a sweep point's time, and was missing from the table of times; the last line is of the frames."""
    fitted = simulating.clamp_of

    def slowly(*given: Any) -> Any:
        time.sleep(0.2)
        return fitted(*given)

    monkeypatch.setattr(simulating, "clamp_of", slowly)
    run(study, tmp_path / "out", "--until", "simulate")
    times = read(tmp_path / "out" / "cases" / "bifurcation" / TIMINGS.file, TIMINGS)["clamp_s"]
    assert times.max() > 0.2
    said = re.search(r"simulate ([\d.]+) ms/frame", capsys.readouterr().out)
    assert said is not None
    assert float(said[1]) < 50.0, "the fit, 0.2 s over four frames, is none of theirs"


def plan_of(workers: int, **more: Any) -> Plan:
    plan: Plan = object.__new__(Plan)
    vars(plan).update(workers=workers, address="", limits=Limits(), **more)
    return plan


def test_cases_come_first_and_what_is_left_over_is_shared_among_them() -> None:
    assert [cores_each(plan_of(4), jobs) for jobs in (0, 1, 2, 3, 4, 5, 100)] == [4, 4, 2, 1, 1, 1, 1]
    assert cores_each(plan_of(1), 1) == 1


def test_a_limit_of_memory_is_that_of_one_process_and_a_cluster_has_cores_of_its_own() -> None:
    limited, remote = plan_of(4), plan_of(4)
    vars(limited)["limits"], vars(remote)["address"] = Limits(math.inf, 500.0), "tcp://there:1"
    assert cores_each(limited, 1) == cores_each(remote, 1) == 1


@pytest.mark.slow
def test_the_command_takes_no_threads_beside_those_of_j() -> None:
    """With two threads of BLAS, -j 1 and -j 2 differed in the last digit."""
    code = "import os, pipeline; from pipeline.cli import main; main(); print(*map(os.environ.get, pipeline.THREADS))"
    told = {name: value for name, value in os.environ.items() if name not in THREADS} | {THREADS[0]: "2"}
    said = subprocess.check_output([sys.executable, "-c", code, "--version"], env=told, encoding="utf-8")
    assert said.splitlines()[-1].split() == ["1"] * len(THREADS)
