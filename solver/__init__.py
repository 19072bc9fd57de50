"""Where does a guide wire lie? Given a wire, a wall and a push, the minimum of their energy."""

from __future__ import annotations

from solver.grid import Grid
from solver.insertion import Insertion
from solver.relax import relax
from solver.solution import Solution
from solver.status import Status
from solver.wall import VesselWall
from solver.warm import warm_up
from solver.wire import GuideWire

__all__ = ["Grid", "GuideWire", "Insertion", "Solution", "Status", "VesselWall", "relax", "warm_up"]
