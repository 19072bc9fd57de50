"""One input, one process: it ends well, or what it did instead.

The program is imported and warmed once; every input then gets a fork of its own, with limits on time and memory.
"""

from __future__ import annotations

import json
import os
import re
import resource
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pipeline.cli import main

SECONDS, BYTES = 60, 2**30
"""Bounds on one input: time (several ones share a machine: CPU time), and memory over the parent's."""
PYTHON = re.compile(
    r"Traceback|\b[A-Za-z]+(?:Error|Exception)\b|object has no attribute|not subscriptable|\[Errno|positional argument"
    r"|could not broadcast|out of bounds|invalid literal|NoneType"
)


@dataclass(frozen=True)
class Input:
    """make : fills a copy of the study and returns further arguments.     refuse : it must not be believed."""

    kind: str
    name: str
    make: Callable[[Path], list[str] | None]
    refuse: bool
    until: str = "compare"


@dataclass(frozen=True)
class Ending:
    """How an input ended: ``well`` or what is wrong."""

    verdict: str
    detail: str = ""
    seconds: float = 0.0
    extra_bytes: int = 0


def judged(given: Input, base: Path, folder: Path) -> Ending:
    """Try one input in a process of its own, on a copy of the base study."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(base, folder)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    clock = time.monotonic()
    child = os.fork()
    if child == 0:
        _in_child(given, folder)
    status, usage = _waited(child, clock)
    spent, extra = time.monotonic() - clock, usage.ru_maxrss * 1024 - before
    if status is None:
        return Ending("hang", f"over {SECONDS} s", spent, extra)
    if os.WIFSIGNALED(status):
        return Ending("died", signal.Signals(os.WTERMSIG(status)).name, spent, extra)
    if extra > BYTES:
        return Ending("memory", f"{extra / 2**20:.0f} MiB over the parent's", spent, extra)
    verdict, detail = json.loads((folder / "ending.json").read_text(encoding="utf-8"))
    return Ending(verdict, detail, spent, extra)


def _waited(child: int, clock: float) -> tuple[int | None, resource.struct_rusage]:
    while True:
        done, status, usage = os.wait4(child, os.WNOHANG)
        if done:
            hung = os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGXCPU
            return (None if hung else status), usage
        if time.monotonic() - clock > 5 * SECONDS:
            os.kill(child, signal.SIGKILL)
            _, _, usage = os.wait4(child, 0)
            return None, usage
        time.sleep(0.005)


def _in_child(given: Input, folder: Path) -> None:
    """Run the command line on the input; never returns."""
    try:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        more = given.make(folder) or []
        used = resource.getrusage(resource.RUSAGE_SELF)
        cpu = int(used.ru_utime + used.ru_stime)
        resource.setrlimit(resource.RLIMIT_CPU, (cpu + SECONDS, cpu + SECONDS + 5))
        (folder / "ending.json").write_text(json.dumps(_tried(given, folder, more)), encoding="utf-8")
        os._exit(0)
    except BaseException:
        (folder / "ending.json").write_text(json.dumps(["harness", traceback.format_exc()[-800:]]), encoding="utf-8")
        os._exit(0)


def _tried(given: Input, folder: Path, more: list[str]) -> tuple[str, str]:
    log, out = folder / "said.txt", folder / "out"
    manifest = str(folder / "manifest.toml")
    with log.open("w", buffering=1, encoding="utf-8") as file:
        sys.stdout = sys.stderr = file
        try:
            checked = main(["check", manifest, *more])
            code = main(["run", manifest, "-o", str(out), "--no-cache", "--until", given.until, *more])
        except SystemExit as stop:
            checked = code = int(stop.code or 0)
        except BaseException:
            return "traceback", traceback.format_exc()[-600:]
    said = log.read_text(errors="replace")
    failures = out / "failures.csv"
    written = failures.read_text(errors="replace") if failures.exists() else ""
    statuses = [_status(path) for path in out.glob("cases/*/result.json")]
    if "crashed" in statuses or "crashed" in written:
        return "crashed", written[-600:]
    if PYTHON.search(said) or PYTHON.search(written):
        return "python", (said + written)[-600:]
    if code not in (0, 1, 2):
        return "code", f"exit {code}"
    if code == 2 and out.exists():
        return "written", f"exit 2, yet {out} is there"
    if code == 0 and given.refuse:
        return "believed", said[-300:]
    if checked == 2 and code == 0:
        return "believed", f"check refuses it, run does not: {said[-300:]}"
    return "well", f"{checked}/{code} {said.strip().splitlines()[0][:160] if said.strip() else ''}"


def _status(path: Path) -> str:
    try:
        return str(json.loads(path.read_text(encoding="utf-8")).get("status"))
    except ValueError:
        return "no JSON"
