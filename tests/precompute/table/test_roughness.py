# SPDX-License-Identifier: GPL-3.0-or-later
"""The material's *Roughness*, a blur, against the facets that it stands for.

A rough skin is a surface of facets, each with the relief on it. Their slopes have Beckmann's distribution, with alpha
the square of the roughness. A facet shows the diffraction of its own frame. The material instead blurs the table, as if
all facets shared the frame of the whole surface. Shadows between facets and the mirror image are left out."""

import numpy as np
import pytest

from laboratory.benchmarks.hemisphere import without_mirror
from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.colour.observer import white_xyz
from precompute.colour.spaces import delta_e_2000, lab
from precompute.surface.relief import prepare
from precompute.surface.samples.catalogue import make_sample
from precompute.table.radiance import Skin, reflected_xyz

# Pairs of directions that are tried, and pairs that are drawn from them; rings of slopes, and slopes in each ring.
TRIED, DRAWN, FACETS = 20_000, 400, 24


def slopes(roughness):
    """Slopes (n, 2) of Beckmann's distribution, of equal weight: their radius has the distribution 1 - exp(-s^2 / a^2)
    for a = roughness^2."""
    share = (np.arange(FACETS) + 0.5) / FACETS
    radius = roughness**2 * np.sqrt(-np.log1p(-share))
    # A turn by the golden ratio from ring to ring.
    turn = 2 * np.pi * (share[:, None] + np.arange(FACETS) * (np.sqrt(5) - 1) / 2)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=-1).reshape(-1, 2)


def of_facets(baked, wi, wr, roughness):
    """The radiance (n, 3) in XYZ under unit irradiance of facets, for unit vectors (n, 3).

    A facet with slopes (a, b) has the normal m along (-a, -b, 1), and the tangent along (1, 0, a). It takes the share
    (wr.m) / ((n.wr) (n.m)) of the view."""
    total = np.zeros((len(wi), 3))
    chosen = slopes(roughness)
    for a, b in chosen:
        normal = np.array([-a, -b, 1]) / np.sqrt(1 + a * a + b * b)
        tangent = np.array([1, 0, a]) / np.sqrt(1 + a * a)
        frame = np.stack([tangent, np.cross(normal, tangent), normal])
        own_i, own_r = wi @ frame.T, wr @ frame.T
        lit = np.flatnonzero((own_i[:, 2] > 0) & (own_r[:, 2] > 0))
        share = own_r[lit, 2] / (wr[lit, 2] * normal[2])
        total[lit] += share[:, None] * reflected_xyz(baked, own_i[lit], own_r[lit])
    return total / len(chosen)


def median_and_light(baked, roughness):
    """The median of dE00, where the brightest hundredth is white, and the material's light over the facets'."""
    rng = np.random.default_rng(0)
    cosine = np.sqrt(rng.uniform(0.3**2, 1, (2, TRIED)))  # facets hide each other towards grazing light
    turn, sine = 2 * np.pi * rng.random((2, TRIED)), np.sqrt(1 - cosine**2)
    wi, wr = np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine], axis=-1)
    shown = reflected_xyz(baked, wi, wr, skin=Skin(roughness=roughness))
    weight = np.maximum(shown[:, 1], 0)
    drawn = rng.choice(TRIED, DRAWN, p=weight / weight.sum())
    true = of_facets(baked, wi[drawn], wr[drawn], roughness)
    level = np.percentile(true[:, 1], 99)
    errors = delta_e_2000(*(lab(colours / level, white_xyz()) for colours in (true, shown[drawn])))
    # The pairs are drawn by the material's light, so the mean of the ratios is the ratio of all light.
    return float(np.median(errors)), float(1 / np.mean(true[:, 1] / shown[drawn, 1]))


def test_slopes_have_beckmanns_variance_and_no_mean():
    found = slopes(0.3)
    # The last ring's middle stands for the tail: with 24 rings the variance is 2 % short.
    np.testing.assert_allclose(np.mean(found**2, axis=0), 0.3**4 / 2, rtol=0.03)
    np.testing.assert_allclose(found.mean(axis=0), 0, atol=1e-12)


@pytest.mark.night("tests/precompute/table/test_radiance.py")
@pytest.mark.parametrize("sample", ["elaphe", "xenopeltis", "blazed"])
def test_the_blur_is_right_for_small_slopes_only(sample):
    """The figures of docs/theory.md: the medians at 0.1, 0.25 and 0.4."""
    baked = without_mirror(bake(prepare(make_sample(sample)), BakeRequest()))
    found = {roughness: median_and_light(baked, roughness) for roughness in (0.1, 0.25, 0.4)}
    print(sample, {roughness: [round(each, 3) for each in pair] for roughness, pair in found.items()})
    assert found[0.1][0] < found[0.25][0] <= 3.85 and 3.55 <= found[0.4][0] <= 20.85
    assert found[0.1][1] == pytest.approx(1, abs=0.005)
