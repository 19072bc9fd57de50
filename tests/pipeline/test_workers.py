"""Worker processes: they die alone, keep to limits, and never outlive the run."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from pipeline.run import workers
from pipeline.run.batch import run_all
from pipeline.run.workers import Limits, in_processes

LONG_S = 300


@pytest.fixture(autouse=True)
def _nothing_heavy(monkeypatch: pytest.MonkeyPatch) -> None:
    """These jobs need none of the pipeline's modules."""
    monkeypatch.setattr(workers, "PRELOADED", "time")


def hungry(job: str) -> str:
    """Takes too long, takes too much, or does neither."""
    if job == "long":
        time.sleep(LONG_S)
    if job == "much":
        held = [bytearray(os.urandom(2**20)) for _ in range(400)]
        time.sleep(LONG_S)
        return str(len(held))
    return job


def test_who_takes_more_than_allowed_is_named_and_the_others_go_on() -> None:
    limits = Limits(seconds=20.0, memory_mib=resident_of_a_worker() + 200.0)
    found = {o.job: o for o in run_all(["a", "much", "b"], hungry, 2, limits=limits)}
    assert (found["a"].result, found["b"].result) == ("a", "b")
    assert found["much"].status == "over_limit"
    assert "MiB of memory, more than" in found["much"].error
    (late,) = run_all(["long"], hungry, limits=Limits(seconds=0.5))
    assert "took longer than the 0.5 s of --case-timeout (peak memory " in late.error


def resident_of_a_worker() -> float:
    (found,) = in_processes([0], own_memory, 1)
    assert found.result is not None
    return found.result


def own_memory(_: int) -> float:
    return workers.resident_mib(os.getpid())


def test_a_server_that_is_killed_as_it_starts_costs_no_job(monkeypatch: pytest.MonkeyPatch) -> None:
    """It was a traceback of multiprocessing's (EOFError), and no case had a row in failures.csv."""
    begin, killed = workers._start_server, list[int]()

    def start() -> None:
        begin()
        server = multiprocessing.forkserver._forkserver._forkserver_pid
        if len(killed) < most and server not in killed:
            killed.append(server)
            os.kill(server, signal.SIGSTOP)  # as if it still imported
            threading.Timer(0.2, os.kill, (server, signal.SIGKILL)).start()

    monkeypatch.setattr(workers, "_start_server", start)
    most = 1
    assert sorted((o.job, o.result) for o in run_all([7, 8], abs, 2)) == [(7, 7), (8, 8)]
    most, killed = 99, []
    (lost,) = run_all([7], abs, limits=Limits(seconds=20.0))
    assert lost.lost
    assert "killed twice" in lost.error
    assert lost.log.endswith("(the server that starts workers was killed)")


def threads_of_a_worker(job: str) -> str | None:
    """The limit of its threads, or the worker's end."""
    if job == "ends":
        os.kill(os.getpid(), signal.SIGKILL)
    return os.environ.get("OMP_NUM_THREADS")


def test_a_server_that_is_killed_while_it_waits_is_started_as_the_first_was(monkeypatch: pytest.MonkeyPatch) -> None:
    """multiprocessing started it again with this process's environment: as many threads as cores in each worker."""
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    outcomes = in_processes(["ends", "asks"], threads_of_a_worker, 1)
    assert next(outcomes).lost
    server = multiprocessing.forkserver._forkserver._forkserver_pid
    os.kill(server, signal.SIGKILL)
    wait_for(lambda: not running(server))
    assert next(outcomes).result == "1"


def test_time_in_which_everything_was_suspended_does_not_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """A job that its queue holds for a night had "taken longer than --case-timeout"."""
    clock = iter([0.0, 0.1, 40000.0, 40000.1, 40000.2])
    monkeypatch.setattr(workers, "time", SimpleNamespace(monotonic=lambda: next(clock, 40000.2)))
    (found,) = run_all([0.3], time.sleep, limits=Limits(seconds=5.0))
    assert found.status == "ok"


@pytest.mark.parametrize("name", ["signal", "pipeline"])
def test_nothing_is_imported_from_the_working_folder(tmp_path: Path, name: str) -> None:
    """Where `wireval` is started, a user's own package pipeline may lie: every case was lost to a dead worker."""
    (tmp_path / f"{name}.py").write_text("raise SystemExit('not mine')", encoding="utf-8")
    words = "import os, sys; os.chdir(sys.argv[1]); from pipeline.run.workers import in_processes; "
    words += "from pipeline.run import workers; workers.PRELOADED = 'time'; "
    words += "print([o.result for o in in_processes([7], abs, 1)])"
    done = subprocess.run(
        [sys.executable, "-P", "-c", words, str(tmp_path)], env=with_root(), capture_output=True, text=True, check=False
    )
    assert (done.stdout, done.stderr) == ("[7]\n", "")


