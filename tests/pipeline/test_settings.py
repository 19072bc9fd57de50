"""Settings: precedence, origin, messages; and the stage store that they key."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pipeline import load
from pipeline.commands import complain, settings_of
from pipeline.model import Curve, Lumen, Volume
from pipeline.run import store as store_keys
from pipeline.run.cache import Store
from pipeline.run.hashing import file_hash
from pipeline.run.store import digest, key_of
from pipeline.run.sweep import points_of, unchanged
from pipeline.segment import segment
from pipeline.segment.config import SegmentConfig
from pipeline.status import FrameStatus
from pipeline.study.settings import SettingsError, parse_assignment, read_settings, resolve, to_toml
from pipeline.trace import trace
from solver._compile import hash_of
from solver.grid import Grid


def test_the_command_line_wins_over_a_file_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "cfg.toml"
    path.write_text("[solver]\nsegment_mm = 0.5\nmax_iterations = 50\n", encoding="utf-8")
    resolved = resolve([*read_settings(path), parse_assignment("solver.segment_mm=0.25")])
    assert resolved.config.solver.segment_mm == 0.25
    assert resolved.config.solver.max_iterations == 50
    entries = resolved.as_dict()["solver"]
    assert entries["segment_mm"]["source"] == "command line"
    assert entries["max_iterations"]["source"] == "cfg.toml"
    assert entries["method"]["source"] == "default"


def test_resolved_settings_read_back(tmp_path: Path) -> None:
    resolved = resolve([parse_assignment("solver.segment_mm=0.25"), parse_assignment("solver.hull=samples:8")])
    path = tmp_path / "config.resolved.toml"
    path.write_text(to_toml(resolved), encoding="utf-8")
    assert resolve(read_settings(path)).config == resolved.config


def test_settings_that_were_used_with_parameters_ask_for_these(tmp_path: Path) -> None:
    """Read back, they ran uncalibrated without a word: rms 0.217 for 0.026 mm."""
    path = tmp_path / "config.resolved.toml"
    path.write_text(to_toml(replace(resolve([]), calibrated=("0a1b", 'cal "1"/p.toml'))), encoding="utf-8")
    words = argparse.Namespace(config=[path], settings=["solver.segment_mm=0.25"], parameters=None)
    with pytest.raises(SettingsError, match=r'config.resolved.toml: .* say --parameters cal "1"/p.toml, too, or take'):
        settings_of(words)
    words.parameters = tmp_path / "p.toml"
    config = resolve(settings_of(words)).config
    assert config == resolve([parse_assignment("solver.segment_mm=0.25")]).config
    del words.parameters  # as of check and calibrate
    assert resolve(settings_of(words)).config == config


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("solver.segmnt_mm=1", "did you mean 'segment_mm'"),
        ("sovler.segment_mm=1", "did you mean 'solver'"),
        ("solver.segment_mm=wide", '"wide": expected a number from 0.01 to 20 or "auto"'),
        (
            "budget.members=abc",
            'budget.members = "abc": expected a whole number from 0; correct it, or leave it out for 0',
        ),
        ("segment_mm=1", "no setting; write table.key=value"),
        ("simulate.entry=foo", '"traced" or "manifest"'),
        ("solver.segment_mm=-3", "from 0.01"),
        ("compare.sample_mm=0", "from 0.01"),
        ("segment.threshold=1\n[load]\nmost_gib=3", 'threshold = "1\\n[load]\\nmost_gib=3": more than one value'),
        ("compare.simulated_nulls='1'", "expected true or false"),
        ("load.resample=-0.0", "= -0.0: expected true or false"),
        ("load.resample=yes", "expected true or false"),
        ("segment.homogeneity_sigma=5e-324", "= 5e-324: expected a number from 1e-09"),
        ("segment.scale=3", "= 3: expected a whole number from 0 to 2"),
        ("solver.tolerance=5e-324", "= 5e-324: expected a number from 1e-300"),
        ("segment.outer_mm=nan", "= nan: expected a number from 0.1 to 50"),
        ("trace.rotation_axis=[0,0,0]", "length zero"),
    ],
)
def test_a_wrong_setting_is_explained(text: str, expected: str) -> None:
    with pytest.raises(SettingsError) as caught:
        resolve([parse_assignment(text)])
    assert expected in str(caught.value) or expected.replace("no setting", "is no setting") in str(caught.value)


def test_all_wrong_settings_come_at_once() -> None:
    with pytest.raises(SettingsError) as caught:
        resolve([parse_assignment("solver.a=1"), parse_assignment("trace.b=2")])
    assert len(caught.value.problems) == 2
    assert complain(caught.value.problems, "x") == 2


def test_keys_follow_contents_and_settings_not_paths(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).write_bytes(b"same")
    a, b = tmp_path / "a", tmp_path / "b"
    assert file_hash(a) == file_hash(b)
    first = key_of(segment, a, SegmentConfig())
    assert first == key_of(segment, b, SegmentConfig())
    assert first != key_of(segment, a, SegmentConfig(threshold=0.123))
    assert first != key_of(trace, a, SegmentConfig())
    assert key_of(segment, np.array([1.0])) != key_of(segment, np.array([1.0 + 1e-15 * 4]))


def test_keys_follow_the_code_that_reads_and_the_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever took over a mended reader, or another SimpleITK, kept lumens of voxels that were read wrong."""
    scan = Volume(np.zeros((2, 2, 2), np.int16), made_of="a file's hash")
    first = key_of(segment, scan)
    monkeypatch.setattr(store_keys, "versions", lambda names: dict.fromkeys(names, "another"))
    assert key_of(segment, scan) != first
    monkeypatch.undo()
    monkeypatch.setattr(store_keys, "hash_of", lambda file: "mended" if file == Path(load.__file__) else hash_of(file))
    monkeypatch.setattr(store_keys, "_known", {})
    assert key_of(segment, scan) != first


