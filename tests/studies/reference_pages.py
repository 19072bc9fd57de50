"""docs/reference and docs/schema from the code: ``make pages`` (or ``python -m tests.studies.reference_pages``) writes
them anew; tests/test_documents.py fails where they are not what the code says."""

from __future__ import annotations

import argparse
import inspect
import json
import math
from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import pipeline.compare.nulls  # noqa: F401 - registers
import wireval
from pipeline.cli import parsers
from pipeline.run.results import LOST, RESULT
from pipeline.status import FrameStatus
from pipeline.study.explain import described
from pipeline.study.manifest import ManifestTables
from pipeline.wording import WRITTEN_HERE, in_words
from reports import frames_file, schema
from reports.frames_file import ATTRIBUTES, FrameArrays
from reports.schema import Table
from solver import Status
from tests.studies import metrics_page

DOCS = Path(__file__).resolve().parents[2] / "docs"
PROPERTIES = property, cached_property
NOTE = "*Written by `make pages` from the code; do not edit.*\n"
KEYS = {
    "id": "Name of the case and of its folder in OUT.",
    "role": "What the case is for: a calibration case counts in no score.",
    "assumed": "What nobody has confirmed yet, a sentence each. `init` writes them; `check` and the pages repeat them.",
    "group": "Insertions of one group are one unit of the intervals. Default: the case itself.",
    "phantom": "A name. Insertions into one phantom, in the same coordinates, are guesses for each other "
    "(null_another_rms_mm). Default: one phantom is what has the same lumen, or a reference of the same voxels in the "
    "same place.",
    "reference": "Scan without the wire. Without it the lumen is segmented from the first frame.",
    "frames": "Scans with the wire: a pattern in natural order, or a list. Files, DICOM folders, `study.h5#/frames`.",
    "entry_mm": "Where the wire enters the lumen, LPS mm.",
    "entry_direction": "Where the wire points at the entry.",
    "entry": 'Take the clamp from another insertion of the same fixation: `"case:ID"`.',
    "entry_sigma_mm": "How well entry_mm is known; 0 is exact. Default: half a voxel. Along the wire nothing "
    "else tells of the place.",
    "entry_direction_sigma_deg": "How well entry_direction is known; 0 is exact.",
    "material_axis": "Where material axis 1 points at roll 0. Default: the world axis least along the direction.",
    "wire": "Name of one of `[wires.*]`.",
    "insertion_mm": "Expected depths, one per frame; traces are held against them. Without frames: depths to simulate.",
    "spacing_mm": "Voxel size, for files that lack it. It is reported as assumed.",
    "lumen": "Own lumen instead of a segmented one: label map, .stl, .vtp, or centreline with radii (.swc, .mrk.json). "
    "A label map tells the wall to 0.1 voxel, a surface better. "
    '`{file = "seg.nrrd", label = 2}` takes one label, by number or name. '
    "`{file = ..., level = 0.5}` takes a probability.",
    "traces": "Own or corrected centrelines instead of traced ones, one file per frame: .csv (x_mm, y_mm, z_mm, LPS "
    "unless a line says # space: RAS or # unit: m), .vtp, 3D Slicer's .mrk.json.",
    "parameters": "What `wireval calibrate` wrote.",
    "roll_deg": 'Roll about entry_direction, right-handed: one number, one per frame, or `"fit"`. That fits it on the '
    "first frame, which is then not scored.",
    "push_force_N": "Measured push force, one per frame.",
    "push_force_sigma_N": "Standard deviation of the measured push force.",
    "roll_sigma_deg": "How well the roll is known. The budget and `calibrate` use it. Default: 5 degrees, in "
    "the budget of a fitted roll what the fit says.",
    "insertion_sigma_mm": "Standard deviation of the depth.",
    "simulated": "Another simulator's wires instead of simulated ones, one file per frame; or "
    '`{files = ..., space = "RAS", unit = "mm"}` where the files do not state them.',
    "files": "The files, as `simulated` alone names them.",
    "space": "LPS or RAS, where the files do not state it.",
    "unit": "mm, um, cm, m or inch, where the files do not state it.",
    "uncertainty": "How well other inputs are known, below: what the budget draws from.",
    "lumen_mm": "Standard deviation of the lumen's surface, from place to place, mm.",
    "lumen_bias_mm": "The same, common to all of the surface, mm.",
    "rest_curvature": "Standard deviation of the rest curvature, relative.",
    "taper": "Standard deviation of the logarithm of the lengths over which the stiffness changes.",
    "wall_stiffness": "Standard deviation of the logarithm of the wall's stiffness.",
    "traces_mm": "Standard deviation of own curves (`traces`) across the wire, mm. Default: 0.15 voxel.",
    "friction of Uncertainty": "Standard deviation of the coefficient of friction.",
    "projections": "Two-dimensional views instead of frames.",
    "lumen_seed_mm": "Points in the lumen, LPS mm. Default: the entry.",
    "truth": "True wires of a synthetic study, one for each frame, LPS mm, from the entry to the tip: JSON, "
    '`{"frames": [{"points_mm": [[x, y, z], ...]}, ...]}`.',
    "wall": "The wall's stiffness and friction, below.",
    "down": "Where gravity points; needed by a wire with a weight.",
    "catheter": "An outer tube over the wire, below.",
    "radius_mm": "Outer radius.",
    "bending_stiffness_N_mm2": "EI. A wire's may change along it: `[[distance from the tip in mm, EI], ...]`.",
    "rest_curvature_per_mm": "Curvature of the wire when nothing touches it, towards material axis 1 where positive.",
    "torsional_stiffness_N_mm2": "GJ. Default: inf, the tip turns with the hand.",
    "weight_N_per_mm": "Weight per length; needs `down`.",
    "opacity": "Brightness per length in X-rays, in any unit, over the distance from the tip: "
    "`[[0, 3.0], [20, 3.0], [20, 1.0]]` for a coil of platinum. Left out: found in the scans.",
    "stiffness_N_mm2": "Force per mm of wire and mm of way into the wall.",
    "friction": "Coulomb's coefficient.",
    "insertion_mm of OverWire": "Depth of the catheter's own tip, one for all frames or one per frame.",
}
"""What the keys of the manifest mean; their kinds and defaults stand in the code."""


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    escaped = [[str(cell).replace("|", "\\|").replace("\n", " ") for cell in row] for row in rows]
    lines = [" | ".join(row) for row in ([*head], ["---"] * len(head), *escaped)]
    return "\n".join(f"| {line} |" for line in lines) + "\n"


