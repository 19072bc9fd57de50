"""Headers of NIfTI-1 and -2 (.nii, .nii.gz, .hdr + .img), read here: both forms (sform, qform) and their units.

Where both forms are given the sform is used, as nibabel does, unless it is sheared and the qform is not; ITK takes the
qform in some cases.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pipeline.load.geometry import unusable
from pipeline.load.guard import opened, unpacked
from pipeline.load.voxels import Head, Placed, axes_of

TYPES = {2: "u1", 4: "i2", 8: "i4", 16: "f4", 64: "f8", 256: "i1", 512: "u2", 768: "u4", 1024: "i8", 1280: "u8"}
UNITS_MM = {0: 1.0, 1: 1e3, 2: 1.0, 3: 1e-3}
AGREE_VOXELS = 0.1
"""The two forms may lie this far apart at a corner before the header's notes say so."""
RIGHT_ANGLES = 1e-3
"""Cosine between axes up to which a form's matrix is a rotation written with few digits, not a shear."""
LEAST_SPAN = 0.01
"""Volume that the unit axes of a form must span: below it the form is singular, whatever its rounding."""
_FIRST = {
    "size": ("i4", 0), "dim": ("8i2", 40), "datatype": ("i2", 70), "bitpix": ("i2", 72), "pixdim": ("8f4", 76),
    "vox_offset": ("f4", 108),
    "slope": ("f4", 112), "intercept": ("f4", 116), "units": ("u1", 123), "qform": ("i2", 252), "sform": ("i2", 254),
    "quatern": ("3f4", 256), "qoffset": ("3f4", 268), "srow": ("12f4", 280), "magic": ("S4", 344),
}  # fmt: skip
_SECOND = {
    "size": ("i4", 0), "magic": ("S4", 4), "datatype": ("i2", 12), "bitpix": ("i2", 14), "dim": ("8i8", 16),
    "pixdim": ("8f8", 104),
    "vox_offset": ("i8", 168), "slope": ("f8", 176), "intercept": ("f8", 184), "qform": ("i4", 344),
    "sform": ("i4", 348), "quatern": ("3f8", 352), "qoffset": ("3f8", 376), "srow": ("12f8", 400), "units": ("i4", 500),
}  # fmt: skip


def other_half(path: Path) -> Path:
    """The .img of a .hdr, and the other way round, in capitals where that is; any other file is whole."""
    swap = {".hdr": ".img", ".img": ".hdr"}
    other = swap.get(path.suffix.lower(), path.suffix)
    return path.with_suffix(other.upper() if path.suffix.isupper() else other)


def head_of(path: Path) -> Head:
    """What the header says; LoadError where it cannot be a scan."""
    path_of_head = other_half(path) if path.suffix.lower() == ".img" else path
    packing = _packing(path_of_head)
    try:
        with unpacked(path_of_head, packing, 0) as file:
            raw = file.read(540)
    except (EOFError, OSError, ValueError):
        raise unusable(path, "cannot read its header: the packed data are damaged; copy the file again") from None
    fields = _fields(raw)
    if fields is None:
        why = "cannot read it as NIfTI: no header of NIfTI-1 or -2 (Analyze does not say where its axes point)"
        raise unusable(path, f"{why}; convert it, or check that the file is complete")
    whole = bytes(fields["magic"])[:2] == b"n+"
    count = int(fields["dim"][0])
    if not 1 <= count <= 7:
        raise unusable(path, f"dim[0] = {count}; allowed: 3, or 4 for a sequence")
    shape, items = axes_of(path, [int(n) for n in fields["dim"][1 : count + 1]])
    kind = _kind(path, fields)
    data = path_of_head if whole else other_half(path_of_head)
    begin = float(fields["vox_offset"])
    if not np.isfinite(begin) or begin != int(begin) or not (int(fields["size"]) + 4 if whole else 0) <= begin < 2**40:
        raise unusable(path, f"vox_offset {begin:g}; allowed: a whole number beyond the header; correct the header")
    order = fields.dtype["size"].byteorder  # of the record: a number taken out of it is in this machine's order
    (spacing, origin, direction), assumed = _geometry(path, fields, np.array(shape))
    packing = packing if whole else _packing(data)
    if packing:  # the offset counts unpacked bytes
        shift, begin = int(begin), 0.0
    else:
        shift = 0
    slope, intercept = _scale(path, fields)
    return Head(
        path, shape, kind.newbyteorder(order), ((data, int(begin)),), spacing, origin, direction,
        packing=packing, before=shift, items=items, slope=slope, intercept=intercept, assumed=assumed,
    )  # fmt: skip


