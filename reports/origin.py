"""Where results come from: settings, code, versions, manifest, contents of inputs; what of it differs between runs.

Each case says it of itself: a folder may hold cases that were run at different times.
"""

from collections.abc import Iterable, Mapping
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import Any

from reports.case_files import counted, listed, manifests_in, results_in, runs_in
from reports.records import read_json, run_records
from reports.schema import OURS

CODE = {"wireval": "wireval", "git_commit": "commit", "git_dirty": "changed files", "python": "Python"}
ABSENT = "(none)"
TOLD, UNTOLD = "kept in its result.json", "(not kept): of this run there are tables alone, without result.json"
WIRES = "simulated.files"
"""Key of the manifest for another simulator's wires, and how their files' keys begin."""
Told = dict[str, str]
"""What something was made from, each under a name for a reader."""


def what_differs(before: Path, after: Path) -> list[dict[str, str]]:
    """Rows (what, before, after) of everything that is not the same in two output folders."""
    old, new = results_in(before), results_in(after)
    both = old.keys() & new.keys()
    first, second = _whole(before, old) | _cases(old), _whole(after, new) | _cases(new)
    before_said, after_said = _stated(old, both), _stated(new, both)
    of_cases = [(_inputs(old, both), _inputs(new, both, old), "input"),
                (_known_to(before_said, after_said), _known_to(after_said, before_said), "manifest")]  # fmt: skip
    silent = [told.keys() <= {"cases"} for told in (first, second)]
    if any(silent):  # golden tables say nothing of where they come from
        of_cases = []
        what = "settings, code and inputs: not compared"
        first, second = ({"cases": told["cases"], what: UNTOLD if mute else TOLD}
                         for told, mute in zip((first, second), silent, strict=True))  # fmt: skip
    if second.get("manifest") != first.get("manifest") and _stated_alike(old, new, both):
        first, second = ({_TEXT if name == "manifest" else name: value for name, value in told.items()}
                         for told in (first, second))  # fmt: skip
    rows = [(name, first.get(name, ABSENT), second.get(name, ABSENT)) for name in dict.fromkeys([*first, *second])]
    for files, others, what in of_cases:
        same: dict[tuple[str, str, str], list[str]] = {}
        for case, key in dict.fromkeys([*files, *others]):
            change = key, files.get((case, key), ABSENT), others.get((case, key), ABSENT)
            same.setdefault(change, []).append(case)
        rows += [(f"{what} of {listed(cases)}: {key}", a, b) for (key, a, b), cases in same.items()]
    return [{"what": name, "before": a, "after": b} for name, a, b in rows if a != b]


def of_two_simulators(before: Path, after: Path) -> str:
    """That one output folder's wires are the solver's own and the other's another simulator's; empty where not so.

    A simulator that wrote nothing for one case of several has no files there: that case is not the solver's own.
    """
    old, new = results_in(before), results_in(after)
    handed = [any(_handed(found[case]) for case in old.keys() & new.keys()) for found in (old, new)]
    return "the wires of one run are the solver's own, those of the other another simulator's" * (len({*handed}) > 1)


def _handed(result: Mapping[str, Any]) -> bool:
    """Whether a case's wires are another simulator's: a score names whose they are, else its input files say so."""
    keys = (str(item.get("key", "")) for item in result.get("inputs", ()))
    return bool(name != OURS) if (name := result.get("simulator")) else any(key.startswith(WIRES) for key in keys)


def told_alike(before: Path, after: Path) -> str:
    """The sentence on two output folders of which nothing differs; empty where something does, or was not kept."""
    results = [result for out in (before, after) for result in results_in(out).values()]
    kept = all(result.get(key) is not None for result in results for key in ("config", "provenance", "inputs"))
    if not results or not kept or what_differs(before, after):
        return ""
    if any(result["provenance"].get("git_dirty") for result in results):
        return "nothing differs in settings, commit and inputs; files were changed since the commit, how is not kept"
    return "nothing differs in settings, code and inputs"


def why_not_pooled(*outs: Path) -> str:
    """Why nothing may be pooled over the cases of output folders: they are of different settings, of manifests that
    state them otherwise, or of a file that changed between them; empty where none is so.
    """
    found = {out: results_in(out) for out in outs}
    others = (sentence for out in outs for sentence in (_of_changed_file(found[out]), _of_other_arrays(out)))
    return _of_other_settings(found) or _of_other_manifests(found) or next(filter(None, others), "")


