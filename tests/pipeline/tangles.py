"""Wires that are hard to follow: gaps, crossings, parallel turns. One scene per seed, the lumen being a wide tank."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.model import Lumen, Volume
from pipeline.trace import trace
from solver.grid import Grid
from tests.pipeline import phantoms

VOXEL = 0.3
PSF = 0.8
RADIUS = 0.2
PEAK = phantoms.wire_peak(RADIUS / VOXEL, PSF)


@dataclass(frozen=True, eq=False)
class Tangle:
    """A wire (n, 3), the stretches (start, stop in mm of arc) of it that the scan does not show, and what it is."""

    kind: str
    points: np.ndarray
    gaps: tuple[tuple[float, float], ...] = ()


def _arc(points):
    return np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def gapped(rng):
    """A wandering wire with two gaps of 3 to 12 voxels."""
    points = phantoms.random_curve(int(rng.integers(1 << 30)), length=36.0, bend=0.05)
    starts = (rng.uniform(8, 14), rng.uniform(20, 26))
    return Tangle("gap", points, tuple((s, s + VOXEL * rng.uniform(3, 12)) for s in starts))


def crossing(rng, clear=None):
    """A loop whose strands cross at 50 to 90 degrees, 1.3 to 3 voxels apart: in contact at the least."""
    clear = VOXEL * rng.uniform(1.33, 3.0) if clear is None else clear
    scale, slope = rng.uniform(1.1, 1.8), rng.uniform(0.85, 1.7)
    t = np.linspace(-2.5, 2.5, 6000)
    # the cubic (t^3 - 3 t, slope t^2) crosses itself at t = +-sqrt 3
    points = scale * np.stack([t**3 - 3 * t, slope * t**2, np.zeros_like(t)], axis=1)
    points[:, 2] = clear * np.clip(t / (2 * np.sqrt(3)) + 0.5, -0.2, 1.2)
    return Tangle("crossing", phantoms.resample(points, 0.05))


def coil(rng, pitch=None):
    """Parallel turns at 3 to 6 voxels."""
    pitch = VOXEL * rng.uniform(3.0, 6.0) if pitch is None else pitch
    radius, turns = rng.uniform(4.0, 6.0), rng.uniform(1.8, 2.6)
    a = np.linspace(0, 2 * np.pi * turns, 4000)
    helix = np.stack([radius * np.cos(a), radius * np.sin(a), pitch * a / (2 * np.pi)], axis=1)
    t = helix[0] - helix[1]
    lead = helix[0] + np.linspace(rng.uniform(5, 8), 0, 300)[:-1, None] * t / np.linalg.norm(t)
    return Tangle("coil", phantoms.resample(np.concatenate([lead, helix]), 0.05))


def tangle(seed, kind=None):
    """The tangle of a seed; kinds take turns."""
    rng = np.random.default_rng(seed)
    return (gapped, crossing, coil)[seed % 3 if kind is None else kind](rng)


def _rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))


def tank(points, margin=3.0):
    """A box-shaped lumen around a wire, its walls 1 mm off and more: origin, shape, Lumen."""
    origin = points.min(axis=0) - margin
    shape = tuple(np.ceil((points.max(axis=0) + margin - origin) / VOXEL).astype(int))
    index = np.stack(np.meshgrid(*[np.arange(n) for n in shape], indexing="ij"), axis=-1)
    low, high = np.full(3, 1.5), np.array(shape) * VOXEL - 1.5
    x = index * VOXEL
    depth = np.minimum(x - low, high - x).min(axis=-1)
    distance = Grid((-depth).astype(np.float32), [VOXEL] * 3, origin)
    return origin, shape, Lumen(distance)


def clean_frame(wire: Tangle, origin, shape):
    """Grey values of the tank with the wire in it, before blur."""
    clean = np.full(shape, phantoms.CONTRAST, np.float32)
    arc = _arc(wire.points)
    edges = [0.0, *[x for gap in wire.gaps for x in gap], arc[-1]]
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        part = wire.points[(arc >= begin) & (arc <= end)]
        phantoms.add_wire(clean, part, RADIUS, phantoms.WIRE, VOXEL, origin)
    return clean


@dataclass(frozen=True, eq=False)
class Outcome:
    """One traced tangle: errors in voxels; flagged = the curve says that it may be wrong."""

    kind: str
    mean: float
    worst: float
    tip: float
    coverage: float
    status: str
    flagged: bool

    @property
    def right(self) -> bool:
        """On the wire everywhere (gaps allow 3 voxels), all of it, up to the tip, without steps back."""
        return self.mean < 0.6 and self.worst < 3.0 and self.coverage > 0.98 and self.tip < 3.0


def judge(curve, wire: Tangle) -> Outcome:
    """Errors of a curve in arc order: the wire must be walked forwards, so each point is compared ahead only."""
    if len(curve.points_mm) == 0:
        return Outcome(wire.kind, np.inf, np.inf, np.inf, 0.0, curve.status.name, True)
    true = wire.points
    foot, errors, seen = 0, [], np.zeros(len(true), bool)
    for p in curve.points_mm:
        window = slice(max(0, foot - 10), foot + 40)
        d = np.linalg.norm(true[window] - p, axis=1)
        foot = window.start + int(np.argmin(d))
        errors.append(d.min() / VOXEL)
        seen[max(0, foot - 8) : foot + 9] = True
    tip = float(np.linalg.norm(curve.points_mm[-1] - true[-1]) / VOXEL)
    flagged = curve.status.name != "OK"
    return Outcome(
        wire.kind, float(np.mean(errors)), float(np.max(errors)), tip, float(seen.mean()), curve.status.name, flagged
    )


def run(seed, cnr=8.0, kind=None, previous=None, wire=None, expected=True, correlation=0.0):
    """Trace the tangle of a seed at a contrast over noise; returns curve and outcome."""
    rng = np.random.default_rng(seed + 10_000)
    wire = tangle(seed, kind) if wire is None else wire
    turn = _rotation(rng)
    wire = Tangle(wire.kind, wire.points @ turn.T, wire.gaps)
    origin, shape, lumen = tank(wire.points)
    noise = PEAK / cnr
    empty = np.full(shape, phantoms.CONTRAST, np.float32)
    frame = phantoms.scan(clean_frame(wire, origin, shape), PSF, noise, seed * 2 + 1, correlation)
    reference = phantoms.scan(empty, PSF, noise, seed * 2 + 2, correlation)
    volume, still = (Volume(np.asfortranarray(v), [VOXEL] * 3, origin) for v in (frame, reference))
    entry = wire.points[20]
    direction = wire.points[25] - wire.points[15]
    depth = _arc(wire.points)[-1] - 1.0
    if previous is not None:
        previous = previous @ turn.T
        from pipeline.model import Curve

        previous = Curve(previous, np.full(len(previous), 0.03))
    curve = trace(
        volume, lumen, entry, direction, reference=still, previous=previous, expected_mm=depth if expected else None
    )
    rest = Tangle(wire.kind, wire.points[20:], ())
    return curve, judge(curve, rest)
