"""The manifest: everything wrong with it at once, each with its place, what was found and what is allowed."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from pipeline.load import Header, LoadError, Source, read_header
from pipeline.load.curves import read_truth
from pipeline.model import Array
from pipeline.ranges import Name, Sentence
from pipeline.study.check import check
from pipeline.study.devices import implausible
from pipeline.study.manifest import ManifestError, read_manifest
from pipeline.study.plausible import (
    among,
    entry_in_metres,
    in_case,
    loose_entry,
    lost_header,
    measured_otherwise,
    odd_depths,
    odd_truth,
    other_voxels,
    slices_apart,
    wrapped_rolls,
)
from pipeline.study.same_scans import continued
from pipeline.study.settings import Config

GOOD = """
schema = 1
[wires.soft]
radius_mm = 0.18
bending_stiffness_N_mm2 = [[0.0, 0.5], [30.0, 5.0]]
[[case]]
id = "run1"
frames = "frames/*.mha"
entry_mm = [1.0, 2.0, 3.0]
entry_direction = [0.0, 0.0, 2.0]
wire = "soft"
"""


def written(folder: Path, text: str, frames: int = 3) -> Path:
    (folder / "frames").mkdir(exist_ok=True)
    for i in (10, 2, 1)[:frames]:
        (folder / "frames" / f"f_{i}.mha").touch()
    path = folder / "manifest.toml"
    path.write_text(text, encoding="utf-8")
    return path


def problems(folder: Path, text: str) -> str:
    with pytest.raises(ManifestError) as caught:
        read_manifest(written(folder, text))
    return "\n".join(caught.value.problems)


def test_defaults_paths_and_order(tmp_path: Path) -> None:
    case = read_manifest(written(tmp_path, GOOD)).cases[0]
    assert [s.path.name for s in case.frames] == ["f_1.mha", "f_2.mha", "f_10.mha"]
    assert case.entry_direction == (0.0, 0.0, 1.0)
    assert case.role == "validation"
    assert case.group == "run1"
    assert case.lumen_seed_mm == (case.entry_mm,)
    assert case.wall.stiffness_N_mm2 == 2.0
    assert case.wire.rest_curvature_per_mm == 0.0


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (("radius_mm", "radus_mm"), "unknown key; did you mean 'radius_mm'?"),
        (("wire = ", "roll = 60\nwire = "), "roll: unknown key; did you mean 'roll_deg'?"),  # it was 'role'
        (("wire = ", "Insertion = [60]\nwire = "), "did you mean 'insertion_mm'?"),
        (('wire = "soft"', 'wire = "sofd"'), "not among [wires.*]; did you mean 'soft'?"),
        (("radius_mm = 0.18", "radius_mm = -1"), "radius_mm = -1: expected a number from 0.001 to 20"),
        (("[0.0, 0.0, 2.0]", "[0.0, 0.0, 0.0]"), "length zero"),
        (('wire = "soft"', 'wire = "soft"\nmaterial_axis = [0.05, 0, -3]'), "within 5 degrees of entry_direction"),
        (('frames = "frames/*.mha"', ""), "neither frames nor insertion_mm"),
        (("entry_mm = [1.0, 2.0, 3.0]", ""), "case 'run1' entry_mm: missing"),
        (('id = "run1"', 'id = "a/b"'), "id"),
        (("[30.0, 5.0]", "[-3.0, 5.0]"), "distances from the tip"),
        (("schema = 1", "schema = 2"), "schema"),
        (("wire = ", "entry_sigma_mm = 5e-324\nwire = "), "entry_sigma_mm: 4.94066e-324; expected 0, which"),
        (
            ("wire = ", "roll_sigma_deg = 1e-200\nwire = "),
            "roll_sigma_deg: 1e-200; expected 0, which is exact, or 1e-09",
        ),
        (
            ("wire = ", "uncertainty = {taper = 1e9}\nwire = "),
            "uncertainty taper = 1000000000.0: expected 0 or a number from 1e-09 to 3",
        ),
        (("wire = ", 'phantom = " "\nwire = '), "phantom: blanks alone"),
        (("wire = ", "wall = {stiffness_N_mm2 = 1e-12}\nwire = "), "= 1e-12: expected a number from 1e-09; correct it"),
        (
            ("radius_mm", "torsional_stiffness_N_mm2 = 5e-324\nradius_mm"),
            "torsional_stiffness_N_mm2 = 5e-324: expected a number from 1e-12",
        ),
        (("radius_mm", "torsional_stiffness_N_mm2 = 1e13\nradius_mm"), "1e+13; expected 1e+12 at most, or inf"),
        (('wire = "soft"', 'wire = "soft"\nroll_deg = "fitted"'), "did you mean 'fit'?"),
        (('wire = "soft"', 'wire = "soft"\ncalibrated = "x"'), "calibrated: unknown key; write parameters = FILE"),
        *(
            (("entry_mm", f"catheter = {{ {keys} }}\nentry_mm"), expected)
            for keys, expected in (
                ("radius_mm = 0.9, insertion_mm = 1.0", "catheter bending_stiffness_N_mm2: missing"),
                ("bending_stiffness_N_mm2 = -1, radius_mm = 0.9, insertion_mm = 1.0", "= -1: expected a number from 0"),
                ("bending_stiffness_N_mm2 = 5, radius_mm = 0.9, insertion = 1.0", "did you mean 'insertion_mm'?"),
                ("bending_stiffness_N_mm2 = 5, radius_mm = 0.9, insertion_mm = -1", "= -1: expected a number from 0"),
                ("bending_stiffness_N_mm2 = 5, radius_mm = 0.1, insertion_mm = 1", "no more than the wire's 0.18"),
                (
                    "bending_stiffness_N_mm2 = 5, radius_mm = 0.9, insertion_mm = [1, 9, 3] }\nspacing_mm = [1, 1, 1]\n"
                    "insertion_mm = [4, 8, 12] #",
                    "insertion_mm = 9 of frame 1 is deeper than the wire, 8",
                ),
            )
        ),
    ],
)
def test_what_is_wrong_is_said(tmp_path: Path, change: tuple[str, str], expected: str) -> None:
    assert expected in problems(tmp_path, GOOD.replace(*change))


@pytest.mark.parametrize(
    "change", [('"run1"', str([1.0] * 5000)), ('= "soft"', f"= {[1.0] * 5000}"), ('"run1"', f'"{"a" * 9999}"')]
)
def test_what_was_found_is_cut_where_it_is_long(tmp_path: Path, change: tuple[str, str]) -> None:
    """A list in place of an id was told whole, 25 kB."""
    assert len(problems(tmp_path, GOOD.replace(*change))) < 600


def test_all_problems_come_at_once(tmp_path: Path) -> None:
    text = GOOD.replace("radius_mm = 0.18", 'radius_mm = "thin"').replace('id = "run1"', 'idd = "run1"')
    found = problems(tmp_path, text)
    assert "radius_mm" in found
    assert "did you mean 'id'?" in found


def test_all_problems_of_a_whole_case_come_at_once(tmp_path: Path) -> None:
    """A weight without a direction and a thin catheter that is too deep: told in one go."""
    catheter = "catheter = { bending_stiffness_N_mm2 = 5, radius_mm = 0.1, insertion_mm = [1, 9, 3] }"
    text = GOOD.replace("radius_mm = 0.18", "radius_mm = 0.18\nweight_N_per_mm = 1e-5")
    text = text.replace("entry_mm", f"{catheter}\ninsertion_mm = [4, 8, 12]\nentry_mm", 1)
    found = problems(tmp_path, text)
    for part in ("down is missing", "no more than the wire's 0.18", "deeper than the wire, 8"):
        assert part in found


@pytest.mark.parametrize("name", ["frames/f_1.mha", "frames/*_1.mha"])
def test_a_dataset_of_a_file_that_has_none_is_refused(tmp_path: Path, name: str) -> None:
    """It was dropped, and the file read as a whole."""
    said = "frames = 'f_1.mha#/x': this file holds no datasets; allowed: study.h5#/frames"
    assert said in problems(tmp_path, GOOD.replace("frames/*.mha", f"{name}#/x"))


def test_a_hash_in_a_name_is_told_for_what_it_is(tmp_path: Path) -> None:
    """ "no such file: f" was said of f#1.mha."""
    (tmp_path / "f#1.mha").touch()
    said = problems(tmp_path, GOOD.replace("frames/*.mha", "f#1.mha"))
    assert "frames = 'f#1.mha': a # parts a file's name from that of a dataset; rename the file" in said


