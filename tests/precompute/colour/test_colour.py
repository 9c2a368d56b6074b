# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.colour.illuminants import ILLUMINANTS
from precompute.colour.observer import _cie_table, observer, spectral_weights, white_xyz
from precompute.colour.spaces import RGB_SPACES, delta_e_2000, lab, rgb_from_xyz, srgb_encode

# Sharma, Wu and Dalal 2005, table 1: L1 a1 b1, L2 a2 b2, the difference; made to cover every branch of the formula.
SHARMA = np.array([
    (50, 2.6772, -79.7751, 50, 0, -82.7485, 2.0425),
    (50, 3.1571, -77.2803, 50, 0, -82.7485, 2.8615),
    (50, 2.8361, -74.0200, 50, 0, -82.7485, 3.4412),
    (50, -1.3802, -84.2814, 50, 0, -82.7485, 1.0000),
    (50, -1.1848, -84.8006, 50, 0, -82.7485, 1.0000),
    (50, -0.9009, -85.5211, 50, 0, -82.7485, 1.0000),
    (50, 0, 0, 50, -1, 2, 2.3669),
    (50, -1, 2, 50, 0, 0, 2.3669),
    (50, 2.4900, -0.0010, 50, -2.4900, 0.0009, 7.1792),
    (50, 2.4900, -0.0010, 50, -2.4900, 0.0010, 7.1792),
    (50, 2.4900, -0.0010, 50, -2.4900, 0.0011, 7.2195),
    (50, 2.4900, -0.0010, 50, -2.4900, 0.0012, 7.2195),
    (50, -0.0010, 2.4900, 50, 0.0009, -2.4900, 4.8045),
    (50, -0.0010, 2.4900, 50, 0.0010, -2.4900, 4.8045),
    (50, -0.0010, 2.4900, 50, 0.0011, -2.4900, 4.7461),
    (50, 2.5, 0, 50, 0, -2.5, 4.3065),
    (50, 2.5, 0, 73, 25, -18, 27.1492),
    (50, 2.5, 0, 61, -5, 29, 22.8977),
    (50, 2.5, 0, 56, -27, -3, 31.9030),
    (50, 2.5, 0, 58, 24, 15, 19.4535),
    (50, 2.5, 0, 50, 3.1736, 0.5854, 1.0000),
    (50, 2.5, 0, 50, 3.2972, 0, 1.0000),
    (50, 2.5, 0, 50, 1.8634, 0.5757, 1.0000),
    (50, 2.5, 0, 50, 3.2592, 0.3350, 1.0000),
    (60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644),
    (63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630),
    (61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731),
    (35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645),
    (22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373),
    (36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146),
    (90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441),
    (90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381),
    (6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377),
    (2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082),
])  # fmt: skip

ORDER = slice(0, 3), slice(3, 6)
OPPOSITE = (9, 13)

SPACES = {"Rec.709": "ITU-R BT.709", "Rec.2020": "ITU-R BT.2020", "ACEScg": "ACEScg"}

rounded = settings(deadline=None, max_examples=50)


def random_lab(rng, count):
    """Random colours: L* from 0 to 100, a* and b* from -100 to 100."""
    return rng.uniform([0, -100, -100], [100, 100, 100], (count, 3))


def test_delta_e_gives_the_published_figures():
    """To the four printed decimals. If two hues are exactly opposite, as in the 10th and the 14th pair, their mean has
    two possible values, and rounding selects one. The result is then the figure of a neighbour in the table.
    colour-science itself gives the other value for the 14th pair."""
    given_order, turned = (delta_e_2000(SHARMA[:, a], SHARMA[:, b]) for a, b in (ORDER, ORDER[::-1]))
    for computed in (given_order, turned):
        wrong = np.abs(computed - SHARMA[:, 6]) > 0.5001e-4
        assert not wrong[[k for k in range(34) if k not in OPPOSITE]].any()
        for k in OPPOSITE:
            assert np.abs(computed[k] - SHARMA[k - 1 : k + 2, 6]).min() < 0.5001e-4


