"""Every compiled function of the solver: named tuples of arrays and scalars in, numbers out.

rotation  exponential map and its derivatives        spline   the interpolated signed distance
layout    a wire cut into segments                   energy   eq. 1-7, the one place that defines it
newton    Riccati sweep and rollout                  minimise the one loop: acceptance and stopping
follow    a wire moved along its own curve
"""
