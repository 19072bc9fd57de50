"""trace: scan -> the real wire as one ordered sub-voxel curve from entry to tip."""

from __future__ import annotations

from pipeline.trace.follow import trace
from pipeline.trace.in_region import trace_region

__all__ = ["trace", "trace_region"]