def _kind(path: Path, fields: Any) -> np.dtype[Any]:
    """The type of the voxels; LoadError for one that is no grey value, or of another size than the header says."""
    number, bits = int(fields["datatype"]), int(fields["bitpix"])
    if number not in TYPES:
        raise unusable(path, f"datatype {number}; allowed: {sorted(TYPES)} (grey values); convert it")
    kind = np.dtype(TYPES[number])
    if bits not in (0, 8 * kind.itemsize):
        why = f"bitpix {bits} and datatype {number}, which has {8 * kind.itemsize}"
        raise unusable(path, f"the header says {why}; allowed: the same; correct the header")
    return kind


def _scale(path: Path, fields: Any) -> tuple[float, float]:
    """Slope and intercept of the grey values; 0 and NaN, as nibabel writes, say that they are stored as they are."""
    slope, intercept = float(fields["slope"]), float(fields["intercept"])
    if slope == 0.0 or np.isnan(slope):
        return 1.0, 0.0
    if not (np.isfinite(slope) and np.isfinite(intercept)):
        raise unusable(path, f"scl_slope {slope:g} and scl_inter {intercept:g}; allowed: finite; correct the header")
    return slope, intercept


def _packing(path: Path) -> str:
    with opened(path) as file:
        return "deflate" if file.read(2) == b"\x1f\x8b" else ""


def _fields(raw: bytes) -> Any:
    """The header as a record in its own byte order; None where the bytes are no header of NIfTI."""
    for table, size, magics in ((_FIRST, 348, (b"n+1", b"ni1")), (_SECOND, 540, (b"n+2", b"ni2"))):
        for order in "<>":
            if len(raw) < size or int(np.frombuffer(raw[:4], order + "i4")[0]) != size:
                continue
            names, formats = list(table), [_ordered(kind, order) for kind, _ in table.values()]
            layout = np.dtype({"names": names, "formats": formats, "offsets": [at for _, at in table.values()]})
            fields = np.frombuffer(raw[: layout.itemsize], layout)[0]
            return fields if bytes(fields["magic"]).rstrip(b"\0")[:3] in magics else None
    return None


def _ordered(kind: str, order: str) -> Any:
    """A format of the tables, as "8i2" or "S4", in a byte order."""
    count, letter, size = re.fullmatch(r"(\d*)([a-zS])(\d)", kind).groups()  # type: ignore[union-attr]
    single = f"{order}{letter}{size}"
    return (single, int(count)) if count else single


