"""The kernels of segment and trace against finite differences and closed forms."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import ndimage
from scipy.stats import ncx2

from pipeline.arrays.jets import Blurred, jets_at, values_at
from pipeline.arrays.spare import Spare
from pipeline.segment.blurred import blur_of_wall, half_level_offset
from pipeline.trace._kernels.tube import Blob, Claim, active_voxels, normal_equations
from pipeline.trace.tube import Tube, fit_tube, predicted, sampled, sampling, tint_nodes
from solver.grid import read_only
from tests.pipeline.entry_points import hessian, jet, ridge_frame, ridge_step, value_gradient


def test_spline_derivatives_are_those_of_its_value():
    rng = np.random.default_rng(0)
    lattice = rng.normal(size=(9, 9, 9))
    p, h = np.array([4.3, 4.6, 4.2]), 1e-4
    f, *g = value_gradient(lattice, *p)
    second = hessian(lattice, *p)
    for axis in range(3):
        e = h * np.eye(3)[axis]
        up, down = value_gradient(lattice, *(p + e)), value_gradient(lattice, *(p - e))
        assert g[axis] == pytest.approx((up[0] - down[0]) / (2 * h), abs=1e-6)
        assert second[axis] == pytest.approx((up[axis + 1] - down[axis + 1]) / (2 * h), abs=1e-6)
    assert np.isfinite(f)


def test_jets_at_nodes_are_gaussian_derivatives():
    grey = np.random.default_rng(1).normal(size=(15, 16, 17)).astype(np.float32)
    spacing, out, w = np.array([0.5, 0.5, 0.5]), np.empty(10), np.empty((3, 3, 64))
    jet(Blurred(grey, spacing, 0.6), np.array([7, 8, 8]) * 0.5, w, out)
    orders = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    orders += [(2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 1, 0), (1, 0, 1), (0, 1, 1)]
    impulse = np.eye(7)[3]
    taps = [ndimage.gaussian_filter1d(impulse, 1.2, order=m, truncate=2.9)[::-1] for m in range(3)]
    taps = [one - (m > 0) * one.sum() * taps[0] for m, one in enumerate(taps)]  # cut off, they are not 0 of a constant
    around = grey[4:11, 5:12, 5:12].astype(float)
    for n, order in enumerate(orders):
        expected = np.einsum("ijk,i,j,k", around, *(taps[m] for m in order))
        assert out[n] == pytest.approx(expected / 0.5 ** sum(order), rel=0.02, abs=5e-3)


@pytest.mark.parametrize("zero", [0.0, 1000.0, -3000.0])
def test_derivatives_do_not_ask_where_grey_has_its_zero(zero):
    """With HU that begin at -1000 a tenth of a thin branch was segmented of which all is with grey from 0 on."""
    grey = np.random.default_rng(3).normal(0.0, 20.0, (15, 16, 17))
    w, plain, lifted = np.empty((3, 3, 64)), np.empty(10), np.empty(10)
    for at in np.random.default_rng(4).uniform(-0.3, 4.0, (30, 3)):  # beside nodes, and at the border
        jet(Blurred(grey, np.array([0.3, 0.3, 0.3]), 0.2), at, w, plain)
        jet(Blurred(grey + zero, np.array([0.3, 0.3, 0.3]), 0.2), at, w, lifted)
        np.testing.assert_allclose(lifted, plain + zero * np.eye(10)[0], rtol=0.0, atol=1e-8)


def test_values_alone_are_those_that_have_derivatives():
    """To the last bit, near and beyond the border, too: which of the two is asked for moves no curve."""
    rng = np.random.default_rng(7)
    for kind in (np.float32, np.int16):
        grey = (300 * rng.normal(size=(12, 14, 16))).astype(kind)
        field = Blurred(read_only(grey), read_only([0.3, 0.3, 0.4]), 0.3)
        points = rng.uniform(-1.0, 7.0, (200, 3))
        np.testing.assert_array_equal(values_at(field, points), jets_at(field, points)[:, 0])


def _equations(grey, spacing, samples, controls, tint, sigma):
    line = sampled(Tube(controls, tint, sigma, 3.0), samples)
    slot = np.zeros(grey.shape, np.int32)
    radius = 6 * sigma
    voxels = active_voxels(slot, spacing, line.curve, radius)
    claim = Claim(voxels, slot, np.ones(len(voxels)))
    e = normal_equations(grey, spacing, claim, line, Blob(sigma, radius, 3.0), len(controls), len(tint))
    return e.square, e.right, e.normal


def test_tube_gradient_is_that_of_its_cost():
    """J^T r against central differences of half the sum of squares, in controls, amplitudes and blur."""
    rng = np.random.default_rng(2)
    grey = rng.normal(0, 5, (24, 24, 30)).astype(np.float32)
    spacing = np.full(3, 0.3)
    controls = np.stack([np.full(7, 3.5), 3.6 + 0.3 * np.sin(np.arange(7)), 0.5 + 1.2 * np.arange(7)], axis=1)
    tint = np.array([50.0, 60.0])
    samples = sampling(Tube(controls, tint, 0.3, 3.0), 0.24)  # six an interval
    _, right, normal = _equations(grey, spacing, samples, controls, tint, 0.3)
    np.testing.assert_allclose(normal, normal.T, rtol=0.0, atol=1e-6 * np.abs(normal).max())
    h = 1e-5
    for k, axis in ((0, 0), (3, 1), (5, 2), (6, 2)):
        ends = []
        for sign in (1, -1):
            moved = controls.copy()
            moved[k, axis] += sign * h
            ends.append(_equations(grey, spacing, samples, moved, tint, 0.3)[0])
        assert right[3 * k + axis] == pytest.approx(-0.5 * (ends[0] - ends[1]) / (2 * h), rel=2e-3, abs=1.0)
    ends = [_equations(grey, spacing, samples, controls, tint + np.array([d, 0]), 0.3)[0] for d in (1e-3, -1e-3)]
    assert right[21] == pytest.approx(-0.5 * (ends[0] - ends[1]) / 2e-3, rel=1e-3, abs=1e-2)


def test_tube_fit_finds_a_noise_free_tube_again():
    spacing = np.full(3, 0.3)
    controls = np.stack(
        [4 + np.cos(0.4 * np.arange(9)), 4 + np.sin(0.4 * np.arange(9)), -1 + 1.5 * np.arange(9)], axis=1
    )
    truth = Tube(controls, np.full(tint_nodes(6), 700.0), 0.27, 0.0)
    shape = (30, 30, 40)
    grey = np.zeros(shape, np.float32)
    region = SimpleNamespace(numbers=Spare(shape, np.int32))
    image = SimpleNamespace(grey=grey, spacing=spacing, noise=1.0, voxel=0.3, region=region)
    voxels, model = predicted(image, truth)
    grey.reshape(-1)[voxels] = model
    start = Tube(controls + 0.2 * np.sin(np.arange(27)).reshape(9, 3), truth.tint * 0.8, 0.3, 0.0)
    fit = fit_tube(image, start, iterations=30, tolerance=1e-4)
    u = np.linspace(0, 6, 60)
    dense, found = truth.at(np.linspace(0, 6, 6000)), fit.at(u)
    off = np.min(np.linalg.norm(found[:, None] - dense[None], axis=2), axis=1)
    assert off[3:-3].max() < 0.01 * 0.3
    assert off.max() < 0.05 * 0.3
    assert fit.sigma == pytest.approx(0.27, rel=0.02)


def test_half_level_offset_is_exact_for_cylinders_and_second_order_for_flat_walls():
    sigma, radius = 0.35, 0.8
    r = np.linspace(0.3, 0.8, 2001)
    share = ncx2.cdf((radius / sigma) ** 2, 2, (r / sigma) ** 2)
    half = float(np.interp(0.5, share[::-1], r[::-1]))
    assert half + half_level_offset(np.array([1 / half]), sigma)[0] == pytest.approx(radius, abs=2e-3)
    gentle = half_level_offset(np.array([0.05, -0.05]), sigma)
    np.testing.assert_allclose(gentle, [0.5 * sigma**2 * 0.05, -0.5 * sigma**2 * 0.05], rtol=0.05)


def test_blur_is_read_off_a_curved_wall():
    sigma, radius, contrast = 0.3, 0.7, 900.0
    r = np.linspace(0.2, 1.2, 4001)
    grey = contrast * ncx2.cdf((radius / sigma) ** 2, 2, (r / sigma) ** 2)
    half = float(np.interp(-0.5 * contrast, -grey, r))
    steep = -float(np.interp(half, r, np.gradient(grey, r)))
    assert blur_of_wall(np.array([steep]), np.array([1 / half]), contrast) == pytest.approx(sigma, rel=0.02)


def crest_jet(seed):
    """The ten numbers of a quadratic ridge with a tilted crest, in ``jet``'s order, its tangent and its offset."""
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    curved = turn @ np.diag([-3.0 - rng.random(), -1.0 - rng.random(), 0.2 * rng.random()]) @ turn.T
    across = turn[:, :2] @ rng.uniform(-0.5, 0.5, 2)
    gradient, second = -curved @ across, curved[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return np.concatenate([[1.0], gradient, second]), curved, turn[:, 2], across


@pytest.mark.parametrize("seed", range(8))
def test_a_ridge_has_the_curvatures_and_the_direction_of_its_hessian(seed):
    ten, curved, along, _ = crest_jet(seed)
    tangent = along + 0.3
    low, middle = ridge_frame(ten, tangent)
    # the closed form takes an arccosine, which costs half the digits where two curvatures are alike
    np.testing.assert_allclose([low, middle], np.linalg.eigvalsh(curved)[:2], rtol=1e-7)
    np.testing.assert_allclose(tangent, along * np.sign(along @ (along + 0.3)), rtol=0.0, atol=1e-7)


@pytest.mark.parametrize("seed", range(8))
def test_one_newton_step_leads_from_beside_a_quadratic_ridge_onto_its_crest(seed):
    ten, _, along, across = crest_jet(seed)
    step = np.empty(3)
    ridge_step(ten, along, 10.0, step)
    np.testing.assert_allclose(step, across, rtol=0.0, atol=1e-12)
    ridge_step(ten, along, 0.1, step)
    np.testing.assert_allclose(step, 0.1 * across / np.linalg.norm(across), rtol=0.0, atol=1e-12)
