"""Named numbers of the synthetic scenes, each with its reason."""

from __future__ import annotations

TINY_LENGTH_MM = 1e-12
"""Lengths below this are treated as zero where a direction has to be formed (coordinates are below 1e3 mm)."""

FOOT_TOLERANCE_MM = 1e-10
"""Step at which the foot on a centreline counts as found: far below the 1e-7 mm that a force of 1e-7 N needs."""

NEWTON_FORCE_N = 1e-7
"""Largest unbalanced nodal force of a recorded wire; rounding leaves about 1e-9 N at 2e4 N of axial stiffness."""

REPLAY_FORCE_N = 1e-5
"""Largest unbalanced nodal force between recorded depths: it only has to follow the branch."""

HESSIAN_STEP = 1e-6
"""Relative step of the central difference of the exact gradient; its error is about 1e-10 of the stiffness."""
