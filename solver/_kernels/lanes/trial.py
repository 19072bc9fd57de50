"""A trial state of wires in lanes: laid out as by ``rollout``, its energy, and its acceptance."""

from typing import Any

from solver import _tolerances as tol
from solver._kernels import wall_law
from solver._kernels.algebra import Three, dot, load3, load9, minus, store3, store9, times
from solver._kernels.data import CURRENT, TRIAL, Field
from solver._kernels.flags import inlined, kernel
from solver._kernels.lanes.block import (
    ACCEPTED,
    ACTIVE,
    ALONG,
    ANCHOR,
    AT_ENTRY,
    BENDING,
    CLEAR,
    FRACTION,
    FULL,
    JUMP,
    LOAD,
    REACH,
    ROOM,
    START,
    STIFFNESS,
    STILL,
    WALL,
    WEIGHT,
    Block,
)
from solver._kernels.lanes.field import look_first, look_up
from solver._kernels.lanes.vectors import WIDTH, anywhere, bits, greater, select, select3, size, spread
from solver._kernels.rollout import limited, relative
from solver._kernels.rotation import bent, with_rest


@kernel
def rollout(b: Block, base: int, spacing: float) -> None:
    """``rollout.rollout`` of every lane from joint ``base`` on; also fills BENDING, LOAD and JUMP.

    spacing : of the field, mm; see ``crossing.crossed``.
    """
    old_u, old_x, old_r, u, x, r = b.u[CURRENT], b.x[CURRENT], b.r[CURRENT], b.u[TRIAL], b.x[TRIAL], b.r[TRIAL]
    fraction, start, zero = b.number[FRACTION], b.number[START], spread(0.0)
    frame, at = load9(old_r, base), load3(old_x, base)
    store9(r, base, frame)
    store3(x, base, at)
    energy, furthest, entry = zero, zero, at
    for j in range(base, b.length.shape[0]):
        ahead, there, before = load9(old_r, j + 1), load3(old_x, j + 1), (old_u[j, 0], old_u[j, 1], zero)
        moved, turned = minus(at, load3(old_x, j)), relative(load9(old_r, j), frame)
        v = limited(before, answer(b.gain, j, fraction, moved, turned))
        length, held = b.length[j], start > float(j)
        if anywhere(held):
            v = select3(held, before, v)
        frame = times(frame, bent(with_rest(b.rest[j], v)))
        at = (at[0] + length * frame[2], at[1] + length * frame[5], at[2] + length * frame[8])
        if anywhere(held):
            frame, at = select9(held, ahead, frame), select3(held, there, at)
        u[j, 0], u[j, 1] = v[0], v[1]
        store9(r, j + 1, frame)
        store3(x, j + 1, at)
        energy = energy + 0.5 * b.bend[j] * (v[0] * v[0] + v[1] * v[1])
        way = minus(at, there)
        furthest = greater(furthest, dot(way, way))
    # joint ``base`` is at the entry in every lane, see ``block.fill_up``
    b.number[BENDING], b.number[LOAD] = energy, -dot((b.load[0], b.load[1], b.load[2]), minus(at, entry))
    b.number[JUMP] = select(furthest > 0.25 * spacing * spacing, 1.0, zero)


@inlined
def answer(gain: Any, j: int, fraction: Any, dp: Three, dr: Three) -> Three:
    """``rollout.answer`` with two controls."""
    one = fraction * gain[j, 0, 0]
    two = fraction * gain[j, 1, 0]
    one += gain[j, 0, 1] * dp[0] + gain[j, 0, 2] * dp[1] + gain[j, 0, 3] * dp[2]
    two += gain[j, 1, 1] * dp[0] + gain[j, 1, 2] * dp[1] + gain[j, 1, 3] * dp[2]
    one += gain[j, 0, 4] * dr[0] + gain[j, 0, 5] * dr[1] + gain[j, 0, 6] * dr[2]
    two += gain[j, 1, 4] * dr[0] + gain[j, 1, 5] * dr[1] + gain[j, 1, 6] * dr[2]
    return one, two, spread(0.0)


@inlined
def select9(condition: Any, one: Any, other: Any) -> Any:
    """``select`` of nine numbers."""
    head = select3(condition, one[:3], other[:3])
    return head + select3(condition, one[3:6], other[3:6]) + select3(condition, one[6:], other[6:])


@kernel
def wall_energy(b: Block, raw: Block, field: Field, first: Any, base: int) -> None:
    """``energy.wall_energy`` of the trial in every active lane; only a part where that is too much already.

    Points that touched are looked up first: mostly a trial fails by them, and needs no others.     raw : the numbers
    of b.
    """
    number, site, touch, total = b.number, b.site, b.touch[TRIAL], b.number[AT_ENTRY]
    # ample room for rounding: the order of summation must not decide on which side of the limit a sum is
    number[ROOM] = number[ROOM] - (number[BENDING] + number[LOAD]) + 1e-9 * number[BENDING]
    sure, unsure = ask(b, field.slope, first, base)
    touch_at(b, raw, field, sure)
    touch_at(b, raw, field, sift(b, raw, field, unsure))
    if sure + unsure > 0:
        for p in range(first[base + 1], first[b.length.shape[0] + 1]):
            total = total + wall_law.energy(number[STIFFNESS], site[p, WEIGHT], touch[p, 0])
    number[WALL] = total


