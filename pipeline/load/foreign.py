"""What only ITK reads, packed DICOM slices: in a child process of its own.

A file that makes the library crash, hang or ask for all memory then ends the child, and is one refused file. ITK also
turns MONOCHROME1 round, rescales by the first slice's slope and passes over HighBit. So it is given the packed pixels
without what says how to take them, and gives back the stored values, of which ``slices`` makes greys as of all others.
"""

import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from pipeline.load.geometry import unusable
from pipeline.load.guard import GIB, size_of, told
from pipeline.load.slices import Plane, dataset

SECONDS = 40
STORED = ("Rows", "Columns", "BitsAllocated", "PixelRepresentation", "NumberOfFrames",
          "PixelData")  # fmt: skip
"""All of a file that unpacking needs."""
SECONDARY_CAPTURE = "1.2.840.10008.5.1.4.1.1.7"
PROGRAM = """
import resource, sys
import SimpleITK as sitk
sitk.ProcessObject.SetGlobalDefaultNumberOfThreads(1)
sitk.ProcessObject.SetGlobalWarningDisplay(False)
most, folder, kinds = int(sys.argv[1]), sys.argv[2], sys.argv[3:]
resource.setrlimit(resource.RLIMIT_AS, (most, most))
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
try:
    for k, kind in enumerate(kinds):
        image = sitk.ReadImage(f"{folder}/{k}.dcm")
        sitk.GetArrayViewFromImage(image).astype(kind).tofile(f"{folder}/{k}.raw")
except (RuntimeError, MemoryError, OSError, TypeError):
    sys.exit(3)
"""


@contextmanager
def unpacked(planes: Sequence[Plane]) -> Iterator[dict[Path, Path]]:
    """Where the stored values of packed planes' files lie, each frame behind the other from the first byte on."""
    each = {plane.path: plane for plane in planes}
    if not each:
        yield {}
        return
    with tempfile.TemporaryDirectory(prefix="wireval-") as folder:
        out = {path: Path(folder) / f"{k}.raw" for k, path in enumerate(each)}
        need = {path: _write_bare(plane, out[path].with_suffix(".dcm")) for path, plane in each.items()}
        _run(out, folder, [plane.pixels.kind for plane in each.values()], sum(need.values()))
        for path, expected in need.items():
            if size_of(out[path]) != expected:
                why = f"unpacked to {size_of(out[path])} bytes of pixels; its header asks for {expected}"
                raise unusable(path, f"{why}. Export the series again.")
        yield out


def _write_bare(plane: Plane, path: Path) -> int:
    """A copy of a file with its packed pixels, and no more of its header than unpacking needs; bytes it unpacks to."""
    from pydicom.dataset import Dataset, FileMetaDataset

    with told(plane.path):
        data, bare = dataset(plane.path), Dataset()
        for name in STORED:
            if name in data:
                bare[name] = data[name]
        # of fewer bits GDCM keeps the lowest, whichever of them count
        bare.BitsStored, bare.HighBit = data.BitsAllocated, data.BitsAllocated - 1
        bare.SamplesPerPixel, bare.PhotometricInterpretation = 1, "MONOCHROME2"
        bare.SOPClassUID, bare.SOPInstanceUID, bare.file_meta = SECONDARY_CAPTURE, "1.2.3", FileMetaDataset()
        bare.file_meta.TransferSyntaxUID = data.file_meta.TransferSyntaxUID
        bare.save_as(path, enforce_file_format=True)
        return max(int(data.get("NumberOfFrames") or 1), 1) * plane.pixels.frame_bytes


def _run(out: dict[Path, Path], folder: str, kinds: Sequence[str], need: int) -> None:
    """Unpack in a child process; LoadError of the file that it has come to where it fails."""
    # ITK maps some 3 GiB of address space for its libraries and threads before it reads a byte
    most = str(5 * GIB + 3 * need)
    try:
        command = [sys.executable, "-I", "-c", PROGRAM, most, folder, *kinds]
        code = subprocess.run(command, capture_output=True, timeout=SECONDS, check=False).returncode
    except subprocess.TimeoutExpired:
        code = None
    if code == 0:
        return
    at = next((path for path, raw in out.items() if not raw.exists()), list(out)[-1])
    if code is None:
        raise unusable(at, f"ITK has not read it after {SECONDS} s; convert it to .mha or .nii")
    how = "cannot read it" if code == 3 else "crashes on it"
    raise unusable(at, f"cannot be unpacked: ITK {how}; allowed: whole DICOM slices. Copy the file again.")
