"""Where the wire is held: the solver's own wire fitted to the first millimetres of the traces of all frames.

A clamp turned by 2 degrees puts a free wire 0.35 mm off after 10 mm, more than everything else in the pipeline, and a
hand-picked entry is no better. The wire's first millimetres show the clamp, bent by what the wire does farther on: so
the solver's wire, with its stiffness, rest curvature and wall, is what is fitted. The manifest's statement is the
prior, with the uncertainty that it states. The unknowns are the clamp's place (3), two tilts of its direction and an
offset of each frame's depth; Gauss-Newton finds them, with difference quotients from clamps that are a little off.
Long segments do for that, unless they are seen to lay the wire elsewhere where the steps end.

Along the wire the clamp stays in the manifest's plane. A straight wire that slides along itself is the same wire, so
that nothing but what the model gets wrong farther on would tell this place, and all depths would follow it: a wire that
is no solution of the model slid the clamp by 1 mm, five of its standard deviations. How well it is known stays what the
manifest states, and what it may be makes the rest less certain.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.arrays.polyline import across, at_arc, tangents
from pipeline.model import Array, Clamp, Curve
from pipeline.simulate.clamp_told import REACH_MM, clamp_told, left_out
from pipeline.simulate.departures import departed
from pipeline.simulate.evidence import TraceSamples, covariance_of, disagreeing, posterior, rougher, roughness_mm
from solver import Solution

FIRST_MM, LAST_MM, EVERY_MM = 0.5, 0.5, 0.5  # the trace's own ends are left out
MOST_FRAMES = 12
"""Frames that are fitted, the least deep ones: half of a trace's noise is the reference scan's, which all share, so
that more of them tell hardly more."""
STEP_MM, STEP_RAD, STEP_DEPTH_MM = 0.05, np.radians(0.5), 0.1
ROUNDS, WHOLE_STEPS, SETTLED = 6, 2, 0.1
"""Most Gauss-Newton steps; how many of them are whole, before they are halved, since contacts may make them oscillate;
and the part of the standard deviations below which a step is the last one."""
TIP_VOXELS = 0.25
"""What a traced tip may be off along the wire beyond its own standard deviation. It matters where rest curvature ends
near the entry: 0.3 mm deeper turns such a wire by 2.6 degrees."""
TANGENT_MM = 0.25
"""How far to both sides of a point a wire's tangent is taken."""
ALONG = 0  # of the unknowns: the place along the entry direction, which is held
COARSE_MM = 0.005
"""Segments may be off by so much, root mean square over the points that are fitted: a third of what noise leaves of the
place. Those of 1 mm turned a clamp 2 mm before a bend of 4 mm radius by 2 degrees."""
SNAPS = 3.0
"""A derivative of more than this many times a rigid wire's is a snap: that frame is not used in this round."""


@dataclass(frozen=True)
class TracedFrame:
    """A frame that is fitted: its number, its trace, the base's roll and the catheter's tip."""

    index: int
    curve: Curve
    roll_deg: float = 0.0
    catheter_mm: float = 0.0


@dataclass(frozen=True)
class Prior:
    """How well the manifest knows the clamp, one standard deviation along each axis; 0 is exact."""

    sigma_mm: float
    direction_sigma_deg: float

    @property
    def sigmas(self) -> Array:
        """Of the five unknowns (5,): mm along the direction and twice across it, and two tilts in rad."""
        return np.array([self.sigma_mm] * 3 + [np.radians(self.direction_sigma_deg)] * 2)


Replay = Callable[[Sequence[Clamp], Sequence[TracedFrame], Sequence[Sequence[float]]], Sequence[Sequence[Solution]]]
"""Called with clamps, frames and depths (clamps, frames): the wire of every frame from each clamp."""


def ahead_of(clamp: Clamp, curve: Curve) -> float:
    """How far beyond a clamp's plane a trace begins, mm: it does so in the plane of the manifest's entry."""
    return float((curve.points_mm[0] - clamp.entry_mm) @ clamp.direction)


def depth_from(clamp: Clamp, curve: Curve) -> float:
    """Length of wire beyond a clamp, mm."""
    return curve.length_mm + ahead_of(clamp, curve)


def depths_from(clamp: Clamp, seen: Sequence[TracedFrame], off_mm: Array) -> list[float]:
    """Depths of frames whose traces are off by ``off_mm`` (frames,) along the wire, mm from a clamp."""
    return [max(depth_from(clamp, frame.curve) + off, 0.1) for frame, off in zip(seen, off_mm, strict=True)]


def axes_of(direction: Array) -> Array:
    """Rows (3, 3): the direction, and two axes across it."""
    return np.array([direction, *across(direction)])


