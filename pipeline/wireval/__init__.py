"""wireval for scripts and notebooks: the verbs of the command line as functions, results as pandas frames, the solver.

    import wireval

    wireval.check("study/manifest.toml")                          # [] where nothing is wrong
    results = wireval.run("study/manifest.toml", "out", jobs=2)
    good = results.errors[results.errors["status"] == "ok"]       # the frames that count
    worst = good.nlargest(1, "p95_mm").iloc[0]                    # the tutorial draws it
    case = results.cases[worst.case]                              # CaseFiles: .result, .errors, .scan, .folder, ...
    case.read_frame(worst.frame).curves                           # FrameArrays: the wires; .mips, .error_mm, ...
    wireval.wall_of(case)                                         # the lumen of this case, for the solver alone

``synth``, ``check``, ``run``, ``score``, ``calibrate`` and ``diff`` do what the commands of these names do; all other
commands (report, bench, ...) exist on the command line alone. Everything else here is defined in other packages and can
be imported from this one, too. Input that cannot be used raises ``InputError``, and a scan in which nothing can be
found raises ``StageError``; both say what the command would print.
"""

import json
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from . import _own_packages  # noqa: F401 - first: it says what is in the way of the imports below

# isort: split
from pipeline.cli import BAD_INPUT, carried_out, parsed
from pipeline.compare import point_to_curve
from pipeline.run.compared import compared
from pipeline.run.provenance import package_version
from pipeline.status import InputError, StageError
from pipeline.study.settings import TYPED, SettingsError
from reports.case_files import CaseFiles
from reports.frames_file import FrameArrays, ScanCrop
from reports.texts import UnreadableError
from reports.two_runs import Verdict
from solver import Catheter, Grid, GuideWire, Insertion, Insertions, Snap, Solution, Status, VesselWall, relax

from ._arguments import require, typed, with_flags
from .results import Results, read_results, read_run, wall_of

__version__ = package_version()
__all__ = [
    "CaseFiles",
    "Catheter",
    "FrameArrays",
    "Grid",
    "GuideWire",
    "InputError",
    "Insertion",
    "Insertions",
    "Results",
    "ScanCrop",
    "Snap",
    "Solution",
    "StageError",
    "Status",
    "Verdict",
    "VesselWall",
    "calibrate",
    "check",
    "diff",
    "point_to_curve",
    "read_results",
    "relax",
    "run",
    "score",
    "synth",
    "wall_of",
]


def __dir__() -> list[str]:
    """What a notebook completes: what is promised, without the modules and names that are imported for it."""
    return sorted([*__all__, *(name for name in globals() if name.startswith("__"))])


Place = str | Path
Settings = Mapping[str, bool | float | str | Sequence[object]]
"""``{"solver.segment_mm": 0.5}``: what --set takes, by table.key; `wireval settings` lists them."""


def synth(scene: str, out: Place, **more: bool | float | str) -> Path:
    """Write a synthetic study, whose true wires are known, and return the path of its manifest.

    more : options of ``wireval synth``, such as ``frames=8`` or ``seed=3``.
    """
    given = require(scene=scene, out=out)
    if more.get("list"):
        raise InputError(["list: it writes no study; `wireval synth --list` names the scenes, on the command line"])
    _carried_out("synth", given["scene"], out=given["out"], **more)
    return Path(given["out"]) / "manifest.toml"


def check(manifest: Place, *, settings: Settings | None = None) -> list[str]:
    """Every problem of a manifest, or of a folder of scans, as one sentence each; empty if none is found.

    Only the headers of scans are read, not their voxels, unless a manifest has to be inferred from a folder of scans.
    What is assumed, and what is allowed and not plausible, is printed, as ``run`` does it.
    """
    try:
        _carried_out("check", require(manifest=manifest)["manifest"], settings=settings)
    except InputError as error:
        return list(error.problems)
    except StageError as error:
        return [str(error)]
    return []


