"""A manifest for a folder of scans: what can be seen is inferred, what cannot is assumed and said."""

import json
import re
from collections.abc import Sequence
from pathlib import Path

from pipeline.load import SUFFIXES, load, read_header
from pipeline.load.common import on_common_box
from pipeline.load.config import LoadConfig
from pipeline.load.dicom import series_in
from pipeline.load.geometry import LoadError, unusable
from pipeline.load.guard import is_folder
from pipeline.load.order import in_order
from pipeline.load.slices import is_dicom, is_multiframe
from pipeline.model import Array, Volume, Wall
from pipeline.study.first_wire import NOWHERE, infer_entry, wire_voxels
from pipeline.study.same_grid import apart
from reports.case_files import listed
from reports.texts import TEXT_BYTES

NO_REFERENCE = "reference: none found (a file named reference.*); --reference names a scan without the wire"
REFERENCE_NAMES = ("reference", "ref", "wire_free", "nowire", "empty")
DEFAULT_RADIUS_MM = 0.18
PACKED = ".zip", ".7z", ".rar", ".tar", ".tgz", ".gz", ".bz2", ".xz"
UNSUBTRACTED = (
    "; without a reference to subtract the brightest thing there may be a filled vessel or a bone: such a guess is "
    "several mm off, look at the first frame and correct both, or scan the phantom without the wire"
)
SEED = (
    "lumen_seed_mm: the entry, from where the vessel is segmented in the first frame, with the wire in it: name a "
    "point in the filled vessel beyond the wire's tip"
)
HOW_TO_CORRECT = """# entry_mm: where the wire enters the vessel; entry_direction: from there the way it is pushed.
# Both in LPS mm: 3D Slicer shows R A S, change the signs of the first two numbers.
"""
SEED_LINE = "# lumen_seed_mm = [[x, y, z]]      # in the vessel beyond the wire's tip of the first frame, LPS mm\n"
MANIFEST = """schema = 1

[wires.assumed]
radius_mm = {radius}
bending_stiffness_N_mm2 = [[0.0, 0.5], [30.0, 5.0], [100.0, 40.0]]
rest_curvature_per_mm = [[0.0, 0.15], [10.0, 0.15], [10.0, 0.0]]

[[case]]
id = "{id}"
{reference}frames = [{frames}]
assumed = [
{assumed}]
{how}entry_mm = {entry}
entry_direction = {direction}
{seed}# material_axis = [x, y, z]        # where the curved tip points at roll 0; left out: follows entry_direction
wire = "assumed"
[case.wall]
stiffness_N_mm2 = {wall.stiffness_N_mm2}
friction = {wall.friction}
"""


def _is_scan(path: Path) -> bool:
    """A volume in a file, or a folder with DICOM in it."""
    if is_folder(path):
        return path.name != "frames" and any(_is_dicom(p) for p in path.iterdir())
    return path.name.lower().endswith(SUFFIXES) or (_is_dicom(path) and is_multiframe(path))


def _is_dicom(path: Path) -> bool:
    return path.is_file() and path.stat().st_size > 0 and path.name != "DICOMDIR" and is_dicom(path)


DEEPEST = 4
"""Folders below the given one in which scans are looked for, for the message alone."""


def _cases(folder: Path) -> str:
    """A hint where the folder holds several that look like a case each, with frames or a reference; empty without."""
    below = [p for p in sorted(folder.iterdir()) if is_folder(p) and p.name != "frames" and not _is_scan(p)]
    found = [p for p in below if is_folder(p / "frames") or any(map(looks_wire_free, p.iterdir()))]
    if len(found) < 2:
        return ""
    name, first = folder.resolve().name, found[0].name
    return (
        f"; {name} holds {len(found)} folders that look like cases: {listed([p.name for p in found], 3)}; run `wireval "
        f"init` on each, as on {name}/{first}, then put their [[case]] blocks and one [wires.assumed] into one "
        f"{name}/manifest.toml, with {first}/ and so on before their paths"
    )


def _studies(folder: Path) -> str:
    """A hint where folders in it have manifests, not inferred ones, which a run leaves in its output; empty without."""
    found = [p for p in sorted(folder.glob("*/*.toml")) if not p.name.endswith(".inferred.toml") and states_cases(p)]
    if not found:
        return ""
    names = listed([p.relative_to(folder).as_posix() for p in found], 3)
    return (
        f"; below it {'is a manifest' if len(found) == 1 else 'are manifests'}: {names}; give one, as {found[0]}"
        + "; to judge several together join them into one manifest" * (len(found) > 1)
    )


