"""Where two runs come from, and what of it differs: settings, code, versions, manifest, the contents of inputs."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from reports.case_files import find_cases, read_json

CODE = {"wireval": "wireval", "git_commit": "commit", "git_dirty": "changed files", "python": "Python"}
ABSENT = "(none)"


def what_differs(before: Path, after: Path) -> list[dict[str, str]]:
    """Rows (what, before, after) of everything that is not the same in two output folders."""
    old, new = origin(before), origin(after)
    return [
        {"what": name, "before": old.get(name, ABSENT), "after": new.get(name, ABSENT)}
        for name in dict.fromkeys([*old, *new])
        if old.get(name) != new.get(name)
    ]


def origin(out: Path) -> dict[str, str]:
    """What the results of an output folder were made from, each under a name for a reader."""
    found: dict[str, str] = {}
    for path in sorted(out.glob("run*.json")):
        run = read_json(path)
        found |= _settings(run.get("config", {})) | _code(run.get("provenance", {}))
        if "manifest_sha256" in run:
            found["manifest"] = str(run["manifest_sha256"])[:12]
    for folder in find_cases(out):
        result = read_json(folder / "result.json")
        for item in result.get("inputs", ()):
            found[f"input of {folder.name}: {Path(item['path']).name}"] = str(item["sha256"])[:12]
        if not found.keys() & set(CODE.values()):
            found |= _settings(result.get("config", {})) | _code(result.get("provenance", {}))
    return found


def _settings(config: Mapping[str, Any]) -> dict[str, str]:
    return {f"{table}.{key}": str(item.get("value")) for table, items in config.items() for key, item in items.items()}


def _code(provenance: Mapping[str, Any]) -> dict[str, str]:
    code = {said: str(provenance[name]) for name, said in CODE.items() if name in provenance}
    return code | {name: str(version) for name, version in provenance.get("versions", {}).items()}
