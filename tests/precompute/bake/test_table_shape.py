# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake's table: its size, its limits, its zero order, and the stages of making it."""

import numpy as np
import pytest

from precompute.bake.ensemble import bake
from precompute.bake.plan import TEXELS_MAX, TEXELS_MIN
from precompute.bake.request import BakeRequest
from precompute.colour.observer import spectral_weights, white_xyz
from precompute.maths import chebyshev
from precompute.optics import coherence
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.table.blur_levels import TILE_PADDING
from precompute.table.table import ZERO_ORDER_SAMPLES

from .conftest import COHERENCE_M


def test_progress_runs_through_its_stages(made):
    """Each stage is reported once. The fractions rise to 1 for the plan, and again for the table."""
    _, (expects, *told) = made
    assert expects[0].startswith("expects ")
    stages = [stage for k, (stage, _) in enumerate(told) if k == 0 or told[k - 1][0] != stage]
    assert stages == ["transforms", "wavelengths"]
    for part in (stages[:1], stages[1:]):
        fractions = [fraction for each, fraction in told if each in part]
        assert fractions == sorted(fractions) and fractions[-1] == 1
        assert all(0 < fraction <= 1 for fraction in fractions)


def distance(table):
    v, u = table.axes
    return np.hypot(v[:, None], u)


def test_the_table_is_what_it_says(baked):
    assert baked.terms.dtype == np.float32
    size = baked.tile[0]
    assert baked.terms.shape[1:] == (size, size, 3)
    assert TEXELS_MIN <= baked.sigma_b / baked.texel <= TEXELS_MAX
    np.testing.assert_allclose(baked.axes[0], -baked.axes[0][::-1], atol=1e-12)
    assert baked.axes[1][TILE_PADDING] == pytest.approx(-2) and baked.axes[1][-1 - TILE_PADDING] == pytest.approx(2)
    assert baked.region == ((pytest.approx(-2), pytest.approx(2)),) * 2
    assert baked.zero_order.shape == (ZERO_ORDER_SAMPLES, 3)
    assert baked.sigma_b == pytest.approx(coherence.kernel_sigma(COHERENCE_M), rel=1e-12)
    assert baked.texel == pytest.approx(4 / (size - 2 * TILE_PADDING - 1), rel=1e-12)
    assert np.isfinite(baked.terms).all()


def test_nothing_is_stored_outside_the_disc(baked):
    """Light is stored in |(u, v)| <= 2 and in a rim of three texels, since a reading uses two along each axis."""
    radius = distance(baked)
    assert (baked.terms[:, radius > 2 + 3.001 * baked.texel] == 0).all()
    assert np.abs(baked.terms[:, radius < 1]).max() > 0


def test_the_rim_of_the_disc_is_kept():
    """A surface that is rough at the scale of a pixel scatters up to |(u, v)| = 2 where w is near 0. The table is
    filled there, and one texel beyond."""
    rough = 60e-9 * np.random.default_rng(0).standard_normal((40, 40))
    table = bake(
        prepare(HeightMap(rough, (90e-9, 90e-9), "test", periodic=True)),
        BakeRequest(delta_e=5, coherence_length_m=2e-6),
    )
    radius = distance(table)
    rim = (radius > 2 - table.texel) & (radius < 2 + table.texel)
    assert (table.terms[0, rim, 1] > 0).all()


def test_at_the_horizon_all_is_zero_order(baked):
    """At w = 0 the surface is a mirror, to twice the 1e-4 of the amplitude's series."""
    np.testing.assert_allclose(baked.zero_order[0], white_xyz(), rtol=2e-4)
    assert (baked.zero_order > -1e-6).all()


def test_the_zero_order_of_waves_is_bessels(baked):
    """Two crossed waves of amplitudes a and b have J_0(2 pi s a)^2 J_0(2 pi s b)^2 (docs/theory.md), weighted by the
    observer at steps of 1 nm."""
    lambdas = np.arange(380, 781) * 1e-9
    for w in (0.5, 1.3, 2.0):
        efficiency = [
            np.prod([chebyshev.bessel_j(2 * np.pi * w / lam * a, 1)[0] ** 2 for a in (75e-9, 37.5e-9)])
            for lam in lambdas
        ]
        expected = efficiency @ spectral_weights(lambdas)
        np.testing.assert_allclose(baked.zero_order_xyz(w), expected, atol=2e-4)


def test_a_mirror_bakes_to_nothing_but_white():
    flat = prepare(HeightMap(np.zeros((32, 32)), (80e-9, 80e-9), "test", periodic=True))
    table = bake(flat, BakeRequest(coherence_length_m=2e-6))
    assert len(table.terms) == 2
    assert not table.terms.any()
    # The weights of the interpolation sum to 1 within 1e-15.
    np.testing.assert_allclose(table.zero_order, np.tile(white_xyz(), (ZERO_ORDER_SAMPLES, 1)), rtol=1e-12)


def test_the_coherence_kernel_has_unit_energy(baked):
    axis = np.arange(-0.3, 0.3, 0.5 * baked.sigma_b)
    u, v = (c.ravel() for c in np.meshgrid(axis, axis))
    # The sum reaches 9 standard deviations on either side, in steps of half a one: it is flat to 2 exp(-8 pi^2).
    assert baked.kernel(u, v).sum() * (0.5 * baked.sigma_b) ** 2 == pytest.approx(1, rel=1e-9)