def settings() -> str:
    groups = dict.fromkeys(one.table for one in described())
    parts = [
        "# Settings\n",
        NOTE,
        "| to | do |\n| --- | --- |\n"
        "| set one | `--set table.key=value` |\n"
        "| set many | `-c FILE.toml` |\n"
        "| get a file of all | `wireval settings > FILE.toml` |\n"
        "| see what was in force and where it came from | `config.resolved.toml` in OUT |\n\n"
        "The command line wins over a file, and a file over the default. *Left out* means: taken from the data or\n"
        "the manifest.\n",
    ]
    for group in groups:
        rows = [(f"`{s.key}`", s.meaning, s.allowed, s.value or "left out") for s in described() if s.table == group]
        parts += [f"## {group}\n", table(("setting", "meaning", "allowed", "default"), rows)]
    return "\n".join(parts)


def plain(node: Any) -> Any:
    """A schema without titles and without what no user may write."""
    if isinstance(node, list):
        return [plain(item) for item in node]
    if not isinstance(node, dict):
        return node
    kept = {key: plain(value) for key, value in node.items() if key != "title" or not isinstance(value, str)}
    if kept.get("default") == math.inf:
        del kept["default"]  # JSON has none
    for key in [key for key, of in kept.get("properties", {}).items() if of.get("not") == WRITTEN_HERE["not"]]:
        del kept["properties"][key]
        kept["required"] = [name for name in kept.get("required", []) if name != key]
    return kept


def manifest_schema() -> dict[str, Any]:
    made = plain(ManifestTables.model_json_schema())
    for name, owner in made["$defs"].items():
        for key, value in owner.get("properties", {}).items():
            owner["properties"][key] = {"description": meaning(key, name), **value}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "wireval manifest", **made}


def meaning(key: str, owner: str = "Case") -> str:
    return KEYS.get(f"{key} of {owner}", KEYS.get(key, "")) or KEYS[key]


def result_schema() -> dict[str, Any]:
    made = plain(RESULT.json_schema())
    made["properties"].pop("details", None)
    made["properties"] = {"schema": {"const": 1}, **made["properties"]}
    made["required"] = ["schema", *made["required"]]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "wireval result.json", **made}