def _mapping(value: object) -> Mapping[str, Any]:
    """What a record holds by names; nothing where somebody else wrote something else there."""
    return value if isinstance(value, Mapping) else {}


def _of_changed_file(results: Mapping[str, Mapping[str, Any]]) -> str:
    """The sentence on a file of several cases, as the parameters of a wire, that was another one for some of them."""
    met: dict[str, dict[str, str]] = {}
    for case, result in results.items():
        for item in result.get("inputs", ()):
            met.setdefault(str(item.get("path")), {}).setdefault(str(item.get("sha256")), case)
    changed = next(((path, [*cases.values()]) for path, cases in met.items() if len(cases) > 1), None)
    if changed is None:
        return ""
    path, (one, other, *_) = changed
    what = f"Nothing is pooled: {path} was changed between case {one} and case {other}, which were computed with it"
    return f"{what}; run all of them again (--resume, without --only; their shards, where there are shards)."


def _of_other_arrays(out: Path) -> str:
    """The sentence on shards of several arrays that were merged: a case may be what an earlier one made of it."""
    sizes = {int(path.stem.rpartition("-")[2]) for path in run_records(out) if "-" in path.name}
    if len(sizes) < 2:
        return ""
    counts = " and of ".join(map(str, sorted(sizes)))
    what = f"Nothing is pooled: shards of arrays of {counts} were merged, and a case may be of the earlier one"
    return f"{what}; merge the folders of one array, into an empty one."


def _of_other_settings(found: Mapping[Path, Mapping[str, Mapping[str, Any]]]) -> str:
    made = {
        f"{out.name}: {case}" if len(found) > 1 else case: _made(result)
        for out, results in found.items()
        for case, result in results.items()
    }
    told = _over(made)
    apart = [f"{name} {told[name]}" for name in told if len(_by_value(made, name)) > 1]
    if not apart:
        return ""
    more = f" and {len(apart) - 1} more" * (len(apart) > 1)
    what = f"Nothing is pooled: the cases were run with different settings ({apart[0]}{more})"
    return f"{what}; run all of them with the same ones, or keep them in folders of their own."


def _of_other_manifests(found: Mapping[Path, Mapping[str, Mapping[str, Any]]]) -> str:
    """The sentence on cases that the latest run into their folder states otherwise than the run that computed them.

    Runs of an earlier version do not say what they state: those of several manifests may state anything.
    """
    apart: set[str] = set()
    for out, results in found.items():
        runs = runs_in(out)
        if len(manifests_in(run for run in runs if "stated" not in run)) > 1:
            apart |= results.keys()
        own = {name: result["stated"] for name, result in results.items() if result.get("stated")}
        latest = {name: text for run in runs for name, text in _mapping(run.get("stated")).items()}
        apart |= {name for name, text in latest.items() if own.get(name, text) != text}
    if not apart:
        return ""
    what = f"Nothing is pooled: {listed(sorted(apart))} was computed from another manifest, which stated it otherwise"
    what = what if len(apart) == 1 else what.replace(" was ", " were ").replace(" it ", " them ")
    do = "run them again (--resume, without --only; their shards, where there are shards)"
    do += ", or keep them in folders of their own"
    return f"{what} than a run into this folder; {do}."


def settings_of(result: Mapping[str, Any]) -> Told:
    """Settings of what a result.json or run.json holds, by table.key; None is what the data or the manifest say."""
    return {
        f"{table}.{key}": "as the manifest says" if item.get("value") is None else str(item["value"])
        for table, items in result.get("config", {}).items()
        for key, item in items.items()
    }


def _whole(out: Path, found: Mapping[str, Mapping[str, Any]]) -> Told:
    """Settings, code and manifest; a folder whose cases tell nothing has those of its runs."""
    runs = {path.name: read_json(path) for path in run_records(out)}
    told = _over({name: _made(r) | _code(r) for name, r in found.items()})
    told = told or _over({name: _made(r) | _code(r) for name, r in runs.items()})
    hashes = manifests_in(runs.values())
    return told | ({"manifest": " and ".join(hashes)} if hashes else {})


def _over(made: Mapping[str, Told]) -> Told:
    """What all say alike, and where they do not, who says what; who says nothing is not asked."""
    found = {}
    for name in dict.fromkeys(name for told in made.values() for name in told):
        values = _by_value(made, name)
        found[name] = "; ".join(
            f"{value} in {listed(who)}" if len(values) > 1 else value for value, who in values.items()
        )
    return found


