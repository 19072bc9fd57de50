"""The writhe of an open curve: it changes by 2 where one strand passes through another, and slowly elsewhere."""

from __future__ import annotations

import numpy as np


def writhe(joints: np.ndarray) -> float:
    """The Gauss integral over all pairs of segments of joints (n, 3) (Klenin and Langowski 2000, method 1a)."""
    total = 0.0
    for i in range(len(joints) - 3):
        for j in range(i + 2, len(joints) - 1):
            corners = [joints[b] - joints[a] for a, b in ((i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j))]
            normals = [np.cross(corners[n], corners[(n + 1) % 4]) for n in range(4)]
            sizes = [float(np.linalg.norm(normal)) for normal in normals]
            if min(sizes) == 0.0:
                continue
            units = [normal / size for normal, size in zip(normals, sizes, strict=True)]
            angle = sum(np.arcsin(np.clip(units[n] @ units[(n + 1) % 4], -1.0, 1.0)) for n in range(4))
            side = np.cross(joints[j + 1] - joints[j], joints[i + 1] - joints[i]) @ corners[0]
            total += float(angle * np.sign(side))
    return total / (2.0 * np.pi)