def test_a_link_to_nothing_is_called_so(tmp_path: Path) -> None:
    """It was asked whether this very name was meant."""
    (tmp_path / "gone.mha").symlink_to("elsewhere.mha")
    path = written(tmp_path, GOOD.replace("frames/*.mha", "gone.mha"))
    (said,) = [text for text in check(read_manifest(path).cases, Config()) if "gone.mha" in text]
    assert f"{tmp_path / 'gone.mha'}: a link to nothing (elsewhere.mha); name the file itself" in said


def test_ids_are_unique(tmp_path: Path) -> None:
    twice = GOOD + GOOD[GOOD.index("[[case]]") :]
    assert "used more than once" in problems(tmp_path, twice)


def test_ids_that_some_disks_do_not_tell_apart_are_refused(tmp_path: Path) -> None:
    """`straight` and `Straight` passed check: on such a disk one result replaced the other."""
    said = problems(tmp_path, GOOD + GOOD[GOOD.index("[[case]]") :].replace("run1", "Run1"))
    assert "case 'Run1': this id differs from 'run1' by capital letters alone; rename one: ids name" in said


def test_broken_toml_and_no_file(tmp_path: Path) -> None:
    assert "not valid TOML" in problems(tmp_path, "schema = = 1")
    with pytest.raises(ManifestError, match="no such manifest"):
        read_manifest(tmp_path / "nothing.toml")


