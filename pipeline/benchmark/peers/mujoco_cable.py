"""MuJoCo: the cable of its elasticity plugin, implicitfast; the wall's force is set from Python within each step.

Bodies lie about the nodes, so that the first hinge is half a cell behind the clamp (the default holds a whole segment
and is first order). The plugin's stiffness is explicit: the mass is scaled so that the fastest bending mode is stable
at the time step, and joints are damped critically for the slowest.

The wall is asked between the two halves of a step, where the places are those of now. After a whole step they are
those before it; a force one step late is a negative damping of dt times the wall's stiffness, more than the joints
take away, and the wire flew apart soon after it had touched.
"""

from __future__ import annotations

from time import process_time
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from pipeline.benchmark.peers.common import (
    DEPTH_B_MM,
    EI,
    GJ,
    LENGTH_A_MM,
    LOAD_A_N,
    RADIUS_MM,
    STEPS_B,
    Answer,
    wall_of,
)

Array = NDArray[np.float64]

NAME = "MuJoCo"
PACKAGE = "mujoco"
DT_S = 0.002
SAFETY = 0.005
"""Share of the mass that an explicit step would need: joints damped implicitly carry the fast modes; by hand."""
WALL_SAFETY = 1.4
"""The same for the wall, which nothing damps implicitly: more than 1, by hand (0.8 times the time of 2)."""
REST_MM = 1e-3
"""Relative to the slowest mode's own pace: a node that moves slower than this times its frequency is at rest.
In scene B with 30 segments no node is 1e-3 mm from where a limit 10,000 times tighter leaves it."""
MOST_STEPS = 60_000
CHECK = 20

XML = """
<mujoco>
  <extension><plugin plugin="mujoco.elasticity.cable"/></extension>
  <option timestep="{dt}" integrator="implicitfast" gravity="0 0 0"/>
  <option><flag contact="disable"/></option>
  <worldbody>
    <body name="base" pos="{start} 0 0">
      <composite prefix="w" type="cable" curve="s 0 0" count="{count} 1 1" size="{length}" initial="none">
        <plugin plugin="mujoco.elasticity.cable">
          <config key="twist" value="{shear}"/>
          <config key="bend" value="{young}"/>
        </plugin>
        <joint kind="main" damping="{damping}"/>
        <geom type="capsule" size="{radius}" mass="{mass}"/>
      </composite>
    </body>
  </worldbody>
</mujoco>
"""


class Cable:
    """n + 1 bodies about the nodes of a wire along MuJoCo's x; ours is (x, y, z) = (its y, its z, its x)."""

    def __init__(
        self, n: int, length_mm: float, first_z: float, slowest_mm: float, extra_stiffness: float
    ) -> None:
        segment = length_mm / n
        moment = 0.25 * np.pi * RADIUS_MM**4
        # fastest mode: bending of neighbouring segments against each other, 16 EI / (m λ³), plus the wall's
        self.mass = 0.25 * DT_S**2 * (SAFETY * 16.0 * EI / segment**3 + WALL_SAFETY * extra_stiffness)
        self.pace = 3.52 * np.sqrt(EI * segment / self.mass) / slowest_mm**2
        self.model: Any = mujoco.MjModel.from_xml_string(
            XML.format(
                dt=DT_S, start=first_z - 0.5 * segment, count=n + 2, length=length_mm + segment, radius=RADIUS_MM,
                young=EI / moment, shear=GJ / (2.0 * moment), mass=self.mass,
                damping=1.4 / self.pace * EI / segment,
            )
        )  # fmt: skip
        self.data: Any = mujoco.MjData(self.model)
        self.first = self.model.nbody - (n + 1)
        mujoco.mj_forward(self.model, self.data)

    def points(self) -> Array:
        """Nodes (n + 1, 3) mm in our axes."""
        return np.asarray(self.data.xipos[self.first :][:, [1, 2, 0]])

    def settle(self, force: Any) -> int:
        """Step until at rest, else RuntimeError; force : of the places, or an array. Returns the number of steps."""
        before = self.points()
        for count in range(CHECK, MOST_STEPS + 1, CHECK):
            self._advance(force)
            # MuJoCo answers an unstable step by putting the wire back as it was built, with no more than a warning
            if self.data.warning.number.any():
                msg = "MuJoCo: the simulation became unstable and was reset"
                raise RuntimeError(msg)
            now = self.points()
            if np.abs(now - before).max() < REST_MM * self.pace * CHECK * DT_S:
                return count
            before = now
        msg = f"MuJoCo: not at rest after {MOST_STEPS} steps"
        raise RuntimeError(msg)

    def _advance(self, force: Any) -> None:
        """CHECK steps; the places are those at the end of them."""
        applied = self.data.xfrc_applied[self.first :, :3]
        if callable(force):
            for _ in range(CHECK):
                mujoco.mj_step1(self.model, self.data)
                applied[:] = force(self.points())[:, [2, 0, 1]]
                mujoco.mj_step2(self.model, self.data)
        else:
            applied[:] = force[:, [2, 0, 1]]
            mujoco.mj_step(self.model, self.data, CHECK)
        mujoco.mj_kinematics(self.model, self.data)


def cantilever(n: int) -> Answer:
    """Scene A."""
    cable = Cable(n, LENGTH_A_MM, 0.0, LENGTH_A_MM, 0.0)
    load = np.zeros((n + 1, 3))
    load[-1, 0] = LOAD_A_N
    start = process_time()
    steps = cable.settle(load)
    seconds = process_time() - start
    note = f"cable plugin, implicitfast, dt {DT_S} s, {steps} steps, clamp shifted, mass scaled"
    return Answer(cable.points(), np.array([seconds]), note)


def bend(n: int, steps: int = STEPS_B, pushes: int | None = None) -> Answer:
    """Scene B."""
    wall = wall_of(n)
    segment = DEPTH_B_MM / n
    # in the tube the longest free stretch is about half the wire
    cable = Cable(n, DEPTH_B_MM, -DEPTH_B_MM, 0.5 * DEPTH_B_MM, wall.wall.stiffness_N_mm2 * segment)
    base = mujoco.mj_name2id(cable.model, mujoco.mjtObj.mjOBJ_BODY, "base")
    seconds, total = [], 0
    for i in range(pushes or steps):
        start = process_time()
        cable.model.body_pos[base, 0] = -DEPTH_B_MM * (1 - (i + 1) / steps) - 0.5 * segment
        total += cable.settle(wall.forces)
        seconds.append(process_time() - start)
    note = f"cable plugin, implicitfast, dt {DT_S} s, {total / steps:.0f} steps per push, clamp shifted, mass scaled"
    return Answer(cable.points(), np.array(seconds), note, wall.seconds / sum(seconds))
