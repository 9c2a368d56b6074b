# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark that compares the blur of a rough skin with facets."""

import numpy as np
import pytest

from laboratory.benchmarks import roughness
from laboratory.benchmarks.hemisphere import without_mirror
from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.surface.relief import prepare
from precompute.surface.samples.catalogue import make_sample
from precompute.table.radiance import reflected_xyz


@pytest.fixture(scope="module")
def baked():
    return without_mirror(bake(prepare(make_sample("elaphe")), BakeRequest(delta_e=3, coherence_length_m=12e-6)))


def test_slopes_have_beckmanns_variance_and_no_mean():
    found = roughness.slopes(0.3)
    # The last ring's middle stands for the tail: with 24 rings the variance is 2 % short.
    np.testing.assert_allclose(np.mean(found**2, axis=0), 0.3**4 / 2, rtol=0.03)
    np.testing.assert_allclose(found.mean(axis=0), 0, atol=1e-12)


@pytest.mark.night("tests/precompute/table/test_radiance.py")
def test_facets_without_slopes_are_the_table(baked):
    wi = np.array([[0.3, 0.1, np.sqrt(0.9)], [0.0, -0.6, 0.8]])
    wr = np.array([[-0.1, 0.2, np.sqrt(0.95)], [0.48, 0.36, 0.8]])
    found = roughness.of_facets(baked, wi, wr, 1e-6)
    # Slopes of 1e-12 move nothing that single precision sees.
    np.testing.assert_allclose(found, reflected_xyz(baked, wi, wr), rtol=1e-5, atol=1e-12)


@pytest.mark.night("tests/precompute/table/test_radiance.py")
def test_the_blur_is_right_for_small_slopes_only(baked):
    small, large = (roughness.row_of("elaphe", baked, each) for each in (0.1, 0.4))
    assert small.median < 0.5 and small.light == pytest.approx(1, abs=0.005)
    assert large.median > 4 * small.median
