"""Scenes in which it is tempting to be wrong: one function a case, one scene a seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from pipeline.model import Volume
from tests.studies.seeing import render as r

CASES: dict[str, Callable] = {}


def case(name):
    def register(function):
        CASES[name] = function
        return function

    return register


@dataclass(frozen=True, eq=False)
class Scene:
    """Scans, the true wire from entry to tip (None: there is none), what the manifest says, and the true vessel.

    voxel : smallest edge, mm.  tip_cnr : of the
    wire's last piece.  gaps : arcs (mm from the entry) that the scan does not show.  stated : more that the manifest
    says, as arguments of ``trace``.
    """

    frame: Volume
    reference: Volume | None
    wire: np.ndarray | None
    entry: np.ndarray
    direction: np.ndarray
    axis: np.ndarray
    radius: np.ndarray
    voxel: float
    cnr: float
    tip_cnr: float
    gaps: tuple = ()
    stated: dict = field(default_factory=dict)
    wire_radius: float = 0.2


class Draft:
    """A vessel with a wire in it, of one random generator, to be changed by a case before it is scanned."""

    def __init__(self, rng, length=42.0, bend=0.06, spacing=0.3, radius=None, wire_radius=0.2, room=0.3):
        self.rng, self.wire_radius = rng, wire_radius
        self.axis = r.wandering(rng, length, bend) @ turned(rng).T
        arc = self.arc = r.arc_of(self.axis)
        radius = rng.uniform(1.5, 2.2) if radius is None else radius
        self.radius = radius * (1 + 0.1 * np.sin(arc * rng.uniform(0.2, 0.5) + rng.uniform(0, 6)))
        self.level = np.ones(len(arc))
        path = r.beside(self.axis, np.maximum(self.radius - wire_radius - room, 0.0), rng)
        stop = len(path) - round(rng.uniform(0.1, 0.35) * length / 0.05)
        self.path = path[20:stop]
        self.entry_at = 60  # 3 mm of wire before the entry
        self.opacity = np.ones(len(self.path))
        self.lattice = r.Lattice.around(self.axis, radius + 2.5, spacing, rng, rng.uniform(0.7, 0.9))
        self.gain, self.correlation, self.direction = 1.0, 0.0, None
        self.more, self.others, self.shown, self.stated = [], [], True, {}

    @property
    def from_tip(self):
        arc = r.arc_of(self.path)
        return arc[-1] - arc

    def scan(self, cnr, reference=True, gaps=()):
        """The scene, its wire ``cnr`` noises bright."""
        rng, lattice = self.rng, self.lattice
        lumen = r.vessel(lattice, self.axis, self.radius, self.level)
        empty = r.TISSUE + r.CONTRAST * lumen
        for share, grey in self.more:  # what is bright and no wire: bone, branches; as bright in both scans
            empty = np.maximum(empty, r.TISSUE + grey * share)
        filled = r.TISSUE + self.gain * (empty - r.TISSUE)
        if self.shown:
            keep = max(1, round(0.3 * lattice.spacing.min() / 0.05))
            for curve, radius, opacity in [(self.path, self.wire_radius, self.opacity), *self.others]:
                opacity = np.broadcast_to(opacity, len(curve))
                # the last point is the tip: left out of every second wire, that was drawn 0.17 voxel short of the truth
                kept = slice((len(curve) - 1) % keep, None, keep)
                filled = filled + r.METAL * r.wire(lattice, curve[kept], radius, opacity[kept])
        sd = r.peak(lattice, self.wire_radius) / cnr
        frame, still = (
            Volume(r.noisy(g, sd, rng, self.correlation), lattice.spacing, lattice.origin) for g in (filled, empty)
        )
        n = self.entry_at
        towards = self.path[n + 8] - self.path[n - 8] if self.direction is None else self.direction
        shift = rng.normal(size=3)
        shift *= 0.5 * lattice.spacing.min() / np.linalg.norm(shift)
        return Scene(
            frame, still if reference else None, self.path[n:] if self.shown else None, self.path[n] + shift,
            towards / np.linalg.norm(towards), self.axis, self.radius, float(lattice.spacing.min()), cnr,
            cnr * min(1.0, float(self.opacity[-1])), gaps, self.stated, self.wire_radius,
        )  # fmt: skip


def turned(rng):
    q, up = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(up))
    return q * np.sign(np.linalg.det(q))


def sideways(path, rng, apart):
    """A curve beside another at a distance, on one side."""
    t = np.gradient(path, axis=0)
    t /= np.linalg.norm(t, axis=1)[:, None]
    side = np.cross(t, rng.normal(size=3))
    return path + apart * side / np.linalg.norm(side, axis=1)[:, None]


@case("plain")
def plain(rng, seed):
    return Draft(rng).scan((16, 8, 4)[seed % 3])


@case("plain, no reference")
def plain_alone(rng, seed):
    return Draft(rng).scan((16, 8, 4)[seed % 3], reference=False)


@case("no wire, contrast x 1.15 to 1.6")
def brighter(rng, seed):
    d = Draft(rng, radius=rng.uniform(0.7, 1.2), wire_radius=0.15) if seed % 2 else Draft(rng)
    d.shown, d.gain = False, (1.3, 1.15, 1.6, 1.3, 0.7)[seed % 5]
    return d.scan((8, 16, 24)[seed % 3])


@case("no wire, no reference")
def nothing(rng, seed):
    d = Draft(rng)
    d.shown = False
    return d.scan((8, 16)[seed % 2], reference=False)


@case("wire, contrast x 0.7 to 1.4")
def gain(rng, seed):
    d = Draft(rng, radius=rng.uniform(0.8, 2.0), wire_radius=0.18)
    d.gain = (0.8, 1.3, 0.7, 1.4)[seed % 4]
    return d.scan((8, 16)[seed // 4 % 2])


@case("correlated noise, CNR 4 to 6")
def correlated(rng, seed):
    d = Draft(rng)
    d.correlation = 0.8
    return d.scan((4, 5, 6)[seed % 3])


@case("platinum coil tip, x 3 to 10")
def platinum(rng, seed):
    d = Draft(rng, length=48.0)
    d.opacity = np.where(d.from_tip < 20.0, rng.uniform(3, 10), 1.0)
    return d.scan((8, 16)[seed // 2 % 2], reference=seed % 2 == 0)


@case("marker band before the tip")
def band(rng, seed):
    d = Draft(rng)
    off = rng.uniform(2.0, 5.0) if seed % 2 else 3.0
    d.opacity = np.where(np.abs(d.from_tip - off - 0.5) < 0.5, rng.uniform(2.5, 4), 1.0)
    return d.scan((8, 16)[seed // 2 % 2], reference=seed % 4 < 3)


@case("dim distal part, x 0.15 to 0.2")
def dim(rng, seed):
    d = Draft(rng)
    d.opacity = np.where(d.from_tip < rng.uniform(3, 18), rng.uniform(0.15, 0.2), 1.0)
    return d.scan((10, 16)[seed // 2 % 2], reference=seed % 4 < 3)


@case("a catheter over the wire")
def catheter(rng, seed):
    d = Draft(rng)
    tip = round(rng.uniform(0.2, 0.7) * len(d.path))
    d.others = [(d.path[:tip], 0.45, 0.12)]
    if seed % 2:  # with markers
        on = np.zeros(tip)
        on[-25:-5] = 0.6
        on[-125:-105] = 0.6
        d.others.append((d.path[:tip], 0.45, on))
    return d.scan((8, 16)[seed // 2 % 2])


@case("wire out of the scan")
def leaves(rng, seed):
    d = Draft(rng)
    cut_at = d.path[round(rng.uniform(0.55, 0.9) * len(d.path))]
    end = d.path[-1] - d.path[0]
    axis = int(np.argmax(np.abs(end)))
    n = round(float((cut_at - d.lattice.origin)[axis] / d.lattice.spacing[axis]))
    low, high = np.zeros(3, int), np.array(d.lattice.shape)
    if end[axis] > 0:
        high[axis] = n
    else:
        low[axis] = n
    lattice = d.lattice
    d.lattice = r.Lattice(
        tuple((high - low).tolist()), lattice.spacing, lattice.origin + low * lattice.spacing, lattice.blur
    )
    return d.scan((8, 16)[seed % 2], reference=seed % 4 < 3)


@case("wire from a side branch")
def side(rng, seed):
    d = Draft(rng, radius=1.7)
    n = round(10 / 0.05)
    t = d.axis[n + 5] - d.axis[n - 5]
    t /= np.linalg.norm(t)
    u = np.cross(t, rng.normal(size=3))
    u /= np.linalg.norm(u)
    angle = np.radians(rng.uniform(35, 80))
    back = -np.cos(angle) * t + np.sin(angle) * u
    branch = d.axis[n] + np.linspace(12, 0, 200)[:, None] * back
    way = np.concatenate([branch[60:-60:10], d.axis[n + 50 : -200 : 40]])
    d.path = r.even(way, 0.05)
    d.opacity = np.ones(len(d.path))
    d.entry_at = 100
    d.direction = t
    box = np.concatenate([d.axis, branch])
    d.lattice = r.Lattice.around(box, 4.0, 0.3, rng, 0.8)
    d.more = [(r.vessel(d.lattice, branch, 1.2), r.CONTRAST)]
    return d.scan((8, 16)[seed % 2], reference=seed % 4 < 3)


def gap_of(rng, seed, after):
    d = Draft(rng)
    size = rng.uniform(5, 8)
    d.opacity = np.where((d.from_tip > after) & (d.from_tip < after + size), 0.0, 1.0)
    whole = r.arc_of(d.path[d.entry_at :])[-1]
    gaps = ((whole - after - size, whole - after),)
    return d.scan((8, 16)[seed // 2 % 2], reference=seed % 4 < 3, gaps=gaps)


@case("gap of 5 to 8 mm")
def gap(rng, seed):
    return gap_of(rng, seed, rng.uniform(6, 14))


@case("gap of 5 to 8 mm, 2 to 4 mm of tip beyond")
def late_gap(rng, seed):
    return gap_of(rng, seed, rng.uniform(2, 4))


@case("two wires 0.8 mm apart")
def two(rng, seed):
    d = Draft(rng, radius=2.2, room=0.8)
    other = sideways(d.path, rng, rng.uniform(0.6, 1.0) if seed % 2 else 0.8)
    d.others = [(other, d.wire_radius, 1.0)]
    if seed % 3 == 2:  # side by side for 15 mm only
        d.others = [(other[:300], d.wire_radius, 1.0)]
    return d.scan((8, 16)[seed // 2 % 2], reference=seed % 4 < 3)


@case("tip folded back on itself")
def folded(rng, seed):
    d = Draft(rng, radius=2.2, room=0.8)
    back = sideways(d.path, rng, rng.uniform(0.4, 0.8))[-round(rng.uniform(5, 10) / 0.05) :][::-1]
    far = d.path[-1] - d.path[-10]
    turn = 0.5 * (d.path[-1] + back[0]) + 0.4 * far / np.linalg.norm(far)
    d.path = r.even(np.concatenate([d.path[:-8:20], turn[None], back[8::20]]), 0.05)
    d.opacity = np.ones(len(d.path))
    return d.scan((8, 16)[seed // 2 % 2], reference=seed % 4 < 3)


@case("entry_direction the wrong way round")
def backwards(rng, seed):
    d = Draft(rng)
    d.direction = d.path[d.entry_at - 8] - d.path[d.entry_at + 8]
    return d.scan((8, 16)[seed % 2], reference=seed % 4 < 3)


@case("0.9 mm wire, 0.1 mm voxels")
def thick(rng, seed):
    d = Draft(rng, length=14.0, spacing=0.1, radius=1.6, wire_radius=0.45, room=0.2)
    return d.scan(8, reference=seed % 2 == 0)


@case("slices of 2 mm")
def slices(rng, seed):
    d = Draft(rng, length=60.0, spacing=(0.5, 0.5, 2.0), radius=3.5, wire_radius=0.3)
    return d.scan((8, 16)[seed % 2], reference=seed % 4 < 3)


def narrowed(rng, seed, reference):
    d = Draft(rng, radius=1.5)
    d.radius[:] = 1.5
    at, neck = rng.uniform(14, 22), 0.3 * rng.uniform(0.7, 1.2)
    d.radius -= (1.5 - neck) * np.exp(-(((d.arc - at) / rng.uniform(1.5, 3.0)) ** 2))
    room = np.clip(d.radius - d.wire_radius - 0.25, 0.0, None)
    path = r.beside(d.axis, room, rng)
    d.path = path[20 : 20 + len(d.path)]
    d.opacity = np.ones(len(d.path))
    return d.scan((8, 16)[seed % 2], reference=reference)


@case("stenosis")
def stenosis(rng, seed):
    return narrowed(rng, seed, True)


@case("stenosis, no reference")
def stenosis_alone(rng, seed):
    return narrowed(rng, seed, False)


@case("contrast that decays by 60 %")
def decay(rng, seed):
    d = Draft(rng)
    d.level = 1.0 - 0.6 * d.arc / d.arc[-1]
    return d.scan((8, 16)[seed // 2 % 2], reference=seed % 2 == 0)


@case("layered filling")
def layered(rng, seed):
    d = Draft(rng)
    at, low = rng.uniform(12, 28), rng.uniform(0.4, 0.6)
    d.level = low + (1 - low) / (1 + np.exp((d.arc - at) / 1.5))
    return d.scan((8, 16)[seed // 2 % 2], reference=seed % 2 == 0)


@case("bone that touches")
def bone(rng, seed):
    d = Draft(rng)
    n = round(rng.uniform(12, 25) / 0.05)
    t = d.axis[n + 5] - d.axis[n - 5]
    u = np.cross(t, rng.normal(size=3))
    u /= np.linalg.norm(u)
    size = rng.uniform(2.5, 4.0)
    centre = d.axis[n] + (d.radius[n] + size - 0.1) * u
    along = np.cross(u, t / np.linalg.norm(t)) + rng.normal(size=3) * 0.3
    spine = centre + np.linspace(-6, 6, 240)[:, None] * along / np.linalg.norm(along)
    d.lattice = r.Lattice.around(np.concatenate([d.axis, spine]), 5.0, 0.3, rng, 0.8)
    d.more = [(r.vessel(d.lattice, spine, size), rng.uniform(1.2, 2.2) * r.CONTRAST)]
    return d.scan((8, 16)[seed % 2], reference=seed % 2 == 0)


def at_a_side(rng, sine, at, beyond):
    """A vessel whose wire makes an angle with the scan's third side at its point ``at`` (share of its length); the scan
    ends ``beyond`` (mm) that point.
    """
    while True:
        d = Draft(rng, bend=0.03)
        n = round(at * (len(d.path) - 1))
        t = d.path[n] - d.path[n - 20]
        phi, flat = rng.uniform(0, 2 * np.pi), np.sqrt(1 - sine**2)
        to = [flat * np.cos(phi), flat * np.sin(phi), sine]
        turn = Rotation.align_vectors([to], [t / np.linalg.norm(t)])[0]
        d.axis, d.path = turn.apply(d.axis), turn.apply(d.path)
        full = d.lattice = r.Lattice.around(d.axis, d.radius.max() + 2.5, 0.3, rng, d.lattice.blur)
        layers = min(full.shape[2], round((d.path[n, 2] + beyond - full.origin[2]) / 0.3))
        top = full.origin[2] + 0.3 * layers
        # only scenes in which nothing else of the wire comes near that side
        if d.path[: n - 60, 2].max() < top - 1.0 and (at == 1 or d.path[-1, 2] > top + 0.5):
            d.lattice = r.Lattice((*full.shape[:2], layers), full.spacing, full.origin, full.blur)
            return d


@case("wire out of the scan at a shallow angle")
def leaves_slowly(rng, seed):
    d = at_a_side(rng, rng.uniform(0.15, 0.5), rng.uniform(0.55, 0.9), 0.0)
    return d.scan((4, 8, 16)[seed % 3], reference=seed % 4 < 3)


@case("tip 2 to 5 voxels from the scan's side")
def tip_at_side(rng, seed):
    d = at_a_side(rng, rng.uniform(0.0, 1.0), 1, rng.uniform(0.9, 1.5))
    return d.scan((8, 16)[seed % 2], reference=seed % 4 < 3)


def with_profile(rng, length, level):
    """A wire whose last ``length`` mm have ``level`` times the brightness, and a manifest that says so, nearly."""
    d = Draft(rng, length=48.0)
    d.opacity = np.where(d.from_tip < length, level, 1.0)
    told = length + rng.normal(scale=0.2)
    d.stated["opacity"] = [(0.0, level * rng.uniform(0.8, 1.25)), (told, level), (told, 1.0)]
    return d


@case("platinum coil tip, opacity stated")
def platinum_stated(rng, seed):
    d = with_profile(rng, 20.0, rng.uniform(3, 10))
    return d.scan((8, 16)[seed // 2 % 2], reference=seed % 2 == 0)


@case("dim distal part, opacity stated")
def dim_stated(rng, seed):
    d = with_profile(rng, rng.uniform(3, 18), rng.uniform(0.15, 0.2))
    return d.scan((10, 16)[seed // 2 % 2], reference=seed % 4 < 3)


@case("slices of 2 mm, insertion_mm stated")
def slices_stated(rng, seed):
    d = Draft(rng, length=60.0, spacing=(0.5, 0.5, 2.0), radius=3.5, wire_radius=0.3)
    d.stated["expected_mm"] = float(r.arc_of(d.path[d.entry_at :])[-1] + rng.normal(scale=0.5))
    return d.scan((8, 16)[seed % 2], reference=seed % 4 < 3)


@case("a catheter that reaches beyond the wire")
def catheter_beyond(rng, seed):
    d = Draft(rng)
    whole, tip = d.path, len(d.path) - round(rng.uniform(2.0, 15.0) / 0.05)
    d.path, d.opacity = whole[:tip], np.ones(tip)
    radius, level = rng.uniform(0.3, 0.55), rng.uniform(0.08, 0.25)
    d.others = [(whole, radius, level)]
    if seed % 2:  # with a marker at its end
        d.others.append((whole[-30:-10], radius, 0.6))
    return d.scan((8, 16)[seed // 2 % 2])


@case("a marker at the tip, beyond 5 to 15 mm unseen")
def lone_marker(rng, seed):
    d = Draft(rng)
    size = rng.uniform(5.0, 15.0)
    d.opacity = np.where((d.from_tip > 1.0) & (d.from_tip < 1.0 + size), 0.0, 1.0)
    whole = r.arc_of(d.path[d.entry_at :])[-1]
    return d.scan((8, 16)[seed // 2 % 2], reference=seed % 4 < 3, gaps=((whole - 1.0 - size, whole - 1.0),))


@case("a longer device 0.4 to 0.6 mm beside the wire")
def longer_beside(rng, seed):
    d = Draft(rng, radius=2.2, room=0.8)
    whole, tip = d.path, len(d.path) - round(rng.uniform(8.0, 16.0) / 0.05)
    d.path, d.opacity = whole[:tip], np.ones(tip)
    d.others = [(sideways(whole, rng, rng.uniform(0.4, 0.6)), d.wire_radius, rng.uniform(0.7, 1.3))]
    return d.scan((8, 16)[seed // 2 % 2], reference=seed % 4 < 3)


@case("a streak beyond the tip, x 0.1 to 0.3")
def streak(rng, seed):
    d = Draft(rng, radius=2.5)
    t = d.path[-1] - d.path[-20]
    t /= np.linalg.norm(t)
    line = d.path[-1] + np.linspace(0.3, rng.uniform(4.0, 10.0), 200)[:, None] * t
    d.others = [(line, d.wire_radius, rng.uniform(0.1, 0.3))]
    return d.scan((8, 16)[seed // 2 % 2], reference=seed % 4 < 3)


@case("0.9 mm wire, voxels of 0.1 to 0.3 mm, no reference")
def thick_alone(rng, seed):
    spacing = (0.1, 0.15, 0.2, 0.3)[seed % 4]
    length = 14.0 if spacing < 0.2 else 36.0
    d = Draft(rng, length=length, spacing=spacing, radius=rng.uniform(1.2, 2.2), wire_radius=0.45, room=0.05)
    return d.scan((8, 12, 16)[seed // 4 % 3], reference=False)


@case("two wires that touch all along")
def touching(rng, seed):
    radius = rng.uniform(0.15, 0.25)
    d = Draft(rng, radius=2.2, wire_radius=radius, room=0.6)
    other = sideways(d.path, rng, 2.0 * radius)
    stop = len(other) - (0 if seed % 3 else round(rng.uniform(2, 10) / 0.05))
    d.others = [(other[:stop], radius, 1.0 if seed % 2 else rng.uniform(0.7, 1.3))]
    return d.scan((6, 8, 16, 24)[seed // 2 % 4], reference=seed % 4 < 2)


@case("plain, slices of 0.4 to 0.6 mm")
def uneven_voxels(rng, seed):
    return Draft(rng, spacing=(0.3, 0.3, rng.uniform(0.4, 0.6))).scan((16, 8, 4)[seed % 3], reference=seed % 2 == 0)


@case("wire out of the round field of view")
def leaves_the_circle(rng, seed):
    """What a scanner reconstructs is a cylinder in its box; around it there is one grey, in both scans."""
    d = Draft(rng)
    scene = d.scan((8, 16)[seed % 2], reference=seed % 4 < 3)
    away = np.linalg.norm((scene.wire - scene.entry)[:, :2], axis=1)
    reach = rng.uniform(0.5, 0.9) * away.max()
    grid = scene.frame
    at = [grid.origin_mm[k] + grid.spacing_mm[k] * np.arange(grid.shape[k]) - scene.entry[k] for k in (0, 1)]
    out = np.hypot(*np.meshgrid(*at, indexing="ij"))[..., None] > reach
    grey = (0.0, r.TISSUE, -1000.0)[seed // 4 % 3]
    scans = [s and replace(s, values=np.where(out, grey, s.values)) for s in (scene.frame, scene.reference)]
    return replace(scene, frame=scans[0], reference=scans[1])


@case("a piece of wire in the reference, where the wire ends")
def left_in_reference(rng, seed):
    d = Draft(rng, radius=2.2, room=0.8)
    scene = d.scan((8, 16)[seed % 2])
    piece = d.path[-round(rng.uniform(5.0, 10.0) / 0.05) :: 6]
    left = r.METAL * r.wire(d.lattice, piece, d.wire_radius, np.ones(len(piece)))
    return replace(scene, reference=replace(scene.reference, values=scene.reference.values + left))


@case("an end of plastic, darker than the contrast medium")
def dark_end(rng, seed):
    d = Draft(rng, radius=2.2, room=0.6)
    d.opacity = np.where(d.from_tip < rng.uniform(4.0, 8.0), -rng.uniform(0.2, 0.4), 1.0)
    return d.scan((8, 16)[seed % 2], reference=seed % 4 < 2)


@case("contrast that has settled")
def settled(rng, seed):
    d = Draft(rng, radius=rng.uniform(1.5, 2.5))
    faint, edge = rng.uniform(0.4, 0.75), rng.uniform(0.1, 0.4)
    down = np.cross(d.axis[-1] - d.axis[0], rng.normal(size=3))
    centres = d.lattice.centres()
    at = cKDTree(d.axis).query(centres)[1]
    depth = (centres - d.axis[at]) @ down / np.linalg.norm(down) - rng.uniform(-0.5, 0.5) * d.radius[at]
    share = (faint + (1 - faint) / (1 + np.exp(-depth / edge))).reshape(d.lattice.shape)
    d.more = [(share * r.vessel(d.lattice, d.axis, d.radius), r.CONTRAST)]
    d.level *= 0  # all of it is drawn by ``more``
    return d.scan((8, 16)[seed // 2 % 2], reference=seed % 2 == 0)


@case("a bead or a jet of contrast ahead of the tip")
def wider_ahead(rng, seed):
    """Wider than the wire, in the frame alone: a bead 0.5 mm beside its line, or medium that fades over 3 mm."""
    d = Draft(rng, radius=2.5, room=1.0)
    t = d.path[-1] - d.path[-20]
    t /= np.linalg.norm(t)
    if seed % 2:
        line = sideways(d.path[-1] + np.linspace(0.5, 1.3, 16)[:, None] * t, rng, 0.5)
        d.others = [(line, 0.5, rng.uniform(0.3, 0.8))]
    else:
        along = np.linspace(0.0, 3.0, 61)
        d.others = [(d.path[-1] + along[:, None] * t, rng.uniform(0.45, 0.6), rng.uniform(0.1, 0.25) * (1 - along / 3))]
    return d.scan((8, 16)[seed // 2 % 2], reference=seed % 4 < 2)


def less_sharp(scene, ratio, axis):
    """The scene as a scanner sees it whose blur is so many times as large along one axis."""
    more = np.sqrt(ratio**2 - 1.0) * 0.85
    scans = (
        scan and replace(scan, values=ndimage.gaussian_filter1d(scan.values.astype(np.float32), more, axis=axis))
        for scan in (scene.frame, scene.reference)
    )
    return replace(scene, **dict(zip(("frame", "reference"), scans, strict=True)))


@case("a scanner less sharp along one axis")
def uneven_blur(rng, seed):
    """One wire looks like two in contact."""
    ratio = rng.uniform(1.1, 1.4)
    return less_sharp(Draft(rng).scan((16, 8)[seed % 2], reference=seed % 4 < 3), ratio, seed % 3)
