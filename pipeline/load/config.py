"""How scans are read."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from pipeline.ranges import Number, Truth


@dataclass(frozen=True)
class LoadConfig:
    """How scans are read."""

    resample: Truth = False
    """Resample a tilted or irregularly spaced series onto a regular grid instead of refusing it."""
    most_gib: Annotated[float, Field(gt=0, le=1024, allow_inf_nan=False), Number] = 8.0
    """Largest volume (GiB of voxels) that is read. A larger one is refused before a byte of it is read."""
