"""A scene of 3D Slicer (.mrml) that opens what lies in a case's folder ``view``, with names and colours.

The lumen as a surface to look into and as a segmentation in the slices; every frame's wires, of which those of one
frame are switched on, and scans, the last in the slices. Models are lines with arrays (error_mm, ...), curves have
measurements.
"""

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from reports import colours
from reports.atomic import write_bytes
from reports.case_files import GOOD

_WIRE = re.compile(rf"wire_({'|'.join(colours.WIRES)})_(\d+)\.(vtp|mrk\.json)")
_DISPLAY = {"MarkupsCurve": "MarkupsDisplay"}  # of the others: their own name with "Display" behind it
_CLASS = {"Volume": "ScalarVolume", "VolumeDisplay": "ScalarVolumeDisplay"}
"""Nodes whose class has another name than their tag."""
_GREY = {"references": "color:vtkMRMLColorTableNodeGrey;", "autoWindowLevel": "1", "visibility": "true"}


class _Thing(NamedTuple):
    """A file of the scene: its node's tag, those of its storage, what its display node says."""

    tag: str
    storage: str
    name: str
    file: str
    display: dict[str, str]


def wire_name(kind: str, frame: int, status: str) -> str:
    """What 3D Slicer calls a wire. status : of its frame, which is named where the wire counts in no score."""
    # not "refused": where the simulation failed, the traced wire is none the worse
    doubtful = kind != "true" and status not in GOOD
    return f"{kind} {frame:03d}" + f" (frame not ok: {status})" * doubtful


def write_scene(
    folder: Path,
    shown: int,
    scans: Mapping[str, Path] | None = None,
    said: str = "",
    statuses: Mapping[int, str] = MappingProxyType({}),
) -> Path | None:
    """Write scene.mrml over the files of ``folder``, frame ``shown`` switched on; None where there is none of them.

    scans : by name, which 3D Slicer reads as they are.     said : what a reader of the scene should know of them.
    statuses : of the frames, for their wires' names; ok where it is not given.
    """
    things = list(_things(folder, shown, statuses))
    if not things:
        return None
    root = ET.Element("MRML", version="Slicer5.0.0", userTags="")
    # by their whole path: results are merged and moved without the scans (cp -r), to folders from which a relative
    # path leads elsewhere, and the same run into another folder gives the same bytes
    files = {name: str(path.absolute()) for name, path in (scans or {}).items()}
    volumes = [_Thing("Volume", "VolumeArchetypeStorage", name, file, _GREY) for name, file in files.items()]
    for number, thing in enumerate([*volumes, *things], start=1):
        _add(root, thing, number)
    if said:
        ET.SubElement(root, "Text", id="vtkMRMLTextNode1", name="about the scans", text=said)
    for view in ("Red", "Green", "Yellow") if volumes else ():
        behind = {
            "layoutName": view,
            "singletonTag": view,
            "references": f"backgroundVolume:{_id('Volume', len(volumes))};",
        }
        ET.SubElement(root, "SliceComposite", {"id": f"vtkMRMLSliceCompositeNode{view}", **behind})
    ET.indent(root, " ")
    path = folder / "scene.mrml"
    write_bytes(path, ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")
    return path


def _things(folder: Path, shown: int, statuses: Mapping[int, str]) -> Iterator[_Thing]:
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
            name = wire_name(kind, int(frame), statuses.get(int(frame), "ok"))
            look = {"color": _triple(colours.WIRES[kind]), "visibility": seen}
            if ending == "vtp":
                yield _Thing("Model", "ModelStorage", name, file, look | {"lineWidth": "4"})
            else:
                look["selectedColor"] = look["color"]
                yield _Thing("MarkupsCurve", "MarkupsJsonStorage", f"{name}, curve", file, look)


def _add(root: ET.Element, thing: _Thing, number: int) -> None:
    """The three nodes of a thing, which find each other by their identifiers: storage, display, the thing itself."""
    display = _DISPLAY.get(thing.tag, f"{thing.tag}Display")
    storage_id, display_id = (_id(tag, number) for tag in (thing.storage, display))
    storage = {"id": storage_id, "name": f"{thing.name} file", "fileName": thing.file}
    space = {"coordinateSystem": "LPS"} if thing.tag == "Model" else {}  # the other files say it themselves
    ET.SubElement(root, thing.storage, storage | space)
    ET.SubElement(root, display, {"id": display_id, "name": f"{thing.name} display"} | thing.display)
    references = f"display:{display_id};storage:{storage_id};"
    ET.SubElement(root, thing.tag, id=_id(thing.tag, number), name=thing.name, references=references)


def _id(tag: str, number: int) -> str:
    return f"vtkMRML{_CLASS.get(tag, tag)}Node{number}"


def _triple(colour: str) -> str:
    return " ".join(f"{value:.4f}" for value in colours.rgb(colour))
