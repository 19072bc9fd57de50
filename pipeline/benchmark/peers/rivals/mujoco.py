"""MuJoCo: the cable of its elasticity plugin, implicitfast; the wall's force is set from Python within each step.

Bodies lie about the nodes, so that the first hinge is half a cell behind the clamp (the default holds a whole segment
and is first order). The plugin's stiffness is explicit: the mass is scaled so that the fastest bending mode is stable
at the time step, and joints are damped critically for the slowest.

The wall's force is computed between the two halves of a step, when positions are current. After a whole step they are
those before it; a force one step late is a negative damping of dt times the wall's stiffness, more than the joints take
away, and the wire flew apart soon after it had touched.
"""

import mujoco
import numpy as np

from pipeline.benchmark.peers.frame import EI, GJ, MOMENT_MM4, RADIUS_MM, RivalWire, Task
from pipeline.model import Array

DT_S = 0.002
SAFETY = 0.005
"""Share of the mass that an explicit step would need: joints damped implicitly carry the fast modes; tuned by hand."""
WALL_SAFETY = 1.4
"""The same for the wall, which nothing damps implicitly: more than 1, tuned by hand (0.8 times the time of 2)."""
STILL_MM = 1e-3
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


class Wire(RivalWire):
    """n + 1 bodies about the nodes of a wire along MuJoCo's x; ours is (x, y, z) = (its y, its z, its x)."""

    name = "MuJoCo"
    segments_a, segments_b = (20, 50), (30, 60)
    note = f"cable plugin, implicitfast, dt {DT_S} s, {{steps}}, clamp shifted, mass scaled"

    def __init__(self, task: Task) -> None:
        super().__init__(task)
        segment = self.segment_mm
        # fastest mode: bending of neighbouring segments against each other, 16 EI / (m λ³), plus the wall's
        mass = 0.25 * DT_S**2 * (SAFETY * 16.0 * EI / segment**3 + WALL_SAFETY * self.wall_N_mm)
        pace = self.pace(mass)
        self.still_mm = STILL_MM * pace * CHECK * DT_S
        self.model = mujoco.MjModel.from_xml_string(
            XML.format(
                dt=DT_S, start=self.start_mm - 0.5 * segment, count=task.n + 2, length=self.length_mm + segment,
                radius=RADIUS_MM, young=EI / MOMENT_MM4, shear=GJ / (2.0 * MOMENT_MM4), mass=mass,
                damping=1.4 / pace * EI / segment,
            )
        )  # fmt: skip
        self.data = mujoco.MjData(self.model)
        self.first = self.model.nbody - (task.n + 1)
        self.base = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, "base")
        mujoco.mj_forward(self.model, self.data)

    def points(self) -> Array:
        """Nodes in our axes."""
        return np.asarray(self.data.xipos[self.first :][:, [1, 2, 0]])

    def push(self, depth_mm: float) -> None:
        """Move the clamp and wait."""
        self.model.body_pos[self.base, 0] = depth_mm - self.length_mm - 0.5 * self.segment_mm
        self.rest(self._advance, self.still_mm, MOST_STEPS // CHECK)

    def _advance(self) -> Array:
        """CHECK steps; the places are those at the end of them."""
        applied = self.data.xfrc_applied[self.first :, :3]
        if self.wall is None:
            applied[:] = self.load_N[:, [2, 0, 1]]
            mujoco.mj_step(self.model, self.data, CHECK)
        else:
            for _ in range(CHECK):
                mujoco.mj_step1(self.model, self.data)
                applied[:] = self.forces(self.points())[:, [2, 0, 1]]
                mujoco.mj_step2(self.model, self.data)
        mujoco.mj_kinematics(self.model, self.data)
        self.steps += CHECK
        # MuJoCo answers an unstable step by putting the wire back as it was built, with no more than a warning
        if self.data.warning.number.any():
            raise RuntimeError("MuJoCo: the simulation became unstable and was reset")
        return self.points()


RIVALS = (Wire,)
