"""What is finished is kept, what is missing is made again, what is not as it was written is not believed."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from pipeline.__main__ import main as as_program
from pipeline.cli import main
from pipeline.model import Curve
from pipeline.run import launch, ledger
from pipeline.run.cache import Store
from pipeline.run.occupied import held, owner_of
from pipeline.run.outcome import Outcome
from pipeline.run.results import found_in
from pipeline.run.stages import STEPS, Context, Known
from pipeline.status import InputError
from pipeline.wireval import read_results
from reports import atomic
from tests.studies.trees import differences

pytestmark = pytest.mark.usefixtures("one_store")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    assert main(["synth", "bifurcation", "-o", str(folder), "--size", "64", "--frames", "2", "--seed", "7"]) == 0
    return folder


@pytest.fixture(scope="module")
def whole(study: Path, store: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("whole")
    assert run(study, out) == 0
    return out


@pytest.fixture
def out(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "out"))


def run(study: Path, out: Path, *more: str) -> int:
    return main(["run", str(study / "manifest.toml"), "-o", str(out), *more])


def case_of(out: Path) -> Path:
    return out / "cases" / "bifurcation"


@pytest.mark.parametrize("lost", ["report.html", "figures"])
def test_pages_are_made_again_without_the_rest(study: Path, whole: Path, out: Path, lost: str) -> None:
    """Killed between the result and its pages, or a picture lost since."""
    case = case_of(out)
    path = case / lost
    _ = shutil.rmtree(path) if path.is_dir() else path.unlink()
    before = (case / "frames.h5").stat().st_mtime_ns
    assert run(study, out) == 0
    assert differences(whole, out) == []
    assert (case / "frames.h5").stat().st_mtime_ns == before


def test_a_run_that_ended_before_its_pages_gets_them(study: Path, whole: Path, out: Path) -> None:
    case = case_of(out)
    known = ledger.read(case)
    assert known is not None
    for name in known.drawn:
        (case / name).unlink()
    ledger.write(case, known.key)
    assert run(study, out) == 0
    assert differences(whole, out) == []


@pytest.mark.quick(1)
@pytest.mark.parametrize(("name", "how"), [("errors.csv", "altered"), ("view/lumen.vtp", "gone")])
def test_what_is_not_as_it_was_written_is_computed_again(
    study: Path, whole: Path, out: Path, name: str, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = case_of(out) / name
    content = path.read_bytes()
    path.unlink()
    if how == "altered":
        path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))  # of the same size
    assert run(study, out) == 0
    words = "is not as it was written" if how == "altered" else "is missing"
    assert f"{name} {words}: computed again" in capsys.readouterr().err
    assert differences(whole, out) == []


def test_no_number_is_pooled_from_a_table_that_was_changed(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = case_of(out) / "errors.csv"
    path.write_text(path.read_text(encoding="utf-8").replace(",ok,", ",ok, "), encoding="utf-8")
    assert main(["report", str(out)]) == 1
    said = capsys.readouterr()
    assert "errors.csv is not as it was written" in said.err
    assert "1 case, 2 frames: 0 ok.  2 frames not ok (failures.csv)" in said.out
    assert list(pd.read_csv(out / "summary.csv")["status"]) == ["damaged"]


@pytest.mark.parametrize("how", ["gone", "cut short"])
def test_a_page_stays_where_what_it_is_drawn_from_is_not_whole(
    out: Path, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was drawn again without its viewer, exit 0; and other insertions had one guess less, without a word."""
    path, page = case_of(out) / "frames.h5", (case_of(out) / "report.html").read_bytes()
    content = path.read_bytes()
    path.unlink()
    if how == "cut short":
        path.write_bytes(content[:-1])
    assert main(["report", str(out)]) == 1
    words = "is missing" if how == "gone" else "is not as it was written"
    assert f"bifurcation: {case_of(out)}: frames.h5 {words}; run the case again" in capsys.readouterr().err
    assert (case_of(out) / "report.html").read_bytes() == page
    assert list(pd.read_csv(out / "summary.csv")["status"]) == ["damaged"]