def states_cases(file: Path) -> bool:
    """Whether a TOML file states cases: one that was inferred from the scans beside it would be judged instead."""
    return file.is_file() and re.search(rb"^\s*\[\[\s*case\s*\]\]", file.read_bytes()[:TEXT_BYTES], re.M) is not None


def _deeper(folder: Path) -> str:
    """A hint where scans lie further down than they are looked for, as archives export them; empty without."""
    below = (p for depth in range(2, DEEPEST + 1) for p in sorted(folder.glob("/".join("*" * depth))))
    found = [p.relative_to(folder).as_posix() for p in below if p.parent.name != "frames" and _is_scan(p)]
    if not found:
        return ""
    return (
        f"; further down are scans: {listed(found, 3)}; move each frame's own folder or file up into "
        f"{folder.resolve().name}/frames, or list them in a manifest (frames = [...])"
    )


def _packed(folder: Path) -> str:
    """A hint where what lies in the folder is packed, as data sets are handed out; empty where it is not.

    A .nii.gz is a scan as it is.
    """
    found = next((p.name for p in sorted(folder.iterdir()) if p.suffix.lower() in PACKED and not _is_scan(p)), "")
    return f"; {found} is packed: unpack it" * bool(found)


def _loose(folder: Path) -> str:
    """A hint where slices lie in frames/ itself, which holds a folder or a file for each frame; empty without."""
    frames = folder / "frames"
    if not is_folder(frames) or not any(_is_dicom(p) for p in frames.iterdir()):
        return ""
    series, _ = series_in(frames)
    count, slices = len(series), sum(map(len, series.values()))
    of = "one series" if count == 1 else f"{count} series"
    return f"; frames/ holds {slices} slices of {of}: one folder a series, as in frames/0, frames/1" * bool(count)


def _items(folder: Path) -> str:
    """A hint where an HDF5 file lies, whose items only a manifest names; empty without."""
    found = next((p.name for p in sorted(folder.iterdir()) if p.suffix.lower() in (".h5", ".hdf5")), "")
    return f'; {found}: name its items in a manifest, as frames = "{found}#/frames"' * bool(found)


def looks_wire_free(path: Path) -> bool:
    """Whether a file is named as a scan without the wire: reference.mha, empty_phantom.nii.gz."""
    stem = path.name.lower().split(".")[0]
    return any(stem == name or stem.startswith((f"{name}_", f"{name}-")) for name in REFERENCE_NAMES)


def beside(frames: Sequence[Path]) -> list[Path]:
    """Scans that are named as ones without the wire, in the folder of a case's frames and in that above it."""
    places = dict.fromkeys(place for path in frames for place in (path.parent, path.parent.parent))
    found = [p for place in places if place.is_dir() for p in sorted(place.iterdir()) if looks_wire_free(p)]
    return [p for p in found if _is_scan(p) and p not in frames]


def _scans_in(folder: Path, stated: Path | None) -> tuple[Path | None, list[Path], list[Path]]:
    """The reference, stated or by its name, the frames, and what is neither: named as a reference beside a stated one.

    Raises LoadError where two scans have such a name and none is stated.
    """
    scans = (p for p in (*folder.iterdir(), *folder.glob("frames/*")) if _is_scan(p))
    below = in_order(scans, lambda p: p.relative_to(folder).as_posix())
    if not below and _is_scan(folder):
        return None, [folder], []
    named = [p for p in below if looks_wire_free(p)]
    if stated is None and len(named) > 1:
        names = " and ".join(p.relative_to(folder).as_posix() for p in named)
        raise unusable(folder, f"{names}: each has the name of a scan without wire; say which: --reference FILE")
    reference = stated or next(iter(named), None)
    others = [p for p in below if reference is None or not p.samefile(reference)]
    return reference, [p for p in others if p not in named], [p for p in others if p in named]


def _named(path: Path, base: Path | None) -> str:
    """A path as TOML writes it: a JSON text, whatever quotes and backslashes are in it."""
    near = base is not None and path.is_relative_to(base)
    return json.dumps((path.relative_to(base) if base and near else path.resolve()).as_posix(), ensure_ascii=False)