def test_delta_e_is_that_of_colour_science(science):
    """Both do the same few dozen operations in another order, on numbers up to 1e14 (c^7 under a root). That is 1e-12
    relative, and cancellation in the rotation term costs a factor of 100. Random hues are never opposite to 1e-9."""
    rng = np.random.default_rng(0)
    one, near = random_lab(rng, 2000), rng.normal(0, 1, (2000, 3))
    for other in (random_lab(rng, 2000), one + near, one * [1, 0, 0]):
        truth = science.delta_E(one, other, method="CIE 2000")
        np.testing.assert_allclose(delta_e_2000(one, other), truth, rtol=1e-10, atol=1e-10)


@rounded
@given(st.integers(0, 2**32))
def test_delta_e_is_a_difference(seed):
    one, other = random_lab(np.random.default_rng(seed), 200).reshape(2, 100, 3)
    assert (delta_e_2000(one, one) == 0).all()
    forth, back = delta_e_2000(one, other), delta_e_2000(other, one)
    assert (forth > 0).all()
    np.testing.assert_allclose(forth, back, rtol=1e-10)


def test_delta_e_of_greys_is_that_of_their_lightness():
    """At a mean L* of 50, S_L is 1; without chroma the other terms vanish."""
    computed = delta_e_2000(np.array([49.0, 0, 0]), np.array([51.0, 0, 0]))
    assert computed == pytest.approx(2, rel=1e-15)


def test_white_is_white_and_black_is_black():
    white = white_xyz()
    np.testing.assert_allclose(lab(np.stack([white, 0 * white]), white), [[100, 0, 0], [0, 0, 0]], atol=1e-13)


def test_lab_is_that_of_colour_science(science):
    """Far below and far above Y = 0.0089, where the two branches meet; rounding is 1e-13 of 100."""
    white = white_xyz()
    xyz = np.geomspace(1e-6, 20, 300).reshape(100, 3) * np.random.default_rng(0).uniform(0.1, 1, (100, 3))
    # colour-science takes the white's xy, with Y = 1.
    truth = science.XYZ_to_Lab(xyz, science.XYZ_to_xy(white))
    np.testing.assert_allclose(lab(xyz, white), truth, rtol=1e-11, atol=1e-11)


def test_lab_has_no_step_where_its_branches_meet():
    """With the CIE's exact fractions the value and the slope are continuous: over a relative step of 1e-9 the lightness
    changes by 1e-9 of 8."""
    white = np.ones(3)
    below, above = (lab(np.full(3, 216 / 24389 * (1 + e)), white)[0] for e in (-1e-9, 1e-9))
    assert above - below == pytest.approx(0, abs=2e-8 * 8)
    assert below == pytest.approx(8, abs=1e-7)


def test_the_table_is_the_cie_table(science):
    """The tables are printed to seven digits, so they differ by at most 5e-7 of a value. Where z is 0, colour-science
    interpolates it to 1e-16."""
    table = _cie_table()
    nm = np.arange(380, 781)
    np.testing.assert_array_equal(table[:, 0], nm)
    cmfs = science.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    np.testing.assert_allclose(table[:, 1:4], cmfs[nm.astype(float)], rtol=5.1e-7, atol=1e-14)
    d65 = science.SDS_ILLUMINANTS["D65"]
    power = np.interp(nm, d65.wavelengths, d65.values)
    np.testing.assert_allclose(table[:, 4], power, rtol=5.1e-7)


def test_the_white_is_d65(science):
    """To 1e-4: the published xy has four decimals, and this table ends at 780 nm."""
    x, y = science.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"]["D65"]
    assert white_xyz("D65")[:2] / white_xyz("D65").sum() == pytest.approx((x, y), abs=1e-4)
    np.testing.assert_allclose(white_xyz("E"), 1, atol=2e-4)


@pytest.mark.parametrize("illuminant", ILLUMINANTS)
def test_y_of_the_white_is_one(illuminant):
    """To the rounding of 401 terms."""
    assert white_xyz(illuminant)[1] == pytest.approx(1, rel=1e-13)


def test_there_is_no_light_outside_the_visible():
    np.testing.assert_array_equal(observer(np.array([100e-9, 379e-9, 781e-9, 2e-6])), 0)
    assert (observer(np.linspace(380e-9, 645e-9, 300)) > 0).all()