@pytest.mark.quick(1)
@pytest.mark.parametrize("how", ["gone", "half"])
def test_tables_without_their_ledger_are_not_believed(
    study: Path, whole: Path, out: Path, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was the way round every check."""
    path = case_of(out) / "ledger.json"
    _ = path.unlink() if how == "gone" else path.write_text('{"key": "', encoding="utf-8")
    for more in ((), ("--overview",)):
        assert main(["report", str(out), *more]) == 1
        assert f"{case_of(out)}: ledger.json is missing or cannot be read; run the case" in capsys.readouterr().err
    assert list(pd.read_csv(out / "summary.csv")["status"]) == ["damaged"]
    assert main(["diff", str(whole), str(out)]) == 1
    with held(case_of(out), print):  # as between the result and its ledger
        assert main(["report", str(out), "--overview"]) == 0
    assert run(study, out) == 0
    assert differences(whole, out) == []


def edited(path: Path, **changes: object) -> None:
    """Change keys of a JSON file."""
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | changes), encoding="utf-8")


def with_ledger(case: Path) -> None:
    """Write the ledger of a case whose files were changed, as one would who wants them to be believed."""
    known = ledger.read(case)
    assert known is not None
    ledger.write(case, known.key)


def healed(study: Path, whole: Path, out: Path, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The case counts as damaged for this reason, and the same command computes it again."""
    assert main(["report", str(out), "--overview"]) == 1
    assert f"bifurcation: {case_of(out)}{said}; " in capsys.readouterr().err
    assert list(pd.read_csv(out / "summary.csv")["status"]) == ["damaged"]
    assert run(study, out) == 0
    assert f"{case_of(out)}{said}: computed again" in capsys.readouterr().err
    assert differences(whole, out) == []


@pytest.mark.quick(1)
@pytest.mark.parametrize("lost", [(), ("errors.csv",), ("points.csv.gz",)])
def test_a_ledger_that_names_too_few_files_is_not_believed(
    study: Path, whole: Path, out: Path, lost: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    """With none of them named and the tables deleted all was ok, and nothing was made again."""
    path = case_of(out) / "ledger.json"
    files = json.loads(path.read_text(encoding="utf-8"))["files"]
    edited(path, files={name: files[name] for name in files if name not in lost} if lost else {})
    for name in lost or ("errors.csv", "points.csv.gz", "frames.h5"):
        (case_of(out) / name).unlink()
    healed(study, whole, out, f": ledger.json does not name {(*lost, 'result.json')[0]}", capsys)


def test_a_table_that_the_ledger_does_not_name_is_not_believed(out: Path) -> None:
    (case_of(out) / "budget.csv").write_text("input,u_mm", encoding="utf-8")
    known = ledger.read(case_of(out))
    assert known is not None
    assert known.amiss(case_of(out), ledger.DATA) == "ledger.json does not name budget.csv"


def test_a_result_without_key_and_ledger_is_not_believed(
    study: Path, whole: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It passed for one of a case that crashed, which has neither."""
    (case_of(out) / "ledger.json").unlink()
    edited(case_of(out) / "result.json", key="")
    healed(study, whole, out, ": result.json has no key", capsys)


@pytest.mark.parametrize("stage", ["load", "trace"])
def test_a_case_that_was_to_end_early_is_whole_with_fewer_files(study: Path, tmp_path: Path, stage: str) -> None:
    assert run(study, tmp_path, "--until", stage) == 0
    assert found_in(case_of(tmp_path)).ok
    before = (case_of(tmp_path) / "result.json").stat().st_mtime_ns
    assert run(study, tmp_path, "--until", stage) == 0
    assert (case_of(tmp_path) / "result.json").stat().st_mtime_ns == before


@pytest.mark.quick(1)
@pytest.mark.parametrize("name", ["errors.csv", "view/scene.mrml"])
def test_a_pipe_that_the_ledger_calls_empty_does_not_block(
    study: Path, whole: Path, out: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    case = case_of(out)
    spoil(case / name, "a pipe")
    files = json.loads((case / "ledger.json").read_text(encoding="utf-8"))["files"]
    edited(case / "ledger.json", files=files | {name: {"bytes": 0, "sha256": "0" * 64}})
    assert main(["report", str(out), "--overview"]) == (name == "errors.csv")
    assert run(study, out) == 0
    assert f"{name} is not as it was written: computed again" in capsys.readouterr().err
    assert differences(whole, out) == []


@pytest.mark.quick(1)
@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"frames": "two"}, "summary.frames: got 'two'; expected a whole number from 0 on"),
        ({"rms_mm": "=cmd|calc"}, "summary.rms_mm: got '=cmd|calc'; expected a number"),
        ({"frames_ok": 99}, "summary.frames_ok: got 99; expected 2, the number of frames that are ok"),
    ],
)
def test_a_result_that_no_case_has_is_damaged_and_computed_again(
    study: Path, whole: Path, out: Path, change: dict[str, object], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its ledger fitted it: errors of Python's own, or counts that were believed."""
    path = case_of(out) / "result.json"
    edited(path, summary=json.loads(path.read_text(encoding="utf-8"))["summary"] | change)
    with_ledger(case_of(out))
    with pytest.raises(InputError, match=re.escape(f"result.json: {said}")):
        read_results(out)
    assert main(["diff", str(whole), str(out)]) == 1
    assert said in capsys.readouterr().out
    healed(study, whole, out, f"/result.json: {said}", capsys)


def test_a_result_of_another_case_is_computed_again(
    study: Path, whole: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was kept, called damaged, and the advice was to do the same again."""
    path = case_of(out) / "result.json"
    edited(path, case="x", summary=json.loads(path.read_text(encoding="utf-8"))["summary"] | {"case": "x"})
    with_ledger(case_of(out))
    healed(study, whole, out, ": holds the result of case 'x'", capsys)


def test_a_folder_in_the_place_of_a_file_is_named_and_not_the_case(
    study: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The advice was to remove the folder of the case."""
    spoil(case_of(out) / "ledger.json", "a folder")
    assert run(study, out) == 1
    assert f"{case_of(out) / 'ledger.json'}: cannot be written: Is a directory; remove" in capsys.readouterr().err


@pytest.mark.parametrize("how", ["altered", "gone"])
def test_a_damaged_case_is_pooled_nowhere_and_says_why(out: Path, how: str) -> None:
    """overall.csv was made of an altered table; of one that was gone, points.csv.gz was blamed."""
    path = case_of(out) / "errors.csv"
    table = pd.read_csv(path)
    path.unlink()
    if how == "altered":
        table.assign(rms_mm=0.01).to_csv(path, index=False)
    assert main(["report", str(out), "--overview"]) == 1
    assert pd.read_csv(out / "overall.csv").empty
    words = "is not as it was written" if how == "altered" else "is missing"
    assert f"errors.csv {words}; run" in pd.read_csv(out / "failures.csv")["message"][0]


SPOILT = {
    "empty": "", "a list": "[1]", "config": '{"config": []}', "deep": '{"a":' * 50_000 + "1" + "}" * 50_000,
    "a number": f'{{"a": {"9" * 5000}}}', "a pipe": None, "a folder": None,
}  # fmt: skip


def spoil(path: Path, how: str) -> None:
    path.unlink()
    if how in ("a pipe", "a folder"):
        (os.mkfifo if how == "a pipe" else os.mkdir)(path)
    else:
        path.write_text(str(SPOILT[how]), encoding="utf-8")


@pytest.mark.parametrize("how", SPOILT)
def test_a_record_of_a_run_that_is_none_is_named(
    study: Path, out: Path, how: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """They blocked, or ended in errors of Python's own."""
    spoil(out / "run.json", how)
    assert main(["report", str(out), "--overview"]) == 2
    assert capsys.readouterr().err.startswith(f"{out / 'run.json'}: ")
    assert main(["diff", str(out), str(out)]) == 2
    assert capsys.readouterr().err.startswith(f"{out / 'run.json'}: ")
    assert run(study, out) == 2
    assert "run.json is damaged; say --resume" in capsys.readouterr().err


@pytest.mark.quick(8)
@pytest.mark.parametrize("name", ["result.json", "ledger.json", "errors.csv", "frames.h5"])
@pytest.mark.parametrize("how", SPOILT)
def test_a_file_of_a_case_that_is_none_is_named(
    out: Path, how: str, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    spoil(case_of(out) / name, how)
    assert main(["report", str(out), "--overview"]) == 1
    assert re.search(rf"bifurcation: {case_of(out)}: {name} is (not as it was|missing)", capsys.readouterr().err)
    assert list(pd.read_csv(out / "summary.csv")["status"]) == ["damaged"]


def test_the_frames_of_a_case_without_a_result_are_counted_as_planned(out: Path) -> None:
    """With result.json cut in half there were none, with errors.csv altered they were all there."""
    planned = len(pd.read_csv(case_of(out) / "errors.csv"))
    path = case_of(out) / "result.json"
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert main(["report", str(out), "--overview"]) == 1
    row = pd.read_csv(out / "summary.csv").iloc[0]
    assert (row["frames"], row["frames_ok"], row["frames_failed"]) == (planned, 0, planned)
    (case_of(out) / "errors.csv").write_text("", encoding="utf-8")
    assert main(["report", str(out), "--overview"]) == 1
    assert list(pd.read_csv(out / "summary.csv")["frames"]) == [0]


def test_a_result_of_another_kind_is_damaged_without_its_ledger_too(out: Path) -> None:
    path = case_of(out) / "result.json"
    path.write_text(json.dumps(json.loads(path.read_text(encoding="utf-8")) | {"config": []}), encoding="utf-8")
    (case_of(out) / "ledger.json").unlink()
    assert main(["report", str(out), "--overview"]) == 1
    assert main(["diff", str(out), str(out)]) == 2
    with pytest.raises(InputError, match=r"result\.json: config is of another kind than expected"):
        read_results(out)


def test_a_log_that_is_a_pipe_does_not_block(study: Path, whole: Path, out: Path) -> None:
    spoil(case_of(out) / "log.txt", "a pipe")
    assert run(study, out, "--fresh") == 0
    assert (case_of(out) / "log.txt").is_file()


def test_a_page_that_cannot_be_drawn_costs_no_result(
    study: Path, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A frame of one point had no band to draw: all frames of its case were lost as crashed."""

    def faulty(*_: object) -> None:
        raise ValueError("no band")

    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr("pipeline.run.case.render_case", faulty)
        assert run(study, out) == 0
    assert "its pages cannot be drawn (ValueError: no band); its results stand" in capsys.readouterr().err
    assert main(["report", str(out)]) == 0
    assert differences(whole, out) == []


def test_report_heals_pages(study: Path, whole: Path, out: Path) -> None:
    shutil.rmtree(case_of(out) / "figures")
    (case_of(out) / "report.html").write_text("half a pa", encoding="utf-8")
    assert main(["report", str(out)]) == 0
    assert differences(whole, out) == []


def test_a_case_whose_run_goes_on_is_missing_for_the_exit_code_too(
    out: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """ "1 case without a result" was printed, and a run that ended while pages were drawn made it exit 0."""
    info = json.loads((out / "run.json").read_text(encoding="utf-8"))
    (out / "run.json").write_text(json.dumps(info | {"planned": ["bifurcation", "late"]}), encoding="utf-8")

    def drawn(*_: object) -> bool:
        shutil.copytree(case_of(out), out / "cases" / "late")
        return True

    monkeypatch.setattr("pipeline.commands.report._all_drawn", drawn)
    assert main(["report", str(out)]) == 1
    assert "1 case without a result" in capsys.readouterr().out


def test_an_output_that_is_removed_is_told_for_gone(tmp_path: Path) -> None:
    """ "make room or allow writing there" was said of it."""
    with pytest.raises(atomic.WriteError, match="its folder is gone: leave it in its place"), atomic.writing(tmp_path):
        (tmp_path / "gone" / "log.txt").open("a", encoding="utf-8")


def test_files_of_a_users_own_stay_among_those_of_a_run(
    study: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """3D Slicer saves corrected curves in ``view``: a run after one scan was changed removed them, as --resume did
    with run_notes.json; with it no page was drawn, since it was no record of a run.
    """
    own = [case_of(out) / "view" / "corrected_000.mrk.json", case_of(out) / "figures" / "mine.svg"]
    others = [out / "run_notes.json", out / "run.mine-2.json", out / "cases" / "mine" / "result.json"]
    for path in (*own, *others):
        path.parent.mkdir(exist_ok=True)
        path.write_text('{"my": 1}', encoding="utf-8")
    assert main(["report", str(out)]) == 0
    ours = ledger.read(case_of(out))
    assert ours is not None
    assert not {"view/corrected_000.mrk.json", "figures/mine.svg"} & ours.files.keys()
    capsys.readouterr()
    assert run(study, out, "--fresh", "--until", "load") == 0
    assert "not of a run, and kept: view/corrected_000.mrk.json, figures/mine.svg" in capsys.readouterr().err
    assert [*own[1].parent.iterdir()] == [own[1]]
    assert not (own[0].parent / "wire_traced_000.vtp").exists()
    assert {path.read_text(encoding="utf-8") for path in (*own, *others)} == {'{"my": 1}'}


def test_what_a_user_saves_over_a_file_of_a_run_is_kept_under_another_name(
    study: Path, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """3D Slicer's Save writes to the file that it has opened: the next run removed what was corrected there."""
    place, name = case_of(out) / "view", "wire_traced_000"
    for mine in ("first", "second"):
        (place / f"{name}.mrk.json").write_text(mine, encoding="utf-8")
        assert run(study, out, "--fresh", "--until", "load") == 0
    said = f"not of a run, and kept: view/{name}.yours.mrk.json, view/{name}.yours1.mrk.json\n"
    assert said in capsys.readouterr().err
    assert said in (case_of(out) / "log.txt").read_text(encoding="utf-8")
    (place / f"{name}.yours.vtp").touch()
    assert run(study, out, "--fresh", "--until", "trace") == 0, "a frame had the number '000.yours'"
    assert (place / f"{name}.yours.mrk.json").read_text(encoding="utf-8") == "first"
    assert (place / f"{name}.yours1.mrk.json").read_text(encoding="utf-8") == "second"


def test_a_picture_that_a_ledger_names_goes_whatever_it_is_called(study: Path, out: Path) -> None:
    """One that an earlier version drew under another name was called the user's own."""
    ours = case_of(out) / "figures" / "error_by_depth.png"
    assert ours.exists()
    text = (case_of(out) / ledger.FILE).read_text(encoding="utf-8").replace("/error_by_depth.png", "/renamed.png")
    (case_of(out) / ledger.FILE).write_text(text, encoding="utf-8")
    ours.rename(ours.with_name("renamed.png"))
    assert run(study, out, "--fresh", "--until", "load") == 0
    assert not ours.parent.exists()


@pytest.mark.parametrize("name", ["summary.csv", "index.html", "cases/bifurcation/errors.csv"])
@pytest.mark.parametrize("how", ["--resume", "--fresh"])
def test_results_replace_no_file_of_a_users_own(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, how: str
) -> None:
    """A folder without a run is told to be written into with --resume or --fresh: they replaced what it held."""
    own = tmp_path / name
    own.parent.mkdir(parents=True, exist_ok=True)
    own.write_text("mine", encoding="utf-8")
    assert run(study, tmp_path, how, "--until", "load") == 2
    assert f"{own}: is of no run, and would be replaced; name another folder" in capsys.readouterr().err
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [own]
    assert own.read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("name", ["summary.csv", "run_dir.json"])
def test_a_folder_where_a_run_writes_is_named_before_anything_is_run(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    (tmp_path / name).mkdir()
    assert run(study, tmp_path, "--resume", "--until", "load") == (2 if name == "summary.csv" else 0)
    said = f"{tmp_path / name}: cannot be written: Is a directory; remove this folder"
    assert (said in capsys.readouterr().err) == (name == "summary.csv")
    assert (tmp_path / name).is_dir()


def test_a_folder_where_a_report_writes_is_named(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It ended in a traceback."""
    (out / "gates.json").mkdir()
    assert main(["report", str(out), "--overview"]) == 1
    assert f"{out / 'gates.json'}: cannot be written: Is a directory; remove this folder" in capsys.readouterr().err


def test_leftovers_of_the_dead_go_and_those_of_the_living_stay(study: Path, whole: Path, out: Path) -> None:
    dead, living = (out / f".tmp-{atomic.HOST}-{n}-0123abcd-run.json" for n in (2**22 + 1, os.getppid()))
    inside = case_of(out) / f".tmp-{atomic.HOST}-1-0123abcd-errors.csv"
    for path in (dead, living, inside):
        path.write_text("half", encoding="utf-8")
    assert run(study, out, "--fresh", "--until", "load") == 0
    assert [path.exists() for path in (dead, living, inside)] == [False, True, False]


def test_a_run_that_left_nothing_but_half_a_file_goes_on(study: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / ".tmp-host-1-0123abcd-run.json").write_text("{", encoding="utf-8")
    assert run(study, tmp_path / "out", "--dry-run") == 0


def test_a_shard_of_another_study_is_refused(study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "run.1-2.json").write_text('{"manifest_sha256": "another"}', encoding="utf-8")
    assert run(study, out, "--shard", "1/1") == 2
    assert "made from another manifest" in capsys.readouterr().err


def test_a_disk_that_fills_up_is_named_and_the_rest_comes_later(
    study: Path, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr("pipeline.run.view.export.write_surface_vtp", with_full_disk)
        assert run(study, out) == 1
    said = capsys.readouterr().err
    assert "lumen.vtp: cannot be written: No space left on device; make room" in said
    assert "Traceback" not in said
    assert run(study, out) == 0
    assert differences(whole, out) == []


def with_full_disk(path: Path, *_: object) -> None:
    with atomic.replacing(path):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_an_output_that_cannot_be_written_is_named_before_anything_is_run(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    assert run(study, tmp_path / "file" / "out") == 2
    said = capsys.readouterr().err
    assert "cannot be written: Not a directory; name a place where you may write" in said


@pytest.mark.slow
def test_a_store_that_cannot_be_written_costs_a_warning(
    study: Path, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv("WIREVAL_CACHE", str(tmp_path / "file" / "store"))
    assert run(study, tmp_path / "out") == 0
    said = capsys.readouterr().err
    assert said.count("the cache keeps nothing from here on") == 1
    assert "cannot be read" not in said, "a line more for each result"
    assert "store cannot be written: Not a directory; make room or allow writing there" in said
    assert differences(whole, tmp_path / "out") == []


@pytest.mark.parametrize("how", ["altered", "cut", "of another", "a folder", "a pipe"])
def test_a_stored_result_that_was_changed_is_not_used(tmp_path: Path, how: str) -> None:
    said: list[str] = []
    mine = Store(tmp_path, said.append)
    for letter in "ab":
        mine.put("trace", letter * 64, Curve(np.eye(3) * (1 + (letter == "b")), np.ones(3)))
    first, second = (path for path, _, _ in mine.entries())
    content = first.read_bytes()
    place = content.index(np.eye(3).tobytes())
    altered = content[:place] + np.float64(1.5).tobytes() + content[place + 8 :]
    if how == "a folder":
        first.unlink()
        (first / "within").mkdir(parents=True)
    elif how == "a pipe":
        first.unlink()
        os.mkfifo(first)
    else:
        first.write_bytes({"altered": altered, "cut": content[:-9], "of another": second.read_bytes()}[how])
    assert mine.get("trace", "a" * 64) is None
    assert "is not as it was written" in said[0]
    assert mine.get("trace", "b" * 64) is not None


def test_the_cache_has_a_limit_and_a_check(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("WIREVAL_CACHE", str(tmp_path))
    mine, foreign = Store(tmp_path), tmp_path / "letters" / "de" / "brief.result"
    foreign.parent.mkdir(parents=True)
    foreign.write_text("of somebody who named this folder as the store", encoding="utf-8")
    for age, letter in enumerate("abcd"):
        mine.put("trace", letter * 64, Curve(np.eye(3), np.ones(3)))
        os.utime(mine.entries()[-1][0], (1e9 - age, 1e9 - age))  # d is the oldest
    assert mine.get("trace", "d" * 64) is not None  # and now the youngest
    one = mine.entries()[0][1]
    assert main(["cache", "--limit", "5"]) == 2, "meant as 5 GB, it removed all"
    assert len(mine.entries()) == 4
    assert mine.trim(4 * one) == (0, 0)
    assert mine.trim(4 * one - 1) == (1, one), "a byte too much"
    assert main(["cache", "--limit", f"{2 * one / 1024}K"]) == 0
    assert [path.stem[0] for path, _, _ in mine.entries()] == ["a", "d"]
    assert mine.limit == 2 * one
    assert main(["cache", "--check"]) == 0
    path = mine.entries()[0][0]
    path.write_bytes(path.read_bytes()[:-1])
    assert main(["cache", "--check"]) == 1
    assert f"{path}: not as it was written" in capsys.readouterr().err
    assert [path.stem[0] for path, _, _ in mine.entries()] == ["d"]
    assert main(["cache", "--limit", "lots"]) == 2
    assert main(["cache", "--prune"]) == 0
    assert mine.entries() == []
    assert foreign.exists()


def test_the_second_run_says_who_is_at_work(study: Path, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    done: list[int] = []
    second = threading.Thread(target=lambda: done.append(run(study, out)))
    with held(case_of(out), print):
        second.start()
        log = case_of(out) / "log.txt"
        while "is at work" not in log.read_text(encoding="utf-8"):
            time.sleep(0.01)
        assert not done
        assert f"process {os.getpid()} on " in owner_of(case_of(out))
    second.join()
    assert done == [0]
    assert f"[bifurcation] process {os.getpid()} on " in capsys.readouterr().err
    assert owner_of(case_of(out)) == ""
    assert not (case_of(out) / ".at-work").exists()


def test_a_case_that_another_run_works_on_is_left_to_it(
    out: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its files are not cleared away for the sake of a message that this run's worker was lost."""
    job = SimpleNamespace(folder=case_of(out), case=SimpleNamespace(id="bifurcation"))
    with held(case_of(out), print):
        launch._write_lost(Outcome(job, None, "over", "over", "over_limit"))  # type: ignore[arg-type]
    assert "bifurcation: over; left to process" in capsys.readouterr().err
    assert (case_of(out) / "result.json").exists()


def test_an_executor_that_is_not_there_is_refused(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(study, tmp_path / "out", "--executor", "nonsense://") == 2
    assert "--executor 'nonsense://': expected the address" in capsys.readouterr().err


AT_A_FORK = """
import os, signal, sys
from pipeline.cli import main
os.register_at_fork(after_in_parent=lambda: os.kill(os.getpid(), int(sys.argv[1])))
sys.exit(main(["synth", "straight", "-o", sys.argv[2], "--size", "72", "--insertions", "2", "-j", "2"]))
"""


@pytest.mark.quick(1)
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_that_comes_while_python_forks_is_not_lost(tmp_path: Path, number: signal.Signals, code: int) -> None:
    """Python prints the exception of a signal that it handles there, and goes on: the study was made to its end."""
    words = [sys.executable, "-c", AT_A_FORK, str(int(number)), str(tmp_path / "study")]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    assert "Exception ignored" not in done.stderr


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_have_their_exit_codes(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals, code: int
) -> None:
    before = signal.getsignal(signal.SIGTERM)
    monkeypatch.setattr("pipeline.run.case.run_stages", lambda *_: os.kill(os.getpid(), number))
    assert run(study, tmp_path / "out") == code
    assert signal.getsignal(signal.SIGTERM) == before


def test_a_signal_of_which_an_import_makes_an_error_is_not_lost(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As pybind11 does: a traceback and exit code 1, which is a regression where diff was interrupted."""

    def imported(_: object) -> int:
        try:
            os.kill(os.getpid(), signal.SIGINT)
        except KeyboardInterrupt:
            raise ImportError("initialization failed") from None
        return 0

    monkeypatch.setattr("pipeline.cli.carried_out", imported)
    assert main(["diff", "a", "b"]) == 130
    assert capsys.readouterr().err == "\ninterrupted\n"
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_ctrl_c_before_the_command_line_is_there_has_its_exit_code(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Pressed:
        def find_spec(self, *_: object) -> None:
            raise KeyboardInterrupt

    monkeypatch.setattr(sys, "meta_path", [Pressed()])
    monkeypatch.delitem(sys.modules, "pipeline.cli")
    monkeypatch.delattr("pipeline.cli")
    assert as_program() == 130
    assert capsys.readouterr().err == "\ninterrupted\n"


@pytest.mark.parametrize(
    "words", [["--case-timeout", "0"], ["--case-memory", "nan"], ["--case-timeout", "9", "--executor", "tcp://x:1"]]
)
def test_limits_that_make_no_sense_are_refused(study: Path, tmp_path: Path, words: list[str]) -> None:
    assert run(study, tmp_path / "out", *words) == 2
    assert not (tmp_path / "out").exists()


def test_a_case_beyond_its_time_is_named_with_its_stage(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(study, tmp_path / "out", "--no-cache", "--case-timeout", "0.01") == 1
    failures = pd.read_csv(tmp_path / "out" / "failures.csv")
    assert list(failures["status"]) == ["over_limit"]
    assert "took longer than the 0.01 s" in failures["message"][0]
    assert failures["stage"][0] in ("run", "load"), "it was empty where no stage was begun"


# without pages, budget and simulated predictors, which are no matter here
UNTIL = ("--until", "compare", "--set", "budget.members=0", "--set", "compare.simulated_nulls=false")


def changing(monkeypatch: pytest.MonkeyPatch, stage: str, change: Callable[[], object]) -> None:
    """Let something happen right before a stage of the next run."""
    step = STEPS[stage]

    def changed(run: Context, known: Known) -> Known:
        change()
        return step(run, known)

    monkeypatch.setitem(STEPS, stage, changed)


@pytest.mark.quick(2)
@pytest.mark.parametrize(
    ("stage", "how"),
    [
        ("trace", "written to"),
        ("trace", "written to, its time put back"),
        ("compare", "replaced"),
        ("trace", "its folder"),
    ],
)
def test_a_scan_that_is_replaced_while_it_is_read_fails_its_case(
    study: Path, whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stage: str, how: str
) -> None:
    """The hash that is recorded would be that of the new file, and the numbers those of the old one, for good."""
    own = Path(shutil.copytree(study, tmp_path / "study"))
    scan, other = sorted((own / "frames").iterdir())
    was = scan.read_bytes()

    def replace() -> None:
        if how.startswith("written to"):
            stat = scan.stat()
            scan.write_bytes(other.read_bytes())
            if how.endswith("put back"):  # as by `rsync --inplace --times`
                os.utime(scan, ns=(stat.st_atime_ns, stat.st_mtime_ns))
        elif how == "replaced":
            shutil.copy2(other, own / "new.mha")
            os.utime(own / "new.mha", ns=(0, scan.stat().st_mtime_ns))
            (own / "new.mha").replace(scan)
        else:
            shutil.rmtree(scan.parent)
            shutil.copytree(study / "frames", scan.parent)
            scan.write_bytes(other.read_bytes())

    store = tmp_path / "store"
    monkeypatch.setenv("WIREVAL_CACHE", str(store))
    with monkeypatch.context() as patch:
        changing(patch, stage, replace)
        assert run(own, tmp_path / "out", *UNTIL) == 1
    result = json.loads((case_of(tmp_path / "out") / "result.json").read_text(encoding="utf-8"))
    assert all(frame["status"] != "ok" for frame in result["frames"])
    assert str(scan) in result["sentence"]
    assert "give the same command again" in result["sentence"]
    # nothing that was made of the old file is kept under the new one's name, and the other way round
    scan.write_bytes(was)
    assert run(own, tmp_path / "out", *UNTIL) == 0
    assert run(own, tmp_path / "again", "--no-cache", *UNTIL) == 0
    assert differences(tmp_path / "out", tmp_path / "again") == []


def test_a_scan_that_is_gone_once_it_was_read_fails_nothing(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = Path(shutil.copytree(study, tmp_path / "study"))
    changing(monkeypatch, "simulate", lambda: shutil.rmtree(own / "frames"))
    assert run(own, tmp_path / "out", *UNTIL) == 0


def test_a_result_that_is_removed_while_the_run_goes_on_is_missed(
    study: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of two cases the first is removed while the second is computed: not one case, all ok."""
    two = Path(shutil.copytree(study, tmp_path / "two")) / "manifest.toml"
    text = two.read_text(encoding="utf-8")
    more = text[text.index("[[case]]") :].replace('id = "bifurcation"', 'id = "second"')
    two.write_text(f"{text}\n{more}", encoding="utf-8")
    first = case_of(tmp_path / "out")
    changing(monkeypatch, "compare", lambda: (first / "result.json").exists() and shutil.rmtree(first))
    assert run(two.parent, tmp_path / "out", *UNTIL) == 1
    said = capsys.readouterr()
    assert "2 cases, 4 frames: 2 ok" in said.out
    assert "removed while the run went on" in said.err


def test_a_result_under_another_name_is_not_counted(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(case_of(out), out / "cases" / "copy")
    (out / "run.json").unlink()
    assert main(["report", str(out), "--overview"]) == 1
    assert "holds the result of case 'bifurcation'" in capsys.readouterr().err


@pytest.mark.parametrize("how", ["a pipe", "a hard link", "a link"])
def test_what_is_no_lock_is_neither_written_to_nor_waited_for(tmp_path: Path, how: str) -> None:
    """Through another name of it a user's file was emptied, and told of the process."""
    lock, precious, case = tmp_path / "case" / ".at-work", tmp_path / "precious", tmp_path / "case"
    precious.write_text("precious", encoding="utf-8")
    case.mkdir()
    if how == "a pipe":
        os.mkfifo(lock)
    else:
        (lock.hardlink_to if how == "a hard link" else lock.symlink_to)(precious)
    assert owner_of(case) == ""
    with held(case, print):
        assert f"process {os.getpid()} on " in owner_of(case)
    assert precious.read_text(encoding="utf-8") == "precious"
    assert not lock.exists()


def test_a_folder_where_a_lock_is_meant_is_named(tmp_path: Path) -> None:
    (tmp_path / ".at-work").mkdir()
    with pytest.raises(atomic.WriteError, match="Is a directory; remove this folder"), held(tmp_path, print):
        pass


def test_a_result_of_a_sweep_that_is_not_there_when_a_run_ends_is_the_exit_code(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    computed = launch.run_cases

    def run_cases(plan: launch.Plan, jobs: list[launch.Job]) -> None:
        computed(plan, jobs)
        shutil.rmtree(next(plan.out.glob("sweep/*/cases/*")))

    monkeypatch.setattr(launch, "run_cases", run_cases)
    assert run(study, tmp_path / "out", "--until", "compare", "--sweep", "simulate.roll_offset_deg=20") == 1
    assert "1 result of the sweep not run" in capsys.readouterr().out
