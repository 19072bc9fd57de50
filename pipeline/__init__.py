"""Orchestration: load, segment, trace, simulate, compare, report."""
