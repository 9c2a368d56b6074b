# SPDX-License-Identifier: GPL-3.0-or-later
"""A plate over the relief: Snell's law, what its front face lets through, and ranges of w."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from precompute.optics.brdf import fresnel_reflectance
from precompute.optics.plate import (
    NO_PLATE,
    face_reflectance,
    inside_plate,
    least_cosine,
    passed,
    refracted,
    w_above_plate,
    w_inside_plate,
)

INDICES = st.floats(1.01, 3)
COSINES = st.floats(0.001, 1)


def direction(cosine, azimuth):
    sine = np.sqrt(1 - cosine**2)
    return np.array([sine * np.cos(azimuth), sine * np.sin(azimuth), cosine])


@given(COSINES, st.floats(0, 6), INDICES)
def test_snells_law(cosine, azimuth, ior):
    above = direction(cosine, azimuth)
    inside = inside_plate(above, ior)
    # Rounding.
    assert np.linalg.norm(inside) == pytest.approx(1, abs=1e-12)
    assert inside[:2] * ior == pytest.approx(above[:2], abs=1e-12)
    assert inside[2] >= least_cosine(ior)


@given(COSINES, COSINES, st.floats(0, 6), INDICES)
def test_a_plate_keeps_a_reciprocal_relief_reciprocal(cos_i, cos_r, azimuth, ior):
    """f = L / (E cos(ti)) of the relief inside is reciprocal; f above must be too."""
    wi, wr = direction(cos_i, 0.0), direction(cos_r, azimuth)
    there, back = (
        passed(one, other, ior) * refracted(one, ior) * inside_plate(one, ior)[2] / one[2]
        for one, other in ((wi, wr), (wr, wi))
    )
    assert there == pytest.approx(back, rel=1e-9)


@pytest.mark.parametrize("ior", [1.3, 1.585, 2.5])
def test_the_light_of_a_white_relief_is_what_the_face_lets_through(ior):
    """A relief inside that reflects all light evenly, f = 1 / pi: of the light that enters, T(ti), the part within the
    critical angle arrives at the face, and T of it leaves. The albedo above is the sum over the directions above, the
    expected value the sum over those inside: both by Gauss-Legendre over the squared cosine (the square root of T's
    slope at grazing light leaves 1e-4)."""
    nodes, weights = np.polynomial.legendre.leggauss(200)
    squares, weights = (nodes + 1) / 2, weights / 2
    wi = direction(0.5, 0.3)
    above = np.stack([direction(np.sqrt(square), 1.0) for square in squares])
    # The radiance inside is cos(ti') / pi; the integral of cos(tr) over the hemisphere is pi times one over cos(tr)^2.
    albedo = weights @ (passed(wi, above, ior) * refracted(wi, ior) * inside_plate(wi, ior)[2]) / wi[2]
    least = least_cosine(ior) ** 2
    cos2_inside = least + (1 - least) * squares
    leaving = 1 - fresnel_reflectance(np.sqrt(1 - (1 - cos2_inside) * ior**2), ior)
    expected = (1 - fresnel_reflectance(wi[2], ior)) * (1 - least) * (weights @ leaving)
    assert albedo == pytest.approx(expected, rel=1e-3)


@given(COSINES, st.floats(0, 6), INDICES)
def test_the_face_returns_the_same_share_to_both_sides(cosine, azimuth, ior):
    """Fresnel's reflectance is the same from both sides (Born and Wolf 1.5.3), and 1 beyond the critical angle."""
    above = direction(cosine, azimuth)
    # A cosine of 0.001 comes back from the tangential part, whose square is 1 - 1e-6, with ten digits.
    assert face_reflectance(above[:2] / ior, ior) == pytest.approx(fresnel_reflectance(cosine, ior), abs=1e-8)
    assert face_reflectance(above[:2] / np.linalg.norm(above[:2]) / ior * 1.001, ior) == 1 or cosine == 1


def test_no_plate_changes_nothing():
    wi = direction(0.4, 1.0)
    assert inside_plate(wi, NO_PLATE) == pytest.approx(wi, abs=1e-15)
    assert passed(wi[None], np.stack([wi, wi]), NO_PLATE) == pytest.approx(1)
    assert refracted(wi, NO_PLATE) == pytest.approx(1)
    assert least_cosine(NO_PLATE) == 0
    assert w_inside_plate((0.3, 1.7), NO_PLATE) == pytest.approx((0.3, 1.7))


@given(st.floats(0, 1.9), st.floats(0.05, 1), INDICES)
def test_ranges_of_w(low, width, ior):
    """Every pair within a range above is within the range inside, whose ends some pair reaches."""
    high = min(low + width, 2.0)
    found = w_inside_plate((low, high), ior)
    cos_i, cos_r = np.meshgrid(np.linspace(0, 1, 201), np.linspace(0, 1, 201))
    inside = np.sqrt(1 - (1 - cos_i**2) / ior**2) + np.sqrt(1 - (1 - cos_r**2) / ior**2)
    # Half a step of the cosines on either side.
    within = inside[(cos_i + cos_r >= low - 0.005) & (cos_i + cos_r <= high + 0.005)]
    assert within.min() == pytest.approx(found[0], abs=0.01)
    assert within.max() == pytest.approx(found[1], abs=0.01)
    assert w_above_plate(found, ior) == pytest.approx((low, high), abs=1e-6)


def test_a_range_that_begins_below_all_light_begins_at_0_above():
    assert w_above_plate((0.0, 2.0), 1.5) == pytest.approx((0.0, 2.0))
