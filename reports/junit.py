"""A JUnit summary on disk: XML knows no control characters, messages of libraries may hold some."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

from reports.atomic import write_bytes

UNKNOWN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What XML 1.0 does not allow (section 2.2, Char)."""


def write_junit(path: Path, root: ET.Element) -> None:
    """Write a summary, less the characters that would make it no XML."""
    for element in root.iter():
        element.text = element.text and UNKNOWN.sub("", element.text)
        for name, value in element.items():
            element.set(name, UNKNOWN.sub("", value))
    write_bytes(path, ET.tostring(root, encoding="utf-8", xml_declaration=True))
