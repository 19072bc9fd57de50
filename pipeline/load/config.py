"""How scans are read."""

from dataclasses import dataclass


@dataclass(frozen=True)
class LoadConfig:
    """How scans are read."""

    resample: bool = False
    """Resample a tilted or irregularly spaced series onto a regular grid instead of refusing it."""
