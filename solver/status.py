"""How a relaxation or an insertion step ends: every member is the sentence that the user reads."""

from __future__ import annotations

from enum import Enum


class Status(Enum):
    """Outcome of one depth; the name is its identifier, the value its sentence."""

    CONVERGED = "the wire is at rest: a minimum of the energy within solver.tolerance"
    MAX_ITERATIONS = "stopped at the iteration limit; raise solver.max_iterations or loosen solver.tolerance"
    STALLED = (
        "the energy can no longer be lowered but the wire is not at rest within solver.tolerance; "
        "loosen solver.tolerance, or lower the ratio of wall to bending stiffness"
    )
    FRICTION = "the friction forces did not settle; lower wall.friction or shorten solver.step_mm"
    FOLDED = (
        "the wire folded at a joint (turned by more than 90 degrees); use shorter segments or smaller steps"
    )
    LEFT_GRID = "the wire left the wall's grid; give a larger grid, or check entry point and direction"
    ENTRY_OUTSIDE = "the entry point lies outside the lumen; check entry_mm and the registration of the wall"
    TOO_LONG = "the depth needs more joints than allowed; use longer segments or raise solver.max_joints"
    NON_FINITE = "the energy became infinite or undefined; check stiffnesses and loads"

    @property
    def identifier(self) -> str:
        """The short name used in tables."""
        return self.name.lower()