@kernel
def ask(b: Block, slope: float, first: Any, base: int) -> tuple[int, int]:
    """List the points of the trial that touched when they were looked up last, and those that may; count both.

    The way from a point's last look-up decides, for all lanes at once. Where a listed point is stands in ``b.touch``.
    """
    x, r, site, touch, number, asked = b.x[TRIAL], b.r[TRIAL], b.site, b.touch[TRIAL], b.number, b.asked
    reach, zero, active, square = number[REACH], spread(0.0), number[ACTIVE] > 0.0, slope * slope
    clear, sure, unsure = number[CLEAR], 0, 0
    for n in range(base + 1, b.length.shape[0] + 1):
        for p in range(first[n], first[n + 1]):
            along = site[p, ALONG]
            q = (x[n, 0] + along * r[n, 0, 2], x[n, 1] + along * r[n, 1, 2], x[n, 2] + along * r[n, 2, 2])
            room = -site[p, ANCHOR + 3] - reach
            way = minus(q, (site[p, ANCHOR], site[p, ANCHOR + 1], site[p, ANCHOR + 2]))
            off = room >= 0.0
            still = off & (square * dot(way, way) <= room * room)
            here = active & (site[p, WEIGHT] > 0.0)
            clear = clear + select(here & still, 1.0, zero)
            touch[p, 0] = zero
            near, far = bits(here & ~off), bits(here & off & ~still)
            if near + far != 0:
                touch[p, 1], touch[p, 2], touch[p, 3] = q
                # without a branch: whether a lane wants this point cannot be foretold
                for lane in range(WIDTH):
                    asked[0, sure] = asked[1, unsure] = p * WIDTH + lane
                    sure, unsure = sure + (near >> lane & 1), unsure + (far >> lane & 1)
    number[CLEAR] = clear
    return sure, unsure


@kernel
def gather(raw: Block, which: int, at: int, count: int) -> tuple[int, int]:
    """Gather up to eight points of a list from ``at`` on; return how many, and where to go on.

    Points of trials that cost too much already are left out.
    """
    asked, found, touches, numbers, n = raw.asked, raw.found, raw.touch[TRIAL], raw.number, 0
    while at < count and n < WIDTH:
        point = asked[which, at]
        p, lane = point // WIDTH, point % WIDTH
        at += 1
        if numbers[ROOM, lane] >= 0.0:
            for a in range(3):
                found[a, n] = touches[p, 1 + a, lane]
            numbers[FULL, lane] += 1.0
            asked[2, n] = point
            n += 1
    for m in range(n, WIDTH):
        for a in range(3):
            found[a, m] = found[a, 0]
    return n, at


@inlined
def keep(raw: Block, n: int) -> tuple[int, int]:
    """Keep where the n-th gathered point is, and what is known of the distance there; return it and its lane."""
    point, sites, touches = raw.asked[2, n], raw.site, raw.touch[TRIAL]
    p, lane = point // WIDTH, point % WIDTH
    for a in range(3):
        sites[p, ANCHOR + a, lane] = touches[p, 1 + a, lane]
    sites[p, ANCHOR + 3, lane] = raw.found[10, n]
    return p, lane


@kernel
def sift(b: Block, raw: Block, field: Field, count: int) -> int:
    """Look up the distance alone of points that may touch; list those that do, and count them."""
    found, asked, numbers, at, sure = raw.found, raw.asked, raw.number, 0, 0
    while at < count:
        some, at = gather(raw, 1, at, count)
        look_first(field, b.found)
        for n in range(some):
            _, lane = keep(raw, n)
            asked[0, sure] = asked[2, n]
            sure += found[0, n] + numbers[REACH, lane] > 0.0
    return sure


@kernel
def touch_at(b: Block, raw: Block, field: Field, count: int) -> None:
    """Look up the points of the list of those that will touch."""
    found, sites, touches, numbers, at = raw.found, raw.site, raw.touch[TRIAL], raw.number, 0
    while at < count:
        some, at = gather(raw, 0, at, count)
        look_up(field, b.found)
        for n in range(some):
            p, lane = keep(raw, n)
            d = found[0, n] + numbers[REACH, lane]
            if d > 0.0:
                touches[p, 0, lane] = d
                for a in range(10):
                    touches[p, 1 + a, lane] = found[a, n]
                numbers[ROOM, lane] -= wall_law.energy(numbers[STIFFNESS, lane], sites[p, WEIGHT, lane], d)


@kernel
def accept(b: Block, first: Any, base: int) -> None:
    """Make the trial the current state in the lanes that accept it; say which joint is the first that it turned.

    Turned: by more than ``tol.UNMOVED`` of the joint that it turned most.
    """
    accepted, k, zero = b.number[ACCEPTED] > 0.0, b.length.shape[0], spread(0.0)
    u, x, r, touch = b.u[CURRENT], b.x[CURRENT], b.r[CURRENT], b.touch[CURRENT]
    new_u, new_x, new_r, new_touch = b.u[TRIAL], b.x[TRIAL], b.r[TRIAL], b.touch[TRIAL]
    largest, still = zero, spread(float(k))
    for j in range(base, k):
        largest = greater(largest, greater(size(new_u[j, 0] - u[j, 0]), size(new_u[j, 1] - u[j, 1])))
    for j in range(k - 1, base - 1, -1):
        change = greater(size(new_u[j, 0] - u[j, 0]), size(new_u[j, 1] - u[j, 1]))
        still = select(change > tol.UNMOVED * largest, float(j), still)
        u[j, 0], u[j, 1] = select(accepted, new_u[j, 0], u[j, 0]), select(accepted, new_u[j, 1], u[j, 1])
    b.number[STILL] = still
    for n in range(base + 1, k + 1):
        store3(x, n, select3(accepted, load3(new_x, n), load3(x, n)))
        store9(r, n, select9(accepted, load9(new_r, n), load9(r, n)))
        for p in range(first[n], first[n + 1]):
            touches = anywhere(new_touch[p, 0] > 0.0)
            for a in range(11 if touches else 1):
                touch[p, a] = select(accepted, new_touch[p, a], touch[p, a])
