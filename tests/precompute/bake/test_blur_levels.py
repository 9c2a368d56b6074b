# SPDX-License-Identifier: GPL-3.0-or-later
"""The wider levels of a table: the same light under wider kernels."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.bake import self_check
from precompute.bake.ensemble import carry_out, plan
from precompute.bake.levels_and_basis import blur_weights, with_levels
from precompute.bake.plan import texel_size
from precompute.bake.request import BakeRequest
from precompute.base.progress import silent
from precompute.measure.errors import measure
from precompute.measure.truths import draw_pairs
from precompute.optics.region import Region
from precompute.reference.reference import reference_xyz
from precompute.surface.relief import prepare
from precompute.surface.samples.reptiles import elaphe
from precompute.surface.samples.ruled_gratings import blazed
from precompute.table import atlas, blur_levels
from precompute.table.blur_levels import SPACINGS, level_mix
from precompute.table.table import Table

from .conftest import waves


def test_the_levels_are_as_many_as_a_light_asks_for(baked):
    """From sigma_b = 0.031 the kernel grows to 0.25. Each level has fewer inner texels than the one before, at least as
    many to its kernel as level 0, and keeps all light."""
    spacing = baked.spacing
    assert spacing == SPACINGS[0]
    widest = [baked.sigma_b * spacing.grown(len(baked.levels) - back) ** 0.5 for back in (2, 1)]
    assert widest[0] < 0.25 <= widest[1]
    for level, tiles in enumerate(baked.levels):
        texel = baked.cell.texels(level)
        inner = int(np.ceil((baked.tile[0] - 5) / texel - 1e-9)) + 1
        assert texel <= spacing.grown(level) ** 0.5 + 1e-9
        assert tiles.shape == (len(baked.terms), inner + 4, inner + 4, 3) and tiles.dtype == np.float32
        assert tiles.flags.c_contiguous
    # All light lies so far inside that only kernels of 0.1 and wider reach over the table's rim.
    light = [tiles.sum(axis=(1, 2)) * baked.cell.texels(level) ** 2 for level, tiles in enumerate(baked.levels)]
    for level in range(1, 7):
        np.testing.assert_allclose(light[level], light[0], rtol=0, atol=2e-3 * np.abs(light[0]).max())


def test_wider_levels_are_coarser_only_for_want_of_memory(baked, monkeypatch):
    """Level 1 then has 1.3 times fewer texels to its kernel than level 0."""
    alone = replace(baked, wider=())
    assert with_levels(alone, coarser=1.3).cell == baked.cell
    monkeypatch.setattr(blur_levels, "FINE_BYTES", 1 << 20)
    tight = with_levels(alone, coarser=1.3)
    assert tight.spacing == SPACINGS[-1]
    assert tight.cell.texels(1) == pytest.approx(1.3 * tight.spacing.grown(1) ** 0.5)


@pytest.mark.parametrize("level", [1, 2, 5, 9])
def test_a_level_is_a_wider_kernel(baked, level):
    """Each level against exact sums under its kernel. Each level has as many texels to its kernel as level 0, so the
    tolerance is the same: 2 % of the peak (test_bake_against_reference.py)."""
    sigma = baked.sigma_b * baked.spacing.grown(level) ** 0.5
    # Near the table's rim, light that a wide kernel would bring from outside is missing.
    u, v = np.random.default_rng(level).uniform(-0.6, 0.6, (2, 300))
    for w in (0.5, 1.7):
        truth = reference_xyz(waves(), (u, v), w=w, sigma_b=sigma, step_m=4e-9)[0] / w**2
        found = baked.scattered_over_w2(u, v, w, variance=sigma**2 - baked.sigma_b**2)
        np.testing.assert_allclose(found, truth, rtol=0, atol=0.02 * truth.max())


def test_between_levels_lies_their_mixture(baked):
    """Two levels are mixed for the asked variance. Beyond the last level, the last one is read. A table without wider
    levels is read at level 0."""
    u, v = np.random.default_rng(1).uniform(-1, 1, (2, 50))

    def read(grown):
        return baked.scattered_over_w2(u, v, 1.1, variance=(grown - 1) * baked.sigma_b**2)

    for level in range(len(baked.levels) - 1):
        below, above = (baked.spacing.grown(each) for each in (level, level + 1))
        low, high = read(below), read(above)
        for share in (0.25, 0.5, 0.9):
            mixed = read((1 - share) * below + share * above)
            np.testing.assert_allclose(mixed, (1 - share) * low + share * high, rtol=1e-5, atol=1e-6 * high.max())
    last = read(baked.spacing.grown(len(baked.levels) - 1))
    np.testing.assert_array_equal(read(1e6), last)
    alone = replace(baked, wider=())
    np.testing.assert_array_equal(alone.scattered_over_w2(u, v, 1.1, variance=1e-3), alone.scattered_over_w2(u, v, 1.1))


@pytest.fixture(scope="module", params=[blazed, elaphe])
def sampled(request):
    """For a sample at a coherence of 12 um: a function that measures the errors of readings under a wider kernel. It
    takes a place between the levels and compares with sums over the bins of the same spectrum."""
    chosen = plan(prepare(request.param()), BakeRequest(coherence_length_m=12e-6))
    table = with_levels(carry_out(chosen))

    def errors(level):
        rng, grown = np.random.default_rng(3), table.spacing.grown(level)
        sigma, truths = table.sigma_b * grown**0.5, []
        for w in (0.7, 1.6):
            drawn = draw_pairs(self_check._spectrum(chosen.ensemble, rng), sigma, w, count=250, rng=rng)
            drawn = drawn.within(Region((-1.5, 1.5), (-1.5, 1.5)))
            truths.extend(self_check._truths(replace(chosen, sigma_b=sigma), drawn, w, ("D65",), "D65", silent))
        variance = (grown - 1) * table.sigma_b**2

        def read(u, v, w):
            return table.scattered_over_w2(u, v, w, variance=variance), table.zero_order_xyz(w)

        return measure(truths, read)

    return errors


@pytest.mark.short("elaphe-3")
@pytest.mark.parametrize("level", [0, 1, 3, 6])
def test_a_level_of_a_sample_keeps_the_budget(sampled, level):
    """Level 0 was asked for a dE00 of 1, and each level has as many texels to its kernel. The luminance may differ by
    1 %, as in a bake's self-check."""
    errors = sampled(level)
    assert errors.p99 < 1
    assert errors.relative_dy < 0.01


