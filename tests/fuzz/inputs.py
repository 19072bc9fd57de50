"""What is malformed: manifests, volumes, curves, surfaces and settings, drawn from a seed."""

from __future__ import annotations

import gzip
import json
import os
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.load import Source
from tests.fuzz.harness import Input
from tests.studies.formats import variants

BAD = ("nan", "inf", "-inf", "-1", "1e300", "-1e300", '""', '"text"', "true", "[]", "{}", "[[]]", '["a"]', "[nan]",
       "1979-05-27", "[1, 2]", "[1, 2, 3, 4]", "[nan, 0, 0]", "[inf, 0, 0]", '["a", "b", "c"]', "0")  # fmt: skip
NEVER = {
    "id": ("nan", "-1", '""', '"a/b"', '".."', '"a b"', '"' + "x" * 300 + '"', "true", "[]", '"a\\nb"', '"<b>"'),
    "role": ('"x"', "1", "true"),
    "frames": ("[]", '""', '[""]', "1", "true", '"nothing*"', '"/**/*.mha"', '"../*.mha"', '"no.mha"', '"[*.mha"',
               '"' + "x" * 300 + '.mha"', '"a\\u0000b"', '["frames"]', '"/proc/self/mem"', '"/dev/zero"', '"fifo"',
               '"manifest.toml"', '"**/**/**/..*"', '"' + "x/" * 3000 + '"', '"loop"', '"."'),
    "reference": ('""', '"no.mha"', '"../ref.mha"', '"/dev/zero"', '"fifo"', "1", "[]", '"frames"', '"manifest.toml"',
                  '"' + "y" * 300 + '"'),
    "entry_mm": (*BAD[:14], "[1, 2]", "[1, 2, 3, 4]", "[nan, 0, 0]", "[inf, 0, 0]", "[1e9, 0, 0]", "[5000, 0, 0]"),
    "entry_direction": (*BAD[:14], "[0, 0, 0]", "[nan, 0, 1]", "[1, 2]", "[inf, 0, 0]"),
    "material_axis": (*BAD[:14], "[0, 0, 0]", "[nan, 0, 1]"),
    "wire": ('"none"', "1", "[]", '""'),
    "insertion_mm": ("[]", "[nan]", "[inf]", "[-1]", "[0]", "[1e9]", '["a"]', "5", "true", "[1, 2, 3, 4, 5, 6, 7]"),
    "spacing_mm": ("0", "[0, 0, 0]", "[nan, 1, 1]", "[-1, 1, 1]", "[1, 1]", "[1e-9, 1, 1]", "[1e9, 1, 1]", '"a"'),
    "lumen": ('""', '"no.stl"', "1", "[]", "{}", '{file = ""}', '{file = "reference.mha", label = 0}',
              '{file = "reference.mha", level = 2}', '{file = "reference.mha", label = 1, level = 0.5}', '"fifo"',
              '{file = "reference.mha", label = "artery"}', '{files = "reference.mha"}', '"/dev/zero"', '"frames"',
              '"reference.mha"'),
    "traces": ("[]", '""', '"no*.csv"', "1", '"reference.mha"', '"/dev/zero"', '"fifo"'),
    "roll_deg": ("nan", "inf", '"fit"', '"a"', "[nan]", "[1, 2, 3, 4, 5, 6, 7]", "true", "1e300"),
    "lumen_seed_mm": ("[]", "[[nan, 0, 0]]", "[[1, 2]]", "1", "[[5000, 0, 0]]"),
    "truth": ('""', '"no.json"', '"manifest.toml"', '"fifo"', '"reference.mha"'),
    "parameters": ('"x.toml"',),
    "down": ("[0, 0, 0]", "[nan, 0, 0]", "1"),
    "entry": ('"case:none"', '"x"', "1", '"case:"'),
    "entry_sigma_mm": ("nan", "-1", '"a"', "inf", "true"),
    "entry_direction_sigma_deg": ("nan", "-1", '"a"', "inf"),
    "group": ('""', "1", "[]"),
    "catheter": ("1", "{}", "{radius_mm = nan, bending_stiffness_N_mm2 = 1, insertion_mm = 1}"),
    "wall": ("1", "{stiffness_N_mm2 = nan}", "{stiffness_N_mm2 = -1}", "{friction = -1}", "{friction = inf}"),
    "nonsense": ("1",),
}  # fmt: skip
WIRE = {
    "radius_mm": (*BAD[:14], "0", "1e9", "1e-9"),
    "bending_stiffness_N_mm2": (*BAD[:11], "0", "[[0, nan]]", "[[1, 1], [0, 1]]", "[[0, 0]]", "[[inf, 1]]", "1e300"),
    "rest_curvature_per_mm": ("nan", "inf", '"a"', "[[0, nan]]", "[[nan, 0]]", "1e300", "[]", "true"),
    "torsional_stiffness_N_mm2": ("nan", "-1", "0", '"a"', "true"),
    "weight_N_per_mm": ("nan", "-1", "inf", "2", '"a"'),
    "nonsense": ("1",),
}
SETTINGS = {
    "load.most_gib": ("nan", "-1", "0", "a", "inf", "1e9", "1e-6"),
    "load.resample": ("nan", "2", "a"),
    "segment.threshold": ("-1", "nan", "2", "a", "[]", "true"),
    "segment.margin_mm": ("-1", "nan", "inf", "1e9", "a"),
    "segment.outer_mm": ("nan", "-1", "0", "1e9", "a", "true"),
    "segment.homogeneity_sigma": ("nan", "-1", "0", "a"),
    "segment.feature_sigma": ("nan", "-1", "0", "a"),
    "segment.adjacency": ("5", "-1", "nan", "a"),
    "segment.scale": ("-1", "nan", "a", "1e9", "0.5"),
    "segment.other_seeds_mm": ("nan", "[[nan,0,0]]", "[1,2,3]", "a"),
    "segment.least_voxels": ("-1", "nan", "a", "1e300"),
    "trace.length_tolerance_mm": ("-1", "nan", "a"),
    "trace.ridge_voxels": ("-1", "0", "nan", "1e9", "a"),
    "trace.longest_gap_mm": ("-1", "nan", "1e9", "a"),
    "trace.rotation_axis": ("nan", "[0,0,0]", "[1,2]", "[nan,0,0]"),
    "trace.in_plane_deg": ("-1", "nan", "91", "a"),
    "trace.register": ("a", "1", "true"),
    "trace.register_skip_voxels": ("-1", "nan", "a"),
    "solver.method": ("a", "1", "nan"),
    "solver.segment_mm": ("nan", "-1", "0", "1e-6", "a", "inf", "1e9"),
    "solver.hull": ("a", "samples:0", "samples:-1", "samples:1000000", "1"),
    "solver.tolerance": ("nan", "-1", "0", "1", "2", "a"),
    "solver.max_iterations": ("0", "-1", "nan", "1e300", "a", "1.5"),
    "solver.step_mm": ("nan", "-1", "0", "1e-6", "1e-12", "a", "inf"),
    "solver.finest_mm": ("nan", "-1", "0", "1e-6", "a"),
    "solver.initial": ("a", "1"),
    "simulate.depth": ("a", "1"),
    "simulate.entry": ("a", "1"),
    "simulate.bending_scale": ("nan", "-1", "0", "inf", "1e300", "a"),
    "simulate.wall_scale": ("nan", "-1", "0", "inf", "1e300", "a"),
    "simulate.roll_offset_deg": ("nan", "inf", "1e300", "a"),
    "compare.sample_mm": ("nan", "-1", "0", "1e-6", "1e9", "a"),
    "compare.skip_mm": ("-1", "nan", "1e9", "a"),
    "compare.simulated_nulls": ("nan", "2", "a"),
    "simulate.taper_scale": ("nan", "-1", "0", "inf", "1e300", "a"),
    "simulate.rest_curvature_scale": ("nan", "-1", "inf", "1e300", "a"),
    "simulate.friction": ("nan", "-1", "inf", "1e300", "a"),
    "no.such": ("1",),
    "segment": ("1",),
}


