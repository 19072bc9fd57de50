"""Other simulators on the same two scenes: each in one file, each in its own process, each optional."""

from __future__ import annotations

from pipeline.benchmark.peers.run import ADAPTERS, run_peers

__all__ = ["ADAPTERS", "run_peers"]
