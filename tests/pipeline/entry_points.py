"""Ways from Python into imaging kernels that have none; kept on disk until a source behind them changes."""

from __future__ import annotations

from pipeline.arrays import jets
from pipeline.arrays.lattice import entry_point
from pipeline.segment._kernels import wall


@entry_point
def value_gradient(lattice, x, y, z):
    return wall.value_gradient(lattice, x, y, z)


@entry_point
def hessian(lattice, x, y, z):
    return wall.hessian(lattice, x, y, z)


@entry_point
def jet(field, p, w, out):
    jets.jet(field, p, w, out)


@entry_point
def ridge_frame(out, t):
    return jets.ridge_frame(out, t)


@entry_point
def ridge_step(out, t, limit, step):
    jets.ridge_step(out, t, limit, step)
