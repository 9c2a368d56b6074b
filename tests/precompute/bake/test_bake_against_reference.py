# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake's table against the reference, which sums over the bins of an exact transform."""

import numpy as np
import pytest

from precompute.bake.ensemble import bake, plan
from precompute.bake.request import BakeRequest
from precompute.colour.observer import white_xyz
from precompute.maths import chebyshev
from precompute.measure import truths
from precompute.measure.errors import measure
from precompute.reference.reference import reference_xyz
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare

from .conftest import COHERENCE_M, waves


@pytest.mark.parametrize("w", [0.05, 0.6, 1.2, 1.9])
def test_the_table_is_the_reference(baked, w):
    """The tolerance is 2 % of the peak. At 1.1 texels to a standard deviation, B-splines read a Gaussian with an error
    of at most 1 % of its peak along each axis (test_bspline.py); the orders of the waves have more texels. The dropped
    terms and the bake's 81 wavelengths add half a percent. There is room for this, because no order has the worst case
    along both axes."""
    assert baked.sigma_b / baked.texel > 1.1
    u, v = np.random.default_rng(0).uniform(-0.6, 0.6, (2, 400))
    scattered, zero = reference_xyz(waves(), (u, v), w=w, sigma_b=baked.sigma_b, step_m=5e-9)
    computed = baked.scattered_over_w2(u, v, w) * w**2
    np.testing.assert_allclose(computed, scattered, rtol=0, atol=0.02 * scattered.max())
    np.testing.assert_allclose(baked.zero_order_xyz(w), zero, rtol=0, atol=2e-3)


@pytest.mark.parametrize("delta_e", [3.0, 1.0, 0.5])
def test_the_table_looks_like_the_reference(delta_e):
    """The project's error metric stays below its bound, the only input of the bake. The reference's wavelengths are
    5 nm apart, so that at |u| = 2 an order moves by half a standard deviation."""
    table = bake(waves(), BakeRequest(delta_e=delta_e, coherence_length_m=COHERENCE_M))
    truth = truths.truths(waves(), table.sigma_b, 2, pairs_each=1000, step_m=5e-9)
    errors = measure(truth, table.candidate)
    assert errors.p99 < delta_e
    assert errors.relative_dy < 0.01 * delta_e
    assert errors.zero_order_dy < 2e-3


@pytest.mark.parametrize("w", [0.3, 1.0, 1.8])
def test_the_table_holds_the_energy(baked, w):
    """Scattered light, summed over the texels, and the zero order sum to white, since all orders lie inside the table.
    Dropped terms cost 0.1 % of the luminance, and the series 1e-4. Efficiencies vary slowly with wavelength, but
    summing the observer's curve at 81 wavelengths has an error of up to 0.2 %."""
    basis = chebyshev.polynomials(np.array(w - 1), len(baked.terms))
    table = np.tensordot(basis, baked.terms.astype(float), axes=1) * w**2
    scattered = table.sum(axis=(0, 1)) * baked.texel**2
    assert scattered[1] > 0.01
    np.testing.assert_allclose(scattered + baked.zero_order_xyz(w), white_xyz(), rtol=3e-3)


def test_directions_are_where_they_belong():
    """Sawtooth facets send light to u = -slope w along T; turned towards B they send it to v."""
    ramp = 200e-9 * np.tile(np.arange(16) / 16, 4)
    for along_b in (False, True):
        heights = np.broadcast_to(ramp, (64, 64))
        heights = heights.T[::-1] if along_b else heights
        relief = prepare(HeightMap(heights, (80e-9, 80e-9), "test", periodic=True))
        table = bake(relief, BakeRequest(delta_e=5, coherence_length_m=2e-6))
        w = 1.8
        basis = chebyshev.polynomials(np.array(w - 1), len(table.terms))
        luminance = np.tensordot(basis, table.terms[..., 1], axes=1)
        row, col = np.unravel_index(np.argmax(luminance), luminance.shape)
        v, u = table.axes[0][row], table.axes[1][col]
        # The facet's slope alone would give 1.8 * 200 / 1280 = 0.28, but a grating of 1.28 um has discrete orders:
        # order -1 of green light is at 0.43. The kernel has a standard deviation of 0.12.
        assert (v if along_b else u) == pytest.approx(-550e-9 / 1.28e-6, abs=0.05)
        assert (u if along_b else v) == pytest.approx(0, abs=table.texel)


def test_two_scans_are_their_mean():
    """Every step is linear. The numbers of terms and texels are measured on both scans."""
    one, other = waves(100e-9), waves(200e-9)
    both = bake((one, other), BakeRequest(coherence_length_m=COHERENCE_M))
    chosen = plan((one, other), BakeRequest(coherence_length_m=COHERENCE_M))
    w = 1.2
    u, v = np.random.default_rng(0).uniform(-0.6, 0.6, (2, 200))
    truth = sum(reference_xyz(relief, (u, v), w=w, sigma_b=both.sigma_b, step_m=5e-9)[0] for relief in (one, other)) / 2
    answer = both.scattered_over_w2(u, v, w) * w**2
    np.testing.assert_allclose(answer, truth, rtol=0, atol=0.02 * truth.max())
    zero = (
        sum(reference_xyz(relief, (u[:1], v[:1]), w=w, sigma_b=both.sigma_b, step_m=5e-9)[1] for relief in (one, other))
        / 2
    )
    np.testing.assert_allclose(both.zero_order_xyz(w), zero, atol=2e-3)
    assert len(chosen.ensemble) == 2


def test_a_deep_relief_keeps_its_colour_at_every_w():
    """The error is at most 4 % of the peak near the zero order, at every w. Near the zero order the scattered light of
    a deep relief falls by orders of magnitude from w = 0 to 2. Choosing terms by their error relative to the mean over
    w gave errors of a third. The bake is asked for a dE00 of 1, of which the terms may use a fifth: 0.5 % for 99 % of
    the light. In this region alone five times that is allowed, and 1.5 % for reading and rounding."""
    rng = np.random.default_rng(7)
    spectrum = np.fft.fft2(rng.standard_normal((96, 96)))
    q = np.fft.fftfreq(96)
    smooth = np.fft.ifft2(spectrum * np.exp(-(q[:, None] ** 2 + q**2) / (2 * 0.05**2))).real
    height = 800e-9 * (smooth - smooth.min()) / np.ptp(smooth)
    relief = prepare(HeightMap(height, (80e-9, 80e-9), "deep", periodic=True))
    baked = bake(relief)
    u, v = rng.uniform(-0.05, 0.05, (2, 40))
    for w in (0.6, 1.2, 1.7, 1.95):
        truth, _ = reference_xyz(relief, (u, v), w=w, sigma_b=baked.sigma_b, step_m=4e-9)
        answer = baked.scattered_over_w2(u, v, w) * w**2
        assert np.abs(answer - truth).max() <= 0.04 * truth.max()
