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

from __future__ import annotations

from pathlib import Path


def _drop_stale_cache() -> None:
    """Delete compiled kernels older than any kernel's source.

    numba's cache looks at the file of a function alone: after a change in ``newton`` it would go on running the
    old one inside ``minimise``.
    """
    here = Path(__file__).parent
    newest = max(p.stat().st_mtime for p in (*here.glob("*.py"), here.parent / "_tolerances.py"))
    for index in (here / "__pycache__").glob("*.nbi"):
        try:
            if index.stat().st_mtime < newest:
                index.unlink()
        except OSError:
            # another process was faster, or the installation is read-only: numba then compiles in memory
            continue


_drop_stale_cache()
