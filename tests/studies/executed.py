"""Which test executes which line, from one run of the tests with coverage: ``make coverage``, and for ``make mutants``.

Printed are the modules of which less than four fifths of the lines are executed. Compiled kernels are not seen, nor is
what a worker process of a run does.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("pipeline", "reports", "data_synthetic", "solver")
MAP = ROOT / "reports/out/executed.json"
LITTLE = 0.8


@dataclass(frozen=True)
class Executed:
    """By file and line the tests that execute it; the seconds of each; by file the lines executed and all lines."""

    tests: dict[str, dict[str, list[str]]]
    seconds: dict[str, float]
    lines: dict[str, tuple[int, int]]

    def of(self, file: str, line: int) -> list[str]:
        """The tests that execute a line, the quickest first."""
        found = self.tests.get(file, {}).get(str(line), [])
        return sorted(found, key=lambda test: self.seconds.get(test, 0.0))

    def files(self, tests: list[str]) -> list[str]:
        """The files of these tests, the quickest first."""
        found = dict.fromkeys(test.partition("::")[0] for test in tests)
        return sorted(found, key=self.seconds_of)

    def seconds_of(self, name: str) -> float:
        """How long a test takes, or all of a file."""
        return self.seconds.get(name) or sum(s for test, s in self.seconds.items() if test.startswith(f"{name}::"))


def executed(site: str, words: list[str], kept: Path = MAP) -> Executed:
    """From one run of pytest with these arguments, which is kept. site : where the package coverage is installed."""
    if not kept.exists():
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_text(json.dumps(run_tests(site, words)), encoding="utf-8")
    newer = [p for name in PACKAGES for p in (ROOT / name).rglob("*.py") if p.stat().st_mtime > kept.stat().st_mtime]
    if newer:
        print(
            f"{len(newer)} modules have changed since the tests were run with coverage: `make coverage` anew",
            flush=True,
        )
    return Executed(**json.loads(kept.read_text(encoding="utf-8")))


def run_tests(site: str, words: list[str]) -> dict[str, Any]:
    """What pytest with these arguments executes."""
    with tempfile.TemporaryDirectory() as folder:
        pytest = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "tests.studies.covering"]
        env = os.environ | {"PYTHONPATH": site, "COVERING": f"{folder}/data", "COVERAGE_CORE": "ctrace"}
        subprocess.run([*pytest, f"--junit-xml={folder}/junit.xml", *words], cwd=ROOT, env=env, check=False)
        return read_run(Path(folder), site)


def merged(old: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """Two runs: a test that is in both is that of the second. Of a module's lines the larger count is taken."""
    again = new["seconds"].keys()
    tests = {
        file: {line: [test for test in found if test not in again] for line, found in lines.items()}
        for file, lines in old["tests"].items()
    }
    for file, lines in new["tests"].items():
        for line, found in lines.items():
            tests.setdefault(file, {}).setdefault(line, []).extend(found)
    both = old["lines"].keys() | new["lines"].keys()
    # what was read back from a file has lists
    lines = {file: max(tuple(run["lines"].get(file, (0, 0))) for run in (old, new)) for file in both}
    return {"tests": tests, "seconds": old["seconds"] | new["seconds"], "lines": lines}


def read_run(folder: Path, site: str) -> dict[str, Any]:
    """What a run with coverage left in a folder, one file a process, as ``Executed`` has it."""
    sys.path.append(site)
    import coverage

    cover = coverage.Coverage(data_file=str(folder / "all"), config_file=False)
    cover.combine([str(path) for path in folder.glob("data*")])
    data = cover.get_data()
    tests: dict[str, dict[str, list[str]]] = {}
    lines: dict[str, tuple[int, int]] = {}
    for file in (file for file in data.measured_files() if file.endswith(".py")):  # no templates
        name = Path(file).relative_to(ROOT).as_posix()
        if name.startswith("reports/out/"):  # coverage itself is installed there
            continue
        each = {str(line): [c for c in contexts if c] for line, contexts in data.contexts_by_lineno(file).items()}
        tests[name] = each
        _, statements, _, missing, _ = cover.analysis2(file)
        lines[name] = (len(statements) - len(missing), len(statements))
    cases = ET.parse(folder / "junit.xml").getroot().iter("testcase")
    seconds = {name_of(case): float(case.get("time", "0")) for case in cases}
    return {"tests": tests, "seconds": seconds, "lines": lines}


def name_of(case: ET.Element) -> str:
    """The node of a test in a JUnit file."""
    return f"{case.get('classname', '').replace('.', '/')}.py::{case.get('name')}"


def main() -> int:
    """Run the tests; print a line for each module of which little is executed, and the share of all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--site", default="", help="where the package coverage is installed")
    parser.add_argument("--more", action="store_true", help="these tests are new or changed: keep what is known else")
    parser.add_argument("words", nargs="*", default=["tests"], help="arguments of pytest")
    given = parser.parse_args()
    if given.more:
        known = json.loads(MAP.read_text(encoding="utf-8"))
        MAP.write_text(json.dumps(merged(known, run_tests(given.site, given.words))), encoding="utf-8")
    else:
        MAP.unlink(missing_ok=True)
    lines = executed(given.site, given.words).lines
    for name, (run, count) in sorted(lines.items()):
        if count and run < LITTLE * count:
            print(f"{100 * run / count:3.0f} %  {run:4d} of {count:4d}  {name}")
    run, count = (sum(pair[i] for pair in lines.values()) for i in (0, 1))
    print(f"{100 * run / count:.1f} % of {count} lines of {len(lines)} modules")
    return 0


if __name__ == "__main__":
    sys.exit(main())
