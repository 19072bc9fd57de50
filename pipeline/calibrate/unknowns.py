"""What is fitted: every parameter with its prior, its bounds and how well it must be known to count as seen.

Only the ratio of the wire's and the wall's stiffness counts unless forces or a weight are known (then there is
``bending``), and turning the plane of the rest curvature is the same as the roll: neither is fitted twice.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pipeline.model import Wire
from pipeline.ranges import Profile, scaled

MOST_CURVED = 4.0
"""Largest factor on the rest curvature that is tried."""
ROLL, REST, TAPER, WALL, FRICTION, BENDING = "roll_offset_deg", "rest_curvature", "taper", "wall", "friction", "bending"
SEEN_LOG = 0.2
"""A factor whose logarithm is known no better than this is not seen."""


@dataclass(frozen=True)
class Unknown:
    """A parameter, in degrees, as a coefficient or as the logarithm of a factor on what the manifest states.

    prior, sd : mean and standard deviation.     low, high : bounds.     step : of a difference quotient.     enough :
    largest standard deviation at which it counts as seen.     what : for the reader.     stated_N_mm2 : of the wall.
    """

    name: str
    prior: float
    sd: float
    low: float
    high: float
    step: float
    enough: float
    what: str
    stated_N_mm2: float = float("nan")

    @property
    def logarithmic(self) -> bool:
        """Whether it is the logarithm of a factor."""
        return self.name.split(":")[0] in (REST, TAPER, WALL, BENDING)

    def shown(self, value: float) -> float:
        """A value as the reader sees it: a factor for a logarithm."""
        return float(np.exp(value)) if self.logarithmic else value

    def at_an_end(self, value: float) -> bool:
        """Whether a value is at the end of its range, beyond which it may lie: nothing lies below a friction of 0."""
        low = bool(np.isclose(value, self.low)) and (self.logarithmic or self.low < 0.0)
        return low or bool(np.isclose(value, self.high))

    def end_told(self, value: float) -> str:
        """That a value is at the end of its range."""
        return f"it runs to the end of its range, {self.shown(value):.3g}"

    def one_sided(self, value: float) -> bool:
        """Whether a value is at the end of what is possible, as a friction of 0."""
        return bool(np.isclose(value, self.low)) and not self.at_an_end(value)


def spread_in_words(sd: float, *, logarithmic: bool) -> str:
    """A standard deviation to two digits, no exponent; of a factor's logarithm in per cent, or as a factor itself.

    From 30 % on per cent mislead: 143 % of a wall are a factor of 4.2 up or down, and not less than nothing.
    """
    if logarithmic and sd > 0.3:
        return f"a factor of {np.exp(sd):.2g}"
    return two_digits(100.0 * sd if logarithmic else sd) + " %" * logarithmic


def two_digits(value: float) -> str:
    """A number to two digits, no exponent: 9.4e+03 is no sentence."""
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}"


def _factor(name: str, sd: float, most: float, step: float, what: str) -> Unknown:
    return Unknown(name, 0.0, sd, -float(np.log(most)), float(np.log(most)), step, SEEN_LOG, what)


def unknowns(walls_N_mm2: Sequence[float], friction: float, *, weighed: bool) -> tuple[Unknown, ...]:
    """All parameters of some insertions.

    walls_N_mm2 : stated stiffnesses, walls that are stated alike being one.     friction : as stated.
    weighed : forces or the wire's weight are known, so that the wire's stiffness has a scale.
    """
    found = [
        Unknown(
            ROLL, 0.0, 100.0, -180.0, 180.0, 1.0, 8.0, "degrees added to the stated roll: the plane of the tip's curve"
        ),
        _factor(REST, 0.5, MOST_CURVED, 0.02, "factor on the rest curvature"),
        _factor(TAPER, 0.7, 5.0, 0.05, "factor on the shaft's stiffness over the tip's; its lengths stay as stated"),
    ]
    for stiffness in sorted(set(walls_N_mm2)):
        what = f"factor on wall stiffness over the wire's, walls stated at {stiffness:g} N/mm2"
        found.append(replace(_factor(f"{WALL}:{stiffness:g}", 1.5, 100.0, 0.1, what), stated_N_mm2=stiffness))
    most = max(0.5, 2.0 * friction)
    found.append(Unknown(FRICTION, friction, 0.1, 0.0, most, 0.01, 0.02, "Coulomb's coefficient of wire and wall"))
    if weighed:
        found.append(_factor(BENDING, 0.7, 10.0, 0.05, "factor on the wire's stiffness, wall and wire together"))
    return tuple(found)


def bent(wire: Wire, values: Mapping[str, float]) -> Wire:
    """A wire with other parameters: values by name, those that are missing are as stated."""
    scale, shaft, rest = (np.exp(values.get(name, 0.0)) for name in (BENDING, TAPER, REST))
    stiffness, curvature = wire.bending_stiffness_N_mm2, wire.rest_curvature_per_mm
    changed: Profile
    if isinstance(stiffness, (int, float)):
        changed = float(stiffness * scale)
    else:
        at, ei = np.array(stiffness, dtype=float).T
        # between tip and shaft in proportion, on a logarithmic scale
        reach = np.log(ei[-1] / ei[0])
        share = np.log(ei / ei[0]) / reach if reach else np.zeros(len(ei))
        changed = [(float(s), float(value)) for s, value in zip(at, ei * scale * shaft**share, strict=True)]
    return replace(wire, bending_stiffness_N_mm2=changed, rest_curvature_per_mm=scaled(curvature, rest))


def lacking(wire: Wire) -> dict[str, tuple[str, str]]:
    """Parameters that the wire as stated does not have, so that no scan tells them: each with why, and what to state.

    They are factors on what is stated, and a straight wire lies the same at every roll.
    """
    found = {}
    stiffness = np.array(wire.bending_stiffness_N_mm2, dtype=float)
    if stiffness.ndim == 0 or stiffness[0, 1] == stiffness[-1, 1]:
        why = "the wire is stated as stiff at its tip as at its shaft: no scan tells a factor between them"
        found[TAPER] = why, "state bending_stiffness_N_mm2 as [distance from the tip, EI] pairs that rise to the shaft"
    if not wire.curved:
        why, do = (
            "the wire is stated straight: no scan tells",
            "state rest_curvature_per_mm if the real tip is curved",
        )
        found |= {ROLL: (f"{why} at which roll it lies", do), REST: (f"{why} a factor on its curve", do)}
    return found


def wall_factor(stated_N_mm2: float, values: Mapping[str, float]) -> float:
    """Factor on a wall's stiffness: its factor relative to the wire, times the wire's own factor."""
    return float(np.exp(values.get(f"{WALL}:{stated_N_mm2:g}", 0.0) + values.get(BENDING, 0.0)))