def run(
    manifest: Place,
    out: Place,
    *,
    settings: Settings | None = None,
    jobs: int = 1,
    sweep: Mapping[str, Iterable[object]] | None = None,
    fail_if: str | Iterable[str] = (),
    **more: bool | str | Sequence[str],
) -> Results:
    """Run the whole pipeline over every case of a manifest (or of a folder of scans) and return the results.

    out : the folder that they are written to.     settings : those that differ from the defaults, such as
    ``{"solver.segment_mm": 0.5}``.     sweep : ``{"simulate.wall_scale": [0.5, 2]}`` repeats the run with each of these
    values.     fail_if : a condition such as ``"rms_mm>0.5"``, or several; each one that holds is a sentence in
    ``results.closed``, and ``results.ok`` is then False.     more : any other option of ``wireval run`` by its long
    name, such as ``fresh=True``, ``only=["run1"]``, ``until="trace"`` (``"report"``, all of it, if left out) or
    ``quiet=True``.

    A frame or a case that fails raises nothing; ``results.failures`` says why it failed. Running again into the same
    folder keeps the cases that are finished. A shard without any case writes no files, and its tables are empty.
    Raises InputError where nothing could be run.
    """
    given = require(manifest=manifest, out=out, sweep=sweep, fail_if=fail_if)
    given["sweep"] = [f"{name}={','.join(map(str, values))}" for name, values in (given["sweep"] or {}).items()]
    _carried_out("run", given.pop("manifest"), settings, jobs=jobs, **given, **more)
    return read_run(Path(given["out"]))


def score(
    manifest: Place,
    out: Place,
    curves: Place | Iterable[Place] | Mapping[str, Place],
    *,
    fail_if: str | Iterable[str] = (),
    **more: bool | int | str | Settings,
) -> Results:
    """Compare the wires of other simulators with the traced ones, and return the results of the first simulator.

    curves : ``"mine=DIR"``, several of these, or ``{"mine": DIR, ...}``.     fail_if : as for ``run``, asked of every
    simulator, or of the one that is named (``"mine:rms_mm>0.5"``). Those that hold are in ``results.closed``.
    more : options of ``wireval score``.
    For the results of another simulator: ``read_results(out / "simulators" / NAME)``.
    """
    given = require(manifest=manifest, out=out, curves=curves, fail_if=fail_if)
    _carried_out("score", given.pop("manifest"), **given, **more)
    return read_results(given["out"])


def calibrate(manifest: Place, out: Place, **more: bool | Settings) -> Path:
    """Fit parameters to the cases of role calibration, and return the file with them, which ``run`` takes.

    more : options of ``wireval calibrate``.
    """
    given = require(manifest=manifest, out=out)
    _carried_out("calibrate", given["manifest"], out=given["out"], **more)
    return Path(given["out"]) / "parameters.toml"


def diff(first: Place, second: Place, *, tolerance: Place | None = None) -> Verdict:
    """Tell whether a second run (or score) is worse than a first one.

    tolerance : a TOML file that says how much worse each column may become, such as ``rms_mm = 0.03``; its table
    ``share`` says by which share of the first value, where that is more. By default the one installed with wireval.
    Raises InputError where the two cannot be compared.
    """
    given = require(first=first, second=second, tolerance=tolerance)
    least = None if tolerance is None else Path(given["tolerance"])
    try:
        return compared(Path(given["first"]), Path(given["second"]), least)
    except (ValueError, OSError) as error:
        raise InputError([str(error)]) from None


def _carried_out(verb: str, manifest: str, settings: object = None, **options: object) -> None:
    """Carry out the verb as typed with these options. A list repeats its option, True stands for one alone."""
    words = [verb, manifest]
    options = with_flags(verb, options)
    for key, wanted in (require(settings=settings, jobs=options.get("jobs"))["settings"] or {}).items():
        if isinstance(wanted, Mapping):
            flat = {f"{key}.{name}": value for name, value in wanted.items()}
            raise InputError([f"settings: write {json.dumps(flat, default=str)}"])
        words += ["--set", f"{key}={json.dumps(wanted, default=_plain)}"]
    for name, value in options.items():
        for one in value if isinstance(value, (list, tuple)) else [value]:
            if one is not None and one is not False:
                words += [f"--{name.replace('_', '-')}"] + [typed(name, one)] * (one is not True)
    with _as_typed(words):
        try:
            args = parsed(words)
        except SystemExit:
            raise InputError([f"help: of the command line alone; see help(wireval.{verb})"]) from None
        try:
            code = carried_out(args)
        except UnreadableError as error:
            raise InputError([str(error)]) from None
        except SettingsError as error:  # they were handed on as if they had been typed
            raise SettingsError([re.sub(f"^{TYPED}: ", "settings: ", text) for text in error.problems]) from None
    if code == BAD_INPUT:
        raise InputError([f"wireval {verb}: nothing was run; the problems stand above"])


def _plain(value: object) -> object:
    """A number or array of numpy's as Python's own."""
    return value.tolist() if hasattr(value, "tolist") else str(value)


@contextmanager
def _as_typed(words: Sequence[str]) -> Iterator[None]:
    """Provenance of the output, also of worker processes, and the next command in it name what was called."""
    before, sys.argv = sys.argv, ["wireval", *words]
    try:
        yield
    finally:
        sys.argv = before
