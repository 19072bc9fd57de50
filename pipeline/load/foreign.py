"""What only ITK reads (packed DICOM slices, Analyze, formats of other fields): in a child process of its own.

A file that makes the library crash, hang or ask for all memory then ends the child, and is one refused file.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.load.geometry import unusable
from pipeline.load.guard import GIB
from pipeline.load.metaimage import head_of as metaimage_head
from pipeline.load.voxels import Head, axes_of, require_data

SECONDS = 40
PROGRAM = """
import json, resource, sys
import SimpleITK as sitk
sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(1)
sitk.ProcessObject.SetGlobalWarningDisplay(False)
most, out, files = int(sys.argv[1]), sys.argv[2], sys.argv[3:]
resource.setrlimit(resource.RLIMIT_AS, (most, most))
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
try:
    if out:
        image = sitk.ReadImage(files if len(files) > 1 else files[0])
        sitk.WriteImage(image, out, useCompression=False)
    else:
        reader = sitk.ImageFileReader()
        reader.SetFileName(files[0])
        reader.ReadImageInformation()
        print(json.dumps({
            "size": reader.GetSize(), "spacing": reader.GetSpacing(), "origin": reader.GetOrigin(),
            "direction": reader.GetDirection(), "channels": reader.GetNumberOfComponents(),
            "kind": sitk.GetPixelIDValueAsString(reader.GetPixelID()),
        }))
except (RuntimeError, MemoryError, OSError, TypeError):
    sys.exit(3)
"""
BITS = {"8-bit": "1", "16-bit": "2", "32-bit": "4", "64-bit": "8"}


def head_of(path: Path) -> Head:
    """What ITK says of a file; LoadError where it says nothing."""
    said: dict[str, Any] = json.loads(_asked([path], "", GIB))
    shape, items = axes_of(path, [int(n) for n in said["size"]])
    words = str(said["kind"]).split()
    letter = {"signed": "i", "unsigned": "u", "float": "f"}.get(words[1] if len(words) > 1 else "")
    if letter is None or words[0] not in BITS:
        raise unusable(path, f"voxels of {said['kind']}; allowed: grey values")
    count = len(said["size"])
    turn = np.array(said["direction"], float).reshape(count, count)[:3, :3]
    note = f"{path.name}: geometry as ITK reads it; this format may hold none"
    return Head(
        path, shape, np.dtype(letter + BITS[words[0]]), (), np.array(said["spacing"][:3]), np.array(said["origin"][:3]),
        turn, items=items, channels=int(said["channels"]), assumed=(note,),
    )  # fmt: skip


def converted(files: Sequence[Path], need: int, folder: str) -> Head:
    """The voxels of a file, or of slices in order, as an unpacked MetaImage in ``folder``; ``need`` : their bytes."""
    out = Path(folder) / "voxels.mha"
    _asked(files, str(out), GIB + 3 * need)
    return require_data(metaimage_head(out), float("inf"))


def _asked(files: Sequence[Path], out: str, most: int) -> str:
    """What the child prints; LoadError where it does not end well."""
    # ITK maps some 3 GiB of address space for its libraries and threads before it reads a byte
    command = [sys.executable, "-I", "-c", PROGRAM, str(most + 4 * GIB), out, *(str(path.absolute()) for path in files)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired:
        raise unusable(files[0], f"ITK has not read it after {SECONDS} s; convert it to .mha or .nii") from None
    if done.returncode == 0:
        return done.stdout.decode()
    how = "cannot read it" if done.returncode == 3 else "crashes on it"
    allowed = ".mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .dcm, .h5 or a folder with one DICOM series"
    raise unusable(files[0], f"cannot read it: ITK {how}; allowed: {allowed}. Check that the file is complete.")


def temporary() -> tempfile.TemporaryDirectory[str]:
    """A folder for a conversion, gone once it was read."""
    return tempfile.TemporaryDirectory(prefix="wireval-")