def replaced(text: str, key: str, value: str, table: str) -> str:
    """The manifest with a key of its first case, or of its wire, set to a value."""
    lines = [line for line in text.splitlines() if not line.startswith(f"{key} =")]
    at = next(i for i, line in enumerate(lines) if line.startswith(table))
    return "\n".join([*lines[: at + 1], f"{key} = {value}", *lines[at + 1 :]]) + "\n"


def in_manifest(key: str, value: str, table: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        os.mkfifo(folder / "fifo")
        (folder / "loop").symlink_to(folder / "loop")
        path = folder / "manifest.toml"
        path.write_text(replaced(path.read_text(encoding="utf-8"), key, value, table))

    return make


def manifests(rng: np.random.Generator, count: int) -> Iterator[Input]:
    for table, keys in (("[[case]]", NEVER), ("[wires", WIRE)):
        for key, values in keys.items():
            for value in values:
                yield Input("manifest", f"{key} = {value[:60]}", in_manifest(key, value, table), True)
    raw = {
        "not UTF-8": b"\xff\xfe\x00schema = 1", "latin-1": 'id = "\u00e9"'.encode("latin-1"), "empty": b"",
        "nested": b"x = " + b"[" * 20000 + b"]" * 20000, "dotted": b".".join([b"a"] * 5000) + b" = 1",
        "case = [1]": b"schema = 1\ncase = [1]\n[wires]\n", "case = 1": b"schema = 1\ncase = 1\nwires = 1\n",
        "schema = true": b"schema = true\ncase = []\n", "a long number": b"schema = " + b"9" * 10000,
        "NUL": b"schema = 1\0", "huge": b"# " + b"x" * (20 * 2**20), "BOM": b"\xef\xbb\xbfschema = 2\n",
    }  # fmt: skip
    for name, content in raw.items():
        yield Input("manifest", name, lambda f, c=content: (f / "manifest.toml").write_bytes(c) and None, True)
    yield Input("manifest", "a name that is not UTF-8", not_utf8, False)
    for k in range(count):
        yield Input("manifest", f"random {k}", random_manifest(int(rng.integers(2**31))), False)


def not_utf8(folder: Path) -> None:
    """A sound frame under a name that is no text."""
    (frame,) = (folder / "frames").iterdir()
    frame.rename(frame.with_stem(os.fsdecode(b"\xff\xfe")))
    path = folder / "manifest.toml"
    found = json.dumps(f"frames/*{frame.suffix}")
    path.write_text(replaced(path.read_text(encoding="utf-8"), "frames", found, "[[case]]"), encoding="utf-8")


def random_manifest(seed: int) -> Callable[[Path], None]:
    """Bytes changed, cut or doubled, or a key set to any bad value."""

    def make(folder: Path) -> None:
        rng = np.random.default_rng(seed)
        path = folder / "manifest.toml"
        text = path.read_text(encoding="utf-8")
        if rng.random() < 0.5:
            key = rng.choice([*NEVER, "radius_mm"])
            table = "[wires" if key == "radius_mm" else "[[case]]"
            path.write_text(replaced(text, str(key), str(rng.choice(BAD)), table), encoding="utf-8")
        else:
            path.write_bytes(mutated(text.encode(), rng))

    return make


def mutated(raw: bytes, rng: np.random.Generator, within: int | None = None) -> bytes:
    """Some bytes changed, a piece cut out, doubled or moved, within the first ``within``."""
    data, end = bytearray(raw), min(within or len(raw), len(raw))
    how = rng.integers(5)
    a, b = sorted(int(n) for n in rng.integers(0, max(end, 1), 2))
    if how == 0:
        for at in rng.integers(0, end, int(rng.integers(1, 8))):
            data[at] = int(rng.integers(256))
    elif how == 1:
        del data[a : min(b, a + 40)]
    elif how == 2:
        data[a:a] = data[a : min(b, a + 40)]
    elif how == 3:
        del data[max(a, 1) :]
    else:
        digits = [i for i in range(end) if chr(data[i]).isdigit()]
        for at in rng.choice(digits or [0], min(3, len(digits) or 1)):
            data[at] = int(rng.choice(list(b"0123456789-.en")))
    return bytes(data)


def volumes(rng: np.random.Generator, count: int) -> Iterator[Input]:
    for variant in variants():
        if variant.want.startswith("!"):
            yield Input("volume", variant.name, as_frame(variant.write), True, "trace")
    suffixes = ("mha", "mhd", "nrrd", "nhdr", "nii", "nii.gz", "h5", "dcm")
    for k in range(count):
        suffix, seed = suffixes[k % len(suffixes)], int(rng.integers(2**31))
        yield Input("volume", f"random {suffix} {k}", random_volume(suffix, seed), False, "trace")


def as_frame(write: Callable[[Path], Path | Source]) -> Callable[[Path], None]:
    """The manifest with another scan as its one frame, or as its reference."""

    def make(folder: Path) -> None:
        (folder / "other").mkdir()
        made = write(folder / "other")
        name = f"{made.path}#{made.dataset}" if isinstance(made, Source) else str(made)
        path = folder / "manifest.toml"
        path.write_text(replaced(path.read_text(encoding="utf-8"), "frames", json.dumps(name), "[[case]]"))

    return make


def random_volume(suffix: str, seed: int) -> Callable[[Path], None]:
    """The study's own frame in a format, its header's bytes changed."""

    def make(folder: Path) -> None:
        import h5py
        import SimpleITK as sitk

        rng = np.random.default_rng(seed)
        (folder / "other").mkdir()
        image = sitk.ReadImage(str(next((folder / "frames").iterdir())))
        path = folder / "other" / f"a.{suffix}"
        name = str(path)
        if suffix == "h5":
            with h5py.File(path, "w") as file:
                data = file.create_dataset("volume", data=sitk.GetArrayFromImage(image))
                turn = np.array(image.GetDirection()).reshape(3, 3)
                data.attrs.update(spacing_mm=image.GetSpacing(), origin_mm=image.GetOrigin(), direction=turn)
        elif suffix == "dcm":
            path, name = slices(folder / "other", image), str(folder / "other")
        else:
            sitk.WriteImage(image, str(path), useCompression=bool(rng.integers(2)))
        raw = path.read_bytes()
        if suffix == "nii.gz" and rng.random() < 0.7:
            path.write_bytes(gzip.compress(mutated(gzip.decompress(raw), rng, 352), 1))
        else:
            path.write_bytes(mutated(raw, rng, {"nii": 352, "h5": 4000}.get(suffix, 600)))
        manifest = folder / "manifest.toml"
        manifest.write_text(replaced(manifest.read_text(encoding="utf-8"), "frames", json.dumps(name), "[[case]]"))

    return make


def slices(folder: Path, image: Any) -> Path:
    """A DICOM series of an image; returns one of its files."""
    import SimpleITK as sitk
    from pydicom.uid import ExplicitVRLittleEndian

    from tests.studies.formats.dicom import one

    values, origin, gap = sitk.GetArrayFromImage(image).T, np.array(image.GetOrigin()), image.GetSpacing()[2]
    for k in range(values.shape[2]):
        spacing = [image.GetSpacing()[1], image.GetSpacing()[0]]
        data = one(values[:, :, k], origin + [0, 0, gap * k], ExplicitVRLittleEndian, PixelSpacing=spacing)
        data.save_as(folder / f"{k:03d}.dcm")
    return folder / "007.dcm"


def given(key: str, name: str, content: bytes) -> Callable[[Path], None]:
    """A file with a content, named under a key of the case."""

    def make(folder: Path) -> None:
        (folder / name).write_bytes(content)
        path = folder / "manifest.toml"
        path.write_text(replaced(path.read_text(encoding="utf-8"), key, json.dumps(name), "[[case]]"))

    return make


def markups(points: Any, **more: Any) -> bytes:
    each = [{"position": list(p)} for p in points]
    return json.dumps({"markups": [{"type": "Curve", "controlPoints": each, **more}]}).encode()


LINE = [[0.0, 0.0, float(z)] for z in range(8)]


def curves(rng: np.random.Generator, count: int) -> Iterator[Input]:
    table = "x_mm,y_mm,z_mm\n" + "\n".join(",".join(map(str, p)) for p in LINE)
    bad = {
        "a.csv": (b"", b"\xff\xfe", b"x_mm,y_mm,z_mm\n", b"1,2,3", b"1,2,nan\n3,4,5", b"1,2\n3,4", b"a,b\n1,2",
                  table.replace("7.0", "1e9").encode(), table.replace("7.0", "inf").encode(), b"\0" * 100,
                  b'"' * 100000, b"1,2,3\n" * 3, b"x" * (17 * 2**20)),
        "a.mrk.json": (b"{}", b"[]", b"1", b"nonsense", b"[" * 100000, b'{"markups": 1}', b'{"markups": [1]}',
                       markups([]), markups([[1, 2]]), markups([["a", 1, 2]] * 3), markups(LINE, coordinateUnits="ell"),
                       markups(LINE, coordinateSystem="XYZ"), markups([[0, 0, float("nan")]] * 3),
                       b'{"markups": [{"controlPoints": [{"position": null}]}]}',
                       b'{"markups": [{"controlPoints": 1}]}',
                       markups([[0, 0, 1e9 * k] for k in range(3)])),
        "a.vtp": (b"", b"<VTKFile/>", b"<a>" * 50000, b"nonsense", entities(), vtp(LINE, lines=[0, 99]),
                  vtp(LINE, lines=[0, -1]), vtp([[0, 0, float("nan")]] * 3), bomb()),
        "a.txt": (table.encode(),),
    }  # fmt: skip
    for name, contents in bad.items():
        for k, content in enumerate(contents):
            yield Input("curve", f"{name} {k}", given("traces", name, content), True)
    whole = {"a.csv": table.encode(), "a.mrk.json": markups(LINE), "a.vtp": vtp(LINE, lines=range(8))}
    truth = json.dumps({"frames": [{"insertion_mm": 7.0, "roll_deg": 0.0, "points_mm": LINE}]}).encode()
    for k, content in enumerate((b"", b"{}", b"[]", b'{"frames": 1}', b'{"frames": []}', b'{"frames": [1]}',
                                 truth.replace(b"7.0]", b"NaN]"), truth.replace(b"7.0]", b"1e9]"), b"[" * 100000,
                                 b'{"frames": [{"points_mm": []}]}', b'{"frames": [{"points_mm": [[1, 2]]}]}',
                                 b'{"frames": [{"points_mm": [[1, 2, 3]]}]}', truth + b"x")):  # fmt: skip
        yield Input("curve", f"truth {k}", given("truth", "t.json", content), True)
    for k in range(count):
        name = list(whole)[k % 3]
        yield Input("curve", f"random {name} {k}", given("traces", name, mutated(whole[name], rng)), False)


def entities() -> bytes:
    text = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10 if k else "x"}">' for k in range(12))
    return f"<!DOCTYPE a [{text}]><VTKFile>&e11;</VTKFile>".encode()


