# SPDX-License-Identifier: GPL-3.0-or-later
"""The sums of `check` against the reference's, which shares no code with them."""

import numpy as np
import pytest

from laboratory.check.direct_sums import Held, draw_pairs, scattered_xyz, zero_order_xyz
from laboratory.check.table_file import PAD, scattered_cells
from precompute.colour.observer import spectral_weights, wavelengths
from precompute.optics.coherence import narrowest_averaging_kernel
from precompute.optics.region import Region
from precompute.reference.reference import reference_grid, reference_xyz
from precompute.spectra.spectrum import zero_order_amplitude
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed

PIXEL, W, STEP_M = 70e-9, 1.6, 100e-9


def skin(periodic, shape=(48, 60), seed=3):
    """An irregular, asymmetric grating of 1.05 um along T."""
    rng = np.random.default_rng(seed)
    y, x = (np.arange(n) / n for n in shape)
    phase = 0.8 * np.cos(2 * np.pi * (x + y[:, None])) + 0.5 * np.cos(2 * np.pi * (2 * x - y[:, None]) + 1)
    heights = 110e-9 * np.sin(2 * np.pi * 4 * x + phase) + 30e-9 * rng.standard_normal(shape).cumsum(axis=0) / 7
    return prepare(HeightMap(heights, (PIXEL, PIXEL), "test", periodic=periodic))


def places(count=60, seed=1):
    return np.random.default_rng(seed).uniform(-1.4, 1.4, (2, count))


def test_where_it_wraps_it_is_the_reference():
    """Both sum the orders of the surface. `check` leaves out what lies beyond 6 sigma in u or in v, which is at most
    all of the light at the kernel's height there."""
    relief, sigma_b = skin(periodic=True), 0.03
    u, v = places()
    expected, zero_order = reference_xyz(relief, (u, v), w=W, sigma_b=sigma_b, step_m=STEP_M)
    computed = scattered_xyz([relief], (u, v, W), sigma_b=sigma_b, step_m=STEP_M)
    np.testing.assert_allclose(computed, expected, rtol=0, atol=2 * np.exp(-18) / (2 * np.pi * sigma_b**2))
    assert expected.max() > 1e5 * 2 * np.exp(-18) / (2 * np.pi * sigma_b**2)
    # The zero order is summed in steps of 1 nm, so the reference is too.
    _, zero_order = reference_xyz(relief, (u[:1], v[:1]), w=W, sigma_b=sigma_b, step_m=1e-9)
    np.testing.assert_allclose(zero_order_xyz([relief], np.array([W]))[0], zero_order, rtol=1e-6)


def folded(relief, lam, sigma_b, lengths):
    """Bound for the difference between a sum over frequencies 1 / length apart and its integral, as a density over (u,
    v). The sum cannot tell lags apart that differ by a length. Each lag of the autocorrelation therefore gets the
    kernel's weight at its images too."""
    rows, cols = relief.height_m.shape
    p = np.exp(-2j * np.pi * (W / lam) * relief.height_m)
    p = relief.apodisation * (p - (relief.apodisation**2 * p).sum() / (relief.apodisation**2).sum())
    lagged = np.fft.ifft2(np.abs(np.fft.fft2(p, (2 * rows, 2 * cols))) ** 2)
    correlation = np.abs(np.fft.fftshift(lagged)) / (relief.apodisation**2).sum()
    own, images = [], []
    for count, length in zip((rows, cols), lengths, strict=True):
        lag = (np.arange(2 * count) - count) * PIXEL
        weigh = np.exp(-2 * (np.pi * sigma_b / lam * (lag + np.arange(-3, 4)[:, None] * length)) ** 2)
        own.append(weigh[3])
        images.append(weigh.sum(axis=0))
    return (correlation * (np.outer(*images) - np.outer(*own))).sum() * PIXEL**2 / lam**2


def test_where_it_does_not_wrap_it_is_the_reference():
    """The difference is at most the sum of both bounds; the reference, which pads less, has the larger one."""
    relief = skin(periodic=False)
    sigma_b = narrowest_averaging_kernel(relief.size_m)
    u, v = places()
    lambdas = wavelengths(STEP_M)
    padded = [n * PIXEL for n in reference_grid(relief, sigma_b).transform_shape]
    missed = np.zeros((2, 3))
    for lam, weight in zip(lambdas, spectral_weights(lambdas), strict=True):
        longer = [length + PAD * lam / (2 * np.pi * sigma_b) for length in relief.size_m]
        missed += [weight * folded(relief, lam, sigma_b, lengths) for lengths in (longer, padded)]
    expected, _ = reference_xyz(relief, (u, v), w=W, sigma_b=sigma_b, step_m=STEP_M)
    computed = scattered_xyz([relief], (u, v, W), sigma_b=sigma_b, step_m=STEP_M)
    assert (np.abs(computed - expected) <= missed.sum(axis=0)).all()
    assert (missed[0] < 1e-3 * expected.max(axis=0)).all()
    assert (missed[1] < 0.02 * expected.max(axis=0)).all()


