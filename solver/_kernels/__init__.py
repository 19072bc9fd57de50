"""Every compiled function of the solver. In: named tuples of arrays and scalars. Out: numbers, or filled arrays.

flags            the eight decorators                   data             what the kernels hand to each other
algebra          3x3 matrices as tuples of scalars      rotation         exponential map and its derivatives
field            the interpolated signed distance       wall_law         energy, force, curvature of the wall
chain            a wire cut into segments               friction         Coulomb friction as a potential
energy           total energy (eq. 1-7)                 forces           forces and moments of a wire at rest
rollout          joints and frames from the controls    blocks           a node's and a joint's part of Newton's step
newton           the step, by a Riccati recursion       newton_straight  the same for a straight round wire
newton_method    one iteration of Newton's method       closed_form      one sweep of the paper's eq. 8-10
minimise         the loop around either method          crossing         whether a way passes through a wall
start            the wire laid along a curve            insertion        the steps to a depth
handle           what these work on, behind one pointer shaft            the wire between hand and entry
septum           whether the wire left its lumen        snaps            energy that a step released
saddle           the way off a saddle                   trial            a share of the step, and the energy there
records          what the kernels note                  forks            whether there is a rest shape on another side
sleeve           the catheter over the wire             free_body        the work on the wire beyond a node

lanes            several wires side by side, in the processor's vectors, by the same formulas
bare             arrays without reference counts
"""
