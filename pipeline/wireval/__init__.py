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
import sys
import warnings
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from . import _own_packages  # noqa: F401 - first: it says what is in the way of the imports below

# isort: split
from pipeline.cli import BAD_INPUT, carried_out, parsed
from pipeline.compare import point_to_curve
from pipeline.run.compared import compared
from pipeline.run.provenance import package_version
from pipeline.status import InputError, StageError
from reports.case_files import CaseFiles
from reports.frames_file import FrameArrays, ScanCrop
from reports.texts import UnreadableError
from reports.two_runs import Verdict
from solver import Catheter, Grid, GuideWire, Insertion, Insertions, Snap, Solution, Status, VesselWall, relax

from ._arguments import require, require_truth
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
    require(scene=scene, out=out)
    if "list" in more:
        raise InputError(["list: it writes no study; `wireval synth --list` names the scenes, on the command line"])
    _carried_out("synth", scene, out=out, **more)
    return Path(out) / "manifest.toml"


def check(manifest: Place, *, settings: Settings | None = None) -> list[str]:
    """Every problem of a manifest, or of a folder of scans, as one sentence each; empty if none is found.

    Only the headers of scans are read, not their voxels, unless a manifest has to be inferred from a folder of scans.
    Warns (UserWarning) of what is allowed and not plausible; what is assumed is printed.
    """
    try:
        require(manifest=manifest)
        found = _carried_out("check", manifest, settings=settings)
    except InputError as error:
        return list(error.problems)
    except StageError as error:
        return [str(error)]
    for doubt in found.doubts:
        warnings.warn(doubt, stacklevel=2)
    return []


def run(
    manifest: Place,
    out: Place,
    *,
    settings: Settings | None = None,
    jobs: int = 1,
    sweep: Mapping[str, Sequence[object]] | None = None,
    fail_if: str | Sequence[str] = (),
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
    require(manifest=manifest, out=out, sweep=sweep or {}, fail_if=fail_if)
    points = [f"{name}={','.join(map(str, values))}" for name, values in (sweep or {}).items()]
    gates = [fail_if] if isinstance(fail_if, str) else list(fail_if)
    _carried_out("run", manifest, out=out, settings=settings, jobs=jobs, sweep=points, fail_if=gates, **more)
    return read_run(Path(out))


def score(
    manifest: Place,
    out: Place,
    curves: Place | Sequence[Place] | Mapping[str, Place],
    *,
    fail_if: str | Sequence[str] = (),
    **more: bool | int | str | Settings,
) -> Results:
    """Compare the wires of other simulators with the traced ones, and return the results of the first simulator.

    curves : ``"mine=DIR"``, several of these, or ``{"mine": DIR, ...}``.     fail_if : as for ``run``, asked of every
    simulator, or of the one that is named (``"mine:rms_mm>0.5"``). Those that hold are in ``results.closed``.
    more : options of ``wireval score``.
    For the results of another simulator: ``read_results(out / "simulators" / NAME)``.
    """
    require(manifest=manifest, out=out, curves=curves, fail_if=fail_if)
    gates = [fail_if] if isinstance(fail_if, str) else list(fail_if)
    named = [f"{name}={place}" for name, place in curves.items()] if isinstance(curves, Mapping) else curves
    curves = [named] if isinstance(named, (str, Path)) else list(named)
    _carried_out("score", manifest, out=out, curves=curves, fail_if=gates, **more)
    return read_results(out)


def calibrate(manifest: Place, out: Place, **more: bool | Settings) -> Path:
    """Fit parameters to the cases of role calibration, and return the file with them, which ``run`` takes.

    more : options of ``wireval calibrate``.
    """
    require(manifest=manifest, out=out)
    _carried_out("calibrate", manifest, out=out, **more)
    return Path(out) / "parameters.toml"


def diff(first: Place, second: Place, *, tolerance: Place | None = None) -> Verdict:
    """Tell whether a second run (or score) is worse than a first one.

    tolerance : a TOML file that says how much worse each column may become, such as ``rms_mm = 0.03``; its table
    ``share`` says by which share of the first value, where that is more. By default the one installed with wireval.
    Raises InputError where the two cannot be compared.
    """
    require(first=first, second=second, **({} if tolerance is None else {"tolerance": tolerance}))
    try:
        return compared(Path(first), Path(second), None if tolerance is None else Path(tolerance))
    except (ValueError, OSError) as error:
        raise InputError([str(error)]) from None


def _carried_out(verb: str, manifest: Place, settings: object = None, **options: object) -> Namespace:
    """Carry out the verb as typed with these options, and return what was parsed, with what the verb has left there.

    A list repeats its option, True stands for one alone.
    """
    words = [verb, str(manifest)]
    require_truth(verb, options)
    chosen: Any = {} if settings is None else settings
    require(settings=chosen)
    for key, wanted in chosen.items():
        if isinstance(wanted, Mapping):
            flat = {f"{key}.{name}": value for name, value in wanted.items()}
            raise InputError([f"settings: write {json.dumps(flat, default=str)}"])
        words += ["--set", f"{key}={json.dumps(wanted, default=_plain)}"]
    for name, value in options.items():
        for one in value if isinstance(value, (list, tuple)) else [value]:
            if one is not None and one is not False:
                words += [f"--{name.replace('_', '-')}"] + [str(one)] * (one is not True)
    with _typed(words):
        try:
            args = parsed(words)
            code = carried_out(args)
        except UnreadableError as error:
            raise InputError([str(error)]) from None
        except SystemExit:
            raise InputError([f"help, print_completion: of the command line alone; see help(wireval.{verb})"]) from None
    if code == BAD_INPUT:
        raise InputError([f"wireval {verb}: nothing was run; the problems stand above"])
    return args


def _plain(value: object) -> object:
    """A number or array of numpy's as Python's own."""
    return value.tolist() if hasattr(value, "tolist") else str(value)


@contextmanager
def _typed(words: Sequence[str]) -> Iterator[None]:
    """Provenance of the output, also of worker processes, and the next command in it name what was called."""
    before, sys.argv = sys.argv, ["wireval", *words]
    try:
        yield
    finally:
        sys.argv = before
