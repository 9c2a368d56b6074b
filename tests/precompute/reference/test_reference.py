# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from precompute.colour.observer import spectral_weights, wavelengths, white_xyz
from precompute.optics.coherence import narrowest_averaging_kernel
from precompute.reference.reference import blurred, reference_grid, reference_xyz
from precompute.spectra.spectrum import scattered_spectrum, zero_order_amplitude
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed, sinusoidal

PIXEL = 70e-9
W = 1.6


def skin(periodic, shape=(48, 60), seed=3):
    """An irregular, asymmetric grating of 1.05 um along T, with slow waves."""
    rng = np.random.default_rng(seed)
    y, x = (np.arange(n) / n for n in shape)
    phase = sum(
        0.4 * np.cos(2 * np.pi * (m * x + n * y[:, None]) + rng.uniform(0, 6)) for m, n in [(1, 1), (0, 2), (2, -1)]
    )
    heights = 110e-9 * np.sin(2 * np.pi * 4 * x + phase) + 30e-9 * rng.standard_normal(shape).cumsum(axis=0) / 7
    return prepare(HeightMap(heights, (PIXEL, PIXEL), "test", periodic=periodic))


def wave(period=2e-6, depth=150e-9, periods=5):
    """A sinusoidal grating of one row, which wraps."""
    return prepare(sinusoidal(period, depth, periods=periods, rows=1))


def places(count=50, seed=1):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.4, 1.4, (2, count))


def phasors(relief, s):
    """The apodised phasor without its mean, written out."""
    p = np.exp(-2j * np.pi * s * relief.height_m)
    mean = (relief.apodisation**2 * p).sum() / (relief.apodisation**2).sum()
    return relief.apodisation * (p - mean)


def applied(relief, sigma_b, lam):
    """The kernels (along v, along u), narrowed by the window's width, but at most to sigma_b / sqrt(5)."""
    return [np.sqrt(max(sigma_b**2 - (lam * width) ** 2, sigma_b**2 / 5)) for width in relief.window_q]


