"""Wrong values of every key and setting: what is refused is said in the program's words, never in a library's."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path

import pytest

from pipeline.load.geometry import LoadError
from pipeline.load.views import read_views
from pipeline.model import OverWire, Uncertainty, Wall, Wire
from pipeline.study.explain import described
from pipeline.study.manifest import Case, ManifestError, read_manifest
from pipeline.study.parameters import ParametersError, read_parameters
from pipeline.study.settings import SettingsError, parse_assignment, resolve
from reports.toml_words import not_toml

WRONG = (
    '"auto"', '"5"', '""', "true", "[]", "{}", "{a = 1}", "[1, 2]", '["a", "b", "c"]', "[[0.0, 1.0], [1.0]]",
    "[[1, 2, 3, 4]]", '[1, "x", 3]', "[nan, nan, nan]", "-1", "nan", "inf", "1e30", "2.5", "1979-05-27",
)  # fmt: skip
FOREIGN = re.compile(
    r"Input|\bvalid\b|function|[Tt]uple|list\[|[Ll]iteral|instance|should|dictionary|Value error|datetime"
    r"|\bNone\b|\bnull\b"
)
WIRE = {"radius_mm": "0.18", "bending_stiffness_N_mm2": "1.0"}
CASE = {
    "id": '"a"', "reference": '"empty.mha"', "insertion_mm": "[1.0]", "entry_mm": "[0.0, 0.0, 0.0]",
    "entry_direction": "[0.0, 0.0, 1.0]", "wire": '"w"',
}  # fmt: skip
CATHETER = {"radius_mm": "0.9", "bending_stiffness_N_mm2": "80.0", "insertion_mm": "0.5"}
PARTS: dict[str, tuple[type, dict[str, str]]] = {
    "wires.w": (Wire, WIRE), "case.catheter": (OverWire, CATHETER), "case.wall": (Wall, {}),
    "case.uncertainty": (Uncertainty, {}),
}  # fmt: skip


def table(head: str, keys: dict[str, str]) -> str:
    return "\n".join([head, *(f"{key} = {value}" for key, value in keys.items()), ""])


def manifest(case: dict[str, str], wire: dict[str, str], *parts: str) -> str:
    return "\n".join(["schema = 1", table("[wires.w]", wire), table("[[case]]", case), *parts])


def manifests() -> Iterator[tuple[str, str]]:
    """(what is wrong, text) of manifests of which one key has a wrong value."""
    for value in WRONG:
        for key in Case.model_fields:
            yield f"{key} = {value}", manifest(CASE | {key: value}, WIRE)
        for name, (kind, good) in PARTS.items():
            for key in (field.name for field in fields(kind)):
                keys = good | {key: value}
                own = manifest(CASE, keys) if kind is Wire else manifest(CASE, WIRE, table(f"[{name}]", keys))
                yield f"{name}.{key} = {value}", own
        yield f"wires = {value}", f"wires = {value}\nschema = 1\n{table('[[case]]', CASE)}"
        yield f"wires.w = {value}", f"wires = {{ w = {value} }}\nschema = 1\n{table('[[case]]', CASE)}"
        yield f"case = {value}", f"case = {value}\nschema = 1\n{table('[wires.w]', WIRE)}"
        yield f"schema = {value}", manifest(CASE, WIRE).replace("schema = 1", f"schema = {value}")


def test_no_wrong_value_of_a_manifest_is_told_in_foreign_words(tmp_path: Path) -> None:
    """And each sentence is told once: a union does not list its branches."""
    path, count = tmp_path / "manifest.toml", 0
    for what, text in manifests():
        path.write_text(text, encoding="utf-8")
        try:
            read_manifest(path)
        except ManifestError as error:
            count += 1
            told = [problem.removeprefix(f"{path}: ") for problem in error.problems]
            assert not [one for one in told if FOREIGN.search(one)], what
            places = [one.partition(" = ")[0].partition(": ")[0] for one in told if not one.startswith("case 'a': ")]
            assert len(places) == len(set(places)), (what, told)
    assert count > 700


def test_no_wrong_setting_is_told_in_foreign_words() -> None:
    for one in described():
        for value in WRONG:
            try:
                resolve([parse_assignment(f"{one.name}={value}")])
            except SettingsError as error:
                (told,) = error.problems
                assert not FOREIGN.search(told)
                assert told.startswith(f"command line: {one.name}")


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        (
            "roll_deg",
            '"auto"',
            "case 'a' roll_deg = \"auto\": expected a number from -100000 to 100000, a list (not empty) of numbers "
            'from -100000 to 100000 or "fit"; correct it, or leave it out for 0.0',
        ),
        ("roll_deg", '"30"', "write it without quotes"),
        ("roll_deg", "[]", "roll_deg = []: expected a number from -100000 to 100000, a list (not empty) of"),
        (
            "roll_deg",
            f"[{'1.0, ' * 30}true]",
            "case 'a' roll_deg[30] = true: expected a number from -100000 to 100000, a list",
        ),
        ("roll_deg", "1e30", "expected a number from -100000 to 100000"),
        ("role", '"validate"', "did you mean 'validation'?"),
        ("entry_mm", "[1, 2]", "entry_mm = [1, 2]: expected [number, number, number], each from -10000 to 10000"),
        ("wire", "5", "case 'a': wire 5 is not among [wires.*]; allowed: w"),
        ("push_force_N", "[]", "a list (not empty) of numbers"),
        ("group", f'"{"g" * 400}"', "expected a text of 1 to 200 characters"),
        ("lumen", "5", "expected the name of a file in quotes, or {file = ..., label = ...}"),
        ("simulated", "5", "or a table {files = ..., space = ..., unit = ...}"),
        ("entry", '"run1"', 'expected "case:ID", with the id of another case'),
    ],
)
def test_what_was_found_and_what_is_allowed(tmp_path: Path, key: str, value: str, told: str) -> None:
    (tmp_path / "manifest.toml").write_text(manifest(CASE | {key: value}, WIRE), encoding="utf-8")
    with pytest.raises(ManifestError) as caught:
        read_manifest(tmp_path / "manifest.toml")
    (problem,) = caught.value.problems
    assert told in problem


def test_a_wire_that_is_wrong_is_told_once(tmp_path: Path) -> None:
    (tmp_path / "manifest.toml").write_text(manifest(CASE, WIRE | {"radius_mm": '"thin"'}), encoding="utf-8")
    with pytest.raises(ManifestError) as caught:
        read_manifest(tmp_path / "manifest.toml")
    (problem,) = caught.value.problems
    assert problem.endswith('wires w radius_mm = "thin": expected a number from 0.001 to 20; correct it')


def test_a_length_in_metres_is_told_its_unit(tmp_path: Path) -> None:
    (tmp_path / "manifest.toml").write_text(manifest(CASE, WIRE | {"radius_mm": "0.00018"}), encoding="utf-8")
    with pytest.raises(ManifestError) as caught:
        read_manifest(tmp_path / "manifest.toml")
    assert caught.value.problems[0].endswith("; correct it; is it in metres (0.18 mm)?")


def test_the_true_of_python_is_no_schema(tmp_path: Path) -> None:
    path = tmp_path / "manifest.toml"
    path.write_text(manifest(CASE, WIRE).replace("schema = 1", "schema = true"), encoding="utf-8")
    with pytest.raises(ManifestError, match="schema = true: expected 1"):
        read_manifest(path)


def test_projections_and_parameters_speak_alike(tmp_path: Path) -> None:
    path = tmp_path / "projections.json"
    path.write_text('{"isocentre_mm": "here", "leaf_mm": [0, 0, 0], "frames": []}', encoding="utf-8")
    with pytest.raises(LoadError, match=r'isocentre_mm = "here": expected \[number, number, number\]'):
        read_views(path, 1)
    path = tmp_path / "parameters.toml"
    path.write_text('schema = 1\nwire = "w"\nfriction = "much"\nfrixion = 1\n', encoding="utf-8")
    with pytest.raises(ParametersError) as caught:
        read_parameters(path)
    found = "\n".join(caught.value.problems)
    assert 'friction = "much": expected a number from 0' in found
    assert "frixion: unknown key; did you mean 'friction'?" in found
    assert not FOREIGN.search(found.replace("function", ""))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[wires.w\nradius_mm = 0.1", "f.toml, line 1: [wires.w: not valid TOML; a table is [name]"),
        ("a = 1\nb =", "f.toml, line 2: b =: not valid TOML; a value is a number"),
        ('a = "x', 'f.toml, line 1: a = "x: not valid TOML; a text ends with the quote'),
        ("a = 1\na = 2", "f.toml, line 2: a = 2: not valid TOML; a key stands once"),
        ("a = [1,\n2", "f.toml, line 2: 2: not valid TOML; a list has commas between its parts and ends with ]"),
        ("a 1", "f.toml, line 1: a 1: not valid TOML; a line is key = value"),
    ],
)
def test_no_words_of_a_parser(text: str, said: str) -> None:
    """It said "Expected ']' at the end of a table declaration (at line 2, column 9)"."""
    with pytest.raises(tomllib.TOMLDecodeError) as caught:
        tomllib.loads(text)
    assert not_toml("f.toml", text, caught.value).startswith(said)
    assert not_toml("f.toml", text, RecursionError("too deep")).startswith("f.toml: not valid TOML; a line is")


@pytest.mark.parametrize(
    ("line", "point"), [("a = 0,18", "0.18"), ("a = -1,5  # mm", "-1.5"), ("a = 1,000.5", ""), ("a = 1,2,3", "")]
)
def test_a_decimal_comma_is_told_only_where_it_is_one(line: str, point: str) -> None:
    """Of 1,000.5 it said "write decimals with a point: 1.000", of 1,2,3, which lacks brackets, 1.2."""
    with pytest.raises(tomllib.TOMLDecodeError) as caught:
        tomllib.loads(line)
    assert not_toml("f.toml", line, caught.value).partition("decimals with a point: ")[2] == point