def manifest() -> str:
    made = manifest_schema()
    parts = [
        "# The manifest\n",
        NOTE,
        "A manifest is TOML. `wireval init FOLDER` writes one from a folder of scans, and `wireval check FILE` lists\n"
        "every problem at once.\n\n"
        "- **Paths** are relative to the file and stay below its folder. One that leads out of it (`../scans`) is\n"
        "  refused. Write such a path as an absolute one, so that it is plain what a manifest reads elsewhere.\n"
        "- **An unknown key** is an error that names the nearest known one.\n"
        "- **Editors** take [manifest.schema.json](../schema/manifest.schema.json) (in the first line:\n"
        "  `#:schema PATH`).\n",
    ]
    names = {"Wire": "[wires.NAME]", "Case": "[[case]]", "Wall": "[case.wall]", "OverWire": "[case.catheter]"}
    names |= {"Uncertainty": "[case.uncertainty]", "Others": "[case.simulated]"}
    for name, title in names.items():
        owner = made["$defs"][name]
        needed = owner.get("required", [])
        rows = []
        for key, value in owner["properties"].items():
            default = "required" if key in needed else json.dumps(value.get("default"))
            default = "" if default in ("null", '""', "[]") else default
            rows.append((f"`{key}`", meaning(key, name), in_words(value, null=False), default))
        parts += [f"## `{title}`\n", table(("key", "meaning", "allowed", "default"), rows)]
    return "\n".join([*parts, *truth()])


TRUTH = {
    "scene, why": ("-", "name of the scene, and what it tries"),
    "entry_mm, entry_direction": ("mm, 1", "where the true wire is held, and where it points there"),
    "expected_status": ("-", "of each frame, what a run should say"),
    "quality": ("-", "how well the true wires were computed, by name"),
    "frames": ("-", "a row for each scan with the wire, in their order:"),
    "frames[].insertion_mm": ("mm", "arc length from the entry to the tip"),
    "frames[].roll_deg": ("deg", "roll about entry_direction, right-handed"),
    "frames[].points_mm": ("mm", "the true wire from the entry to the tip, [x, y, z] each, as the reference shows it"),
    "frames[].residual_N": ("N", "largest unbalanced force at a node of it"),
    "frames[].tip_jump_mm": (
        "mm",
        "how much further than the push its tip moved in one step since the last frame, at most: whether it snapped",
    ),
    "frames[].phantom_shift_mm": ("mm", "where the phantom moved: by how much in this frame's own scan"),
}
"""What the keys of truth.json mean, with their units."""


def truth() -> list[str]:
    rows = [(f"`{key}`", *told) for key, told in TRUTH.items()]
    return [
        "## truth.json\n",
        "What `wireval synth` writes for the key `truth`: the wires that it painted into the scans, LPS mm. A run\n"
        "reads `frames[].points_mm` alone, of a file of your own, too, and fills the columns truth_* and trace_* of\n"
        "errors.csv from it; nothing else sees it.\n",
        table(("key", "unit", "meaning"), rows),
    ]


ASIDE = {
    schema.WIRE_LINES.file: (
        "Arrays of the points of a line, for ParaView and 3D Slicer. KIND is traced, simulated or true; NNN is the\n"
        "frame, which is ParaView's time in the .pvd files.\n"
        "A simulated wire that was compared has its joints within the clamp's reach here, which are not scored (NaN),\n"
        "then the points of points.csv.gz, at which the errors are. In [frames.h5](frames.md) `simulated_mm` and\n"
        "`contact_force_N` are at the joints of the solver, `error_mm` and `arc_mm` at the compared points alone:\n"
        "therefore the numbers of points differ.\n",
    )
}
"""What is said of a file before its columns."""


def columns() -> str:
    parts = [
        "# Columns\n",
        NOTE,
        "A name carries its unit (`_mm`, `_deg`, `_N`, `_s`). What does not apply is an empty field, never 0.\n"
        "overall.csv has the columns of summary.csv. Another page tells [how the errors of a frame are\n"
        "computed](../metrics.md), formula by formula.\n",
    ]
    for one in (value for value in vars(schema).values() if isinstance(value, Table)):
        rows = [(f"`{column.name}`", column.unit, column.kind, column.meaning) for column in one]
        parts += [f"## {one.file}\n", *ASIDE.get(one.file, ()), table(("column", "unit", "kind", "meaning"), rows)]
    return "\n".join(parts)


def statuses() -> str:
    parts = [
        "# Statuses\n",
        NOTE,
        "A frame is `ok` only if it was traced, simulated to its depth, converged and compared. Where a run was to end "
        "before that (`--until`), `ok` says that nothing failed so far; its sentence in result.json says so.\n",
    ]
    for title, pairs in (
        ("Of a frame", [(one.identifier, one.value) for one in FrameStatus]),
        (
            "Of a simulated wire that is not at rest (the frame has this status, too)",
            [(s.identifier, s.value) for s in Status],
        ),
        ("Of a case without a result", [*LOST.items()]),
    ):
        parts += [f"## {title}\n", table(("status", "sentence"), [(f"`{name}`", text) for name, text in pairs])]
    return "\n".join(parts)