@pytest.mark.night("tests/precompute/bake/test_wide_check.py")
@pytest.mark.parametrize("level", [0.5, 2.5, 4.5])
def test_between_levels_orders_are_little_too_bright(sampled, level):
    """Between two levels the variance is exact, the kernel's shape nearly.

    The first two levels are farthest apart, by a factor of 1.625 in variance. Let the variance be sqrt(1.625) times
    that of level 0, so that the share of the next level is f = 0.44. In the middle of a narrow order the mixture is 1 -
    f + f / 1.625 instead of 1 / sqrt(1.625). That is 6 % too bright, and the order's flanks lack the same amount. At
    most half of 6 % of all light is misplaced, beside the 1 % of each level. A luminance 6 % too high is a dE00 of 1.5
    (38.7 / 3 of L*, times 0.06, at most twice that); flanks and colours add the same again."""
    errors = sampled(level)
    assert errors.relative_dy < 0.03 + 0.01
    assert errors.p99 < 3


def test_a_wider_kernel_of_the_zero_order(baked):
    u, v = np.random.default_rng(2).uniform(-0.3, 0.3, (2, 20))
    wide = replace(baked, sigma_b=0.05)
    np.testing.assert_allclose(baked.kernel(u, v, 0.05**2 - baked.sigma_b**2), wide.kernel(u, v), rtol=1e-12)


def test_levels_of_a_file_answer_alike(baked):
    """Half floats round the levels as they round level 0: by 2^-11 of a texel."""
    stored = atlas.unpack(*atlas.pack(baked))
    u, v, variance = np.random.default_rng(3).uniform(0, 1, (3, 200)) * [[1], [1], [0.06]]
    whole = baked.scattered_over_w2(u, v, 1.3, variance=variance)
    assert len(stored.levels) == len(baked.levels)
    # The terms may be larger than their sum, so their sizes are added.
    atol = 2.0**-11 * sum(np.abs(term).max() for term in baked.terms)
    np.testing.assert_allclose(stored.scattered_over_w2(u, v, 1.3, variance=variance), whole, rtol=0, atol=atol)


