"""Volumes in files: MetaImage, NRRD and NIfTI. No other format passes.

ITK reads twenty more, of which some keep header and voxels in two files (.spr and .sdt): a key that knows one of them
takes a new scan for the old one, and of most of them nobody knows what they say of axes and units.
"""

import stat
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from pipeline.load import metaimage, nifti, nrrd
from pipeline.load.config import LoadConfig
from pipeline.load.geometry import Box, Header, LoadError, Source, unusable
from pipeline.load.guard import status_of
from pipeline.load.order import in_order
from pipeline.load.voxels import Head, read_box, require_data

OWN = {
    ".mha": metaimage.head_of, ".mhd": metaimage.head_of, ".nrrd": nrrd.head_of, ".nhdr": nrrd.head_of,
    ".nii": nifti.head_of, ".nii.gz": nifti.head_of, ".hdr": nifti.head_of, ".img": nifti.head_of,
}  # fmt: skip
ALLOWED = ".mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .hdr with .img (NIfTI), .dcm, .h5 or a folder with one DICOM series"
NAMED = {
    ".mha": metaimage.data_files, ".mhd": metaimage.data_files, ".nrrd": nrrd.data_files, ".nhdr": nrrd.data_files,
}  # fmt: skip


def head_of(path: Path, most_gib: float = LoadConfig.most_gib, *, whole: bool = True) -> Head:
    """What a file's header says, checked against the files' lengths; LoadError where it cannot be a scan."""
    read = next((own for suffix, own in OWN.items() if path.name.lower().endswith(suffix)), None)
    if read is None:
        why = f"cannot read it: by its ending and content it is of none of the formats allowed: {ALLOWED}"
        raise unusable(path, f"{why}; convert it, or check that it is complete")
    return require_data(read(path), most_gib, whole=whole)


def recognises(_path: Path) -> bool:
    """Any file: the last to be asked, so that it refuses what is of no format."""
    return True


def parts(path: Path) -> tuple[Path, ...]:
    """Other files that hold the voxels of a header: those that it names, and the other half of a pair.

    Asked of every path that goes into a key, whether or not the header can be used: a change of theirs is a change of
    the scan.
    """
    other = nifti.other_half(path)
    if other != path:
        return (other,) if other.is_file() else ()
    named = NAMED.get(path.suffix.lower())
    try:
        states = {name: status_of(name) for name in (named(path) if named else ()) if name != path}
    except LoadError:  # only another header can mend it
        return ()
    return tuple(sorted(name for name, found in states.items() if found and stat.S_ISREG(found.st_mode)))


def read_header(source: Source, config: LoadConfig) -> Header:
    """Geometry of one file; a 4-D file is a sequence of volumes along its last axis."""
    head = head_of(source.path, config.most_gib, whole=False)
    if head.channels != 1:
        why = f"{head.channels} values per voxel; allowed: a 3-D grey-value volume, or a 4-D file that is a sequence"
        raise unusable(source.path, f"got {why} of them (its last axis counts them).")
    return head.header(source)


def read(header: Header, box: Box, config: LoadConfig) -> NDArray[Any]:
    """Voxels of ``box`` alone, indexed x, y, z."""
    path, item = header.source.path, header.source.item or 0
    return read_box(head_of(path, config.most_gib), item, box)


def held_in(folder: Path) -> str:
    """What else lies in a folder that is no series, and how to name it; empty where nothing does."""
    there = in_order(folder.iterdir(), lambda path: path.name)
    below = [path.name for path in there if path.is_dir()]
    scans = [path.name for path in there if path.name.lower().endswith(tuple(OWN))]
    if below:
        return f"It has sub-folders: {', '.join(below[:5])}; name one of them, as in {folder.name}/{below[0]}.\n"
    if not scans:
        return ""
    end = next(scans[0][-len(end) :] for end in OWN if scans[0].lower().endswith(end))
    return f"It holds scans, as {scans[0]}; name these, as in {folder.name}/*{end}.\n"
