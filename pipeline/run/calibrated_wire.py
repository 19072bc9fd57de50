"""The wire that a calibration ends with, along its length: what is stated, what is used, how well that is known."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from pipeline.calibrate.estimates import Calibration
from pipeline.calibrate.unknowns import bent
from pipeline.model import Array, Wire
from pipeline.ranges import Profile


def wire_rows(wire: Wire, fit: Calibration, rest: Mapping[str, Any]) -> list[dict[str, Any]]:
    """A row for each number of both profiles: quantity, distance from the tip, as stated, as used, and its deviation.

    rest : the estimate of the rest curvature.     at_mm : None where the number holds all along.     sd : of the
    logarithm; 0 where the fit holds the number as stated.
    """
    found, stiffness, curvature = bent(wire, fit.values), "bending_stiffness_N_mm2", "rest_curvature_per_mm"
    pairs = ((name, _points(getattr(wire, name)), _points(getattr(found, name))) for name in (stiffness, curvature))
    spread = {stiffness: _stiffness_sd(wire, fit), curvature: np.array([rest["sd"] if rest["seen"] else 0.0])}
    rows = []
    for name, stated, used in pairs:
        deviations = np.broadcast_to(spread[name], len(stated)) * (used[:, 1] != 0.0)
        for (at, before), (_, after), sd in zip(stated, used, deviations, strict=True):
            where = None if np.isnan(at) else float(at)
            rows.append({"of": name, "at_mm": where, "stated": float(before), "used": float(after), "sd": float(sd)})
    return rows


def _points(profile: Profile) -> Array:
    """A profile as points (n, 2); a number is one at no distance."""
    return np.array([(np.nan, profile)] if isinstance(profile, (int, float)) else profile, dtype=float)


def _stiffness_sd(wire: Wire, fit: Calibration) -> Array:
    """Standard deviations (n,) of the logarithm of EI: it is linear in the parameters, so differences are exact.

    Those of the fit in which all were free, as beside the parameters: with friction and wall held as stated EI of the
    shaft was known to 10 % and its taper, which is the same, to 16 %.
    """
    seen = np.array([one.seen for one in fit.estimates])
    known = [one for one in fit.estimates if one.seen]
    deviations = np.array([one.sd for one in known])
    covariance = fit.correlation[np.ix_(seen, seen)] * np.outer(deviations, deviations)

    def logarithm(change: Mapping[str, float]) -> Array:
        return np.log(_points(bent(wire, {**fit.values, **change}).bending_stiffness_N_mm2)[:, 1])

    here, names = logarithm({}), [one.unknown.name for one in known]
    slopes = np.array([logarithm({name: fit.values[name] + 1.0}) - here for name in names]).reshape(-1, len(here))
    return np.asarray(np.sqrt(np.einsum("in,ij,jn->n", slopes, covariance, slopes)))