def lone(sigma_b, texel, texels, peak=1.0):
    """A table with a lone Gaussian under the kernel sigma_b, and that Gaussian as a function of u, v, variance."""
    axis = (np.arange(texels) - (texels - 1) / 2) * texel
    middle = 0.3 * texel, -0.2 * texel

    def gaussian(u, v, variance):
        squared = (u - middle[0]) ** 2 + (v - middle[1]) ** 2
        return peak / variance * np.exp(-0.5 * squared / variance)

    terms = gaussian(axis, axis[:, None], sigma_b**2 - texel**2 / 3)[None, :, :, None] * np.ones(3)
    table = Table(terms.astype(np.float32), np.zeros((2, 3)), sigma_b, texel, "D65", first=(axis[0], axis[0]))
    return with_levels(table), gaussian


@pytest.mark.parametrize(("texels", "exact"), [(1.2, 0.02), (2.5, 2e-3)])
def test_a_lone_order_has_the_closed_form_of_the_mixture(texels, exact):
    """On a level the order is a Gaussian; between two levels it is the mixture of their Gaussians. The rest is the
    interpolation's error, which falls with the number of texels to a kernel."""
    sigma_b = 0.04
    table, gaussian = lone(sigma_b, sigma_b / texels, int(4 / sigma_b * texels))
    u, v = np.random.default_rng(0).normal(0, 0.05, (2, 200))
    for level in range(4):
        low, high = (sigma_b**2 * table.spacing.grown(each) for each in (level, level + 1))
        for share in (0.0, 0.3, 0.7, 1.0):
            variance = (1 - share) * low + share * high
            expected = (1 - share) * gaussian(u, v, low) + share * gaussian(u, v, high)
            found = table.scattered_over_w2(u, v, 1.0, variance=variance - sigma_b**2)
            np.testing.assert_allclose(found, expected[:, None] * np.ones(3), rtol=0, atol=exact / variance)


@settings(deadline=None, max_examples=60)
@given(st.sampled_from(SPACINGS), st.integers(1, 14), st.floats(0, 1e4))
def test_a_mixture_has_the_variance_that_is_asked_for(spacing, levels, added):
    """The shares are from 0 to 1 and sum to 1, so a mixture keeps the light of its levels and is negative nowhere.
    Rounding moves a share by 1e-12 of the greatest growth asked for, over ratio - 1."""
    level, share = level_mix(np.array([added]), levels, spacing=spacing)
    assert 0 <= level[0] <= max(levels - 2, 0)
    assert -1e-11 <= share[0] <= 1 + 1e-11
    mixed = (1 - share[0]) * spacing.grown(level[0]) + share[0] * spacing.grown(level[0] + 1)
    assert mixed == pytest.approx(min(1 + added, spacing.grown(levels - 1)), rel=1e-9)


@settings(deadline=None, max_examples=10)
@given(st.integers(0, 2**32), st.sampled_from([1.0, 1.4, 2.0]))
def test_levels_keep_the_light_of_any_table(seed, texels):
    """For orders anywhere within |u| < 0.8, a level's texels sum to the light of level 0: to 1e-4, since a kernel of
    0.15 does not reach the rim at 2. Mixtures of levels keep the light too, since their shares sum to 1."""
    rng = np.random.default_rng(seed)
    sigma_b = 0.05
    texel = sigma_b / texels
    count = 2 * int(2 / texel) + 5
    axis = (np.arange(count) - (count - 1) / 2) * texel
    spread = np.sqrt(sigma_b**2 - texel**2 / 3)
    near = [np.exp(-0.5 * ((axis[:, None] - rng.uniform(-0.8, 0.8, 6)) / spread) ** 2) for _ in "vu"]
    terms = np.einsum("vk,uk,kc->vuc", *near, rng.uniform(0, 1, (6, 3)))[None].astype(np.float32)
    table = with_levels(Table(terms, np.zeros((2, 3)), sigma_b, texel, "D65", first=(axis[0], axis[0])))
    light = [tiles.sum(axis=(0, 1, 2), dtype=float) * table.cell.texels(k) ** 2 for k, tiles in enumerate(table.levels)]
    for level in range(1, 6):
        np.testing.assert_allclose(light[level], light[0], rtol=1e-4)


