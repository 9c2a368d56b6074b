# SPDX-License-Identifier: GPL-3.0-or-later
"""Several bakes brought to one layout."""

from dataclasses import replace

import numpy as np
import pytest

from precompute.bake.ensemble import carry_out, plan
from precompute.bake.layers import as_layers, can_be_layers
from precompute.bake.levels_and_basis import comparison
from precompute.bake.request import BakeRequest
from precompute.base.failure import GratingError
from precompute.table import atlas, sample_set

from .conftest import waves


def table(depth_m, coherence_m, delta_e=1.0):
    """The table of waves, by a plan of its own."""
    chosen = plan(waves(depth_m), BakeRequest(coherence_length_m=coherence_m, delta_e=delta_e))
    return carry_out(chosen)


@pytest.fixture(scope="module")
def shallow():
    return table(100e-9, 8e-6)


@pytest.fixture(scope="module")
def others(shallow):
    """A deeper relief of a narrower kernel, which needs finer texels; and under the shallow one's kernel."""
    return table(500e-9, 8.8e-6, 0.5), table(500e-9, 8e-6, 0.5)


def test_each_keeps_its_light(shallow, others):
    deep, under_wider = others
    assert deep.sigma_b < shallow.sigma_b and deep.texel < shallow.texel and can_be_layers([shallow, deep])
    layers = as_layers([shallow, deep], 1.0)
    picture, layout = atlas.pack_layers(layers)
    count = len(layers)
    assert picture.shape == (count * layout.height, layout.width, 3) and layout.sigma_b == shallow.sigma_b
    assert [atlas.layout_of(each).cell for each in layers] == [layout.cell] * count
    for part, truth in zip(np.split(picture, count), (shallow, under_wider), strict=True):
        added, at_one_w = comparison(truth, "D65")(atlas.unpack(part, layout))
        # Half of the requested error by the functions of w, and as much by reading other texels (plan.py).
        assert added.p99 < 0.5 + 0.55 and at_one_w < 2
    assert layout.terms < len(shallow.terms) + len(deep.terms), "functions are shared"


def test_bakes_that_differ_too_much_are_refused(shallow, others):
    black = replace(shallow, terms=0 * shallow.terms)
    assert not can_be_layers([shallow]) and not can_be_layers([black, black]) and can_be_layers([black, shallow])
    for other in (
        replace(shallow, sigma_b=1.2 * shallow.sigma_b, texel=1.2 * shallow.texel),
        replace(shallow, illuminant="A"),
        replace(shallow, ratio_ior=1.5),
        replace(others[0], w_range=(0.5, 2.0)),
    ):
        assert not can_be_layers([shallow, other])
    layers = as_layers([shallow, black], 1.0)
    rows = atlas.layout_of(layers[0]).height
    with pytest.raises(GratingError, match="larger than a graphics card takes"):
        atlas.pack_layers(layers * (atlas.PICTURE_SIDE_MAX // (2 * rows) + 1))


def test_sample_sets_stand_side_by_side():
    """Each is what it was, up to half floats, whose smallest are 6e-8 of a scale that is the largest set's."""
    rng = np.random.default_rng(1)
    sets = []
    for pieces, most in ((1, 1e-14), (5, 1e-12)):
        weights = most * rng.uniform(0, 1, (pieces, 8, 8, 4)).astype(np.float32)
        sets.append(sample_set.SampleSet(rng.uniform(-1e6, 1e6, (8, 8, 2)), weights, 4e6, 0.02, 0.0))
    picture, layouts = sample_set.pack_layers(sets)
    assert [each.pieces for each in layouts] == [1, 5] and len({each.rows for each in layouts}) == 1
    for part, layout, held in zip(np.split(picture, 2, axis=1), layouts, sets, strict=True):
        found = sample_set.unpack(part, layout)
        np.testing.assert_allclose(found.q, held.q, atol=1e-6 / 550e-9)
        np.testing.assert_allclose(found.pieces, held.pieces, rtol=2**-11, atol=1e-12 * 2**-12)