@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize("shape", [(1, 40), (40, 1), (33, 48)])
def test_the_cells_hold_all_the_light(periodic, shape):
    """By Parseval's theorem, up to single precision: some roundings of 6e-8 each. The omitted Nyquist frequency of an
    even count has almost no power here."""
    y, x = (np.arange(n) / n for n in shape)
    heights = 60e-9 * (np.cos(2 * np.pi * 2 * x) + np.sin(2 * np.pi * y[:, None]) * (shape[0] > 1))
    relief = prepare(HeightMap(heights, (PIXEL, PIXEL), "test", periodic=periodic))
    s = W / 550e-9
    cells = scattered_cells(relief, s, (1e12, 1e12), sigma_q=5e4)
    zero_order = abs(zero_order_amplitude(relief, s)) ** 2
    assert cells.power.sum() + zero_order == pytest.approx(1, abs=1e-6 if periodic else 1e-4)
    assert cells.power.shape == (len(cells.q_y), len(cells.q_x))


def test_a_facet_sends_the_light_down_its_slope():
    """u = -slope w: a sampled ramp one wavelength high has only the order m = -1."""
    period, lam = 3e-6, 550e-9
    relief = prepare(blazed(period, lam / W, periods=4, rows=1))
    cells = scattered_cells(relief, W / lam, (1e7, 1e7), sigma_q=1e4)
    at = np.unravel_index(np.argmax(cells.power), cells.power.shape)
    assert cells.q_x[at[1]] == pytest.approx(-1 / period)
    assert cells.power[at] == pytest.approx(1, rel=1e-12)


def test_several_scans_are_their_mean():
    reliefs, (u, v) = [skin(False, seed=3), skin(False, seed=4)], places(10)
    one, other = (scattered_xyz([relief], (u, v, W), sigma_b=0.1, step_m=STEP_M) for relief in reliefs)
    np.testing.assert_allclose(
        scattered_xyz(reliefs, (u, v, W), sigma_b=0.1, step_m=STEP_M), (one + other) / 2, rtol=1e-12
    )
    w = np.array([0.0, 0.7])
    one, other = (zero_order_xyz([relief], w) for relief in reliefs)
    np.testing.assert_allclose(zero_order_xyz(reliefs, w), (one + other) / 2, rtol=1e-12)


def test_pairs_lie_within_the_region():
    region, sigma_b = Region((0.1, 0.9), (-0.2, 0.3)), 0.05
    pairs = draw_pairs([skin(True)], Held(sigma_b, region), 1.1, count=400, rng=np.random.default_rng(0))
    assert (~pairs.drawn).sum() == 200 and pairs.drawn.sum() > 150
    assert (pairs.u >= 0.1).all() and (pairs.u <= 0.9).all() and (pairs.v >= -0.2).all() and (pairs.v <= 0.3).all()
    np.testing.assert_allclose(pairs.wi[:, 2] + pairs.wr[:, 2], 1.1, atol=1e-12)
    assert (np.minimum(pairs.wi[:, 2], pairs.wr[:, 2]) >= 0).all()


def test_drawn_pairs_are_where_the_light_is():
    """At a grating of 560 nm only the first orders are above the horizon, at u = lam / period."""
    x = np.arange(64) / 64
    relief = prepare(HeightMap(60e-9 * np.sin(2 * np.pi * 8 * x)[None], (PIXEL, PIXEL), "test", periodic=True))
    pairs = draw_pairs([relief], Held(0.01, Region()), 1.2, count=400, rng=np.random.default_rng(0))
    u, v = np.abs(pairs.u[pairs.drawn]), pairs.v[pairs.drawn]
    assert len(u) > 150
    assert (np.abs(v) < 0.05).all() and ((u > 0.63) & (u < 1.45)).all()
    # The pairs are spread over the wavelengths instead of a dozen of them.
    assert np.diff(np.sort(u)).max() < 0.12
