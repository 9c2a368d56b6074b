# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables of a part of (u, v, w), as a scene needs."""

from dataclasses import replace

import numpy as np
import pytest

from precompute.bake import make
from precompute.bake.ensemble import bake
from precompute.bake.needs import Needs
from precompute.bake.request import BakeRequest
from precompute.optics.brdf import small_slope_times_cosine_and_w2
from precompute.optics.mirror_image import mirror_kernel
from precompute.optics.region import Region
from precompute.reflectance.matter import parse
from precompute.table.radiance import reflected_xyz, zero_order_reflectance

from .conftest import COHERENCE_M, waves

REGION = Needs(Region((-0.3, 1.1), (-0.2, 0.5)), w=(0.7, 1.8))


def test_a_region_is_the_same_light_in_fewer_texels(baked):
    part = bake(waves(), BakeRequest(coherence_length_m=COHERENCE_M, needs=REGION))
    assert part.terms[..., 0].size < 0.3 * baked.terms[..., 0].size
    rng = np.random.default_rng(0)
    u, v, w = (rng.uniform(*side, 500) for side in (*REGION.region, REGION.w))
    whole = baked.scattered_over_w2(u, v, w)
    # Each reading has an error of up to 2 % of its peak (test_bake_against_reference.py).
    np.testing.assert_allclose(part.scattered_over_w2(u, v, w), whole, atol=0.04 * whole.max())
    for held, asked in zip(part.region, REGION.region, strict=True):
        assert asked[0] - part.texel < held[0] <= asked[0] + 1e-9 and asked[1] - 1e-9 <= held[1] < asked[1] + part.texel


def test_outside_a_region_its_rim_is_read():
    part = bake(waves(), BakeRequest(coherence_length_m=COHERENCE_M, needs=REGION))
    u, v, w = np.array([-2.0, 2.0]), np.array([2.0, -2.0]), np.array([0.1, 2.0])
    u_range, v_range = part.region
    rim = part.scattered_over_w2(np.array(u_range), np.array(v_range)[::-1], np.array(part.w_range))
    np.testing.assert_allclose(part.scattered_over_w2(u, v, w), rim, rtol=1e-6)


def test_a_region_keeps_its_budget():
    made = make.make((waves(),), BakeRequest(1.0, COHERENCE_M, needs=REGION))
    assert made.errors.p99 <= 1 and made.errors.pairs > 50


def test_outside_a_region_a_surface_is_black():
    """Black beyond u, v and w; the mirror image and everything inside the region stay unchanged."""
    part = bake(waves(), BakeRequest(coherence_length_m=COHERENCE_M, needs=REGION))
    uv = np.array([(0.6, 0.6), (-0.5, 0.4), (0.3, 0.3), (0.0, 0.0), (0.6, 0.3)])
    wi = np.c_[uv, np.sqrt(1 - (uv**2).sum(axis=1))]
    wr = np.broadcast_to((0.0, 0.0, 1.0), wi.shape)
    assert part.holds(*(wi + wr).T).tolist() == [False] * 4 + [True]
    found = reflected_xyz(part, wi, wr)
    np.testing.assert_array_equal(found[:3], 0)
    mirrored = mirror_kernel(wi[3:4], wr[3:4])[:, None] * zero_order_reflectance(part, wi[3:4], wr[3:4])
    np.testing.assert_allclose(found[3:4], mirrored, rtol=1e-12)
    assert mirrored.min() > 0
    held = part.scattered_over_w2(*(wi + wr)[4:].T) * small_slope_times_cosine_and_w2(wi, wr)[4:, None]
    # Sums of single precision, which depend on how many places are read at once.
    np.testing.assert_allclose(found[4:], held, rtol=1e-6)


def test_a_whole_table_holds_every_pair_up_to_rounding():
    table = bake(waves(), BakeRequest(coherence_length_m=COHERENCE_M))
    ends = np.array([-2.0, 2.0, 0.0])
    assert table.holds(ends, ends[::-1], np.array([-1e-15, 2 + 1e-15, 2.0])).all()


def test_the_largest_albedo_of_a_region_counts_the_light_of_all_directions():
    """A scene that looks at one order divides by what the relief reflects into all of them. Both numbers come from the
    same spectrum; they differ by the number of their transforms, 2e-4 of the light."""
    narrow = Needs(Region((-0.1, 0.2), (-0.1, 0.1)), w=(1.5, 1.9))
    asked = BakeRequest(coherence_length_m=COHERENCE_M, matter=parse("mirror"))
    part, whole = bake(waves(), replace(asked, needs=narrow)), bake(waves(), asked)
    assert part.largest_albedo == pytest.approx(whole.largest_albedo, abs=2e-3) and whole.largest_albedo > 1.01
