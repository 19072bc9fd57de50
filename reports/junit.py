"""A JUnit summary: frames of a case as tests, and the file. XML knows no control characters, messages may hold some."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pandas as pd

from reports.atomic import write_bytes
from reports.diff import CLOSING

UNKNOWN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What XML 1.0 does not allow (section 2.2, Char)."""


def add_suite(root: ET.Element, name: str, rows: pd.DataFrame) -> None:
    """A suite of a case's rows of a ``Difference``, a test a frame.

    It fails where one closes the gate, and is skipped where only the second run has it.
    """
    tests = [
        ("case" if pd.isna(frame) else f"frame {frame!s}", group, group[group["verdict"].isin(CLOSING)])
        for frame, group in rows.groupby("frame", dropna=False, sort=False)
    ]
    suite = ET.SubElement(root, "testsuite", name=name, tests=str(len(tests)))
    suite.set("failures", str(sum(len(bad) > 0 for _, _, bad in tests)))
    suite.set("skipped", str(sum(_is_new(group) for _, group, _ in tests)))
    for frame, group, bad in tests:
        test = ET.SubElement(suite, "testcase", classname=name, name=frame)
        if len(bad):
            said = [f"{r.column}: {_text(r.before)} -> {_text(r.after)}" for r in bad.itertuples()]
            failure = ET.SubElement(test, "failure", type=bad["verdict"].iloc[0], message=said[0])
            failure.text = "\n".join(said)
        elif _is_new(group):
            ET.SubElement(test, "skipped", message=f"only the second run has it: {group['after'].iloc[0]}")


def _is_new(rows: pd.DataFrame) -> bool:
    return bool((rows["verdict"] == "new").all())


def _text(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def write_junit(path: Path, root: ET.Element) -> None:
    """Write a summary, less the characters that would make it no XML."""
    for element in root.iter():
        element.text = element.text and UNKNOWN.sub("", element.text)
        for name, value in element.items():
            element.set(name, UNKNOWN.sub("", value))
    write_bytes(path, ET.tostring(root, encoding="utf-8", xml_declaration=True))
