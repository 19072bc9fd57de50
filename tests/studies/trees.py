"""Two output folders, file by file."""

from __future__ import annotations

import json
import re
from pathlib import Path

TIMING = ("timings.csv", "provenance.json", "log.txt", "figures/run_time.png", "figures/run_time.csv")
"""When, where and how long: what differs between two runs of the same."""
MADE = re.compile(rb'<p class="made">.*?</p>')


def is_timing(name: str) -> bool:
    return any(name == timing or name.endswith(f"/{timing}") for timing in TIMING)


def files_of(out: Path) -> dict[str, bytes]:
    """Every file by its name; left out are a ledger's lines on timing files, and a first page's on when and how it was
    made.
    """
    found = {path.relative_to(out).as_posix(): path.read_bytes() for path in out.rglob("*") if path.is_file()}
    for name, content in found.items():
        if name.endswith("ledger.json"):
            found[name] = without_timing(content)
        elif name.endswith("index.html"):
            found[name] = MADE.sub(b"", content)
    return found


def without_timing(ledger: bytes) -> bytes:
    table = json.loads(ledger)
    table["files"] = {name: entry for name, entry in table["files"].items() if not is_timing(name)}
    return json.dumps(table).encode()


def differences(first: Path, second: Path) -> list[str]:
    """Names of files that only one has, or whose contents differ; of timing files only whether they are there."""
    a, b = files_of(first), files_of(second)
    return sorted(
        name
        for name in a.keys() | b.keys()
        if name not in a or name not in b or (a[name] != b[name] and not is_timing(name))
    )
