# SPDX-License-Identifier: GPL-3.0-or-later
"""The needs of a scene: boxes of directions, their light, and the ranges that hold it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.bake.needs import WIDTH_MIN, Needs
from precompute.bake.needs import needs_of as read_back
from precompute.bake.shown_directions import (
    MARGIN,
    SHARE,
    Shown,
    held_share,
    joined,
    least_change,
    left_out,
    lowest_of,
    needs_of,
    under_everything,
    under_lamp,
)
from precompute.optics.region import Region
from precompute.table.radiance import AS_BAKED, Skin

# Ends are rounded outwards to four digits.
DIGITS = 1e-4


def unit(*vectors):
    vectors = np.array(vectors, float)
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def at(degrees, azimuth=0.0):
    """The unit vector at an angle from the normal, (1, 3)."""
    theta, phi = np.radians((degrees, azimuth))
    return np.array([[math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta)]])


def lit(wr, wi, *, irradiance=1.0, variance=0.0, skin=AS_BAKED, footprint=None):
    ones = np.ones(len(wr))
    return under_lamp(
        wr, np.broadcast_to(wi, wr.shape), irradiance=irradiance * ones, variance=variance * ones, skin=skin,
        footprint=footprint,
    )  # fmt: skip


def test_one_pair_needs_its_own_place_and_the_margin():
    needs = needs_of(lit(at(30), at(40, 90)))
    u, v, w = (at(30) + at(40, 90))[0]
    for (low, high), middle in zip((*needs.region, needs.w), (u, v, w), strict=True):
        assert low == pytest.approx(middle - MARGIN, abs=DIGITS) and high == pytest.approx(middle + MARGIN, abs=DIGITS)
    assert (needs.light_radius, needs.footprint) == (0, 0)


def test_a_sphere_under_a_sun_needs_a_disc_of_twice_the_cosine_of_the_half_angle():
    """wi + wr is a vector h of length 2 cos(a), with 2 a the angle between them. Over a sphere h occurs in all tangent
    frames that have both above the surface. At grazing h is tangential, and w is 0."""
    normals = np.random.default_rng(0).standard_normal((200_000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    half = np.radians(25)
    wi, wr = ((math.sin(s * half), 0.0, math.cos(half)) for s in (1, -1))
    tangents = np.cross((0.3, 1.0, 0.2), normals)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    frames = np.stack([tangents, np.cross(normals, tangents), normals], axis=1)
    shown = lit(frames @ np.array(wr), frames @ np.array(wi))
    needs = needs_of(shown)
    most = 2 * math.cos(half)
    # Over 200,000 normals, the box for 99.9 % of the light ends within 0.05 of the rim.
    for low, high in needs.region:
        assert most - 0.05 < high <= most + MARGIN + DIGITS and -most - MARGIN - DIGITS <= low < -most + 0.05
    # The largest of 200,000 is below the true maximum by less than 1e-4.
    assert needs.w[1] == pytest.approx(most + MARGIN, abs=1e-3) and 0 <= needs.w[0] < 0.05
    assert held_share(shown, needs) >= SHARE


def test_what_is_below_the_surface_or_unlit_is_left_out():
    wr = np.concatenate([at(30), at(120), at(30), at(30)])
    wi = np.concatenate([at(40), at(40), at(95), at(40)])
    shown = under_lamp(wr, wi, irradiance=np.array([1.0, 1, 1, 0]), variance=np.zeros(4))
    assert len(shown.light) == 1 and not shown.is_dark
    assert joined([]).is_dark and lit(at(100), at(20)).is_dark


def test_a_disc_widens_by_its_radius_and_is_the_smallest_lamp():
    """Along the normal a disc of angular radius a has the variance a^2 / 4 and blurs by a / 2; two of these are a."""
    radius = 0.1
    shown = lit(at(0), at(0), variance=radius**2 / 4)
    np.testing.assert_allclose(shown.high[0] - shown.low[0], (2 * radius, 2 * radius, 0), rtol=1e-12)
    both = joined([shown, lit(at(0), at(0), variance=radius**2)])
    assert needs_of(both).light_radius == pytest.approx(radius, rel=1e-3)  # three digits


def test_roughness_widens_as_the_material_s_blur():
    """Roughness r has the variance (w r^2)^2 / 2 (table/radiance.py)."""
    shown = lit(at(0), at(0), skin=Skin(roughness=0.5))
    assert shown.high[0, 0] == pytest.approx(2 * 2 * 0.25 / math.sqrt(2))


def test_scales_lead_to_the_table_s_own_coordinates():
    shown = lit(at(30), at(20), skin=Skin(period_scale=0.5, height_scale=0.25), footprint=np.array([0.2]))
    u, _, w = (at(30) + at(20))[0]
    assert shown.low[0] == pytest.approx((0.5 * u, 0, 0.25 * w))
    assert needs_of(shown).footprint == pytest.approx(0.1, rel=1e-2)


def test_light_from_everywhere_needs_the_hemisphere_around_the_view():
    wr = at(40)
    needs = needs_of(under_everything(wr))
    sine, cosine = math.sin(np.radians(40)), math.cos(np.radians(40))
    assert needs.region.u == pytest.approx((sine - 1 - MARGIN, sine + 1 + MARGIN), abs=DIGITS)
    assert needs.region.v == pytest.approx((-1 - MARGIN, 1 + MARGIN), abs=DIGITS)
    assert needs.w == pytest.approx((cosine - MARGIN, cosine + 1 + MARGIN), abs=DIGITS)
    wi = unit(*np.random.default_rng(1).standard_normal((1000, 3)))
    wi[:, 2] = np.abs(wi[:, 2])
    assert held_share(lit(np.repeat(wr, 1000, axis=0), wi), needs) == 1


def test_the_least_change_across_a_pixel():
    """The smaller side of a rectangle in any orientation; 0 if a step changes nothing or both are parallel."""
    uv, turn = np.zeros((4, 2)), np.radians(20)
    side, up = np.array((math.cos(turn), math.sin(turn))), np.array((-math.sin(turn), math.cos(turn)))
    beside = np.array([0.3 * side, 0.1 * up, 0 * side, 0.2 * side])
    above = np.array([0.1 * up, 0.3 * side, 0.2 * up, 0.1 * side])
    # The root of the sum of squares rounds at 1e-16 relative, the root of zero at 1e-8.
    np.testing.assert_allclose(least_change(uv, beside, above), [0.1, 0.1, 0, 0], atol=1e-8)


def test_the_footprint_is_exceeded_by_all_but_a_hundredth_of_the_light():
    wr = np.repeat(at(10), 1000, axis=0)
    footprint = np.linspace(0.1, 0.2, 1000)
    footprint[::2] = np.nan
    needs = needs_of(lit(wr, at(20), footprint=footprint))
    # A hundredth of the range from 0.1 to 0.2, and one of 500 steps in it; three digits.
    assert needs.footprint == pytest.approx(0.101, abs=1.5e-3)


def test_a_lamp_at_the_horizon():
    for angle in (89.9, 89.999, 90 - 1e-9):
        needs = needs_of(lit(at(89.999), at(angle)))
        assert needs.region.u == pytest.approx((2 - MARGIN, 2), abs=2 * DIGITS)
        assert needs.w[0] == 0 and needs.w[1] >= WIDTH_MIN
        assert read_back(needs.as_dict(), "test").region == needs.region


def test_what_is_left_out_is_told():
    shown = joined([lit(at(30), at(40)), lit(at(30), at(-40))])
    needs = Needs(Region((0.5, 1.5), (-0.5, 0.5)), (1.0, 2.0))
    assert held_share(shown, needs) == pytest.approx(shown.light[0] / shown.light.sum())
    assert left_out(shown, needs) == ["u down to -0.14, baked to 0.50"]
    assert left_out(shown, Needs()) == [] and held_share(shown, Needs()) == 1
    assert held_share(joined([]), needs) == 1


def test_light_that_is_nearly_none_decides_nothing():
    bright, faint = lit(np.repeat(at(10), 100, axis=0), at(20)), lit(at(80), at(80), irradiance=1e-4)
    assert needs_of(joined([bright, faint])) == needs_of(joined([bright, lit(at(10), at(20))]))


finite = st.floats(-2, 2, allow_nan=False)


@settings(deadline=None)
@given(
    st.lists(st.tuples(finite, finite, st.floats(0, 2), st.floats(0, 0.3), st.floats(1e-6, 1e6)), min_size=1),
    st.floats(0.5, 1),
)
def test_the_ranges_hold_the_share_that_was_asked(boxes, share):
    """For any boxes and light; the needs file then holds the same ranges."""
    u, v, w, width, light = np.array(boxes).T
    middle, half = np.stack([u, v, w], axis=1), width[:, None]
    low, high = np.clip(middle - half, (-2, -2, 0), 2), np.clip(middle + half, (-2, -2, 0), 2)
    shown = Shown(low, high, light, width, width)
    needs = needs_of(shown, share)
    # Sums of a hundred numbers of seven magnitudes round at 1e-13.
    assert held_share(shown, needs) >= share - 1e-12
    again = read_back(needs.as_dict(), "test")
    assert (again.region, again.w, again.footprint) == (needs.region, needs.w, needs.footprint)


@given(st.lists(st.tuples(finite, st.floats(0, 10)), min_size=1), st.floats(0, 0.9))
def test_no_more_than_a_share_lies_below_the_lowest(pairs, share):
    values, weights = np.array(pairs).T
    found = lowest_of(values, weights, share=share)
    assert found in values
    assert weights[values < found].sum() <= share * weights.sum() * (1 + 1e-12)
