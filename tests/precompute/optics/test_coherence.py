# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.optics.coherence import (
    MINIMUM_AREAS,
    REFERENCE_WAVELENGTH_M,
    coherence_areas,
    coherence_length,
    kernel_sigma,
    narrowest_averaging_kernel,
)

lengths = st.floats(1e-7, 1e-2)
few = settings(deadline=None, max_examples=50)


@few
@given(lengths)
def test_length_and_kernel_are_inverse(length_m):
    assert coherence_length(kernel_sigma(length_m)) == pytest.approx(length_m, rel=1e-14)


def test_the_kernel_of_the_thesis():
    """For 4 sigma_s = 65 um at 550 nm, sigma_b = 0.55 / (2 pi sqrt(2) 16.25)."""
    assert kernel_sigma(65e-6) == pytest.approx(0.55 / (2 * np.pi * np.sqrt(2) * 16.25), rel=1e-14)


@few
@given(lengths, lengths, st.floats(1e-6, 1e-3))
def test_areas_are_the_scans_area_over_one_windows(height_m, width_m, length_m):
    """Two windows exp(-x^2 / 2 sigma_s^2) at a distance d overlap by exp(-d^2 / 4 sigma_s^2). The test searches the
    distance at which the square of that is 1 / e, instead of using d = sqrt(2) sigma_s."""
    sigma_s = length_m / 4
    shifts = np.linspace(0, 3, 30001)
    apart = shifts[np.argmax(np.exp(-(shifts**2) / 4) ** 2 <= np.exp(-1))] * sigma_s
    areas = coherence_areas((height_m, width_m), length_m)
    # The search has steps of 1e-4, which is 7e-5 of the distance and twice that of its square.
    assert areas == pytest.approx(height_m * width_m / apart**2, rel=3e-4)


@few
@given(lengths, lengths)
def test_the_narrowest_kernel_averages_just_enough(height_m, width_m):
    length_m = coherence_length(narrowest_averaging_kernel((height_m, width_m)))
    assert coherence_areas((height_m, width_m), length_m) == pytest.approx(MINIMUM_AREAS, rel=1e-12)


def test_a_65_um_scan_takes_some_32_um():
    """30 areas need sigma_s = 65 um / sqrt(60). At the thesis's 65 um the same scan averages only 8 areas."""
    assert coherence_length(narrowest_averaging_kernel((65e-6, 65e-6))) == pytest.approx(4 * 65e-6 / 60**0.5, rel=1e-12)
    assert coherence_areas((65e-6, 65e-6), 65e-6) == pytest.approx(8, rel=1e-12)


@pytest.mark.parametrize(("count", "sigma_pixels"), [(96, 4.0), (97, 6.5), (160, 3.0)])
@pytest.mark.parametrize("seed", [0, 1])
def test_the_kernel_is_the_mean_over_window_positions(count, sigma_pixels, seed):
    """On a periodic profile, two results are equal to rounding. One is the mean of |P|^2 over every circular position
    of a Gaussian amplitude window. The other is the profile's periodogram, blurred by a Gaussian of sigma_q = 1 / (2 pi
    sqrt(2) sigma_s) that wraps. The window's transform is a Gaussian; its copies, one Nyquist period apart, meet where
    it has fallen to exp(-2 (pi sigma_pixels / 2)^2), which is 4e-20 for sigma_pixels = 3."""
    rng = np.random.default_rng(seed)
    pixel_m = 40e-9
    surface = np.exp(1j * rng.uniform(0, 2 * np.pi, count))
    position = np.arange(count)
    copies = count * np.arange(-6, 7)[:, None]
    window = np.exp(-((position + copies) ** 2) / (2 * sigma_pixels**2)).sum(axis=0)
    waves = np.exp(-2j * np.pi * np.outer(position, position) / count)
    seen = [np.abs(waves @ (surface * np.roll(window, shift))) ** 2 for shift in position]
    mean_over_positions = np.mean(seen, axis=0) / np.sum(window**2)

    periodogram = np.abs(waves @ surface) ** 2 / count
    # kernel_sigma is in u; dividing by the reference wavelength gives q.
    sigma_q = kernel_sigma(4 * sigma_pixels * pixel_m) / REFERENCE_WAVELENGTH_M
    bin_q = 1 / (count * pixel_m)
    kernel = np.exp(-(((position + copies) * bin_q / sigma_q) ** 2) / 2).sum(axis=0)
    kernel /= kernel.sum()
    blurred = np.array([kernel[(k - position) % count] @ periodogram for k in position])
    np.testing.assert_allclose(mean_over_positions, blurred, rtol=1e-11)