def _geometry(path: Path, fields: Any, shape: NDArray[Any]) -> tuple[Placed, tuple[str, ...]]:
    """Spacing, origin and direction in LPS mm, and what was assumed or disagrees."""
    pixdim = np.array(fields["pixdim"], float)
    unit = int(fields["units"]) & 7
    if unit not in UNITS_MM:
        raise unusable(path, f"xyzt_units {unit} for lengths; allowed: 1 (m), 2 (mm), 3 (um); correct the header")
    notes = [f"{path.name}: the header has no unit of length: mm assumed"] if unit == 0 else []
    forms = {}
    if int(fields["sform"]) > 0:
        forms["sform"] = np.array(fields["srow"], float).reshape(3, 4)
        if not np.all(np.isfinite(forms["sform"])):
            raise unusable(
                path, "its sform (axes and origin, srow) is not finite; allowed: twelve numbers; correct the header"
            )
    if int(fields["qform"]) > 0:
        forms["qform"] = _of_quaternion(path, fields, pixdim)
    if "sform" in forms and not _span(forms["sform"]) >= LEAST_SPAN:
        why = "its sform is singular (the axes in srow span no volume)"
        if "qform" not in forms:
            raise unusable(path, f"{why}; allowed: three axes across each other; correct the header")
        del forms["sform"]
        notes.append(f"{path.name}: {why}: the qform is used")
    used = next((f for f in forms.values() if _is_rigid(f)), next(iter(forms.values()), None))
    if used is None:
        notes.append(
            f"{path.name}: the header has neither sform nor qform: axes along x, y, z of LPS, origin 0 assumed"
        )
        used = np.column_stack([np.diag(pixdim[1:4] * (-1.0, -1.0, 1.0)), np.zeros(3)])  # as ITK takes it
    if len(forms) == 2:
        notes += _disagreement(path, forms, used, shape)
    matrix = used * np.array([[-1.0], [-1.0], [1.0]]) * UNITS_MM[unit]  # RAS to LPS
    size = np.linalg.norm(matrix[:, :3], axis=0)
    wide = np.abs(pixdim[1:4] * UNITS_MM[unit] - size)
    if not np.all(wide <= 0.01 * size) and np.all(np.isfinite(wide)):
        differ = f"pixdim {pixdim[1:4].tolist()} and the matrix's spacing {size.tolist()} differ"
        notes.append(f"{path.name}: {differ}: the matrix is used")
    with np.errstate(invalid="ignore", divide="ignore"):
        return (size, matrix[:, 3], matrix[:, :3] / size), tuple(notes)


def _span(form: NDArray[Any]) -> float:
    """Volume that a form's axes span, as unit vectors; NaN where one has no length."""
    with np.errstate(all="ignore"):
        return float(abs(np.linalg.det(form[:, :3] / np.linalg.norm(form[:, :3], axis=0))))


def _is_rigid(form: NDArray[Any]) -> bool:
    with np.errstate(all="ignore"):
        axes = form[:, :3] / np.linalg.norm(form[:, :3], axis=0)
        return bool(np.abs(axes.T @ axes - np.eye(3)).max() <= RIGHT_ANGLES)


def _disagreement(path: Path, forms: dict[str, Any], used: NDArray[Any], shape: NDArray[Any]) -> list[str]:
    """A sentence where the two forms put a corner of the scan to two places."""
    ends = np.stack(np.meshgrid(*[(0.0, n - 1.0) for n in shape], indexing="ij"), -1).reshape(-1, 3)
    with np.errstate(all="ignore"):
        places = [ends @ form[:, :3].T + form[:, 3] for form in forms.values()]
        apart = float(np.linalg.norm(places[0] - places[1], axis=1).max())
        voxel = float(np.linalg.norm(used[:, :3], axis=0).min())
    if apart <= AGREE_VOXELS * voxel:
        return []
    name = next(key for key, form in forms.items() if form is used)
    return [f"{path.name}: sform and qform disagree by {apart:.2f} mm at a corner: the {name} is used"]


def _of_quaternion(path: Path, fields: Any, pixdim: NDArray[Any]) -> NDArray[np.float64]:
    """The qform as a matrix (3, 4)."""
    b, c, d = (float(v) for v in fields["quatern"])
    rest = 1.0 - (b * b + c * c + d * d)
    if not rest > -1e-3:
        raise unusable(path, f"the qform's quaternion {b:g}, {c:g}, {d:g} is longer than 1; correct the header")
    turn = Rotation.from_quat([b, c, d, np.sqrt(max(rest, 0.0))]).as_matrix()
    flip = -1.0 if pixdim[0] < 0 else 1.0
    return np.column_stack([turn * (pixdim[1:4] * (1.0, 1.0, flip)), np.array(fields["qoffset"], float)])
