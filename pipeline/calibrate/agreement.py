"""Do the insertions agree on a roll? One offset for all is no answer to rolls that are stated wrongly for each."""

from dataclasses import replace

import numpy as np
from scipy.special import chdtrc

from pipeline.calibrate.residuals import Evidence
from pipeline.calibrate.search import Fit
from pipeline.calibrate.trials import OWN
from pipeline.calibrate.unknowns import ROLL

CHANCE = 1e-3
"""Probability below which insertions that want one roll are not so far apart."""
LEAST_DEG = 3.0
"""Rolls that are nearer together are no fault of the manifest: nobody sets a torque device better."""
LINEAR_DEG = 60.0
"""How far apart they are known to be by derivatives: 90 degrees came out as 77 to 103, 180 as 241."""


def own_rolls(fit: Fit) -> dict[str, tuple[float, float]]:
    """By insertion, how far its traces alone would turn the common roll, degrees, and its standard deviation: that of
    the traces and of how well the roll is stated.

    Its clamp and depths follow; the other shared parameters stay. Insertions of a roll of their own are not asked.
    """
    problem, linear, k = fit.problem, fit.linear, [u.name for u in fit.problem.free].index(ROLL)
    means, sigmas = problem.prior
    found = {}
    for cases in problem.insertions:
        parts, trial = [problem.parts[i] for i in cases], problem.evidence[cases[0]].trial
        turn = parts[0][OWN - 1]
        own = [i for i in np.unique(np.concatenate(parts)) if sigmas[i] > 0.0 and i != turn]
        columns, rest = (np.concatenate([each[i] for i in cases]) for each in (linear.jacobian, linear.residual))
        columns = columns[:, [k, *own]]
        precision = np.concatenate([[0.0], sigmas[own] ** -2.0])
        normal = columns.T @ columns + np.diag(precision)
        if trial.roll_free or not normal[0, 0] > 0.0:
            continue
        from_prior = np.concatenate([[0.0], (means - linear.x)[own]])
        wanted = np.linalg.solve(normal, columns.T @ rest + precision * from_prior)
        sd = float(np.hypot(np.sqrt(np.linalg.inv(normal)[0, 0]), sigmas[turn]))
        found[trial.group] = float(wanted[0] + linear.x[turn]), sd
    return found


def turned_alone(one: Evidence) -> Evidence:
    """The insertion with a roll of its own, of which nothing is known."""
    return replace(one, trial=replace(one.trial, roll_free=True))


def no_common_roll(fit: Fit) -> str:
    """Why there is no roll that all insertions agree on; empty where there is."""
    if ROLL not in [u.name for u in fit.problem.free]:
        return ""
    found = own_rolls(fit)
    shifts, sds = np.array([*found.values()]).reshape(-1, 2).T
    if len(found) < 2 or np.ptp(shifts) < LEAST_DEG:
        return ""
    middle = float(np.average(shifts, weights=sds**-2.0))
    if chdtrc(len(found) - 1, float(np.sum(((shifts - middle) / sds) ** 2))) > CHANCE:
        return ""
    low, high = (list(found)[int(place)] for place in (np.argmin(shifts), np.argmax(shifts)))
    # far from where it is linearised, it is another roll, and nobody knows which
    by = f"{np.ptp(shifts):.0f} degrees more" if np.ptp(shifts) < LINEAR_DEG else "quite another roll"
    apart = f"{high} wants {by} than {low}"
    return f"the insertions want no common one: {apart}; check roll_deg of each (degrees) and material_axis"
