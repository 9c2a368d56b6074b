# SPDX-License-Identifier: GPL-3.0-or-later
"""The cells of `check` against sums in double precision, and merged cells against all cells."""

import numpy as np
import pytest

from laboratory.check.table_file import Cells, scattered_cells
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare

LAM, STEP = 550e-9, 1e4
# The places of cells in (u, v) are 0.0055 apart.
SPACING = LAM * STEP


def speckle(shape, seed=2):
    """Cells of random light; the brightest has a thousand times the mean."""
    power = np.random.default_rng(seed).exponential(size=shape).astype(np.float32)
    power[shape[0] // 2 + 8, shape[1] // 2 - 13] = 1000
    power /= power.sum()
    q_y, q_x = (STEP * (np.arange(n) - n // 2) for n in shape)
    return Cells(q_y, q_x, power, (0.0, 0.0))


def all_cells(cells, u, v, sigma):
    """The density (n,) of the light within |(u, v)| = 2 by the sum over every cell, in double precision."""
    inside = np.hypot(LAM * cells.q_x, LAM * cells.q_y[:, None]) <= 2
    kernel_y, kernel_x = (
        np.exp(-0.5 * ((at[:, None] - LAM * q) / sigma) ** 2) / (np.sqrt(2 * np.pi) * sigma)
        for at, q in ((v, cells.q_y), (u, cells.q_x))
    )
    return np.einsum("ny,nx,yx->n", kernel_y, kernel_x, (cells.power * inside).astype(float))


@pytest.mark.parametrize("widths", [3.1, 6.0, 12.5, 50.0])
def test_merged_cells_give_the_sum_over_all_cells(widths):
    """A cell's light is off by at most 2.1e-4 of the kernel's peak (Cells.merged), and single precision by 1e-6."""
    cells, sigma = speckle((301, 420)), widths * SPACING
    u, v = np.random.default_rng(1).uniform(-1, 1, (2, 200))
    found = cells.wide_density(u, v, LAM, sigma=np.full(200, sigma))
    peak = 1 / (2 * np.pi * sigma**2)
    np.testing.assert_allclose(found, all_cells(cells, u, v, sigma), rtol=0, atol=2.2e-4 * peak)
    halvings = sum(widths >= 3 * 2.0**k for k in range(1, 9))
    assert len(cells.merged(sigma / LAM).q_x) < 420 / 2**halvings + 10


def test_one_order_keeps_its_place_where_cells_are_merged():
    """A single line of light, at every place between the cells that stay, is a Gaussian about its own place."""
    sigma = 12 * SPACING
    for at in range(8):
        power = np.zeros((1, 101), np.float32)
        power[0, 40 + at] = 1
        cells = Cells(np.zeros(1), STEP * np.arange(101.0), power, (0.0, 0.0))
        place = LAM * cells.q_x[40 + at]
        u = place + np.linspace(-4, 4, 33) * sigma
        found = cells.wide_density(u, np.zeros(33), LAM, sigma=np.full(33, sigma))
        exact = np.exp(-0.5 * ((u - place) / sigma) ** 2) / (2 * np.pi * sigma**2)
        assert np.abs(found - exact).max() <= 1.1e-4 * exact.max()
        assert len(cells.merged(sigma / LAM).q_x) < 40


def test_kernels_of_several_widths_at_once():
    cells = speckle((120, 90))
    u, v = np.random.default_rng(3).uniform(-0.3, 0.3, (2, 60))
    sigma = SPACING * np.tile([40.0, 4.0, 13.0], 20)
    found = cells.wide_density(u, v, LAM, sigma=sigma)
    for each in np.unique(sigma):
        of = sigma == each
        alone = cells.wide_density(u[of], v[of], LAM, sigma=sigma[of])
        np.testing.assert_allclose(found[of], alone, rtol=0, atol=2.2e-4 / (2 * np.pi * each**2))


@pytest.mark.parametrize("shape", [(24, 31), (1, 40), (17, 1)])
def test_sums_over_halves_are_sums_over_all_pixels(shape):
    """Against plain sums over the pixels in double precision. A cell is off by at most some roundings, 1e-6, of the
    light of all cells."""
    heights = 120e-9 * np.random.default_rng(5).random(shape)
    relief = prepare(HeightMap(heights, (80e-9, 70e-9), "test", periodic=False))
    s = 1.4 / LAM
    cells = scattered_cells(relief, s, (1.5 / LAM, 1.2 / LAM), sigma_q=2e5)
    field = np.exp(-2j * np.pi * s * relief.height_m)
    field = relief.apodisation * (field - np.average(field, weights=relief.apodisation**2))
    wave_y, wave_x = (
        np.exp(-2j * np.pi * np.outer(q, np.arange(n) * pixel))
        for q, n, pixel in zip((cells.q_y, cells.q_x), relief.height_m.shape, relief.pixel_size_m, strict=True)
    )
    exact = np.abs(wave_y @ field @ wave_x.T) ** 2
    scale = exact.sum() / cells.power.sum()
    np.testing.assert_allclose(cells.power * scale, exact, rtol=0, atol=1e-6 * exact.sum())
