"""A wire at one depth, cut into segments: stiffness and rest bend per joint, look-up points per node.

Everything but the first segment is fixed to the wire; the first takes up the remainder of the depth. The cell of a
joint is the wire from the middle of the segment before it to the middle of the one after it.
"""

import math
from typing import Any

from solver._kernels.data import Chain, Profile, Rule, WireTable
from solver._kernels.flags import entry_point, kernel

GAUSS = 1 / math.sqrt(3.0)


@kernel
def integral(at: Any, value: Any, s: float, reciprocal: bool) -> float:
    """Integral from 0 to s of a piecewise linear function, or of its reciprocal (exact on every piece)."""
    total, start = 0.0, 0.0
    n = at.size
    for i in range(n + 1):
        stop = s if i == n else min(max(at[i], 0.0), s)
        if stop <= start:
            continue
        left = right = value[min(i, n - 1)]
        if 0 < i < n:
            rise = (value[i] - value[i - 1]) / (at[i] - at[i - 1])
            right = value[i - 1] + rise * (stop - at[i - 1])
            left = value[i - 1] + rise * (start - at[i - 1])
        width = stop - start
        if not reciprocal:
            total += 0.5 * width * (left + right)
        else:
            ratio = (right - left) / left
            # log(1 + r)/r: the series keeps 1e-16 where the logarithm would cancel
            mean = math.log1p(ratio) / ratio if abs(ratio) > 1e-4 else 1 - ratio / 2 + ratio * ratio / 3
            total += width * mean / left
        start = stop
    return total


@kernel
def profile_at(at: Any, value: Any, s: float) -> float:
    """A piecewise linear function of the distance from the tip; at a jump the value further out."""
    n = at.size
    if s < at[0]:
        return float(value[0])
    for i in range(n - 1):
        if s < at[i + 1]:
            return float(value[i] + (value[i + 1] - value[i]) * (s - at[i]) / (at[i + 1] - at[i]))
    return float(value[n - 1])


@kernel
def cell(profile: Profile, inner: float, outer: float) -> tuple[float, float]:
    """Compliance 1/c and rest bend of a joint whose cell reaches from ``inner`` to ``outer`` mm from the tip."""
    compliance = integral(profile.stiffness_at, profile.stiffness, outer, True)
    compliance -= integral(profile.stiffness_at, profile.stiffness, inner, True)
    rest = integral(profile.rest_at, profile.rest, outer, False)
    return compliance, rest - integral(profile.rest_at, profile.rest, inner, False)


@entry_point
def tabulate(profile: Profile, segment_mm: float, cells: Any) -> None:
    """Fill cells (m, 2): compliance and rest bend of the whole cell around distance m * segment from the tip."""
    for m in range(cells.shape[0]):
        inner = max(m - 0.5, 0.0) * segment_mm
        cells[m, 0], cells[m, 1] = cell(profile, inner, (m + 0.5) * segment_mm)


@entry_point
def segments_at(depth_mm: float, segment_mm: float) -> tuple[int, float]:
    """Number of segments at a depth, and length of the first, mm: ½ to 1½ segments, less if the depth is."""
    if depth_mm <= 0.0:
        return 0, 0.0
    whole = max(math.floor(depth_mm / segment_mm - 0.5 + 1e-12), 0)
    return whole + 1, depth_mm - whole * segment_mm


@entry_point
def lay_out(chain: Chain, table: WireTable, k: int, first_mm: float) -> None:
    """Fill a chain of k segments whose first one is ``first_mm`` long."""
    profile, cells, segment_mm = table.profile, table.cells, table.segment
    depth = first_mm + (k - 1) * segment_mm
    for j in range(k):
        chain.length[j] = first_mm if j == 0 else segment_mm
        outer = depth if j == 0 else (k - j + 0.5) * segment_mm
        inner = (k - j - 0.5) * segment_mm
        if j == 0:
            inner = depth - 0.5 * first_mm
        elif j == 1:
            outer = depth - 0.5 * first_mm
        if j < 2 or not table.tabled:
            compliance, chain.rest[j] = cell(profile, inner, outer)
        else:
            compliance, chain.rest[j] = cells[k - j, 0], cells[k - j, 1]
        chain.bend[j] = 1.0 / compliance
        shaft = table.shaft if j == 0 else 0.0
        chain.twist[j] = profile.twist / (outer - inner + shaft)
        if j == 0:
            chain.early[0] = shaft / (outer - inner + shaft)
    place_points(chain, table.rule, k)


@kernel
def weigh(chain: Chain, weight: Any, k: int) -> None:
    """Add the wire's own weight, (3,) N/mm, to the loads: half of each segment's to either end, exact for a rigid one.

    Node 0, which stays where it is, gets none.
    """
    if weight[0] == 0.0 and weight[1] == 0.0 and weight[2] == 0.0:
        return
    for n in range(1, k + 1):
        length = 0.5 * chain.length[n - 1] + (0.5 * chain.length[n] if n < k else 0.0)
        for a in range(3):
            chain.load[n, a] += length * weight[a]


@kernel
def place_points(chain: Chain, rule: Rule, k: int) -> None:
    """Fill the look-up points of every node and of the segment that ends there.

    A segment is integrated by the trapezium rule (half of it at each end), except the last one, which has the
    rule's own points, and ``zone`` segments before it, which have two Gauss points each.
    """
    inner = rule.tip_at.size > 1
    p = 0
    chain.held[0] = 0.5 * chain.length[0] if k - 1 > rule.zone or not inner else 0.0
    chain.first[0] = chain.first[1] = 0
    for n in range(1, k + 1):
        behind = k - n if inner else rule.zone + 1
        length = chain.length[n - 1]
        share = 0.0
        if behind > rule.zone:
            share += 0.5 * length
        if n < k and (behind - 1 > rule.zone or not inner):
            share += 0.5 * chain.length[n]
        if share > 0.0:
            p = place_hull(chain, rule, p, 0.0, share)
        if inner and n == k:
            for t in range(rule.tip_at.size):
                p = place_hull(chain, rule, p, -length * rule.tip_at[t], length * rule.tip_weight[t])
        elif behind <= rule.zone:
            for side in (-1.0, 1.0):
                p = place_hull(chain, rule, p, -0.5 * length * (1 + side * GAUSS), 0.5 * length)
        chain.first[n + 1] = p


@kernel
def place_hull(chain: Chain, rule: Rule, p: int, along: float, length: float) -> int:
    """Fill the points around one place on the wire, which stand for ``length`` mm of it; return the next free one."""
    hulls = rule.hull.shape[0]
    for h in range(hulls):
        chain.offset[p, 0], chain.offset[p, 1], chain.offset[p, 2] = rule.hull[h, 0], rule.hull[h, 1], along
        chain.weight[p] = length / hulls
        p += 1
    return p
