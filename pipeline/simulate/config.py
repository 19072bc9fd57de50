"""Settings of the energy minimisation and of what is simulated."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SolverConfig:
    """The energy minimisation."""

    method: str = "newton"
    """newton or closed_form."""
    segment_mm: float = 1.0
    """Length of the wire's rigid segments."""
    hull: str = "offset"
    """offset (the smooth limit) or samples:N."""
    tolerance: float = 1e-9
    """Newton decrement, relative to the energy, at which a step counts as converged."""
    max_iterations: int = 200
    """Iterations allowed for one relaxation."""
    step_mm: float = 1.0
    """Longest insertion step; shortened where the scene asks for it."""
    initial: str = "slide"
    """slide or translate: how the wire is moved before it relaxes."""


@dataclass(frozen=True)
class SimulateConfig:
    """What is simulated."""

    depth: str = "traced"
    """traced (the length found in each frame) or manifest (insertion_mm)."""
    entry: str = "traced"
    """traced (the clamp is measured in the first 8 mm of the traced wires) or manifest (taken as written)."""
    bending_scale: float = 1.0
    """Factor on the wire's bending stiffness, for sensitivity runs."""
    wall_scale: float = 1.0
    """Factor on the wall stiffness, for sensitivity runs."""
    roll_offset_deg: float = 0.0
    """Added to the roll of every frame, for sensitivity runs."""
