"""Where a result comes from: versions, command line, machine, code state."""

import os
import platform
import re
import resource
import subprocess
import sys
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from pipeline.run import ledger
from reports.records import read_json

COMPUTING = ("numpy", "scipy", "scikit-image", "SimpleITK", "pydicom", "h5py", "numba")
"""Libraries on which results depend."""
PACKAGES = (*COMPUTING, "pandas", "matplotlib", "pydantic")


def package_version() -> str:
    """Version of wireval, or ``unknown`` where it runs from a plain checkout."""
    try:
        return version("wireval")
    except PackageNotFoundError:
        return "unknown"


def _git(*args: str) -> str:
    command = ["git", "-C", str(Path(__file__).parent), *args]
    try:
        return subprocess.check_output(command, stderr=subprocess.DEVNULL, encoding="utf-8", timeout=10).strip()
    except (OSError, subprocess.SubprocessError):
        return ""


@cache
def versions(names: tuple[str, ...] = PACKAGES) -> dict[str, str]:
    """Of the libraries; read once a process: it takes 20 ms, and every case asks."""
    return {name: version(name) for name in names}


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    found = re.search(r"^model name.*?:(.*)$", info.read_text(encoding="utf-8"), re.M) if info.exists() else None
    return found[1].strip() if found else platform.processor() or platform.machine()


def peak_memory_mib() -> float:
    """Largest resident memory of this process so far, MiB (Linux counts in KiB)."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def code_state() -> dict[str, Any]:
    """Versions and code state: what a result may depend on beside its inputs and settings."""
    commit = _git("rev-parse", "HEAD")
    return {
        "wireval": package_version(),
        "git_commit": commit,
        "git_dirty": bool(commit and _git("status", "--porcelain", "--untracked-files=no")),
        "python": platform.python_version(),
        "versions": dict(versions()),
    }


def command_line() -> list[str]:
    """The command of this run, as it was typed; ``python -m pipeline`` is ``wireval``."""
    program = Path(sys.argv[0]).name
    return ["wireval" if program == "__main__.py" else program, *sys.argv[1:]]


def working_directory() -> str:
    """Where relative paths are read from; empty where that folder was removed since this process went there."""
    try:
        return str(Path.cwd())
    except FileNotFoundError:
        return ""


def this_run() -> dict[str, Any]:
    """Command line, working directory, machine and time of this run: no result depends on them, and they differ."""
    return {
        "argv": command_line(),
        "cwd": working_directory(),
        "host": platform.node(),
        "system": platform.platform(),
        "processor": _processor(),
        "cpu_count": os.cpu_count(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def times_in(folder: Path) -> dict[str, int]:
    """When the input files of a case were last written, by key, as its result knows them; empty where it does not."""
    try:
        times = read_json(folder / ledger.PROVENANCE).get("files")
    except ValueError:
        return {}
    return times if isinstance(times, dict) else {}