@rounded
@given(st.floats(0.25e-9, 120e-9), st.sampled_from(ILLUMINANTS))
def test_a_mirror_is_white_at_any_step(step, illuminant):
    """To the rounding of at most 1600 terms, 4e-13."""
    wavelengths = np.arange(380e-9, 780e-9, step)
    total = np.ones(len(wavelengths)) @ spectral_weights(wavelengths, illuminant)
    np.testing.assert_allclose(total, white_xyz(illuminant), rtol=1e-12)
    # The matrix multiplies the rounding by up to 3.2, its largest entry.
    np.testing.assert_allclose(rgb_from_xyz("Rec.709", illuminant) @ total, 1, rtol=1e-11)


@rounded
@given(st.lists(st.floats(400e-9, 640e-9), min_size=1, max_size=40, unique=True), st.sampled_from(ILLUMINANTS))
def test_a_mirror_is_white_on_any_grid(wavelengths, illuminant):
    total = spectral_weights(np.sort(wavelengths), illuminant).sum(axis=0)
    np.testing.assert_allclose(total, white_xyz(illuminant), rtol=1e-12)


def test_weights_are_those_of_the_integral():
    """A smooth spectrum has the same colour at steps of 5 nm and 1 nm. The trapezoid rule misses h^2 / 12 f''. With
    functions some 20 nm wide that is 25 / 12 / 400 = 0.5 % locally, and far less in the sum."""
    grids = [np.arange(380, 781, step) * 1e-9 for step in (1, 5)]
    fine, coarse = (np.exp(-(((grid - 560e-9) / 60e-9) ** 2)) @ spectral_weights(grid) for grid in grids)
    np.testing.assert_allclose(coarse, fine, rtol=1e-3)


@pytest.mark.parametrize("space", RGB_SPACES)
def test_primaries_are_the_standards_own(science, space):
    theirs = science.RGB_COLOURSPACES[SPACES[space]]
    primaries, white = RGB_SPACES[space]
    np.testing.assert_array_equal(primaries, theirs.primaries)
    np.testing.assert_array_equal(white, theirs.whitepoint)


@pytest.mark.parametrize("space", RGB_SPACES)
@pytest.mark.parametrize("illuminant", ILLUMINANTS)
def test_matrices_are_those_of_colour_science(science, space, illuminant):
    """Three 3 x 3 systems with condition numbers below 10 round by 1e-14; the test allows 100 times that."""
    primaries, white = RGB_SPACES[space]
    to_xyz = science.normalised_primary_matrix(np.array(primaries), np.array(white))
    adapt = science.adaptation.matrix_chromatic_adaptation_VonKries(
        white_xyz(illuminant), science.xy_to_XYZ(np.array(white)), transform="Bradford"
    )
    np.testing.assert_allclose(rgb_from_xyz(space, illuminant), np.linalg.inv(to_xyz) @ adapt, atol=1e-12)


@pytest.mark.parametrize("space", RGB_SPACES)
@pytest.mark.parametrize("illuminant", ILLUMINANTS)
def test_a_mirror_is_one_one_one(space, illuminant):
    """To a few roundings, times the matrix's largest entry, 3.2."""
    np.testing.assert_allclose(rgb_from_xyz(space, illuminant) @ white_xyz(illuminant), 1, rtol=1e-13)


def test_rec_709_is_the_matrix_that_everyone_knows():
    """IEC 61966-2-1 prints four decimals, for a D65 that differs from this one by 1e-4 in xy."""
    iec = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
    np.testing.assert_allclose(rgb_from_xyz("Rec.709"), iec, atol=2e-3)


def test_srgb_is_that_of_colour_science(science):
    """Only one power is computed, so the tolerance is a few roundings."""
    linear = np.linspace(0, 1, 1001)
    np.testing.assert_allclose(srgb_encode(linear), science.models.eotf_inverse_sRGB(linear), rtol=1e-14)


def test_srgb_keeps_its_ends_and_clips_the_rest():
    np.testing.assert_allclose(srgb_encode(np.array([-1.0, 0.0, 1.0, 7.0])), [0, 0, 1, 1], atol=1e-15)


@rounded
@given(st.floats(0, 1), st.floats(0, 1))
def test_srgb_rises(one, other):
    """The two branches differ by 3e-8 where they meet."""
    low, high = sorted([one, other])
    assert srgb_encode(low) <= srgb_encode(high) + 3e-8