def moved(given: Clamp, step: Array) -> Clamp:
    """The clamp displaced by step (5,), see ``Prior.sigmas``."""
    axes = axes_of(given.direction)
    direction = given.direction + step[3:] @ axes[1:]
    return replace(given, entry_mm=given.entry_mm + step[:3] @ axes, direction=direction / np.linalg.norm(direction))


def samples_of(seen: Sequence[TracedFrame]) -> list[TraceSamples]:
    """The points of each trace that are fitted; nothing of a trace that is too short."""
    stops = [min(REACH_MM, frame.curve.length_mm - LAST_MM) + 1e-9 for frame in seen]
    arcs = [np.arange(FIRST_MM, stop, EVERY_MM) for stop in stops]
    return [TraceSamples.of(frame.index, frame.curve, arc) for frame, arc in zip(seen, arcs, strict=True)]


def _feet(trace: TraceSamples, curve: Array) -> tuple[Array, Array]:
    """The nearest points of a curve to a trace's points: arc lengths (n,), not below 0, and tangents (n, 3) there."""
    foot = trace.arc_mm
    for _ in range(3):
        tangent = tangents(curve, foot, TANGENT_MM)
        foot = np.maximum(foot + np.sum((trace.points_mm - at_arc(curve, foot)) * tangent, axis=1), 0.0)
    return foot, tangent


def _at_rest(*wires: Solution) -> bool:
    return all(wire.converged and len(wire.joints_mm) > 1 for wire in wires)


def _linear(wires: Sequence[Solution], trace: TraceSamples, steps: Array) -> tuple[Array, Array, bool]:
    """Residuals (n, 3) of a trace across the wire, their derivatives (n, 3, 6), and whether the frame can be used.

    wires : from the clamp itself, from the clamp moved by each of the first five ``steps`` (6,), and pushed deeper by
    the last of them.
    """
    n = len(trace.points_mm)
    if n == 0 or not _at_rest(*wires):
        return np.zeros((n, 3)), np.zeros((n, 3, len(steps))), False
    curves = [wire.joints_mm for wire in wires]
    foot, tangent = _feet(trace, curves[0])
    here = at_arc(curves[0], foot)
    across = np.eye(3) - tangent[:, :, None] * tangent[:, None, :]
    change = np.stack([(at_arc(c, foot) - here) / h for c, h in zip(curves[1:], steps, strict=True)], axis=2)
    jacobian = across @ change
    rigid = np.ones((n, len(steps)))
    rigid[:, 3:5] += foot[:, None]
    sane = bool(np.all(np.linalg.norm(jacobian, axis=1) < SNAPS * rigid))
    return np.einsum("nij,nj->ni", across, trace.points_mm - here), jacobian, sane


_Seen = tuple[list[Array], list[Array], NDArray[np.bool_]]
"""Residuals and derivatives of each frame, and which frames can be used."""


class _Round(NamedTuple):
    """A step of the fit: the next values, their covariance, the frames that disagree, those used, and how rough their
    traces are beyond what they state, mm."""

    goal: Array
    covariance: Array
    out: list[int]
    used: list[int]
    rough_mm: float


