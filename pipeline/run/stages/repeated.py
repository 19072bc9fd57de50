"""One scan under two names: the voxels say so where the files do not."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.model import Volume
from pipeline.run.stages.known import Frame
from pipeline.status import FrameStatus


def once(frames: Sequence[Frame], voxels: Sequence[bytes]) -> list[Frame]:
    """The frames; one with the voxels of an earlier one, in whatever file, is not counted again."""
    out, first = list(frames), dict[bytes, int]()
    for n, known in enumerate(voxels):
        same = first.setdefault(known, n)
        if known and same != n:
            # whatever is wrong with its trace, too: that other frames agree with it would be nothing new
            as_read = replace(frames[n], status=FrameStatus.OK.identifier)
            out[n] = as_read.failed("load", FrameStatus.REPEATED, f"it has the voxels of frame {same}")
    return out


def known_by(volume: Volume) -> bytes:
    """A hash of the sums of the rows in memory, which noise makes as good as that of all voxels in a fifth of its time.

    Whatever type the voxels are kept in.
    """
    rows = volume.values.sum(axis=int(np.argmin(volume.values.strides)), dtype=np.float64)
    return hashlib.blake2b(np.ascontiguousarray(rows).data, digest_size=16).digest()
