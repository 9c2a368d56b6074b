# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums of samples under a Gaussian."""

import numpy as np
import pytest

from precompute.maths.gaussian_sums import gaussian_sums


@pytest.mark.parametrize("sigma", [(0.9, 2.5), (3.0, 1.0)])
def test_it_is_the_sum_over_every_sample(sigma):
    rng = np.random.default_rng(0)
    samples = rng.random((30, 25, 2))
    y, x = rng.uniform(-2, 32, 40), rng.uniform(-2, 27, 40)
    down, across = (
        np.exp(-0.5 * ((at[:, None] - np.arange(count)) / each) ** 2) / (np.sqrt(2 * np.pi) * each)
        for at, count, each in zip((y, x), samples.shape, sigma, strict=False)
    )
    expected = np.einsum("nr,rcx,nc->nx", down, samples, across)
    # What is cut off is below exp(-6^2 / 2) of a Gaussian's peak, times 750 samples.
    found = gaussian_sums(samples, y, x, sigma=sigma, cut=6.0)
    np.testing.assert_allclose(found, expected, rtol=0, atol=750 * 1.6e-8)


def test_one_sample_and_single_precision():
    one = np.full((1, 1, 1), 3.0, np.float32)
    found = gaussian_sums(one, np.array([0.0, 1.0, 9.0]), np.zeros(3), sigma=(1.0, 1.0), cut=6.0)
    np.testing.assert_allclose(found[:, 0], 3 / (2 * np.pi) * np.exp([0, -0.5, -np.inf]), rtol=1e-6)
