"""What only ITK reads, packed DICOM slices: in a child process of its own.

A file that makes the library crash, hang or ask for all memory then ends the child, and is one refused file.
"""

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from pipeline.load.geometry import unusable
from pipeline.load.guard import GIB
from pipeline.load.metaimage import head_of as metaimage_head
from pipeline.load.voxels import Head, require_data

SECONDS = 40
PROGRAM = """
import resource, sys
import SimpleITK as sitk
sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(1)
sitk.ProcessObject.SetGlobalWarningDisplay(False)
most, out, files = int(sys.argv[1]), sys.argv[2], sys.argv[3:]
resource.setrlimit(resource.RLIMIT_AS, (most, most))
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
try:
    image = sitk.ReadImage(files if len(files) > 1 else files[0])
    sitk.WriteImage(image, out, useCompression=False)
except (RuntimeError, MemoryError, OSError, TypeError):
    sys.exit(3)
"""


def converted(files: Sequence[Path], need: int, folder: str) -> Head:
    """The voxels of a file, or of slices in order, as an unpacked MetaImage in ``folder``; ``need`` : their bytes."""
    out = Path(folder) / "voxels.mha"
    # ITK maps some 3 GiB of address space for its libraries and threads before it reads a byte
    most = str(5 * GIB + 3 * need)
    command = [sys.executable, "-I", "-c", PROGRAM, most, str(out), *(str(path.absolute()) for path in files)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired:
        raise unusable(files[0], f"ITK has not read it after {SECONDS} s; convert it to .mha or .nii") from None
    if done.returncode:
        how = "cannot read it" if done.returncode == 3 else "crashes on it"
        raise unusable(files[0], f"cannot be unpacked: ITK {how}; allowed: whole DICOM slices. Copy the file again.")
    return require_data(metaimage_head(out), float("inf"))


def temporary() -> tempfile.TemporaryDirectory[str]:
    """A folder for a conversion, gone once it was read."""
    return tempfile.TemporaryDirectory(prefix="wireval-")
