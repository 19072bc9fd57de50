"""A scene of 3D Slicer (.mrml) that opens what lies in a case's folder ``view``, with names and colours.

The lumen as a surface to look into and as a segmentation in the slices; every frame's wires, of which those of one
frame are switched on. Models are lines with arrays (error_mm, ...), curves have measurements.
"""

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from reports import colours
from reports.atomic import write_bytes

_COLOURS = {"traced": colours.TRACED, "simulated": colours.SIMULATED, "true": colours.TRUE}
_WIRE = re.compile(r"wire_(traced|simulated|true)_(\d+)\.(vtp|mrk\.json)")


class _Thing(NamedTuple):
    """A file of the scene: its node's tag, those of its storage, what its display node says."""

    tag: str
    storage: str
    name: str
    file: str
    display: dict[str, str]


def write_scene(folder: Path, shown: int) -> Path | None:
    """Write scene.mrml over the files of ``folder``, frame ``shown`` switched on; None where there is none of them."""
    things = list(_things(folder, shown))
    if not things:
        return None
    root = ET.Element("MRML", version="Slicer5.0.0", userTags="")
    for number, thing in enumerate(things, start=1):
        _add(root, thing, number)
    ET.indent(root, " ")
    path = folder / "scene.mrml"
    write_bytes(path, ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")
    return path


def _things(folder: Path, shown: int) -> Iterator[_Thing]:
    files = sorted(path.name for path in folder.glob("[!.]*"))
    if "lumen.vtp" in files:
        glass = {"color": _triple(colours.LUMEN), "opacity": "0.3", "visibility": "true", "backfaceCulling": "false"}
        yield _Thing("Model", "ModelStorage", "lumen", "lumen.vtp", glass)
    if "lumen.seg.nrrd" in files:
        flat = {"visibility": "true", "visibility3D": "false", "opacity": "0.5"}
        yield _Thing("Segmentation", "SegmentationStorage", "lumen, segmented", "lumen.seg.nrrd", flat)
    for file in files:
        if found := _WIRE.fullmatch(file):
            kind, frame, ending = found.groups()
            seen = "true" if int(frame) == shown and ending == "vtp" else "false"
            look = {"color": _triple(_COLOURS[kind]), "visibility": seen}
            if ending == "vtp":
                yield _Thing("Model", "ModelStorage", f"{kind} {frame}", file, look | {"lineWidth": "4"})
            else:
                look["selectedColor"] = look["color"]
                yield _Thing("MarkupsCurve", "MarkupsJsonStorage", f"{kind} {frame}, curve", file, look)


def _add(root: ET.Element, thing: _Thing, number: int) -> None:
    """The three nodes of a thing, which find each other by their identifiers: storage, display, the thing itself."""
    display = {"MarkupsCurve": "MarkupsDisplay"}.get(thing.tag, f"{thing.tag}Display")
    storage_id, display_id = (f"vtkMRML{tag}Node{number}" for tag in (thing.storage, display))
    storage = {"id": storage_id, "name": f"{thing.name} file", "fileName": thing.file}
    space = {"coordinateSystem": "LPS"} if thing.tag == "Model" else {}  # the other files say it themselves
    ET.SubElement(root, thing.storage, storage | space)
    ET.SubElement(root, display, {"id": display_id, "name": f"{thing.name} display"} | thing.display)
    references = f"display:{display_id};storage:{storage_id};"
    ET.SubElement(root, thing.tag, id=f"vtkMRML{thing.tag}Node{number}", name=thing.name, references=references)


def _triple(colour: str) -> str:
    return " ".join(f"{value:.4f}" for value in colours.rgb(colour))
