"""What MANIFEST stands for on the command line: a file, a folder that holds one, or a folder of scans."""

import argparse
import atexit
import shutil
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline.commands import resolved_settings, say
from reports.texts import status_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pipeline.study.manifest import Case, Manifest

NAME, INFERRED = "manifest.toml", "manifest.inferred.toml"
Inferred = tuple[str, tuple[str, ...], tuple[str, ...]]
"""The text of a manifest, sentences that say what was seen, and what is assumed."""


def file_of(path: Path) -> Path:
    """The manifest in a folder that holds one; else the path itself."""
    return path / NAME if status_of(path / NAME) else path


def add_manifest(parser: argparse.ArgumentParser) -> None:
    """MANIFEST, and what may be said where it is a folder of scans."""
    parser.add_argument(
        "manifest",
        type=Path,
        metavar="MANIFEST",
        help="manifest.toml, a folder that holds it, or one of scans (a case)",
    )
    add_what_is_seen(parser)


def add_calibrated(parser: argparse.ArgumentParser) -> None:
    """What is taken from a calibration, beside what the manifest names."""
    add = parser.add_argument
    add("--parameters", type=Path, metavar="FILE", help="what wireval calibrate found, for all cases")
    add("--score-used", action="store_true", help="also score cases that were calibrated with, marked")


def add_what_is_seen(parser: argparse.ArgumentParser) -> None:
    """What a folder of scans need not be searched for."""
    folder = parser.add_argument_group("of a folder of scans").add_argument
    folder("--entry", metavar="X,Y,Z", help="LPS mm, where the wire enters the lumen")
    folder("--direction", metavar="X,Y,Z", help="where the wire points at the entry")
    folder("--reference", type=Path, metavar="FILE", help="the scan without wire (default: a file named reference.*)")
    folder("--wire-radius", type=float, metavar="MM", help="outer radius of the wire")


def given(args: argparse.Namespace, keep: Path | None = None) -> "Manifest":
    """The manifest; one that is inferred from scans is printed, except with -q.

    keep : folder in which an inferred one is left as manifest.inferred.toml; None leaves nothing.
    """
    from pipeline.load import SUFFIXES
    from pipeline.status import InputError
    from pipeline.study.infer import states_cases
    from pipeline.study.manifest import read_manifest
    from reports.atomic import write_text

    path: Path = args.manifest
    if path.name.lower().endswith(SUFFIXES):
        folder = path.absolute().parent
        raise InputError(
            [f"{path}: a scan is no manifest; give its folder, {folder}, or write one: wireval init {folder}"]
        )
    path = file_of(path)
    if not path.is_dir():
        if unused := _said_of_scans(args):
            raise InputError([f"{', '.join(unused)}: of a folder of scans; {path} is a manifest, which says it itself"])
        return read_manifest(path)
    if named := [file for file in sorted(path.glob("*.toml")) if states_cases(file)]:
        raise InputError([f"{path}: no {NAME} in it, and {named[0].name} is a manifest; give that file: {named[0]}"])
    text, seen, _ = inferred(args)
    seen = (*_other_manifests(path), *seen)
    if not getattr(args, "quiet", False):  # not every verb has it
        say("\n".join([text, *seen]))
    if keep is None:
        keep = Path(tempfile.mkdtemp())
        atexit.register(shutil.rmtree, keep, ignore_errors=True)  # until then its hash may be asked for
    written = keep / INFERRED
    write_text(written, text)
    return read_manifest(written)


def _other_manifests(folder: Path) -> list[str]:
    """A sentence where a folder without manifest.toml holds files that may be one."""
    found = sorted(path.name for path in folder.glob("*.toml"))
    names = ", ".join(found[:3])
    return [f"no {NAME} in {folder}, though it holds {names}: name the file instead of the folder"] * bool(found)


def _said_of_scans(args: argparse.Namespace) -> list[str]:
    """The options that were given for a folder of scans."""
    names = ("entry", "direction", "reference", "wire_radius")
    return [f"--{name.replace('_', '-')}" for name in names if getattr(args, name) is not None]


def assumed_in(cases: "Sequence[Case]") -> tuple[str, ...]:
    """What nobody has confirmed of these cases, a sentence each."""
    return tuple(f"case {case.id!r}: {text}" for case in cases for text in case.unconfirmed)


def inferred(args: argparse.Namespace, beside: bool = False) -> Inferred:
    """A manifest for a folder of scans. beside : it will lie there, and names the scans from there."""
    from pipeline.status import UsageError
    from pipeline.study.infer import infer_manifest

    seen = _vector(args.entry, "--entry"), _vector(args.direction, "--direction"), args.wire_radius
    if args.reference is not None and not args.reference.exists():
        raise UsageError([f"--reference {args.reference}: no such scan"])
    load = resolved_settings(args).config.load
    return infer_manifest(args.manifest, *seen, load, args.manifest if beside else None, args.reference)


def _vector(text: str | None, name: str) -> Any:
    import numpy as np

    from pipeline.status import UsageError

    if text is None:
        return None
    try:
        values = np.array([float(part) for part in text.split(",")])
    except ValueError:
        values = np.zeros(0)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise UsageError([f"{name} {text!r}: expected three numbers X,Y,Z in LPS mm"])
    return values