def _stated_or_seen(
    entry: Array | None, direction: Array | None, frames: Sequence[Path], reference: Path | None, config: LoadConfig
) -> tuple[Array, Array, str]:
    """Entry and direction, each as the frames show it where it is not stated; a sentence on what is not.

    LoadError where the scans that are subtracted for it do not lie on one grid.
    """
    if entry is not None and direction is not None:
        return entry, direction, ""

    looked_at = [reference, frames[0], frames[-1]] if reference else frames[:1]
    headers = dict(zip(looked_at, on_common_box([read_header(path, config) for path in looked_at]), strict=True))
    if problems := apart([*headers.values()]):
        raise LoadError(problems[0])

    def loaded(path: Path) -> Volume:
        return load(headers[path], config=config)

    empty, last = loaded(reference) if reference else None, NOWHERE
    if empty is not None and len(frames) > 1:
        final = loaded(frames[-1])
        last = final.to_mm(wire_voxels(final, empty))
    at, towards, which = infer_entry(loaded(frames[0]), empty, frames[0], last)
    guessed = " and ".join(name for name, of in (("entry_mm", entry), ("entry_direction", direction)) if of is None)
    where = f"{guessed}: {which}{'' if reference else UNSUBTRACTED}"
    return at if entry is None else entry, towards if direction is None else direction, where


def infer_manifest(
    folder: Path,
    entry: Array | None,
    direction: Array | None,
    radius_mm: float | None,
    config: LoadConfig,
    base: Path | None = None,
    reference: Path | None = None,
) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
    """The text of a manifest for one case from a folder of scans; in sentences what was seen, and what is assumed.

    base : folder from which scans are named; None names them in full.     reference : None looks for one.
    Raises LoadError where there is nothing to go by.
    """
    reference, frames, left_out = _scans_in(folder, reference)
    if not frames:
        allowed = f"files {', '.join(SUFFIXES)} or DICOM folders, here or in frames/"
        found = f"{reference.name} alone, a reference, and no frames" if reference else "no scans"
        hint = next(filter(None, (look(folder) for look in (_studies, _loose, _items, _cases, _deeper, _packed))), "")
        raise unusable(folder, f"found {found}; allowed: {allowed}{hint}")
    seen = (
        f"frames: {len(frames)} scans in natural order, {_order([path.name for path in frames])}",
        f"reference: {reference.name}" if reference else NO_REFERENCE,
        *(f"left out: {path.name}, named as a scan without wire" for path in left_out),
    )
    entry, direction, where = _stated_or_seen(entry, direction, frames, reference, config)
    notes = _assumed(radius_mm, [where] * bool(where) + [SEED] * (reference is None))
    text = MANIFEST.format(
        radius=radius_mm or DEFAULT_RADIUS_MM,
        id=re.sub(r"[^A-Za-z0-9._-]", "_", folder.resolve().name).lstrip("._-") or "case",
        assumed="".join(f"  {json.dumps(note)},\n" for note in notes),
        reference=f"reference = {_named(reference, base)}\n" if reference else "",
        frames=", ".join(_named(p, base) for p in frames),
        entry=[round(float(x), 3) for x in entry],
        direction=[round(float(x), 5) for x in direction],
        how=HOW_TO_CORRECT * bool(where),
        seed=SEED_LINE * (reference is None),
        wall=Wall(),
    )
    return text, seen, tuple(notes)


def _order(names: Sequence[str]) -> str:
    """The first and the last name; where the order is not that of a folder's listing, the first few one by one."""
    if [*names] == sorted(names):
        return f"{names[0]} to {names[-1]}"
    return f"which is not the alphabetical one: {listed(names)}"


def _assumed(radius_mm: float | None, places: Sequence[str]) -> list[str]:
    """What nobody has said of a case. radius_mm : where it was said.     places : sentences on entry and seed."""
    stiffness = "stiffness and tip curve of a common 0.014 inch wire"
    return [
        f"wire: {stiffness}" if radius_mm else f"wire: radius {DEFAULT_RADIUS_MM} mm, {stiffness}",
        *places,
        "material_axis: the world axis least along entry_direction, as nothing tells of it",
        f"wall: {Wall().stiffness_N_mm2} N/mm2, friction {Wall().friction:g}",
        'roll_deg: 0, that is, a curved tip bends towards material_axis; roll_deg = "fit" where it is unknown',
        "insertion_mm: not given, so the traced lengths are not checked against anything",
    ]
