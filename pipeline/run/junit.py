"""A JUnit summary for CI: one test a frame, so that a build server shows which frame failed and why."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

from reports.atomic import write_bytes


def write_junit(path: Path, found: list[dict[str, Any]]) -> None:
    """Write one test suite a case, one test a frame (or one for a case that has no frames to show)."""
    root = ET.Element("testsuites", name="wireval")
    for result in found:
        frames = result["frames"] or [{"frame": "case", **result, "message": result["sentence"]}]
        bad = [f for f in frames if f["status"] not in ("ok", "simulated")]
        suite = ET.SubElement(
            root, "testsuite", name=result["case"], tests=str(len(frames)), failures=str(len(bad)), errors="0"
        )
        for frame in frames:
            test = ET.SubElement(suite, "testcase", classname=result["case"], name=f"frame {frame['frame']}")
            if frame in bad:
                failure = ET.SubElement(test, "failure", type=frame["status"], message=frame["sentence"])
                failure.text = frame["message"]
    write_bytes(path, ET.tostring(root, encoding="utf-8", xml_declaration=True))
