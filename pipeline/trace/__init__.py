"""trace: scan -> the real wire as one ordered sub-voxel curve from entry to tip."""

from __future__ import annotations

from pipeline.trace.follow import trace

__all__ = ["trace"]
