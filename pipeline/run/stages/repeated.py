"""Scans that occur twice in a case under different names, found by their voxels."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.model import Volume
from pipeline.run.stages.known import Frame
from pipeline.status import FrameStatus


def once(frames: Sequence[Frame], voxels: Sequence[bytes]) -> list[Frame]:
    """The frames; one with the voxels of an earlier one has failed and is not counted again.

    voxels : of each frame, see ``known_by``; empty where its scan could not be read.
    """
    out, first = list(frames), dict[bytes, int]()
    for n, known in enumerate(voxels):
        same = first.setdefault(known, n)
        if known and same != n:
            # also where its trace has failed: the same scan again is no further evidence for anything
            as_read = replace(frames[n], status=FrameStatus.OK.identifier)
            out[n] = as_read.failed("load", FrameStatus.REPEATED, f"it has the voxels of frame {same}")
    return out


def known_by(volume: Volume) -> bytes:
    """A hash (16 bytes) of the sums over the rows in memory, whatever type the voxels are kept in.

    In scans with noise it tells as much as a hash of all voxels, in a fifth of the time.
    """
    rows = volume.values.sum(axis=int(np.argmin(volume.values.strides)), dtype=np.float64)
    return hashlib.blake2b(np.ascontiguousarray(rows).data, digest_size=16).digest()
