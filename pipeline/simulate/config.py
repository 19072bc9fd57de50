"""Settings of the energy minimisation and of what is simulated."""

from dataclasses import dataclass, replace
from typing import Annotated, Literal

from pydantic import AfterValidator, Field
from pydantic.config import JsonDict
from pydantic_core import PydanticCustomError

from pipeline.ranges import Factor, Friction, NonNegative, Number, PositiveCount, Step, Turn
from solver._kernels.minimise import METHODS
from solver.relax import TOLERANCE
from solver.wire import SEGMENT_MM

Segment = Annotated[float, Field(ge=0.01, le=SEGMENT_MM.largest, allow_inf_nan=False), Number] | Literal["auto"]
HULLS: JsonDict = {"$comment": '"offset" or "samples:N", N from 1 to 256'}
SAMPLES = r"([1-9]\d?|1\d\d|2[0-4]\d|25[0-6])"
COARSEST_MM = 1.0
"""Length of the segments that ``auto`` begins with at most."""


def _known(method: str) -> str:
    if method not in METHODS:
        raise PydanticCustomError("method", "no method")
    return method


@dataclass(frozen=True)
class SolverConfig:
    """The energy minimisation."""

    method: Annotated[str, AfterValidator(_known), Field(json_schema_extra={"enum": [*METHODS]})] = "newton"
    """newton, or the closed_form of Alderliesten et al. (MICCAI 2002)."""
    segment_mm: Segment = "auto"
    """Length of the wire's rigid segments. auto halves it until that changes nothing."""
    hull: Annotated[str, Field(pattern=rf"^(offset|samples:{SAMPLES})$", json_schema_extra=HULLS)] = "offset"
    """offset (the hull's deepest point) or samples:N (the mean of N points, a softer wall for the same stiffness)."""
    tolerance: Annotated[float, Field(ge=TOLERANCE.least, le=TOLERANCE.largest), Number] = 1e-9
    """Newton decrement, relative to the energy, at which a step counts as converged."""
    max_iterations: PositiveCount = 200
    """Iterations allowed for one relaxation."""
    step_mm: Step = 1.0
    """Longest insertion step. It is shortened where the scene asks for it; with friction on the wall, to 0.1 mm."""
    finest_mm: Step = 0.05
    """Steps in which the wire gives way are taken again, down to this length. With step_mm or more they never are."""
    initial: Literal["slide", "translate"] = "slide"
    """slide or translate: how the wire is moved before it relaxes."""

    def quick(self, segment_mm: float) -> "SolverConfig":
        """These settings with segments of one length and no repeated steps, for wires that are only compared."""
        return replace(self, segment_mm=segment_mm, finest_mm=self.step_mm)


@dataclass(frozen=True)
class SimulateConfig:
    """What is simulated."""

    depth: Literal["traced", "manifest"] = "traced"
    """traced (the length found in each frame) or manifest (insertion_mm)."""
    entry: Literal["traced", "manifest"] = "traced"
    """traced (fitted to the first 10 mm of the traces, weighed with the manifest) or manifest (taken as written)."""
    bending_scale: Factor = 1.0
    """Factor on the wire's bending stiffness, for sensitivity runs. The whole wire has one factor: it scales forces."""
    taper_scale: Factor = 1.0
    """Factor on the lengths over which the wire's bending stiffness changes, for sensitivity runs."""
    rest_curvature_scale: NonNegative = 1.0
    """Factor on the wire's rest curvature, for sensitivity runs. 0 takes the curve off its tip."""
    friction: Friction | None = None
    """Coulomb's coefficient instead of the manifest's, for sensitivity runs."""
    wall_scale: Factor = 1.0
    """Factor on the wall stiffness, for sensitivity runs."""
    roll_offset_deg: Turn = 0.0
    """Degrees added to the roll of every frame, for sensitivity runs."""