SECOND = GOOD.split("[[case]]")[1].replace("run1", "run2")


def test_a_table_of_a_case_at_the_top_is_told_where_it_belongs(tmp_path: Path) -> None:
    said = problems(tmp_path, f"{GOOD}[wall]\nstiffness_N_mm2 = 2.0\n")
    assert "wall: unknown key; it is a key of [[case]]: write [case.wall]" in said
    assert "walls: unknown key; allowed: case, schema, wires" in problems(tmp_path, f"{GOOD}[walls]\n")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            f"{GOOD}friction = 0.1\n",
            "case 'run1' friction: unknown key; it is a key of [case.wall] or [case.uncertainty] (its standard "
            "deviation): write it there",
        ),
        (
            f'{GOOD}[case.wall]\ntruth = "truth.json"\n',
            "case 'run1' wall truth: unknown key; it is a key of [[case]]: write it above [case.wall]",
        ),
        (f"{GOOD}opacity = 2.0\n", "opacity: unknown key; it is a key of [wires.NAME]: write it there"),
        (f'reference = "r.mha"\n{GOOD}', "reference: unknown key; it is a key of [[case]]: write it there"),
        (f"{GOOD}[wire.wire]\nradius_mm = 0.2\n", "wire: unknown key; did you mean 'wires'?"),
        (f'{GOOD}entry = "case:other"\n', "no such case; this is the only case: leave entry out"),
        (GOOD.replace("run1", "für"), "expected up to 100 of A-Z, a-z, 0-9 and . _ -"),
        (
            GOOD.replace("[wires.soft]", "[wires.soft]\nrest_curvature = 0.1"),
            "rest_curvature: unknown key; did you mean 'rest_curvature_per_mm'?",
        ),
        (
            GOOD.replace("[wires.soft]", "[wires.soft]\ntaper = 0.1"),
            "taper: unknown key; it is a key of [case.uncertainty] (its standard deviation): write it there",
        ),
        (f"{GOOD}[[wall]]\nfriction = 0.1\n", "wall: unknown key; it is a key of [[case]]: write [case.wall]"),
        (GOOD.replace("radius_mm = 0.18", "radius_mm = 0,18"), "decimals with a point: 0.18"),
    ],
)
def test_a_key_of_another_table_is_told_with_that_table(tmp_path: Path, text: str, told: str) -> None:
    """friction in [[case]]: "did you mean 'projections'?"; truth below [case.wall]: "allowed: friction, stiffness"."""
    assert told in problems(tmp_path, text)


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("roll_deg = 5", "roll_deg is a key of [[case]], and how well it is known is roll_sigma_deg: write the one"),
        (
            "insertion_mm = 0.5",
            "insertion_mm is a key of [[case]], and how well it is known is insertion_sigma_mm: write the one",
        ),
        (
            "entry_direction = 2",
            "entry_direction is a key of [[case]], and how well it is known is entry_direction_sigma_deg",
        ),
        ("entry_sigma_mm = 0.2", "it is a key of [[case]]: write it above [case.uncertainty]"),
        ("push_force_N = [1, 2]", "it is a key of [[case]]: write it above [case.uncertainty]"),
        ("lumen = 0.1", "did you mean 'lumen_mm'?"),
        ("radius_mm = 0.01", "allowed: friction, lumen_bias_mm, lumen_mm"),
    ],
)
def test_a_value_among_standard_deviations_is_sent_to_its_own(tmp_path: Path, line: str, told: str) -> None:
    """A roll known to 5 degrees, written there, "is a key of [[case]]: write it above": that turns the wire by 5."""
    said = problems(tmp_path, f"{GOOD}[case.uncertainty]\n{line}\n")
    assert f"uncertainty {line.partition(' ')[0]}: unknown key; {told}" in said


