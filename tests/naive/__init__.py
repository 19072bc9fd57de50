"""Slow, obvious oracles: one module per part, sharing no code with what they check."""