@pytest.mark.parametrize("sigma_b", [0.03, 0.2])
@pytest.mark.parametrize("periodic", [True, False])
def test_it_is_the_direct_sum(periodic, sigma_b):
    """Without FFT, truncated kernel or selection of bins: sums of exp(-2 pi i q x) over every pixel, at every bin of
    the Nyquist cell, each a Gaussian over all of (u, v); within 1e-9 of the peak. The reference leaves out what lies
    beyond 7 sigma: 2e-11 of a bin's own peak."""
    relief = skin(periodic)
    u, v = places()
    grid = reference_grid(relief, sigma_b)
    lambdas = wavelengths(100e-9)
    expected = np.zeros((len(u), 3))
    zero = np.zeros(3)
    for lam, weight in zip(lambdas, spectral_weights(lambdas), strict=True):
        s = W / lam
        waves, kernels = [], []
        left = applied(relief, sigma_b, lam)
        for count, padded, position, sigma in zip(
            relief.height_m.shape, grid.transform_shape, (v, u), left, strict=True
        ):
            q = (np.arange(padded) - padded // 2) / (padded * PIXEL)
            waves.append(np.exp(-2j * np.pi * np.outer(q, np.arange(count) * PIXEL)))
            distance = (position[:, None] - lam * q) / sigma
            kernels.append(np.exp(-(distance**2) / 2) / (np.sqrt(2 * np.pi) * sigma))
        power = np.abs(waves[0] @ phasors(relief, s) @ waves[1].T) ** 2
        power /= np.prod(grid.transform_shape) * np.sum(relief.apodisation**2)
        density = np.einsum("ny,yx,nx->n", kernels[0], power, kernels[1])
        expected += density[:, None] * weight
        zero += abs(zero_order_amplitude(relief, s)) ** 2 * weight
    computed, zero_order = reference_xyz(relief, (u, v), w=W, sigma_b=sigma_b, step_m=100e-9)
    np.testing.assert_allclose(computed, expected, rtol=0, atol=1e-9 * expected.max())
    np.testing.assert_allclose(zero_order, zero, rtol=1e-12)


def test_bins_stand_for_the_integral():
    """For a scan that does not wrap, the bins stand for the integral over all q of the kernel times the power of the
    apodised scan alone in the plane. That is a sum over the lags of its autocorrelation, times the Gaussian's
    transform. frequency_grid promises 1.5 % at its coarsest. Sigma_b is that of a bake that chooses its own kernel: 30
    coherence areas of the scan, which needs no finer bins."""
    relief = skin(periodic=False)
    sigma_b = narrowest_averaging_kernel(relief.size_m)
    u, v = places(300)
    for lam in (400e-9, 550e-9, 750e-9):
        s = W / lam
        scattered = phasors(relief, s)
        rows, cols = scattered.shape
        # Lags from -(n - 1) to n - 1: no lag wraps in a transform of twice the size.
        padded = np.fft.fft2(scattered, (2 * rows, 2 * cols))
        correlation = np.fft.fftshift(np.fft.ifft2(np.abs(padded) ** 2)) / np.sum(relief.apodisation**2)
        waves = []
        for count, position, sigma in zip((rows, cols), (v, u), applied(relief, sigma_b, lam), strict=True):
            lag = (np.arange(2 * count) - count) * PIXEL
            q, sigma_q = position[:, None] / lam, sigma / lam
            waves.append(np.exp(-2j * np.pi * q * lag - 2 * (np.pi * sigma_q * lag) ** 2) * PIXEL)
        # The density per (u, v) is lam^2 times the density over q.
        exact = np.einsum("ny,yx,nx->n", waves[0], correlation, waves[1]).real / lam**2
        grid = reference_grid(relief, sigma_b)
        power, _ = scattered_spectrum(relief, s, grid)
        computed = blurred(power, grid, (u, v), lam=lam, sigma_b=sigma_b)
        np.testing.assert_allclose(computed, exact, rtol=0, atol=0.015 * exact.max())


@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize("lam", [390e-9, 700e-9])
def test_the_density_holds_the_scattered_energy(periodic, lam):
    """Summed over (u, v) at steps of at most 0.9 of the applied kernel, where a sum over a Gaussian is flat to 5e-11.
    The relief is so smooth that nothing reaches |u| = 2: the grid loses less than 1e-9."""
    y, x = (np.arange(32) / 32 for _ in "yx")
    heights = 40e-9 * np.cos(2 * np.pi * (x + y[:, None])) + 50e-9 * np.sin(2 * np.pi * (x - 2 * y[:, None]))
    if not periodic:
        heights = heights + 20e-9 * x**3
    relief = prepare(HeightMap(heights, (90e-9, 90e-9), "test", periodic=periodic))
    sigma_b, step = 0.1, 0.04
    grid = reference_grid(relief, sigma_b)
    power, zero = scattered_spectrum(relief, W / lam, grid)
    # The kept bins reach 2 + 7 sigma at 380 nm; at 700 nm that is nearly twice as far.
    axis = np.arange(-6, 6, step)
    u, v = (c.ravel() for c in np.meshgrid(axis, axis))
    total = blurred(power, grid, (u, v), lam=lam, sigma_b=sigma_b).sum() * step**2
    # An edge that does not wrap scatters slightly further than the grid keeps.
    assert power.sum() == pytest.approx(1 - zero, rel=1e-9 if periodic else 2e-3)
    # Nothing lies beyond |u| = 6, since the bins end at (2 + 0.7) / 380 nm * 700 nm = 5.
    assert total == pytest.approx(power.sum(), rel=1e-9)


def test_a_spectrum_and_its_zero_order_make_white():
    """XYZ over all of (u, v) and the zero order sum to white: every wavelength's energy is 1. The relief has one row,
    so only u is summed; the grating's orders up to the 10th are all within |u| = 2.5."""
    relief, sigma_b, step = wave(), 0.05, 0.04
    u = np.arange(-3, 3, step)
    scattered, zero = reference_xyz(relief, (u, 0 * u), w=W, sigma_b=sigma_b, step_m=20e-9)
    # At v = 0 the kernel across is 1 / (sqrt(2 pi) sigma).
    total = scattered.sum(axis=0) * step * np.sqrt(2 * np.pi) * sigma_b + zero
    np.testing.assert_allclose(total, white_xyz(), rtol=1e-7)


@pytest.mark.parametrize("lam", [400e-9, 550e-9, 700e-9])
def test_the_grating_equation(lam):
    """u = m lam / period: each order is the kernel itself, as the others are 9 sigma away. Steps of 1e-4."""
    period, sigma_b = 2e-6, 0.02
    relief = wave(period)
    grid = reference_grid(relief, sigma_b)
    power, _ = scattered_spectrum(relief, W / lam, grid)
    for m in (-3, -2, -1, 1, 2, 3):
        u = m * lam / period + np.arange(-0.05, 0.05, 1e-4)
        density = blurred(power, grid, (u, 0 * u), lam=lam, sigma_b=sigma_b)
        assert u[np.argmax(density)] == pytest.approx(m * lam / period, abs=1.01e-4)
        width = np.sqrt(np.average((u - m * lam / period) ** 2, weights=density))
        # A Gaussian cut at 2.5 sigma keeps sqrt(1 - 5 phi(2.5) / 0.98758) = 0.9546 of its spread.
        assert width == pytest.approx(0.9546 * sigma_b, rel=0.005)


def test_a_facet_sends_the_light_down_its_slope():
    """u = -slope * w. The facet is one wavelength high at 550 nm, so the order m = -1 is exactly there. Other
    wavelengths' orders are beside it but share the eye's weight (+- 50 nm): u to 0.02."""
    depth, period = 550e-9 / W, 3e-6
    relief = prepare(blazed(period, depth, periods=4, rows=1))
    u = np.arange(-1.5, 1.5, 0.01)
    scattered, _ = reference_xyz(relief, (u, 0 * u), w=W, sigma_b=0.05, step_m=5e-9)
    assert u[np.argmax(scattered[:, 1])] == pytest.approx(-W * depth / period, abs=0.02)


def test_wavelengths_reach_both_ends():
    np.testing.assert_allclose(wavelengths(), np.arange(380, 781) * 1e-9, rtol=1e-12)
    assert len(wavelengths(5e-9)) == 81
    uneven = wavelengths(7e-9)
    assert (uneven[0], uneven[-1]) == (380e-9, 780e-9)
    assert np.diff(uneven).max() <= 7e-9
    assert len(wavelengths(400e-9)) == 2


def test_a_mirror_has_no_scattered_light():
    relief = prepare(HeightMap(np.zeros((16, 16)), (PIXEL, PIXEL), "test", periodic=True))
    u, v = places(20)
    scattered, zero = reference_xyz(relief, (u, v), w=W, sigma_b=0.1, step_m=50e-9)
    np.testing.assert_array_equal(scattered, 0)
    np.testing.assert_allclose(zero, white_xyz(), rtol=1e-12)


def test_progress_is_told():
    told = []
    reference_xyz(
        wave(),
        (np.zeros(1), np.zeros(1)),
        w=W,
        sigma_b=0.1,
        step_m=100e-9,
        progress=lambda _, fraction: told.append(fraction),
    )
    assert told == [(k + 1) / 5 for k in range(5)]


def test_many_places_are_taken_in_parts():
    relief = skin(periodic=True)
    sigma_b, lam = 0.35, 500e-9
    grid = reference_grid(relief, sigma_b)
    power, _ = scattered_spectrum(relief, W / lam, grid)
    u, v = places(4000)
    together = blurred(power, grid, (u, v), lam=lam, sigma_b=sigma_b)
    alone = [
        blurred(power, grid, (u[k : k + 1], v[k : k + 1]), lam=lam, sigma_b=sigma_b)[0] for k in range(0, 4000, 397)
    ]
    np.testing.assert_allclose(together[::397], alone, rtol=1e-12)