def vtp(points: Any, lines: Any = (), triangles: Any = ()) -> bytes:
    numbers = " ".join(str(v) for p in points for v in p)
    cells = "".join(
        f'<{kind}><DataArray type="Int64" Name="connectivity" format="ascii">{" ".join(map(str, flat))}</DataArray>'
        f'<DataArray type="Int64" Name="offsets" format="ascii">{ends}</DataArray></{kind}>'
        for kind, flat, ends in (
            ("Lines", list(lines), str(len(lines))),
            ("Polys", [i for t in triangles for i in t], " ".join(str(3 * k + 3) for k in range(len(triangles)))),
        )
        if len(flat)
    )
    head = '<VTKFile type="PolyData" byte_order="LittleEndian"><PolyData><Piece><Points>'
    array = f'<DataArray type="Float64" NumberOfComponents="3" format="ascii">{numbers}</DataArray>'
    return f"{head}{array}</Points>{cells}</Piece></PolyData></VTKFile>".encode()


def bomb() -> bytes:
    """Points that unpack to 4 GiB."""
    import base64

    block = zlib.compress(bytes(2**26), 9)
    head = struct.pack("<3I", 64, 2**26, 2**26) + struct.pack("<64I", *[len(block)] * 64)
    packed = base64.b64encode(head) + base64.b64encode(block * 64)
    start = b'<VTKFile type="PolyData" byte_order="LittleEndian" compressor="vtkZLibDataCompressor"><PolyData><Piece>'
    array = b'<Points><DataArray type="Float64" format="binary">' + packed + b"</DataArray></Points>"
    return start + array + b"</Piece></PolyData></VTKFile>"


