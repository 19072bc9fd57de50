"""Put calibrated parameters into the cases of a study, and refuse to score cases that were calibrated with."""

from collections.abc import Sequence
from pathlib import Path

from pipeline.run.hashing import file_hash
from pipeline.run.inputs import stated
from pipeline.study.manifest import Case
from pipeline.study.parameters import Parameters, ParametersError, read_parameters, with_parameters


def data_of(case: Case) -> tuple[str, ...]:
    """SHA-256 of every frame, trace and table of projections of a case: its data, whatever the case is called."""
    sources = [(s.path, s.dataset) for s in (*case.frames, *case.traces)]
    sources += [] if case.projections is None else [(case.projections, "")]
    return tuple(f"{file_hash(path)}#{dataset}" for path, dataset in sources if path.exists())


def as_calibrated(
    cases: Sequence[Case], given: Path | None, *, own: bool = False, part: bool = False
) -> tuple[tuple[Case, ...], tuple[str, ...]]:
    """The cases with their parameters, and sentences for the report; ParametersError lists every problem.

    given : parameters for all cases, in place of those that the manifest names.     own : also score cases that were
    calibrated with. Without it those of role calibration are left out, and one of role validation is a problem.
    part : the cases are a shard's, of which nothing may be left: other shards have cases to score.
    """
    read: dict[Path, Parameters] = {}
    kept, notes, problems = [], [], []
    for case in cases:
        path = given or case.parameters
        if path is None:
            kept.append(case)
            continue
        try:
            if path not in read:
                read[path] = read_parameters(path)
            found = read[path]
            changed = _with_clamp(case, with_parameters(case, found, data_of(case), score_used=own), found)
        except ParametersError as error:
            problems += [text for text in error.problems if text not in problems]
            continue
        if changed.own_parameters and not own and case.role == "validation":
            problems.append(
                f"case {case.id!r}: {changed.own_parameters}; take it out of the validation cases, or say "
                "--score-used: it is then marked and left out of every figure over cases"
            )
        elif changed.own_parameters and not own:
            notes.append(f"case {case.id!r} was calibrated with and is not scored (--score-used scores it, marked)")
        else:
            kept.append(changed)
            notes += [f"case {case.id!r}: {changed.own_parameters}"] * bool(changed.own_parameters)
    if not (kept or problems or part):
        all_of_them = "every case was calibrated with: nothing is left to score; say --score-used"
        problems.append(f"{given or 'parameters'}: {all_of_them}")
    if problems:
        raise ParametersError(problems)
    return tuple(kept), tuple(notes)


def _with_clamp(case: Case, changed: Case, found: Parameters) -> Case:
    """The case and the one whose clamp it borrows, both with the parameters, and what was stated before."""
    other, update = case.entry_case, dict[str, object](as_stated=stated(case))
    if other is not None and other.wire.name == found.wire:
        update["entry_case"] = with_parameters(other, found, ())
    return changed.model_copy(update=update)
