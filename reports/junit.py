"""A JUnit summary for build servers: suites of tests. XML knows no control characters, messages may hold some."""

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from reports.atomic import write_bytes

UNKNOWN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What XML 1.0 does not allow (section 2.2, Char)."""


@dataclass(frozen=True)
class Outcome:
    """What became of one test, in how many seconds.

    kind : the type of a failure.     text : what it has to say beyond its message.
    """

    name: str
    verdict: Literal["passed", "failed", "skipped"] = "passed"
    message: str = ""
    kind: str = ""
    text: str = ""
    seconds: float = 0.0


def write_junit(path: Path, name: str, suites: Sequence[tuple[str, Sequence[Outcome]]]) -> None:
    """Write suites (name, tests), less the characters that would make it no XML."""
    root = ET.Element("testsuites", name=name)
    for title, tests in suites:
        _add(root, title, tests)
    for element in root.iter():
        element.text = element.text and UNKNOWN.sub("", element.text)
        for key, value in element.items():
            element.set(key, UNKNOWN.sub("", value))
    write_bytes(path, ET.tostring(root, encoding="utf-8", xml_declaration=True))


def _add(root: ET.Element, name: str, tests: Sequence[Outcome]) -> None:
    failed, skipped = (sum(test.verdict == verdict for test in tests) for verdict in ("failed", "skipped"))
    counts = {"tests": len(tests), "failures": failed, "errors": 0, "skipped": skipped}
    suite = ET.SubElement(root, "testsuite", {"name": name, **{key: str(n) for key, n in counts.items()}})
    for test in tests:
        # of what is not timed 0, as of tables that are read: some build servers refuse a test without a time
        case = ET.SubElement(suite, "testcase", classname=name, name=test.name, time=f"{test.seconds:.3f}")
        if test.verdict == "failed":
            ET.SubElement(case, "failure", type=test.kind, message=test.message).text = test.text
        elif test.verdict == "skipped":
            ET.SubElement(case, "skipped", message=test.message)
