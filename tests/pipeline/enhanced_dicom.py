"""An enhanced multi-frame CT file, byte by byte: functional groups say where every frame lies."""

from __future__ import annotations

import struct

import numpy as np

CLASS = "1.2.840.10008.5.1.4.1.1.2.1"
EXPLICIT, IMPLICIT = "1.2.840.10008.1.2.1", "1.2.840.10008.1.2"


class Writer:
    """Little-endian elements, with value representations or without; sequences of known length or delimited."""

    def __init__(self, implicit=False, delimited=False):
        self.implicit, self.delimited = implicit, delimited

    def element(self, group, number, kind, value):
        value = value.encode() if isinstance(value, str) else value
        value += (b"\0" if kind in ("UI", "OB", "OW") else b" ") * (len(value) % 2)
        if self.implicit:
            return struct.pack("<HHI", group, number, len(value)) + value
        if kind in ("OB", "OW", "SQ"):
            return struct.pack("<HH2sHI", group, number, kind.encode(), 0, len(value)) + value
        return struct.pack("<HH2sH", group, number, kind.encode(), len(value)) + value

    def sequence(self, group, number, *items):
        if not self.delimited:
            body = b"".join(struct.pack("<HHI", 0xFFFE, 0xE000, len(i)) + i for i in items)
            return self.element(group, number, "SQ", body)
        end, stop = struct.pack("<HHI", 0xFFFE, 0xE00D, 0), struct.pack("<HHI", 0xFFFE, 0xE0DD, 0)
        start = struct.pack("<HHI", 0xFFFE, 0xE000, 0xFFFFFFFF)
        head = struct.pack("<HH", group, number) + (b"" if self.implicit else b"SQ\0\0") + b"\xff" * 4
        return head + b"".join(start + i + end for i in items) + stop

    def short(self, group, number, value):
        return self.element(group, number, "US", struct.pack("<H", value))


def enhanced(values, spacing, positions, implicit=False, delimited=False):
    """File content for values[x, y, frame] whose frames lie at ``positions``, axes x and y."""
    nx, ny, frames = values.shape
    w, plain = Writer(implicit, delimited), Writer()
    meta = plain.element(2, 1, "OB", b"\0\1") + plain.element(2, 2, "UI", CLASS)
    meta += plain.element(2, 3, "UI", "1.2.3.4.5")
    meta += plain.element(2, 0x10, "UI", IMPLICIT if implicit else EXPLICIT)
    meta = plain.element(2, 0, "UL", struct.pack("<I", len(meta))) + meta
    data = w.element(8, 8, "CS", "ORIGINAL\\PRIMARY\\VOLUME\\NONE") + w.element(8, 0x16, "UI", CLASS)
    data += w.element(8, 0x18, "UI", "1.2.3.4.5") + w.element(8, 0x60, "CS", "CT")
    data += w.element(0x20, 0x0D, "UI", "1.2.3") + w.element(0x20, 0x0E, "UI", "1.2.3.9")
    data += w.short(0x28, 2, 1) + w.element(0x28, 4, "CS", "MONOCHROME2")
    data += w.element(0x28, 8, "IS", str(frames)) + w.short(0x28, 0x10, ny) + w.short(0x28, 0x11, nx)
    for number, value in ((0x100, 16), (0x101, 16), (0x102, 15), (0x103, 1)):
        data += w.short(0x28, number, value)
    pixel = w.element(0x28, 0x30, "DS", f"{spacing[1]}\\{spacing[0]}")
    shared = w.sequence(0x20, 0x9116, w.element(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0"))
    shared += w.sequence(0x28, 0x9110, w.element(0x18, 0x50, "DS", str(spacing[2])) + pixel)
    data += w.sequence(0x5200, 0x9229, shared)
    places = ["\\".join(map(str, p)) for p in positions]
    data += w.sequence(0x5200, 0x9230, *[w.sequence(0x20, 0x9113, w.element(0x20, 0x32, "DS", p)) for p in places])
    voxels = np.ascontiguousarray(values.astype("<i2").T).tobytes()
    return b"\0" * 128 + b"DICM" + meta + data + w.element(0x7FE0, 0x10, "OW", voxels)
