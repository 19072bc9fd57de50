"""Work that the solver leaves out because it cannot change the answer; here, and only here, it is put back.

    with skips.off("foresight"):
        insertion = Insertion(...)  # and whatever it does later

An insertion or a relaxation that is made inside ``off`` works without the named skips. Tests use it to prove that the
answer stays the same, and the benchmark to measure what each skip saves.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

from solver.doors import choice


class Skips(NamedTuple):
    """Which skips are on: all of them, unless ``off`` says otherwise.

    clearance : do not look the wall up for a point that moved less than its last distance from the wall.
    cheap : look the wall up by trilinear interpolation first; that is enough where the point is clear of the wall.
    idle : take the rest shape of the wire, without an iteration, where it touches nothing.
    roll : do not step where the base only rolls a straight round wire.
    direction : describe a segment of a straight round wire by its direction alone, without the roll of its frame.
    foresight : begin a step with the change that the step before made.
    window : leave the joints near the base alone while they no longer move.
    rest : return a start at once that is within the tolerance already.
    profile : take stiffness and rest bend of all joints but two from a table.
    """

    clearance: bool = True
    cheap: bool = True
    idle: bool = True
    roll: bool = True
    direction: bool = True
    foresight: bool = True
    window: bool = True
    rest: bool = True
    profile: bool = True


ALL = Skips()
_now = ContextVar("skips", default=ALL)


def current() -> Skips:
    """The skips of a wire that is made now."""
    return _now.get()


@contextmanager
def off(*names: str) -> Iterator[None]:
    """Make wires without the skips of these names."""
    for name in names:
        choice("skips", "name", name, Skips._fields)
    token = _now.set(_now.get()._replace(**dict.fromkeys(names, False)))
    try:
        yield
    finally:
        _now.reset(token)
