"""A real dask scheduler with two workers on loopback; needs the extra ``[cluster]``."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

from pipeline.cli import main
from pipeline.run.batch import run_all
from pipeline.run.outcome import LOST
from tests.studies.trees import differences

pytest.importorskip("distributed", reason="the extra [cluster] is not installed")
pytestmark = pytest.mark.filterwarnings("default")

CLUSTER = """
import dask, sys, time
from distributed import LocalCluster
if __name__ == "__main__":
    # a job whose worker dies is given back at once: that it is tried again is not dask's doing
    dask.config.set({"distributed.scheduler.allowed-failures": 0})
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()
"""


@pytest.fixture(autouse=True)
def unseen_figures() -> None:
    """Figures are drawn in full here: the workers of a scheduler do, and theirs are compared."""


@pytest.fixture(scope="module", autouse=True)
def few_figures() -> None:
    """All of them, too."""


@contextmanager
def cluster(folder: Path) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """The address of a scheduler, and its process. It runs in another folder than the test, as on other machines."""
    (folder / "cluster.py").write_text(CLUSTER, encoding="utf-8")
    words = [sys.executable, str(folder / "cluster.py")]
    path = {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[2]), *sys.path])}
    with subprocess.Popen(
        words,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=folder,
        env=os.environ | path,
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        yield process.stdout.readline().strip(), process
        process.communicate("")


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with cluster(tmp_path_factory.mktemp("cluster")) as (place, _):
        yield place


def work(folder: Path, job: int) -> int:
    """Job 3 kills its worker whenever it is run, job 4 the first time."""
    first = not (folder / "died").exists()
    if job == 4:
        (folder / "died").touch()
    if job == 3 or (job == 4 and first):
        os.kill(os.getpid(), signal.SIGKILL)
    return job


def test_a_job_that_kills_its_workers_is_named_and_the_others_end_well(address: str, tmp_path: Path) -> None:
    found = {o.job: o for o in run_all(range(8), partial(work, tmp_path), address=address)}
    assert sorted(found) == list(range(8))
    assert (found[3].error, found[3].status) == (LOST, "worker_lost")
    assert [job for job in sorted(found) if found[job].result == job] == [0, 1, 2, 4, 5, 6, 7]


def test_a_worker_killed_in_the_middle_of_a_case_costs_nothing(address: str, tmp_path: Path) -> None:
    """The results are those of one process, file by file."""
    folder, first, second = tmp_path / "study", tmp_path / "first", tmp_path / "second"
    assert main(["synth", "bifurcation", "-o", str(folder), "--size", "64", "--frames", "2", "--seed", "7"]) == 0
    manifest = folder / "manifest.toml"
    text = manifest.read_text(encoding="utf-8")
    case = text[text.index("[[case]]") :].replace('id = "bifurcation"', 'id = "second"')
    manifest.write_text(f"{text}\n{case}", encoding="utf-8")
    words = ["run", str(manifest), "--no-cache", "-o"]
    assert main([*words, str(first)]) == 0
    codes: list[int] = []
    run = threading.Thread(target=lambda: codes.append(main([*words, str(second), "--executor", address])))
    run.start()
    held = second / "cases" / "second" / ".at-work"
    while run.is_alive() and "process" not in (held.read_text(encoding="utf-8") if held.exists() else ""):
        time.sleep(0.01)
    os.kill(int(held.read_text(encoding="utf-8").split()[1]), signal.SIGKILL)
    run.join()
    assert codes == [0]
    assert differences(first, second) == []


def test_a_scheduler_that_goes_away_is_told_of_and_what_is_done_is_kept(tmp_path: Path) -> None:
    """It was waited for, for ever."""
    with cluster(tmp_path) as (address, process):
        outcomes = run_all([0.0, 0.1, 600.0, 601.0, 602.0], time.sleep, address=address)
        found = [next(outcomes), next(outcomes)]
        os.killpg(process.pid, signal.SIGKILL)
        found += outcomes
    assert {o.job: o.status for o in found} == {0.0: "ok", 0.1: "ok"} | dict.fromkeys(
        (600.0, 601.0, 602.0), "scheduler_lost"
    )


def test_a_scheduler_that_does_not_answer_leaves_the_folder_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    import dask

    assert main(["synth", "straight", "-o", str(tmp_path / "study"), "--size", "72", "--frames", "2"]) == 0
    monkeypatch.setitem(dask.config.config["distributed"]["comm"]["timeouts"], "connect", "1s")
    for address, said in (("tcp://127.0.0.1:9", "no dask scheduler answers there"), ("smoke://h:1", "smoke")):
        words = ["run", str(tmp_path / "study"), "-o", str(tmp_path / "out"), "--executor", address]
        assert main(words) == 2
        assert said in capsys.readouterr().err
        assert not (tmp_path / "out").exists()
