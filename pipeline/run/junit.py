"""A JUnit summary for CI: one test a frame, so that a build server shows which frame failed and why."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

from pipeline.run.results import Result
from reports.atomic import write_bytes


def write_junit(path: Path, found: Sequence[Result]) -> None:
    """Write one test suite a case, one test a frame (or one for a case that has no frames to show)."""
    root = ET.Element("testsuites", name="wireval")
    for result in found:
        whole = {
            "frame": "case",
            "status": result.status,
            "sentence": result.sentence,
            "message": result.sentence,
        }
        frames = result.frames or [whole]
        bad = [f for f in frames if f["status"] not in ("ok", "simulated")]
        suite = ET.SubElement(root, "testsuite", name=result.case, errors="0")
        suite.set("tests", str(len(frames)))
        suite.set("failures", str(len(bad)))
        for frame in frames:
            test = ET.SubElement(suite, "testcase", classname=result.case, name=f"frame {frame['frame']}")
            if frame in bad:
                failure = ET.SubElement(test, "failure", type=frame["status"], message=frame["sentence"])
                failure.text = frame["message"]
    write_bytes(path, ET.tostring(root, encoding="utf-8", xml_declaration=True))