def test_a_folder_for_temporary_files_may_have_a_long_path(tmp_path: Path) -> None:
    """A socket's path has 107 bytes at most: `-j 2` ended in a traceback."""
    place = tmp_path / ("a" * 60) / ("b" * 60)
    place.mkdir(parents=True)
    words = "from pipeline.run import workers; workers.PRELOADED = 'time'; "
    words += "print([o.result for o in workers.in_processes([7], abs, 1)])"
    env = with_root() | {"TMPDIR": str(place)}
    done = subprocess.run([sys.executable, "-c", words], env=env, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("[7]\n", "")


def test_the_signal_that_ended_a_worker_is_told() -> None:
    (found,) = run_all(["x"], killed, limits=Limits(seconds=LONG_S))
    assert (found.status, "signal 9, SIGKILL" in found.log) == ("worker_lost", True)


def killed(_: str) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


PARENT = """
import sys
from pathlib import Path
from pipeline.run import workers
from tests.pipeline.test_workers import deaf
workers.PRELOADED = "time"
if __name__ == "__main__":
    list(workers.in_processes([Path(sys.argv[1], name) for name in "ab"], deaf, 2))
"""


def deaf(path: Path) -> None:
    """Keeps the interpreter to itself, so that no thread and no handler of this process gets a turn."""
    path.with_suffix(".tmp").write_text(str(os.getpid()), encoding="utf-8")
    path.with_suffix(".tmp").rename(path)
    ctypes.PyDLL(None).sleep(LONG_S)


@pytest.mark.quick(1)
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_no_worker_outlives_its_parent(tmp_path: Path, how: signal.Signals) -> None:
    """The parent may have no chance to say anything, the worker none to listen."""
    script = tmp_path / "parent.py"
    script.write_text(PARENT, encoding="utf-8")
    with subprocess.Popen(
        [sys.executable, str(script), str(tmp_path)], stderr=subprocess.DEVNULL, env=with_root()
    ) as parent:
        wait_for(lambda: all((tmp_path / name).exists() for name in "ab"))
        numbers = [int((tmp_path / name).read_text(encoding="utf-8")) for name in "ab"]
        assert all(Path(f"/proc/{n}").exists() for n in numbers)
        parent.send_signal(how)
    wait_for(lambda: not any(running(n) for n in numbers))


SLOW = """
import os, sys, time
from pathlib import Path
Path(__file__).with_name("server.tmp").write_text(str(os.getpid()))
Path(__file__).with_name("server.tmp").rename(Path(__file__).with_name("server"))
time.sleep(300)
"""


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_the_server_of_the_workers_does_not_either_while_it_imports(tmp_path: Path, how: signal.Signals) -> None:
    """It went on for seven seconds."""
    (tmp_path / "slow.py").write_text(SLOW, encoding="utf-8")
    script = tmp_path / "parent.py"
    script.write_text(PARENT.replace('"time"', '"slow"'), encoding="utf-8")
    path = {"PYTHONPATH": f"{tmp_path}{os.pathsep}{Path(__file__).parents[2]}"}
    with subprocess.Popen(
        [sys.executable, str(script), str(tmp_path)], stderr=subprocess.DEVNULL, env=os.environ | path
    ) as parent:
        wait_for((tmp_path / "server").exists)
        server = int((tmp_path / "server").read_text(encoding="utf-8"))
        assert running(server)
        parent.send_signal(how)
    wait_for(lambda: not running(server))


def with_root() -> dict[str, str]:
    return os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}


def running(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_for(condition) -> None:  # type: ignore[no-untyped-def]
    """A minute is long on any machine, and a fifth of what the jobs sleep."""
    for _ in range(3000):
        if condition():
            return
        time.sleep(0.02)
    pytest.fail("it has not come about")


def test_leaving_early_ends_the_workers(tmp_path: Path) -> None:
    outcomes = in_processes(["a", "long", "b"], hungry, 2)
    assert next(outcomes).result == "a"
    clock = time.monotonic()
    outcomes.close()
    assert time.monotonic() - clock < LONG_S / 2


def with_a_child(_: int) -> int | None:
    """The stress study's scenes run in forks of their worker."""
    child = multiprocessing.get_context("fork").Process(target=os._exit, args=(7,))
    child.start()
    child.join()
    return child.exitcode


def test_a_job_may_have_processes_of_its_own() -> None:
    assert [outcome.result for outcome in in_processes([0], with_a_child, 1)] == [7]