def _by_value(made: Mapping[str, Told], name: str) -> dict[str, list[str]]:
    values: dict[str, list[str]] = {}
    for who, told in made.items():
        if told:
            values.setdefault(told.get(name, ABSENT), []).append(who)
    return values


def _made(result: Mapping[str, Any]) -> Told:
    """Settings, and the last stage that numbers come from: pages add none."""
    until = str(result.get("until", "")).replace("report", "compare")
    return settings_of(result) | ({"--until": until} if until else {})


def _code(result: Mapping[str, Any]) -> Told:
    provenance = result.get("provenance", {})
    code = {said: str(provenance[name]) for name, said in CODE.items() if name in provenance}
    return code | {name: str(version) for name, version in provenance.get("versions", {}).items()}


def _cases(found: Iterable[str]) -> Told:
    return {"cases": ", ".join(sorted(found))}


OF_CASE = "[[case]]"
SURE = "uncertainty"
STATED = {"wire": "[wires]", "wall": "[case.wall]", "entry": OF_CASE, "manifest_keys": OF_CASE, SURE: f"[case.{SURE}]"}
AT_CHOICE = "role", "group", "down", "catheter"
"""Parts of result.json that say what the manifest states of a case, with calibrated parameters where there are any, by
its table for them; and keys that are left out where it states none."""
_TEXT = "manifest (its text alone: it states the same of every case)"
FOUND = "used_", "sigma_", "covariance"
"""How keys begin in them of what was found."""


def _stated(found: Mapping[str, Mapping[str, Any]], cases: Iterable[str]) -> dict[tuple[str, str], str]:
    """What the manifest states, by case and key. Results of an earlier version do not say all of it."""
    said: dict[tuple[str, str], str] = {}
    for case in sorted(cases):
        keys = dict(found[case].get("manifest_keys", {}))
        told = {**found[case], "manifest_keys": keys, SURE: keys.pop(SURE, None) or {}}
        values = {
            f"{table} {key}": value
            for part, table in STATED.items()
            for key, value in _mapping(told.get(part)).items()
            if not key.startswith(FOUND)
        }
        values |= {f"{OF_CASE} {name}": found[case].get(name) for name in AT_CHOICE}
        said |= {(case, name): ABSENT if value is None else str(value) for name, value in values.items()}
    return said


def _known_to(said: Mapping[tuple[str, str], str], other: Mapping[tuple[str, str], str]) -> dict[tuple[str, str], str]:
    return {key: value for key, value in said.items() if key in other}


def _stated_alike(
    old: Mapping[str, Mapping[str, Any]], new: Mapping[str, Mapping[str, Any]], cases: Iterable[str]
) -> bool:
    """Whether two manifests are known to state the same of all cases: a comment gave two hashes, and no word on it."""
    said = [(old[case].get("stated"), new[case].get("stated")) for case in cases]
    return bool(said) and len(old) == len(new) == len(said) and all(a is not None and a == b for a, b in said)


def _inputs(
    found: Mapping[str, Mapping[str, Any]],
    cases: Iterable[str],
    before: Mapping[str, Mapping[str, Any]] = MappingProxyType({}),
) -> dict[tuple[str, str], str]:
    """Hashes by case and key of the manifest; rows of an older version, which have no key, by their paths.

    Another simulator's wires, of which all files differ where the simulator does, have one hash together, with their
    names, which count the frames. Where some of them alone differ from those ``before``, these are named.
    """
    hashes: dict[tuple[str, str], str] = {}
    for case in sorted(cases):
        files = _files(found[case])
        wires = [f"{name} {value}" for key, (name, value) in files.items() if key.startswith(WIRES)]
        hashes |= {(case, key): value for key, (_, value) in files.items() if not key.startswith(WIRES)}
        if wires:
            together = sha256("".join(wires).encode()).hexdigest()[:12]
            known = {value for _, value in _files(before.get(case, {})).values()}
            other = [name for key, (name, value) in files.items() if key.startswith(WIRES) and value not in known]
            some = f"; other: {listed(other)}" if 0 < len(other) < len(wires) else ""
            hashes[case, WIRES] = f"{counted(len(wires), 'file')}, {together}{some}"
    return hashes


def _files(result: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """A case's input files by key: name and hash, its first digits."""
    rows = result.get("inputs", ())
    return {str(row.get("key", row["path"])): (Path(row["path"]).name, str(row["sha256"])[:12]) for row in rows}