def command_line() -> str:
    parser, verbs = parsers()
    parts = [
        "# Command line\n",
        NOTE,
        f"{parser.epilog}\n",
        '`eval "$(wireval --print-completion bash)"` in `~/.bashrc` completes commands, options and files; other\n'
        "shells: `wireval --print-completion zsh`, tcsh, fish or powershell, in the file where that shell keeps it.\n",
    ]
    for name, verb in verbs.items():
        parts += [
            f"## wireval {name}\n",
            f"{verb.description}\n",
            table(("argument", "meaning"), map(argument, shown(verb))),
        ]
    return "\n".join(parts)


def shown(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    return [action for action in parser._actions if action.dest != "help"]


def argument(action: argparse.Action) -> tuple[str, str]:
    value = action.metavar or ("{" + ",".join(map(str, action.choices)) + "}" if action.choices else "")
    names = [" ".join(filter(None, (name, str(value) if action.nargs != 0 else ""))) for name in action.option_strings]
    return ", ".join(f"`{name}`" for name in names or [str(value)]), action.help or ""


def api() -> str:
    parts = ["# Python\n", NOTE, f"```text\n{inspect.getdoc(wireval)}\n```\n"]
    for name in sorted(wireval.__all__, key=str.lower):
        thing = getattr(wireval, name)
        call = f"{name}{signature(thing)}" if inspect.isfunction(thing) else name
        parts += [f"## `{name}`\n", f"```text\n{call}\n\n{inspect.getdoc(thing)}\n```\n"]
        parts += [member(name, key, value) for key, value in public(thing)]
    return "\n".join(parts)


def public(thing: Any) -> list[tuple[str, Any]]:
    if not inspect.isclass(thing) or issubclass(thing, Exception):
        return []
    members = [(key, value) for key, value in vars(thing).items() if not key.startswith("_") or key == "__init__"]
    kept = (inspect.isfunction, lambda value: isinstance(value, PROPERTIES))
    found = [(key, value) for key, value in members if any(kind(value) for kind in kept) and inspect.getdoc(value)]
    return [pair for pair in found if pair[0] != "__init__" or pair[1].__doc__]


def member(owner: str, name: str, value: Any) -> str:
    call = f"{owner}.{name}" if isinstance(value, PROPERTIES) else f"{owner}.{name}{signature(value)}"
    call = call.replace(f"{owner}.__init__", owner)
    return f"```text\n{call}\n\n{inspect.getdoc(value)}\n```\n"


def signature(thing: Callable[..., Any]) -> str:
    found = inspect.signature(thing)
    inputs = [
        one.replace(annotation=inspect.Parameter.empty) for one in found.parameters.values() if one.name != "self"
    ]
    return str(found.replace(parameters=inputs, return_annotation=inspect.Signature.empty))


def frames() -> str:
    rows = [(f"`{name}`", str(value)) for name, value in ATTRIBUTES.items()]
    text = (inspect.getdoc(frames_file) or "").partition("\n\n")[2]
    of_a_frame = (inspect.getdoc(FrameArrays) or "").partition("\n\n")[2]
    parts = [
        *("# frames.h5\n", NOTE, f"```text\n{text}\n```\n"),
        f"Datasets of a frame, as far as it has them:\n\n```text\n{of_a_frame}\n```\n",
        "The lines in `view/` have other numbers of points, and [arrays of their own](columns.md).\n",
        *("Attributes of the file:\n", table(("name", "value"), rows)),
    ]
    return "\n".join(parts)


PAGES: dict[str, Callable[[], str]] = {
    "metrics.md": metrics_page.text,
    "reference/settings.md": settings,
    "reference/manifest.md": manifest,
    "reference/columns.md": columns,
    "reference/statuses.md": statuses,
    "reference/command-line.md": command_line,
    "reference/python.md": api,
    "reference/frames.md": frames,
    "schema/manifest.schema.json": lambda: json.dumps(manifest_schema(), indent=1) + "\n",
    "schema/result.schema.json": lambda: json.dumps(result_schema(), indent=1) + "\n",
}


if __name__ == "__main__":
    for name, write in PAGES.items():
        (DOCS / name).parent.mkdir(parents=True, exist_ok=True)
        (DOCS / name).write_text(write(), encoding="utf-8")