def test_an_entry_in_metres_is_asked_about(tmp_path: Path) -> None:
    """Of an entry 8 mm from the origin, written in metres, check found nothing."""
    text = GOOD.replace("[1.0, 2.0, 3.0]", "[0.000012, -0.000137, -0.00794]")
    (case,) = read_manifest(written(tmp_path, text)).cases
    (told,) = entry_in_metres(case, None)
    assert told == "entry_mm lies within 0.05 mm of 0, 0, 0: is it in metres ([0.012, -0.137, -7.94] mm)?"
    for at in ((0.0, 0.0, 0.0), (1.2e-16, 0.0, 0.0)):
        assert entry_in_metres(case.model_copy(update={"entry_mm": at}), None) == [], "the origin, as it was rounded"
    for origin_mm, count in ((-10.0, 1), (0.0, 0)):
        header = Header(Source(tmp_path), (96,) * 3, np.full(3, 0.5), np.full(3, origin_mm), np.eye(3), "int16")
        assert len(entry_in_metres(case, header)) == count, "in mm it lies in the scan, or not"


def test_a_clamp_is_borrowed_from_another_case(tmp_path: Path) -> None:
    first, second = read_manifest(written(tmp_path, f'{GOOD}\n[[case]]{SECOND}\nentry = "case:run1"\n')).cases
    assert second.entry_case is not None
    assert second.entry_case.id == "run1"
    assert first.entry_case is None


