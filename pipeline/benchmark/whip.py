"""A shaft that is turned in a curved tube: friction winds it up, and its tip lags behind the hand."""

import math

import numpy as np

from pipeline.benchmark.claims import Claim
from pipeline.benchmark.scenes import RADIUS_MM, BenchScene
from pipeline.benchmark.vessels import BEND_TURN_MM, TUBE_LUMEN_MM, bent_tube
from solver import GuideWire, Insertion

COEFFICIENT, LENGTH_MM, PULL_N, TWIST_N_MM2 = 0.1, 45.0, 0.5, 0.4
TURNED_DEG = 150.0


def whip() -> Claim:
    """Lag of the tip of a pulled, straight shaft, over what friction on the inner wall winds up.

    The tension F presses F/R per mm on the wall that bends the shaft to R, and μ r F/R per mm holds against turning:
    over a length L that is μ r F L²/(2 R GJ). Within (EI/F)^½ = 0.45 mm of its ends it is not pressed so: 2 % of L.
    """
    inner = BEND_TURN_MM - (TUBE_LUMEN_MM - RADIUS_MM)
    turn = LENGTH_MM / inner
    wire = GuideWire(0.25, RADIUS_MM, 0.1, torsional_stiffness_N_mm2=TWIST_N_MM2)
    box = ((-3.0, -3.0, -3.0), (34.0, 3.0, 34.0))
    tube = BenchScene("tube", LENGTH_MM, wall_stiffness=20.0, friction=COEFFICIENT, distance=bent_tube, box=box)
    load = (PULL_N * math.sin(turn), 0.0, PULL_N * math.cos(turn))
    entry, axis = (TUBE_LUMEN_MM - RADIUS_MM, 0.0, 0.0), (1.0, 0.0, 0.0)
    insertion = Insertion(wire, tube.wall(voxel_mm=0.25), entry, tube.direction, material_axis=axis, tip_load_N=load)
    straight, rolls = np.arange(1.0, LENGTH_MM + 1.0), np.arange(10.0, TURNED_DEG + 1.0, 10.0)
    *_, turned = insertion.to_depths([*straight, *[LENGTH_MM] * len(rolls)], [*(0.0 * straight), *rolls])
    tip = turned.frames[-1]
    lag = math.radians(TURNED_DEG) - math.atan2(tip[1, 0], float(tip[:, 0] @ np.cross([0, 1, 0], tip[:, 2])))
    pressed = COEFFICIENT / math.hypot(1.0, COEFFICIENT) * PULL_N / inner
    found = lag / (pressed * RADIUS_MM * LENGTH_MM**2 / (2.0 * TWIST_N_MM2))
    name = f"shaft turned in a curved tube, friction {COEFFICIENT:g}: tip behind the hand over μ r F L²/(2 R GJ)"
    return Claim(name, found, "1", "1.00 ± 0.02", abs(found - 1.0) <= 0.02)