@dataclass(frozen=True)
class _Fit:
    """What stays the same from step to step."""

    seen: Sequence[TracedFrame]
    traces: Sequence[TraceSamples]
    given: Clamp
    sigmas: Array
    replay: Replay
    voxel_mm: float

    def ended(self, at: Array) -> tuple[Array, _Round]:
        """The values (5 + frames,) at which the steps from others come to an end, and the last of these."""
        for number in range(ROUNDS):
            last = self.round(at)
            step = (last.goal - at) * (1.0 if number < WHOLE_STEPS else 0.5)
            at = at + step
            if np.all(np.abs(step) <= SETTLED * np.sqrt(np.diag(last.covariance))):
                break
        return at, last

    def too_coarse(self, at: Array, shorter: Replay) -> bool:
        """Whether wires of shorter segments lie elsewhere where they are fitted, at values (5 + frames,)."""
        clamp = moved(self.given, at[:5])
        depths = depths_from(clamp, self.seen, at[5:])
        long, short = (replay([clamp], self.seen, [depths])[0] for replay in (self.replay, shorter))
        pairs = [(a, b, t.arc_mm) for a, b, t in zip(long, short, self.traces, strict=True) if _at_rest(a, b)]
        apart = [at_arc(a.joints_mm, arc) - at_arc(b.joints_mm, arc) for a, b, arc in pairs if len(arc)]
        return any(np.sqrt(np.mean(np.sum(off**2, axis=1))) > COARSE_MM for off in apart)

    def look(self, at: Array) -> _Seen:
        """Residuals and derivatives of each frame at values (5 + frames,), and which frames can be used."""
        steps = np.array([STEP_MM] * 3 + [STEP_RAD] * 2 + [STEP_DEPTH_MM])
        clamps = [moved(self.given, at[:5] + d) for d in (np.zeros(5), *np.diag(steps[:5]), np.zeros(5))]
        more = at[5:] + np.array([0.0] * 6 + [STEP_DEPTH_MM])[:, None]
        depths = [depths_from(clamp, self.seen, off) for clamp, off in zip(clamps, more, strict=True)]
        wires = self.replay(clamps, self.seen, depths)
        residual, jacobian, good = [], [], np.zeros(len(self.seen), bool)
        for i, trace in enumerate(self.traces):
            left, slopes, good[i] = _linear([way[i] for way in wires], trace, steps)
            wide = np.zeros((*left.shape, len(at)))
            wide[:, :, :5], wide[:, :, 5 + i] = slopes[:, :, :5], slopes[:, :, 5]
            residual.append(left)
            jacobian.append(wide)
        return residual, jacobian, good

    def round(self, at: Array) -> _Round:
        """The next step; where most frames disagree and their traces are rough, with that as an error of theirs."""
        seen = self.look(at)
        found = self.step(at, seen, self.traces)
        if len(found.out) < len(found.used):
            return found
        good = [i for i, used in enumerate(seen[2]) if used]
        rough = roughness_mm([seen[0][i] for i in good], [self.traces[i] for i in good], self.voxel_mm)
        return self.step(at, seen, [replace(trace, rough_mm=rough) for trace in self.traces]) if rough else found

    def step(self, at: Array, seen: _Seen, traces: Sequence[TraceSamples]) -> _Round:
        """The next values by what was ``seen`` at those before, without frames that disagree."""
        residual, jacobian, good = seen
        out: list[int] = []
        while True:
            use = [i for i in range(len(good)) if good[i] and i not in out]
            rough = traces[0].rough_mm
            if not use:
                return _Round(np.zeros(len(at)), np.diag(self.sigmas**2), out, [], rough)
            used = [traces[i] for i in use]
            stacked = [np.concatenate([a[i] for i in use]) for a in (residual, jacobian)]
            noise = covariance_of(used, self.voxel_mm)
            held = np.arange(len(at)) == ALONG
            mean, spread, left = posterior(stacked[0], stacked[1], noise, self.sigmas, held, at)
            worst = disagreeing(left, used, self.voxel_mm)
            if worst is None or len(use) < 3:
                return _Round(mean, spread, out, use, rough)
            out.append(use[worst])


def estimated_clamp(
    seen: Sequence[TracedFrame], given: Clamp, prior: Prior, replays: tuple[Replay, Replay], voxel_mm: float
) -> Clamp:
    """The clamp from the traces and what the manifest says of it; the manifest's where they are too far apart.

    seen : frames whose traces are to be trusted, in the order of the insertion.     replays : with long segments, and
    with shorter ones.     voxel_mm : of the scans.
    """
    deepest = sorted(f.curve.length_mm for f in seen)[:MOST_FRAMES][-1:]
    chosen = [f for f in seen if f.curve.length_mm <= deepest[0]] if deepest else []
    given = replace(given, covariance=_in_space(given, np.diag(prior.sigmas**2)))
    if not chosen or not prior.sigmas.any():
        return given
    tips = [np.nan_to_num(f.curve.tip_sigma_mm) for f in chosen]
    sigmas = np.concatenate([prior.sigmas, np.hypot(tips, TIP_VOXELS * voxel_mm)])
    fit = _Fit(chosen, samples_of(chosen), given, sigmas, replays[0], voxel_mm)
    at, last = fit.ended(np.zeros(len(sigmas)))
    if fit.too_coarse(at, replays[1]):
        at, last = replace(fit, replay=replays[1]).ended(at)
    found = moved(given, at[:5])
    out, used = (tuple(chosen[i].index for i in which) for which in (last.out, last.used))
    found = replace(found, covariance=_in_space(given, last.covariance[:5, :5]), fitted=used, left_out=out)
    contradiction = departed(given, found, prior.sigma_mm, prior.direction_sigma_deg)
    left = left_out({frame.index: frame.curve for frame in chosen}, out, len(used))
    told = clamp_told(given, found, left, used, contradiction)
    rough = rougher(last.rough_mm, fit.traces, voxel_mm)
    return replace(told, warning="; ".join(filter(None, (told.warning, rough))))


def _in_space(clamp: Clamp, covariance: Array) -> Array:
    """Covariance (6, 6) of the place, mm, and of the direction's change, from that of ``moved``'s five unknowns."""
    axes = axes_of(clamp.direction)
    turn = np.zeros((6, 5))
    turn[:3, :3], turn[3:, 3:] = axes.T, axes[1:].T
    return np.asarray(turn @ covariance @ turn.T)