def test_a_clamp_cannot_be_borrowed_from_nowhere_or_in_a_ring(tmp_path: Path) -> None:
    assert "no such case; did you mean 'run1'?" in problems(
        tmp_path, f'{GOOD}\n[[case]]{SECOND}\nentry = "case:run3"\n'
    )
    assert "shows no clamp" in problems(tmp_path, f'{GOOD}\nentry = "case:run1"\n')
    assert "unknown key" in problems(tmp_path, f"{GOOD}\nentry_case = {{}}\n")
    second = GOOD[GOOD.index("[[case]]") :].replace('frames = "frames/*.mha"\n', "").replace("run1", "run2")
    assert "case 'run2': neither frames nor insertion_mm" in problems(tmp_path, f"{GOOD}{second}")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("[[0.0, 0.5], [30.0, 5.0]]", "[[0.0, 500.0], [30.0, 5000.0]]"), "bending_stiffness_N_mm2 of 5e+03"),
        (("[[0.0, 0.5], [30.0, 5.0]]", "0.005"), "bending_stiffness_N_mm2 of 0.005"),
        (("radius_mm = 0.18", "radius_mm = 0.89"), "radius_mm = 0.89: guide wires have 0.1 to 0.5 mm; is it the diam"),
        (("radius_mm = 0.18", "radius_mm = 0.007"), "radius_mm = 0.007: guide wires have 0.1 to 0.5 mm; is it in an"),
        (("[[0.0, 0.5], [30.0, 5.0]]", "[[0.0, 5.0], [30.0, 0.5]]"), "bending_stiffness_N_mm2 is 5 at the tip and 0.5"),
        (
            ("[30.0, 5.0]]", "[30.0, 5.0]]\nrest_curvature_per_mm = 8.3"),
            "rest_curvature_per_mm of 8.3 at the most: a bend of 0.12 mm radius in a wire of radius_mm = 0.18; is it a "
            "radius (mm), in degrees, or per metre?",
        ),
        (
            ("[30.0, 5.0]]", "[30.0, 5.0]]\nrest_curvature_per_mm = [[0, 1.2], [8, 1.2], [8, 0]]"),
            "rest_curvature_per_mm turns the wire by 550 degrees in all: pigtails turn by 360 or so, and what turns "
            "more lies in itself; is it in degrees, per cm",
        ),
        (
            ("[30.0, 5.0]]", "[30.0, 5.0]]\nrest_curvature_per_mm = [[0, 0], [72, 0], [72, 0.12], [80, 0.12]]"),
            "rest_curvature_per_mm is 0 at the tip and 0.12 at its far end: guide wires are curved at the tip",
        ),
        (("[30.0, 5.0]]", "[30.0, 5.0]]\nweight_N_per_mm = 7e-3"), "weight_N_per_mm = 0.007: a rod of"),
        (("[30.0, 5.0]]", "[30.0, 5.0]]\ntorsional_stiffness_N_mm2 = 5e-6"), "torsional_stiffness_N_mm2 = 5e-06 is 1e"),
        (("[30.0, 5.0]]", "[30.0, 5.0]]\ntorsional_stiffness_N_mm2 = 5e6"), "torsional_stiffness_N_mm2 = 5e+06 is 1e"),
    ],
)
def test_a_wire_in_another_unit_is_a_warning(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    """EI a thousand times too large, or a diameter of 0.035 inch as the radius, ran without a word."""
    assert implausible(read_manifest(written(tmp_path, GOOD)).cases) == []
    text = GOOD.replace(*change).replace('wire = "soft"', 'wire = "soft"\ndown = [0, 0, 1]')
    notes = implausible(read_manifest(written(tmp_path, text)).cases)
    assert f"wire 'soft': {said}" in notes[0]


@pytest.mark.parametrize(
    ("profile", "depths", "told"),
    [
        (
            "[[0, 0], [72, 0], [72, 0.12], [80, 0.12], [80, 0]]",
            "[8, 20, 38]",
            "begins 72 mm from the tip, where the deepest insertion_mm is 38: ",
        ),
        ("[[0, 0], [72, 0], [72, 0.12], [80, 0.12], [80, 0]]", "[8, 20, 73]", ""),
        ("[[0, 0], [60, 0], [100, 0.1]]", "[8, 20, 38]", "begins 60 mm from the tip, where"),
        ("[[0, 0], [100, 0.1]]", "[8, 20, 38]", "per_mm is 0 at the tip and 0.1 at its far end: "),
        ("[[0, 0.05], [30, 0.08]]", "[8, 20, 38]", "is 0.05 at the tip and 0.08 at its far end: "),
        ("[[0, 0], [50, 0.002]]", "[8, 20, 60]", ""),
        ("[[0, 0], [50, 0], [60, 0.002]]", "[8, 20, 40]", ""),
        ("[[0, 0], [2, 0], [2, 0.1], [8, 0.1], [8, 0]]", "[5, 6, 7]", ""),
        ("[[0, 0.12], [8, 0.12], [8, 0]]", "[5, 6, 7]", ""),
        ("0.05", "[5, 6, 7]", ""),
        ("[[0, 0], [30, 0]]", "[5, 6, 7]", ""),
    ],
)
def test_a_rest_curve_that_no_frame_holds_is_a_warning(tmp_path: Path, profile: str, depths: str, told: str) -> None:
    """Counted from the wire's end nothing was said; the wire was straight in every frame."""
    text = GOOD.replace("[30.0, 5.0]]", f"[30.0, 5.0]]\nrest_curvature_per_mm = {profile}")
    notes = implausible(read_manifest(written(tmp_path, f"{text}insertion_mm = {depths}\n")).cases)
    assert [told in text and "is it turned round?" in text for text in notes] == [True] * bool(told)


def test_a_wire_is_doubted_with_the_deepest_insertion_of_its_cases(tmp_path: Path) -> None:
    """In two cases of other depths it was told twice, though a third one's frames hold the curve."""
    profile = "[[0, 0], [72, 0], [72, 0.12], [80, 0.12], [80, 0]]"
    text = GOOD.replace("[30.0, 5.0]]", f"[30.0, 5.0]]\nrest_curvature_per_mm = {profile}")
    (case,) = read_manifest(written(tmp_path, f"{text}insertion_mm = [8, 20, 38]\n")).cases
    cases = [case.model_copy(update={"insertion_mm": depths}) for depths in ((10.0, 30.0), (10.0, 36.0), (75.0,))]
    assert len(implausible(cases[:2])) == 1
    assert not implausible(cases)


@pytest.mark.parametrize(("stiffness", "told"), [(2e6, True), (0.002, True), (0.03, False), (100.0, False)])
def test_a_wall_in_another_unit_is_a_warning(tmp_path: Path, stiffness: float, told: bool) -> None:
    """A modulus in Pa was "no problem found", and every frame stalled with advice about tolerances."""
    (case,) = read_manifest(written(tmp_path, f"{GOOD}\n[case.wall]\nstiffness_N_mm2 = {stiffness}\n")).cases
    assert any("is it a modulus" in text for text in in_case(case, None)) == told


@pytest.mark.parametrize(("spacing_mm", "origin_mm", "told"), [(1.0, 0.0, 1), (1.0, 3.0, 0), (0.5, 0.0, 0)])
def test_a_header_that_looks_lost_is_a_warning(tmp_path: Path, spacing_mm: float, origin_mm: float, told: int) -> None:
    """An array that was saved without its header: voxels of 1 mm from 0, 0, 0, and "no problem found"."""
    turn = np.diag([-1.0, -1.0, 1.0])
    header = Header(Source(tmp_path), (96,) * 3, np.full(3, spacing_mm), np.full(3, origin_mm), turn, "int16")
    assert len(lost_header(header)) == told


@pytest.mark.parametrize(
    ("name", "told"), [("reference.mha", True), ("empty_phantom.nii.gz", True), ("preference.mha", False)]
)
def test_a_reference_that_nobody_listed_is_a_warning(tmp_path: Path, name: str, told: bool) -> None:
    """The lumen came from frame 0, with the wire in it, and what was said was of bones."""
    manifest = written(tmp_path, GOOD)
    (tmp_path / name).touch()
    (case,) = read_manifest(manifest).cases
    assert any(f"no reference, though {name} lies beside the frames" in text for text in in_case(case, None)) == told
    (named,) = read_manifest(written(tmp_path, GOOD.replace("frames = ", f'reference = "{name}"\nframes = '))).cases
    assert not any("no reference" in text for text in in_case(named, None))


CATHETERS: list[tuple[float, float, str]] = [
    (50.0, 0.9, ""),
    (0.0, 0.9, ""),
    (3.0, 0.3, ""),
    (5e3, 0.9, ""),
    (20e-6, 0.9, "catheter bending_stiffness_N_mm2 = 2e-05: a tube of radius_mm = 0.9 has 1 (of soft silicone)"),
    (20e6, 0.9, "catheter bending_stiffness_N_mm2 = 2e+07: a tube of radius_mm = 0.9 has 1 (of soft silicone)"),
    (50.0, 7.0, "catheter radius_mm = 7: catheters have 0.2 to 2 mm; is it in French"),
]


@pytest.mark.parametrize(("stiffness", "radius_mm", "said"), CATHETERS)
def test_a_catheter_that_hardly_can_be_one_is_a_warning(
    tmp_path: Path, stiffness: float, radius_mm: float, said: str
) -> None:
    """One of 7 mm radius, and an EI in N m2, were "no problem found"."""
    keys = f"{{bending_stiffness_N_mm2 = {stiffness}, radius_mm = {radius_mm}, insertion_mm = 4}}"
    (case,) = read_manifest(written(tmp_path, f"{GOOD}\ncatheter = {keys}\n")).cases
    found = in_case(case, None)
    assert len(found) == bool(said)
    assert all(text.startswith(said) for text in found)


@pytest.mark.parametrize(("depths", "said"), [("[0.014, 0.039]", 1), ("[14, 39]", 0), ("[1400, 3900]", 1)])
def test_depths_in_another_unit_are_a_warning(tmp_path: Path, depths: str, said: int) -> None:
    """0.039 mm and 3.9 m of wire in a scan of 48 mm: "no problem found"."""
    text = GOOD.replace('frames = "frames/*.mha"', f'reference = "frames/a.mha"\ninsertion_mm = {depths}')
    header = Header(Source(tmp_path), (96, 96, 96), np.full(3, 0.5), np.zeros(3), np.eye(3), "int16")
    (case,) = read_manifest(written(tmp_path, text)).cases
    assert len(odd_depths(case, header)) == said
    small = replace(header, spacing_mm=np.full(3, 0.05))
    assert len(odd_depths(case, small)) == 1, "the scan's header is in cm, or the depths are"


def test_depths_that_go_down_are_a_warning(tmp_path: Path) -> None:
    """Files in another order than the scans were made in, or a wire that was drawn back: "no problem found"."""
    text = GOOD.replace('frames = "frames/*.mha"', 'reference = "frames/a.mha"\ninsertion_mm = [14, 39, 20, 21, 8]')
    (case,) = read_manifest(written(tmp_path, text)).cases
    (said,) = odd_depths(case, None)
    assert said.startswith("insertion_mm goes down from 39 mm (frame 1) to 20 mm (2 times): ")
    for depths, count in (("[10, 20, 30, 20, 10]", 0), ("[10, 20, 19.9, 30]", 0), ("[30, 20, 10]", 1)):
        (case,) = read_manifest(written(tmp_path, text.replace("[14, 39, 20, 21, 8]", depths))).cases
        assert len(odd_depths(case, None)) == count


def test_an_entry_that_may_be_anywhere_is_doubted(tmp_path: Path) -> None:
    """With entry_sigma_mm = 5 no error was ever larger than what the inputs explain, without a word."""
    case = read_manifest(written(tmp_path, GOOD)).cases[0]
    assert loose_entry(case) == []
    loose = case.model_copy(update={"entry_sigma_mm": 5.0, "entry_direction_sigma_deg": 30.0})
    position, direction = loose_entry(loose)
    assert position.startswith("entry_sigma_mm = 5: a clamp that lies more than 1 mm off is not accepted")
    assert direction.startswith("entry_direction_sigma_deg = 30: a clamp that lies more than 10 degrees off")
    assert {position, direction} <= set(in_case(loose, None))


@pytest.mark.parametrize(("slices_mm", "told"), [(0.8, 0), (0.9, 1)])
def test_slices_in_which_no_trace_is_accepted_are_doubted(tmp_path: Path, slices_mm: float, told: int) -> None:
    """Nothing was found to be wrong, and then every frame failed."""
    case = read_manifest(written(tmp_path, GOOD)).cases[0]
    spacing = np.array([0.3, 0.3, slices_mm])
    header = Header(Source(tmp_path / "a.mha"), (99, 99, 99), spacing, np.array([-9.0, 0, 0]), np.eye(3), "int16")
    said = slices_apart(header)
    assert len(said) == told
    assert all("slices of 0.9 mm and pixels of 0.3 mm, 3.0 times" in text for text in said)
    assert set(said) <= set(in_case(case, header))
    assert not set(said) & set(in_case(case.model_copy(update={"traces": case.frames}), header))


@pytest.mark.parametrize(("radius_mm", "modulus_gpa"), [(0.18, 9.5), (0.444, 9.5), (0.444, 158.4), (0.1, 60.0)])
def test_real_wires_are_no_warning(tmp_path: Path, radius_mm: float, modulus_gpa: float) -> None:
    """Moduli measured by Harrison et al. 2011; the catalogue's own wires are softer."""
    stiffness = 1000.0 * modulus_gpa * math.pi * radius_mm**4 / 4.0
    text = GOOD.replace("0.18", str(radius_mm)).replace("[30.0, 5.0]", f"[30.0, {stiffness}]")
    text = text.replace("\n[[case]]", f"\ntorsional_stiffness_N_mm2 = {stiffness / 1.3}\n[[case]]")
    assert implausible(read_manifest(written(tmp_path, text)).cases) == []


def test_settings_that_change_what_an_error_is_are_said() -> None:
    """With compare.skip_mm = 0 the stretch that the clamp was fitted on flattered the error, and only a table told."""
    plain = Config()
    assert measured_otherwise(plain) == []
    (said,) = measured_otherwise(replace(plain, compare=replace(plain.compare, skip_mm=0.0)))
    assert said.startswith("compare.skip_mm = 0.0 where the default is 10.0")


@pytest.mark.parametrize(
    ("rolls", "said"),
    [
        ([340.0, 350.0, 10.0], "from 350 to 10 in frame 2: the wire is turned by -340 degrees there"),
        ([-170.0, 175.0, 180.0], "from -170 to 175 in frame 1: the wire is turned by 345 degrees there"),
        ([0.0, 180.0, 360.0], ""),
    ],
)
def test_a_roll_that_goes_round_the_long_way_is_said(tmp_path: Path, rolls: list[float], said: str) -> None:
    """A list of 350, then 10 was turned back by 340 degrees: 0.09 mm off with friction 0.2."""
    (case,) = read_manifest(written(tmp_path, f"{GOOD}\nroll_deg = {rolls}\n")).cases
    found = wrapped_rolls(case)
    assert (said in found[0]) if said else not found
    assert not said or found[0].endswith(("has 370", "has -185"))


@pytest.mark.parametrize(
    ("depths", "more", "said"),
    [
        (("[5, 9]", "[12, 20]"), ("", ""), True),
        (("[5, 12]", "[9, 20]"), ("", ""), False),
        (("[5, 9]", "[12, 20]"), ("", "roll_deg = 30.0"), False),
        (("[5, 9]", "[12, 20]"), ('group = "one"', 'group = "one"'), False),
    ],
)
def test_an_insertion_in_two_cases_is_doubted(
    tmp_path: Path, depths: tuple[str, str], more: tuple[str, str], said: bool
) -> None:
    """Four parts of one insertion counted as four insertions, with an interval."""
    head, case = GOOD.split("[[case]]")
    parts = [
        case.replace("run1", f"part{n}").replace(
            'frames = "frames/*.mha"', f'frames = ["frames/f_{n}.mha", "frames/f_10.mha"]'
        )
        + f'reference = "frames/a.mha"\ninsertion_mm = {depths[n - 1]}\n{more[n - 1]}\n'
        for n in (1, 2)
    ]
    found = continued(read_manifest(written(tmp_path, "[[case]]".join([head, *parts]))).cases)
    assert len(found) == said
    assert all("part1 (5 to 9 mm), part2 (12 to 20 mm)" in text for text in found)


@pytest.mark.parametrize(
    ("second", "said"),
    [((6.0, 10.0, 16.0), True), ((6.0, 16.0), True), ((6.0, 7.0, 16.0), False), ((5.0, 10.0, 16.0), False)],
)
def test_every_second_frame_of_an_insertion_is_doubted(tmp_path: Path, second: tuple[float, ...], said: bool) -> None:
    """Frames 0, 3, 6, then 1, 4, 7, then 2, 5, 8 counted as three insertions; those with depths of their own do."""
    text = f'{GOOD}reference = "frames/a.mha"\ninsertion_mm = [5.0, 9.0]\n'
    (case,) = read_manifest(written(tmp_path, text, frames=2)).cases
    parts = [
        case.model_copy(update={"id": name, "group": name, "insertion_mm": depths})
        for name, depths in (("a", (5.0, 9.0, 12.0)), ("b", second))
    ]
    found = continued(parts)
    assert len(found) == said
    assert all("depths that take turns: they count as 2 insertions" in text for text in found)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda wires: wires, ""),
        (lambda wires: wires[::-1], "frame 0 cannot be its wire: it is 20.0 mm long, insertion_mm states 8"),
        (lambda wires: [wire[::-1] for wire in wires], "passes 8 mm from entry_mm"),
        (lambda wires: [wires[0], wires[1] + [9.0, 0.0, 0.0]], "frame 1 cannot be its wire: its base passes 9 mm"),
    ],
)
def test_a_truth_of_other_frames_is_doubted(
    tmp_path: Path, change: Callable[[list[Array]], list[Array]], said: str
) -> None:
    """Frames in reverse, or wires from tip to base: truth_rms_mm of 16 mm, ok, and no word."""
    (case,) = read_manifest(written(tmp_path, GOOD + "insertion_mm = [8.0, 20.0]\n", frames=2)).cases
    start = np.array([1.0, 2.0, 3.0])
    wires = [start + np.outer(np.arange(0.0, mm + 0.1, 0.5), [0.0, 0.0, 1.0]) for mm in (8.0, 20.0)]
    wires = [wire + np.outer((wire[:, 2] - 3.0) ** 2 / 400.0, [1.0, 0.0, 0.0]) for wire in wires]
    found = odd_truth(case, change(wires))
    assert len(found) == bool(said)
    assert all(said in text for text in found), found