def test_a_black_table_has_black_levels():
    table, _ = lone(0.04, 0.035, 120, peak=0.0)
    u, v = np.random.default_rng(0).normal(0, 0.3, (2, 50))
    for variance in (0.0, 3e-4, 1e-2, 10.0):
        np.testing.assert_array_equal(table.scattered_over_w2(u, v, 1.0, variance=variance), 0)


@pytest.mark.parametrize("sigma", [0.5, 0.8, 1.3, 2.0])
def test_a_blur_is_a_gaussians(sigma):
    """Samples of a Gaussian 0.9 steps wide, read between the samples, become a Gaussian of the summed variances. The
    interpolation cuts off softly from |f| = 0.35 on. Higher frequencies, which may be lost, hold erfc(0.35 pi sqrt(2)
    wide) of the result's peak. The window's end adds 1e-4."""
    at = np.linspace(0, 1, 23)
    rows = np.arange(-12, 14)
    middles = np.linspace(-0.5, 0.5, 7)
    samples = np.exp(-0.5 * ((rows[:, None] - middles) / 0.9) ** 2)
    wide = np.hypot(0.9, sigma)
    expected = 0.9 / wide * np.exp(-0.5 * ((at[:, None] - middles) / wide) ** 2)
    found = blur_weights(at - rows[0], len(rows), sigma) @ samples
    lost = math.erfc(0.35 * math.pi * 2**0.5 * wide) + 1e-4
    np.testing.assert_allclose(found, expected, rtol=0, atol=lost * expected.max())


def constant(axes, sigma_b, value):
    """A table over axes (v, u) with its levels; its terms are `value` (K, rows, columns, 3)."""
    v, u = axes
    table = Table(value, np.zeros((2, 3)), sigma_b, u[1] - u[0], "D65", first=(v[0], u[0]))
    return with_levels(table)


def test_a_wide_kernel_does_not_darken_a_regions_rim():
    """The rim of a region is continued outwards, so a uniform table stays equally bright on every level."""
    axes = np.linspace(-0.12, 0.62, 38), np.linspace(-0.22, 0.72, 48)
    table = constant(axes, 0.03, np.ones((2, 38, 48, 3), np.float32))
    assert len(table.wider) == int(2 * np.log(33 / 7) / np.log(1.5))
    for tiles in table.wider:
        np.testing.assert_allclose(tiles, 1, rtol=2e-6)


def test_a_wide_kernel_finds_nothing_over_the_horizon():
    """Outside the sky, |(u, v)| <= 2, there is no light, so a uniform table darkens towards it. It is a disc, whose
    curvature moves the place of half the light inwards by kernel^2 / (2 * 2)."""
    axis = texel_size(64) * (np.arange(64) - 31.5)
    plain = np.pad(np.ones((1, 60, 60, 3), np.float32), ((0, 0), (2, 2), (2, 2), (0, 0)))
    table = constant((axis, axis), 0.08, plain)
    tiles = table.wider[2]
    texel = table.texel * table.cell.texels(3)
    # The kernels that the texels of both levels sample, without what the B-splines add.
    sampled = [table.spacing.grown(3) * 0.08**2 - texel**2 / 3, 0.08**2 - table.texel**2 / 3]
    kernel = np.sqrt(sampled[0] - sampled[1])
    middle = tiles.shape[1] // 2
    assert tiles[0, :, middle, 0].max() == pytest.approx(1, rel=1e-3)
    ends = -2 + kernel**2 / 4
    for row in range(7):
        share = 0.5 * (1 + math.erf((-2 + (row - 2) * texel - ends) / kernel / 2**0.5))
        assert tiles[0, row, middle, 0] == pytest.approx(share, abs=0.01)
