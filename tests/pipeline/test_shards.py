"""Parts of a study on other machines: a shard without a case has nothing to do, a cluster is looked for first."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import pytest

import wireval
from pipeline.cli import main
from reports.case_files import not_run
from reports.records import run_records
from tests.pipeline.test_calibrate import PARAMETERS

QUICK = ("--until", "load", "-q")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two cases of different scans."""
    folder = tmp_path_factory.mktemp("shards") / "study"
    words = ["synth", "straight", "-o", str(folder), "--size", "96", "--frames", "2", "--insertions", "2"]
    assert main(words) == 0
    return folder


@pytest.mark.parametrize("more", [(), ("--dry-run",), ("--executor", "tcp://127.0.0.1:9"), ("--only", "straight-1")])
def test_a_shard_without_a_case_has_nothing_to_do(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], more: tuple[str, ...]
) -> None:
    """It was exit 2, of calibration: a SLURM array of 20 over 6 cases had 14 failed jobs."""
    only = "--only" in more
    if only:
        more = ("--only", ids(study)[0])
    junit = tmp_path / "junit.xml"
    words = ["run", str(study), "-o", str(tmp_path / "out"), "--shard", "3/20", "--junit", str(junit)]
    assert main([*words, *more]) == 0
    assert junit.exists() == ("--dry-run" not in more), "a build server expects it"
    said = capsys.readouterr()
    of = "does not hold the only case" if only else "holds none of the 2 cases"
    assert (said.out, said.err) == (f"shard 3/20 {of}: nothing to do\n", "")
    assert not (tmp_path / "out").exists()


def ids(study: Path) -> list[str]:
    lines = (study / "manifest.toml").read_text(encoding="utf-8").splitlines()
    return [line.split('"')[1] for line in lines if line.startswith("id =")]


def test_shards_of_which_one_is_empty_are_merged(study: Path, tmp_path: Path) -> None:
    """Each into its own folder, and all into one."""
    for n in (1, 2, 3):
        for name in (str(n), "one"):
            assert main(["run", str(study), "-o", str(tmp_path / name), "--shard", f"{n}/3", *QUICK]) == 0
        if (tmp_path / str(n)).exists():
            shutil.copytree(tmp_path / str(n), tmp_path / "merged", dirs_exist_ok=True)
    for name in ("merged", "one"):
        assert main(["report", str(tmp_path / name), "--overview"]) == 0


def test_a_shard_is_known_by_its_numbers(study: Path, tmp_path: Path) -> None:
    """1/02 was another one than 1/2, and stood beside it."""
    for text in ("1/2", "1/02"):
        assert main(["run", str(study), "-o", str(tmp_path), "--shard", text, *QUICK]) == 0
    assert [path.name for path in run_records(tmp_path)] == ["run.1-2.json"]


def test_an_array_of_another_size_says_that_it_replaces_the_first(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A shard of quarters removed the records of thirds without a word."""
    for text in ("1/3", "2/3", "1/2"):
        assert main(["run", str(study), "-o", str(tmp_path), "--shard", text, *QUICK]) == 0
        said = capsys.readouterr().err
        told = f"{tmp_path}: shards of an array of 3 wrote here, and this is one of 2: their records were removed; run"
        assert (f"{told} all 2, which keep" in said) == (text == "1/2")
    assert [path.name for path in run_records(tmp_path)] == ["run.1-2.json"]


def test_from_python_an_empty_shard_has_empty_tables(study: Path, tmp_path: Path) -> None:
    results = wireval.run(study, tmp_path / "out", shard="3/3", quiet=True)
    assert (len(results.errors), len(results.points), len(results.summary), results.cases) == (0, 0, 0, {})
    assert list(results.errors.columns[:2]) == ["case", "frame"]
    assert "0 cases" in repr(results)


def test_a_case_that_another_shard_calibrated_with_is_not_missed(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of a study in shards the report missed it, with exit code 1."""
    from pipeline.run.calibrated import data_of
    from pipeline.study.manifest import read_manifest

    folder = tmp_path / "study"
    shutil.copytree(study, folder)
    text = (folder / "manifest.toml").read_text(encoding="utf-8")
    (folder / "manifest.toml").write_text(text.replace('"validation"', '"calibration"', 1), encoding="utf-8")
    first, second = read_manifest(folder / "manifest.toml").cases
    wire = PARAMETERS.replace('wire = "w"', f'wire = "{first.wire.name}"').partition("[stated]")[0]
    (tmp_path / "p.toml").write_text(wire.replace("data = []", f'data = ["{data_of(first)[0]}"]'), encoding="utf-8")
    for n in (1, 2):
        words = ["run", str(folder), "-o", str(tmp_path / "out"), "--shard", f"{n}/2", *QUICK]
        assert main([*words, "--parameters", str(tmp_path / "p.toml")]) == 0
    assert "shard 1/2 does not hold the only case: nothing to do" in capsys.readouterr().out
    assert not_run(tmp_path / "out") == []
    assert [case.name for case in (tmp_path / "out" / "cases").iterdir()] == [second.id]


@pytest.mark.quick(2)
@pytest.mark.parametrize(
    ("address", "said"),
    [
        ("foo", "--executor 'foo': expected the address of a dask scheduler, as tcp://host:8786"),
        ("tcp://host", "as tcp://host:8786"),
        ("tcp://host:port", "as tcp://host:8786"),
        ("tcp://127.0.0.1:9", "needs dask; pip install wireval[cluster]"),
    ],
)
def test_an_executor_that_cannot_be_used_leaves_the_folder_alone(
    study: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    address: str,
    said: str,
) -> None:
    """It said that nothing was run, and the next run into the folder was refused."""
    monkeypatch.setitem(sys.modules, "distributed", None)
    words = ["run", str(study), "-o", str(tmp_path / "out"), *QUICK]
    assert main([*words, "--executor", address, "--set", "solver.segment_mm=1"]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert "in the command line; nothing was run" in error
    assert not (tmp_path / "out").exists()
    assert main(words) == 0