def test_a_truth_of_one_point_is_none(tmp_path: Path) -> None:
    path = tmp_path / "truth.json"
    path.write_text(json.dumps({"frames": [{"points_mm": [[0.0, 0.0, 0.0]] * 10}]}), encoding="utf-8")
    with pytest.raises(LoadError, match="frame 0 holds 1 points; expected two or more, apart"):
        read_truth(path, 1)


def test_a_point_of_a_truth_that_is_written_twice_counts_once(tmp_path: Path) -> None:
    """Its step of no length hid that the truth has few points, and numpy warned."""
    path, points = tmp_path / "truth.json", [[0.0, 0.0, 0.0], [0.0, 0.0, 5.0], [0.0, 0.0, 5.0], [0.0, 1.0, 9.0]]
    path.write_text(json.dumps({"frames": [{"points_mm": points}]}), encoding="utf-8")
    assert read_truth(path, 1)[0].tolist() == [points[0], points[1], points[3]]


@pytest.mark.parametrize(("spacing", "said"), [("ElementSpacing = 0.5 0.5 0.5\n", True), ("", False)])
def test_another_voxel_size_than_the_scan_states_is_doubted(tmp_path: Path, spacing: str, said: bool) -> None:
    """5 mm in place of 0.5 was an assumption, and a study of slices."""
    path = tmp_path / "scan.mha"
    head = (
        f"ObjectType = Image\nNDims = 3\nDimSize = 8 8 8\n{spacing}ElementType = MET_SHORT\nElementDataFile = LOCAL\n"
    )
    path.write_bytes(head.encode() + bytes(2 * 8**3))
    found = other_voxels(read_header(path, spacing_mm=(0.5, 0.5, 5.0)))
    assert len(found) == said
    assert all("where the file has [0.5, 0.5, 0.5]; is that meant?" in text for text in found)