def tetrahedra(shells: int, size: float, shift: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]) * size
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    points = np.concatenate([corners + shift * k for k in range(shells)])
    return points, np.concatenate([faces + 4 * k for k in range(shells)])


def stl(points: np.ndarray, faces: np.ndarray, count: int | None = None) -> bytes:
    record = np.zeros(len(faces), np.dtype([("n", "<f4", 3), ("c", "<f4", (3, 3)), ("x", "<u2")]))
    record["c"] = points[faces]
    return bytes(80) + struct.pack("<I", len(faces) if count is None else count) + record.tobytes()


def surfaces(rng: np.random.Generator, count: int) -> Iterator[Input]:
    points, faces = tetrahedra(1, 20.0)
    needle = points * [1e5, 0.01, 0.01]
    tree = "\n".join(f"{k + 1} 0 0 0 {k} 1.5 {k if k else -1}" for k in range(8))
    shells, many = tetrahedra(5000, 20.0, 0.001)
    bad = {
        "a.stl": (b"", b"x", b"solid\n", stl(points, faces[:3]), stl(needle, faces), stl(points * 1e9, faces),
                  stl(points * np.nan, faces), stl(points, faces, 2**32 - 1), stl(points, faces, 0), stl(shells, many),
                  stl(points * [400, 400, 400], faces), b"vertex a b c\n" * 3, b"vertex 1 2 3\n" * 2),
        "a.vtp": (b"<VTKFile/>", vtp(points, triangles=[[0, 1, 99]]), vtp(points, triangles=[[0, 1, -5]]), bomb(),
                  vtp(points, triangles=faces[:2]), entities(), vtp(points)),
        "a.swc": (b"", b"1 2 3", b"a b c d e f g", tree.replace("1.5", "nan").encode(),
                  tree.replace("1.5", "-1").encode(),
                  tree.replace("1.5", "1e9").encode(), tree.replace("0 0 7", "0 0 1e9").encode(), b"\xff\xff",
                  tree.replace("0 0 7", "0 0 nan").encode(), b"1 0 0 0 0 1 1"),
        "a.mrk.json": (markups(LINE), markups(LINE, measurements=[{"name": "Radius", "controlPointValues": [1]}]),
                       markups(LINE, measurements=1), markups(LINE, measurements=[1]),
                       markups(LINE, measurements=[{"name": "Radius", "controlPointValues": [-1] * 8}])),
        "a.mha": (b"", b"nonsense"), "a.obj": (b"v 1 2 3\n",), "a.seg.nrrd": (b"NRRD0004\n",),
    }  # fmt: skip
    for name, contents in bad.items():
        for k, content in enumerate(contents):
            yield Input("surface", f"{name} {k}", given("lumen", name, content), True)
    whole = {"a.stl": stl(points, faces), "a.vtp": vtp(points, triangles=faces), "a.swc": tree.encode()}
    for k in range(count):
        name = list(whole)[k % 3]
        yield Input("surface", f"random {name} {k}", given("lumen", name, mutated(whole[name], rng)), False)


def settings() -> Iterator[Input]:
    for key, values in SETTINGS.items():
        for value in values:
            yield Input("setting", f"{key}={value}", lambda _f, k=key, v=value: ["--set", f"{k}={v}"], True)


def all_inputs(seed: int, count: int) -> list[Input]:
    """About ``count`` inputs; those that are written out always, the rest random ones from the seed."""
    rng = np.random.default_rng(seed)
    fixed = [*manifests(rng, 0), *volumes(rng, 0), *curves(rng, 0), *surfaces(rng, 0), *settings()]
    rest = max(count - len(fixed), 0)
    kinds = (manifests, 0.3), (volumes, 0.45), (curves, 0.125), (surfaces, 0.125)
    drawn = [i for make, share in kinds for i in make(rng, int(rest * share) + 1) if i.name.startswith("random")]
    return [*fixed, *drawn]