def test_what_has_no_known_content_is_refused_in_a_key() -> None:
    with pytest.raises(TypeError, match="cannot be part of a key"):
        digest({"function": print})


def test_the_voxels_behind_a_header_belong_to_its_content(tmp_path: Path) -> None:
    header, voxels = tmp_path / "scan.mhd", tmp_path / "scan.raw"
    header.write_text(
        "NDims = 3\nDimSize = 1 1 5\nElementType = MET_UCHAR\nElementDataFile = scan.raw\n", encoding="utf-8"
    )
    voxels.write_bytes(b"first")
    first = file_hash(header)
    voxels.write_bytes(b"other")
    assert file_hash(header) != first


def test_a_lumen_and_a_curve_come_back_as_they_were(tmp_path: Path) -> None:
    store = Store(tmp_path)
    grid = Grid(np.linspace(-1, 1, 60).reshape(3, 4, 5).astype(np.float32), np.full(3, 0.3), np.ones(3))
    lumen = Lumen(grid, 550.0, ("thin",), {"visited": 7}, {"blur_mm": float(np.float32(0.3))})
    store.put("segment", "ab" * 32, lumen)
    back = store.get("segment", "ab" * 32)
    assert isinstance(back, Lumen)
    np.testing.assert_array_equal(back.distance.values, grid.values)
    assert (back.wall_level, back.warnings, dict(back.counters)) == (550.0, ("thin",), {"visited": 7})
    assert digest(back) == digest(lumen)
    curve = Curve(np.eye(3), np.ones(3), 0.1, np.array([True, False, True]))
    curve = curve.doubted(FrameStatus.TRACE_FAILED, "why not", of="gap").doubted(FrameStatus.LENGTH_MISMATCH, "why")
    store.put("trace", "cd" * 32, curve)
    again = store.get("trace", "cd" * 32)
    assert isinstance(again, Curve)
    np.testing.assert_array_equal(again.points_mm, curve.points_mm)
    np.testing.assert_array_equal(again.flagged, curve.flagged)
    assert (again.status, again.note) == (FrameStatus.LENGTH_MISMATCH, "why")
    assert again.doubts == curve.doubts
    assert digest(again) == digest(curve)


def test_voxels_of_a_lumen_are_hashed_once_for_all_frames(monkeypatch: pytest.MonkeyPatch) -> None:
    lumen, hashed = Lumen(Grid(np.zeros((3, 4, 5), np.float32))), []
    once = np.ascontiguousarray
    monkeypatch.setattr(store_keys.np, "ascontiguousarray", lambda value: hashed.append(value.shape) or once(value))
    assert len({key_of(trace, lumen, frame) for frame in range(3)}) == 3
    assert hashed.count((3, 4, 5)) == 1


@pytest.mark.parametrize("kept", [0, 2, 100, -20, -1])
def test_a_damaged_entry_counts_as_absent(tmp_path: Path, kept: int) -> None:
    store = Store(tmp_path)
    store.put("trace", "ab" * 32, Curve(np.eye(3), np.ones(3)))
    ((entry, _, _),) = store.entries()
    entry.write_bytes(entry.read_bytes()[:kept])
    assert store.get("trace", "ab" * 32) is None
    assert store.entries() == []
    assert Store(None).get("trace", "ab" * 32) is None


@pytest.mark.parametrize(
    ("setting", "frictions", "said"),
    [
        ("", [0.1, 0.1], "0.1"),
        ("", [0.1, 0.2], ""),  # no one value is the plain run's
        ("simulate.friction=0.3", [0.1, 0.2], "0.3"),
        ("simulate.friction=0.0", [0.1], "0"),
    ],
)
def test_the_plain_value_of_a_sweep_is_the_setting_or_what_all_cases_state(setting, frictions, said):
    plain = resolve([parse_assignment(setting)] if setting else [])
    cases = [SimpleNamespace(wall=SimpleNamespace(friction=f)) for f in frictions]
    assert unchanged(plain, cases, "simulate.friction") == said
    assert unchanged(plain, cases, "simulate.roll_offset_deg") == "0"


@pytest.mark.parametrize("text", ["compare.simulated_nulls=true,false", "budget.members=200", "budget.seed=1"])
def test_a_sweep_of_what_its_points_leave_out_is_refused(text: str) -> None:
    """Each had a row under its name that was computed without."""
    with pytest.raises(SettingsError, match="changes no number"):
        points_of([text], [])
    assert len(points_of(["compare.skip_mm=5,6"], [])) == 2
