"""Small studies through every stage, and all that they leave: tables, records, curves, surfaces, figures and pages."""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from pipeline.cli import main
from tests.numbers.drawn import TIMED, drawn, printed, said
from tests.numbers.imaging import TIMES, arrays, columns
from tests.numbers.kept import Numbers, Scene, digest
from tests.unseen import undrawn

NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
HEADS = {".nrrd": re.compile(rb"\A.*?\n\n", re.DOTALL), ".vtp": re.compile(rb"<[^>]*>")}
"""What of these files is no data, but says what the data are."""
HASH = re.compile(r"[0-9a-f]{16,}")
OTHERWISE = re.compile(r"provenance|sha256|bytes|MiB|key|version|argv|host|path|time|seconds|_s$|_ms$|config|inputs")
"""What another machine or another day has otherwise."""


def values_of(record: Any, name: str = "") -> Iterator[float]:
    """The numbers of a record, in order."""
    if OTHERWISE.search(name):
        return
    if isinstance(record, dict):
        for key in sorted(record):
            yield from values_of(record[key], key)
    elif isinstance(record, list):
        for item in record:
            yield from values_of(item, name)
    elif isinstance(record, (bool, int, float)):
        yield float(record)


def texts_of(record: Any, name: str = "") -> Iterator[str]:
    """The texts of a record, in order."""
    if OTHERWISE.search(name):
        return
    if isinstance(record, dict):
        for key in sorted(record):
            yield from texts_of(record[key], key)
    elif isinstance(record, list):
        for item in record:
            yield from texts_of(item, name)
    elif isinstance(record, str) and not HASH.fullmatch(record):
        yield record


def of_file(path: Path) -> Iterator[tuple[str, list[float]]]:
    """The numbers of one file, by quantity; none of a kind that has no numbers of its own."""
    name = path.name.partition(".")[0]
    if path.suffix == ".csv" and not TIMES.search(name):
        yield from columns(path)
        table = pd.read_csv(path, dtype=str, keep_default_na=False)
        texts = [v for name in table if not OTHERWISE.search(str(name)) for v in table[name] if not NUMBER.fullmatch(v)]
        yield from said(name, "  ".join(texts)).items()
    elif path.suffix == ".h5":
        kinds: dict[str, list[float]] = {}
        for key, values in arrays(path):
            kinds.setdefault(key.partition("_")[2], []).extend(values)
        yield from ((f"{name}.{kind}", values) for kind, values in kinds.items())
    elif path.suffix == ".json" and not OTHERWISE.search(name):
        record = json.loads(path.read_text(encoding="utf-8"))
        yield f"{name}.record", digest(list(values_of(record)))
        yield from said(name, "  ".join(texts_of(record))).items()
    elif path.suffix in HEADS:
        head = b" ".join(HEADS[path.suffix].findall(path.read_bytes())).decode("latin-1")
        yield f"{name}.head", [*digest([float(n) for n in NUMBER.findall(head)]), len(head)]


def everything(out: Path) -> Numbers:
    """What a run left, by case and file."""
    found: dict[str, list[float]] = {"files": [float(len([*out.rglob("*")]))]}
    for path in sorted(out.rglob("*.*")):
        place = "_".join(path.relative_to(out).parts[:-1]).replace(" ", "-")
        if path.is_file() and not re.search(r"run_time|ledger|timings|sweep/", path.as_posix()):
            found |= {
                f"{place}_{key}".replace(" ", "-"): np.atleast_1d(values).tolist() for key, values in of_file(path)
            }
    return found


def study(
    scene: str,
    *settings: str,
    frames: int = 2,
    size: int = 56,
    insertions: int = 1,
    seed: int = 4,
    scored: bool = False,
) -> Numbers:
    """A scene of the catalogue written and run, and all of the output read; of the score of its own wires, if so."""
    with tempfile.TemporaryDirectory() as folder, undrawn(), drawn(TIMED) as looks:
        place = [f"{folder}/study", "--frames", str(frames), "--size", str(size), "--seed", str(seed), "-q"]
        assert main(["synth", scene, "-o", *place, "--insertions", str(insertions)]) == 0
        manifest, out = f"{folder}/study/manifest.toml", f"{folder}/out"
        with printed() as words:
            main(["run", manifest, "-o", out, "--no-cache", *settings])
            if scored:
                main(["score", manifest, "--curves", f"own={out}", "-o", f"{folder}/scored"])
        return {**everything(Path(folder) / "scored" if scored else Path(out)), **looks, **words}


SCENES: dict[str, Scene] = {
    # of seeds 4 to 8 the one in which no member of the budget comes to rest otherwise by another processor's rounding
    "insertions": lambda: study(
        "bend", "--sweep", "simulate.roll_offset_deg=20", "--set", "budget.members=8", insertions=2, seed=6
    ),
    "missing": lambda: study("missing-wire", "--set", "simulate.depth=manifest", frames=3, size=64),
    "scored": lambda: study("oblique", size=64, scored=True),
}
