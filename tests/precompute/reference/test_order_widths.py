# SPDX-License-Identifier: GPL-3.0-or-later
"""The orders of a scanned grating against those of the endless grating, in closed form.

The order m of an endless sinusoid of amplitude A has the share J_m(2 pi s A)^2 of the light (Jacobi-Anger), at u = m
lambda / period. The coherence kernel spreads it as a Gaussian of sigma_b. The scan's apodisation window must not widen
it. A narrower Gaussian makes up for the window's width, but not for its side lobes, which take up to 5 % of the light
in the middle of an order."""

import numpy as np
import pytest

from precompute.bake.ensemble import plan, sample_set
from precompute.reference.reference import blurred, reference_grid
from precompute.spectra.density import density_at
from precompute.spectra.spectrum import scattered_spectrum
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare

AMPLITUDE, W, PIXEL = 60e-9, 1.6, 90e-9
PEAK, WIDTH = 0.05, 0.03


def scan_of(size_um, period):
    """A scan (width, height) in micrometres of an endless sinusoid along T. It ends at no whole number of periods."""
    columns, rows = (round(side * 1e-6 / PIXEL) for side in size_um)
    line = AMPLITUDE * np.sin(2 * np.pi * np.arange(columns) * PIXEL / period + 0.7)
    return prepare(HeightMap(np.tile(line, (rows, 1)), (PIXEL, PIXEL), "test"))


def bessel_j1(x):
    """J_1(x): the mean of cos(t - x sin(t)) over a turn, exact for a sum over many equal steps."""
    t = 2 * np.pi * np.arange(64) / 64
    return np.mean(np.cos(t - x * np.sin(t)))


def full_width(offsets, values):
    """The full width at half of the maximum, by linear interpolation."""
    half = values.max() / 2
    above = np.flatnonzero(values >= half)
    rising, falling = above[0] - 1, above[-1]
    ends = [
        np.interp(0, np.sort(values[k : k + 2] - half), offsets[k : k + 2][np.argsort(values[k : k + 2])])
        for k in (rising, falling)
    ]
    return ends[1] - ends[0]


@pytest.mark.short("size_um0-1.5e-06")
@pytest.mark.parametrize("period", [1.5e-6, 2.4e-6])
@pytest.mark.parametrize("size_um", [(60, 32), (40, 40)])
def test_a_first_order_is_as_wide_and_bright_as_stated(size_um, period):
    """By the reference's bins, the bake's, and the samples, at the coherence that a bake chooses, along both axes."""
    relief = scan_of(size_um, period)
    chosen = plan(relief)
    (series,), sigma_b, samples = chosen.ensemble, chosen.sigma_b, sample_set(chosen)
    offsets = np.linspace(-2, 2, 121) * sigma_b
    u, v = np.concatenate([offsets, 0 * offsets]), np.concatenate([0 * offsets, offsets])
    grid = reference_grid(relief, sigma_b)
    for lam in (450e-9, 550e-9, 650e-9):
        s, places = W / lam, (u + lam / period, v)
        power, _ = scattered_spectrum(relief, s, grid)
        peak = bessel_j1(2 * np.pi * s * AMPLITUDE) ** 2 / (2 * np.pi * sigma_b**2)
        for density in (
            blurred(power, grid, places, lam=lam, sigma_b=sigma_b),
            density_at(series, *places, w=W, lambdas=np.array([lam]), sigma=sigma_b)[0],
            of_samples(samples, *places, lam),
        ):
            assert density.max() == pytest.approx(peak, rel=PEAK)
            for along in np.split(density, 2):
                assert full_width(offsets, along) == pytest.approx(np.sqrt(8 * np.log(2)) * sigma_b, rel=WIDTH)


def of_samples(samples, u, v, lam):
    """The density (n,) of a sample set: the mean of its lobes, whose Gaussians have the rest of the kernel."""
    weight = samples.weights(W / lam) * (W / lam) ** 2
    variance = samples.sigma_b**2 - (lam * samples.blur_q) ** 2
    along_u, along_v = (
        np.exp(-((at[:, None] - lam * samples.q[..., axis].ravel()) ** 2) / (2 * variance))
        for axis, at in enumerate((u, v))
    )
    return np.einsum("ns,ns,s->n", along_u, along_v, weight.ravel()) / (weight.size * 2 * np.pi * variance)
