"""Before a run writes into a folder: what lies there, and whether the new results may stand beside it."""

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from pipeline.run import ledger
from pipeline.run.hashing import file_hash
from pipeline.run.inputs import named_files, other_file, stated
from pipeline.run.log import STAGES, Stage
from pipeline.run.provenance import times_in
from pipeline.run.results import jsonable
from pipeline.status import UsageError
from pipeline.study.manifest import Case
from pipeline.study.settings import Resolved
from reports.case_files import find_cases
from reports.inside import WRITTEN
from reports.origin import ABSENT, WIRES, settings_of
from reports.records import read_json, run_records


def guard_apart(out: Path, inputs: Iterable[Path]) -> None:
    """Refuse an output folder that holds inputs: results would lie among the scans, and these would be removed.

    inputs : files, and folders of which every file is read. A folder for results is not to lie in such a one either.
    """
    given = tuple(inputs)
    here, places = out.resolve(), {path.parent.resolve(): path.parent for path in given}
    for folder in (path for path in given if path.is_dir()):
        if here.is_relative_to(folder.resolve()):
            raise UsageError([f"-o {out}: all files in {folder} are read as a scan; name a folder outside of it"])
    if here in places:
        beside = here.with_name(f"{here.name}-out").name
        raise UsageError([f"-o {out}: this is the folder of the inputs; name another one for the results, as {beside}"])
    for place, folder in places.items():
        if place.is_relative_to(here) and place.relative_to(here).parts[0] in WRITTEN:
            what = f"inputs lie in {folder}, and a run removes earlier results there"
            raise UsageError([f"-o {out}: {what}; copy them to a folder of their own, or name another output folder"])


def guard_out(out: Path, manifest: Path, settings: Resolved) -> None:
    """Refuse an output folder that holds something else than a run of the same manifest with the same settings."""
    if (out / "simulators").is_dir():
        raise UsageError([f"-o {out}: it holds a score of other simulators' wires; name another folder"])
    allowed = "say --resume (keep what fits) or --fresh (compute again); in Python resume=True or fresh=True"
    # a run that ended before its first file was whole leaves nothing but that file's temporary name
    if not out.exists() or all(path.name.startswith(".") for path in out.iterdir()):
        return
    infos, wanted = run_records(out), file_hash(manifest)
    for info in infos:
        try:
            known = read_json(info).get("manifest_sha256")
        except ValueError:
            raise UsageError([f"{info} is damaged; {allowed}"]) from None
        if known != wanted:
            raise UsageError([f"{out} was made from another manifest; name another folder, or {allowed}"])
    if not infos and not (out / "manifest.inferred.toml").exists():
        raise UsageError([f"{out} is not empty and holds no run; name another folder, or {allowed}"])
    others = next(filter(None, (_changed(read_json(info), settings) for info in infos)), "")
    if others:
        raise UsageError([f"{out} was run with other settings: {others}; name another folder, or {allowed}"])


def guard_own(out: Path, names: Iterable[str], cases: Iterable[Path]) -> None:
    """Refuse to replace files of a user's own: where no run was into a folder, those with the names of ours are.

    names : of files over all cases.     cases : the folders to write into; one with a ledger was copied from a run.
    """
    if run_records(out):
        return
    inside = (folder for folder in cases if not (folder / ledger.FILE).exists())
    meant = (*(out / name for name in names), *(folder / name for folder in inside for name in ledger.TOP))
    if own := next((path for path in meant if path.is_file()), None):
        raise UsageError([f"{own}: is of no run, and would be replaced; name another folder, or move it away"])


def guard_kept(out: Path, others: Mapping[str, Case], settings: Resolved, *, files: bool) -> None:
    """Refuse what differs from that of cases which this run keeps, settings or their inputs: all of them are pooled.

    others : the manifest's cases that this run does not compute, by id.     files : whether these are asked for, too.
    The shards of an array are not to: each of them would look at those of all others.
    """
    with suppress(ValueError):  # an unreadable result is not pooled
        for folder in find_cases(out):
            if folder.name not in others:
                continue
            known, case = read_json(folder / "result.json"), others[folder.name]
            changed = _otherwise(known, case, settings) or (_other_file(known, case, folder) if files else "")
            if changed:
                what = f"{out}: case {folder.name!r} would keep its result of {changed}"
                raise UsageError([f"{what}; run all cases (no --only, no --shard), or name another folder"])


def _otherwise(known: Mapping[str, Any], case: Case, settings: Resolved) -> str:
    """What of a kept result is not as it would be now, in words; empty where nothing is."""
    if changed := _changed(known, settings):
        return f"other settings: {changed}"
    if known.get("stated") not in (None, "", stated(case)):
        return "another manifest, which stated it otherwise"
    return ""


def _other_file(known: Mapping[str, Any], case: Case, folder: Path) -> str:
    file = other_file(case, known["inputs"], times_in(folder)) if "inputs" in known else ""
    return f"another file: {file}" if file else ""


def _changed(known: Mapping[str, Any], settings: Resolved) -> str:
    """The settings that differ from those in a run.json or result.json, in words; empty where it has no settings."""
    old, new = settings_of(known), settings_of({"config": jsonable(settings.as_dict())})
    pairs = {name: (old.get(name, ABSENT), new.get(name, ABSENT)) for name in dict.fromkeys([*old, *new]) if old}
    return ", ".join(f"{name} {before} before, {now} now" for name, (before, now) in pairs.items() if before != now)


def guard_score(scored: Mapping[str, tuple[Path, Sequence[Case]]], settings: Resolved) -> None:
    """Refuse to put a simulator's results in the place of those of wires from elsewhere, or with other settings.

    scored : folder and cases by simulator. The same files written again are the same wires, mended: what failed is
    computed again by the same command.
    """
    do = "name another folder, or say --fresh (compute again)"
    for name, (out, cases) in scored.items():
        with suppress(ValueError):  # an unreadable result is replaced
            for info in run_records(out):
                if changed := _changed(read_json(info), settings):
                    raise UsageError([f"{out} was scored with other settings: {changed}; {do}"])
        for case in cases:
            with suppress(ValueError):
                before = _wires_in(read_json(out / "cases" / case.id / "result.json"))
                now = {path.parent.resolve() for key, path in named_files(case).items() if key.startswith(WIRES)}
                if before and now and not before & now:
                    what = f"it holds a score of {name} by the wires in {min(before)}, which would be replaced"
                    raise UsageError([f"-o {out}: {what} by that of those in {min(now)}; {do}"])


def _wires_in(result: Mapping[str, Any]) -> set[Path]:
    """The folders of another simulator's wires that a result is of; none of those that are not known any more."""
    rows = [row for row in result.get("inputs", ()) if str(row.get("key", "")).startswith(WIRES)]
    return {path.parent.resolve() for row in rows if (path := Path(row["path"])).is_absolute() or path.exists()}


def guard_stages(out: Path, until: Stage) -> None:
    """Refuse to replace finished results by results of fewer stages."""
    with suppress(ValueError):  # guard_out reports a damaged file
        ends = [read_json(path).get("until", STAGES[-1]) for path in run_records(out)]
        later = [end for end in ends if end in STAGES and STAGES.index(end) > STAGES.index(until)]
        if later and any(out.glob("cases/*/result.json")):
            lost = f"{out} was run until {later[0]}, and --until {until} would take that away"
            raise UsageError([f"{lost}; name another folder, or say --fresh (compute again)"])
