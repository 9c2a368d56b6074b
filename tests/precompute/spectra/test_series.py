# SPDX-License-Identifier: GPL-3.0-or-later
"""The series of a bake (single precision, few nodes, thinned bins) against the exact spectrum."""

import numpy as np
import pytest

from precompute.spectra import series as fast
from precompute.spectra.series import Resampler, _coefficient_sizes, bound, exact_error, fast_series, measured_count
from precompute.spectra.spectrum import frequency_grid, scattered_spectrum
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare

S_MAX, Q_MAX = 2 / 380e-9, 5.6e6
WHOLE = (slice(None), slice(None))


def skin(count=400, pixel=60e-9, scale=30e-9, seed=0, periodic=False, rows=None):
    """A relief of Gaussian bumps of 300 nm with `scale` metres rms: all of `count` rows and columns, or some rows."""
    rng = np.random.default_rng(seed)
    q = np.fft.fftfreq(count, pixel)
    spectrum = np.fft.fft2(rng.standard_normal((count, count)))
    smooth = np.fft.ifft2(spectrum * np.exp(-(q[:, None] ** 2 + q**2) * (np.pi * 300e-9) ** 2)).real
    return prepare(HeightMap(scale * smooth[:rows] / smooth.std(), (pixel, pixel), "skin", periodic=periodic))


@pytest.mark.parametrize("scale", [1e-9, 30e-9, 150e-9])
def test_the_fast_series_is_the_exact_spectrum(scale):
    """The tolerance is 2e-4 of the sum of the coefficients, and its estimate may be wrong by a factor of two. Single
    precision adds 1e-6. A deep relief's power over s^2 is small at large s, so its share of error is larger."""
    relief = skin(scale=scale)
    series = fast_series(relief, Q_MAX, S_MAX, finest_kernel=4e4, tolerance=2e-4)
    light = _coefficient_sizes(series.scattered_over_s2).sum()
    for s in np.random.default_rng(1).uniform(0.05, 1, 6) * S_MAX:
        power, zero = scattered_spectrum(relief, s, series.grid)
        assert exact_error(relief, series, np.array([s])) <= 4e-4 * light / (power.sum() / s**2) + 1e-5
        assert series.zero_order(np.array(s)) == pytest.approx(zero, abs=6e-4)


def test_a_shallow_relief_is_not_lost_in_single_precision():
    """A relief of a tenth of a nanometre scatters 1e-5 of the light; rounding, 1e-12, is negligible."""
    relief = skin(scale=1e-10)
    series = fast_series(relief, Q_MAX, S_MAX, finest_kernel=4e4, tolerance=1e-5)
    assert exact_error(relief, series, np.array([0.3, 0.9]) * S_MAX) <= 1e-4


def test_a_real_relief_takes_fewer_nodes_than_the_bound():
    relief = skin(scale=40e-9)
    assert measured_count(relief, Q_MAX, S_MAX, tolerance=2e-4) < 0.8 * bound(relief, S_MAX, 2e-4)


def test_nodes_that_do_not_suffice_are_noticed(monkeypatch):
    """The measurement asks for four nodes; the coefficients of the whole relief show that these are too few."""
    relief = skin(scale=80e-9)
    monkeypatch.setattr(fast, "measured_count", lambda *_, **__: 4)
    series = fast_series(relief, Q_MAX, S_MAX, finest_kernel=4e4, tolerance=2e-4)
    assert len(series.amplitude) > 4
    assert exact_error(relief, series, np.array([0.2, 0.6, 0.95]) * S_MAX) <= 1e-3


@pytest.mark.parametrize(("rows", "periodic"), [(600, False), (600, True), (48, False)])
def test_thinned_bins_are_the_same_light(rows, periodic):
    """With a kernel of eight bins, the bins are blurred by 0.6 of the kernel and thinned; the rest of the kernel is
    applied afterwards. The sum is flat to 6e-4 of an order (see series.py), and each Gaussian ends at 5.5 sigma. The
    window of 48 rows has half of the kernel's variance across them."""
    relief = skin(count=600, periodic=periodic, rows=rows)
    bins = 1 / relief.size_m[1]
    series = fast_series(relief, Q_MAX, S_MAX, finest_kernel=8 * bins, tolerance=1e-6)
    assert series.blur_q > 0
    assert series.scattered_over_s2[0].size < 0.1 * (2 * Q_MAX / bins) ** 2
    lam, s = 780e-9, 1.5 / 780e-9
    sigma = 8 * bins * lam
    axis = np.linspace(-1.5, 1.5, 90)
    fine = frequency_grid(relief, Q_MAX, 8 * bins)
    exact, _ = scattered_spectrum(relief, s, fine)
    resample = Resampler(fine, axis, axis, lam, fine.kernel_left(sigma, lam))
    truth = resample(exact[resample.kept])
    power = series.mixed(series.weights(np.array([s])) * s**2, WHOLE)[:, 0]
    resample = Resampler(series.grid, axis, axis, lam, series.kernel_left(sigma, lam))
    np.testing.assert_allclose(resample(power[resample.kept]), truth, rtol=0, atol=1e-3 * truth.max())
    assert exact_error(relief, series, np.array([0.5 * S_MAX])) < 1e-3


def test_progress_counts_the_transforms():
    told = []
    series = fast_series(
        skin(100),
        Q_MAX,
        S_MAX,
        finest_kernel=1e5,
        tolerance=1e-3,
        progress=lambda stage, fraction: told.append((stage, fraction)),
    )
    count = len(series.amplitude)
    assert told[-count:] == [("transforms", (k + 1) / count) for k in range(count)]
