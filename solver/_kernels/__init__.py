"""Every compiled function of the solver: named tuples of arrays and scalars in, numbers out.

flags     how everything is compiled                 problem    what the kernels hand to each other
journey   all of that behind one handle              small      3x3 algebra on scalars
rotation  exponential map and its derivatives        spline     the interpolated signed distance
layout    a wire cut into segments                   energy     eq. 1-7, the one place that defines it
node, joint   their parts of a Newton step           newton     the Riccati sweep; straight, of a straight wire
rollout   the chain laid out from its bends          judge      when a state counts as a minimum
moves     from a state to a lower one                minimise   the one loop: acceptance and stopping
closed_form   the seed's eq. 8-10                    settle     friction's rounds around a relaxation
follow    a wire moved along its own curve           foresee    a better start from the last step's change
passage   what makes tunnelling impossible           advance    the way to a depth, and the one door to all of it
forces    derivatives of the minimum
"""