def test_what_is_assumed_is_a_line_that_no_terminal_obeys() -> None:
    """Such a sentence cleared the screen and named the window, by `check`, and stood in the pages."""
    sentence: TypeAdapter[str] = TypeAdapter(Sentence)
    assert sentence.validate_python(" wall:\n\t1 N/mm2\u2009\u2248 soft ") == "wall: 1 N/mm2 \u2248 soft"
    for text in ("\x1b[2Jwall", "wall\u202e", "wall\x07"):
        with pytest.raises(ValidationError, match="has characters that are not seen"):
            sentence.validate_python(text)


def test_names_that_look_alike_are_one_or_refused() -> None:
    """Groups "A", "A " and one with a character of no width were three insertions, with an interval over them."""
    name: TypeAdapter[str] = TypeAdapter(Name)
    assert name.validate_python(" A ") == "A"
    with pytest.raises(ValidationError, match="has characters that are not seen"):
        name.validate_python("A\u200b")


def test_projections_cannot_fit_a_roll(tmp_path: Path) -> None:
    """It was told as a roll that is fitted on the first of 0 frames."""
    change = 'projections = "p.json"\nlumen = "l.nrrd"\nroll_deg = "fit"\ninsertion_mm = [5, 9]'
    said = problems(tmp_path, re.sub("(?m)^frames = .*", change, GOOD))
    assert said.endswith('roll_deg = "fit" with projections: they cannot fit a roll, scans or traces can; state it')


def test_projections_beside_scans_are_told(tmp_path: Path) -> None:
    """Distances in a plane and in space were one rms."""
    (case,) = read_manifest(written(tmp_path, GOOD)).cases
    flat = case.model_copy(update={"id": "flat", "frames": (), "projections": tmp_path / "p.csv"})
    assert "case flat: distances in projections lack" in among([case, flat])[0]
    assert not among([case, case])
    assert not among([flat, flat])
