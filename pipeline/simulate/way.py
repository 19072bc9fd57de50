"""The way of the hand: every replay goes all of it, whichever frames it reads.

A frame whose trace is refused moved the wire all the same. With friction, at a fork, or where the wire was turned or
pulled back meanwhile, what follows hangs on it: without three of twelve frames a friction of 0.1 was fitted as 0.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import NamedTuple, Self, TypeVar

Item = TypeVar("Item")


class Stop(NamedTuple):
    """What the hand had done by a frame.

    frame : its number.     depth_mm : of the tip beyond the clamp.     roll_deg : of the base.
    catheter_mm : of the tip of a catheter over the wire.
    """

    frame: int
    depth_mm: float
    roll_deg: float = 0.0
    catheter_mm: float = 0.0


@dataclass(frozen=True)
class Way:
    """Stops in the order of the insertion, and which of them are read; the others are gone through.

    sheathed : whether there is a catheter, whose tip then counts.
    """

    stops: tuple[Stop, ...]
    read: tuple[bool, ...]
    sheathed: bool = False

    @classmethod
    def reading(cls, read: Iterable[Stop], passed: Iterable[Stop] = (), *, sheathed: bool = False) -> Self:
        """The way to stops that are ``read`` through those ``passed``, up to the last one read: no wire hangs on more.

        The order is that of the frames' numbers.
        """
        both = sorted([*((s, True) for s in read), *((s, False) for s in passed)], key=lambda pair: pair[0].frame)
        while both and not both[-1][1]:
            both.pop()
        return cls(tuple(stop for stop, _ in both), tuple(wanted for _, wanted in both), sheathed)

    @property
    def depths_mm(self) -> list[float]:
        """Depth of every stop, mm."""
        return [stop.depth_mm for stop in self.stops]

    @property
    def rolls_deg(self) -> list[float]:
        """Roll of every stop, degrees."""
        return [stop.roll_deg for stop in self.stops]

    @property
    def tips_mm(self) -> list[float]:
        """Tip of the catheter at every stop, mm; one stated beyond the wire's own tip ends with the wire."""
        return [min(stop.catheter_mm, stop.depth_mm) if self.sheathed else 0.0 for stop in self.stops]

    def otherwise(self, depths_mm: Sequence[float], rolls_deg: Sequence[float]) -> Self:
        """The same way with other depths, mm, and rolls, degrees, of all its stops."""
        new = zip(self.stops, depths_mm, rolls_deg, strict=True)
        return replace(self, stops=tuple(stop._replace(depth_mm=mm, roll_deg=roll) for stop, mm, roll in new))

    def turned(self, by_deg: float) -> Self:
        """The same way with every roll turned, degrees."""
        return self.otherwise(self.depths_mm, [roll + by_deg for roll in self.rolls_deg])

    def of(self, found: Iterable[Item]) -> Iterable[Item]:
        """Of what was found at every stop that of those that are read."""
        return compress(found, self.read)
