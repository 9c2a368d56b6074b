# SPDX-License-Identifier: GPL-3.0-or-later
"""The stack of films against closed forms (Born and Wolf 1.5 and 1.6), and within the law of energy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from precompute.optics.brdf import fresnel_reflectance
from precompute.reflectance.films import _reflectance, stack_reflectance

WAVELENGTHS = np.linspace(380e-9, 780e-9, 7)
COSINES = np.linspace(0, 1, 12)
NM = 1e-9
# Sums and products of a few numbers near 1 in double precision.
ROUNDING = 1e-12


def reflectance(indices, thicknesses_m=(), *, wavelengths=WAVELENGTHS, cosines=COSINES):
    """The reflectance of indices (l + 1,) without dispersion."""
    each = np.repeat(np.array(indices, dtype=complex)[:, None], len(wavelengths), axis=1)
    return stack_reflectance(wavelengths, cosines, each, thicknesses_m=list(thicknesses_m))


def amplitudes(index, cosines):
    """Fresnel's amplitudes of s and p from air into an index, and the normal component q (Born and Wolf 1.5.2)."""
    q = np.sqrt(index**2 - 1 + cosines**2 + 0j)
    return (cosines - q) / (cosines + q), (index**2 * cosines - q) / (index**2 * cosines + q), q


def airy(index, thickness_m, substrate):
    """The reflectance of one film, as Airy's sum over the reflections in it (Born and Wolf 7.6), for each of
    WAVELENGTHS and COSINES."""
    top_s, top_p, q = amplitudes(index, COSINES)
    below = np.sqrt(substrate**2 - 1 + COSINES**2 + 0j)
    bottom_s = (q - below) / (q + below)
    bottom_p = (substrate**2 * q - index**2 * below) / (substrate**2 * q + index**2 * below)
    turn = np.exp(4j * np.pi / WAVELENGTHS[:, None] * q * thickness_m)
    s = (top_s + bottom_s * turn) / (1 + top_s * bottom_s * turn)
    p = (top_p + bottom_p * turn) / (1 + top_p * bottom_p * turn)
    return (np.abs(s) ** 2 + np.abs(p) ** 2) / 2


@pytest.mark.parametrize("index", [1.05, 1.56, 2.5])
def test_without_layers_a_dielectric_is_fresnel(index):
    found = reflectance([index])
    assert found.shape == (7, 12)
    assert found == pytest.approx(np.tile(fresnel_reflectance(COSINES, index), (7, 1)), abs=ROUNDING)


@pytest.mark.parametrize("index", [0.13 + 3.8j, 3.2 + 3.3j, 1.5 + 1e-6j])
def test_an_absorbing_substrate(index):
    s, p, _ = amplitudes(index, COSINES)
    assert reflectance([index])[3] == pytest.approx((abs(s) ** 2 + abs(p) ** 2) / 2, abs=ROUNDING)
    assert reflectance([index])[3, -1] == pytest.approx(abs((index - 1) / (index + 1)) ** 2, abs=ROUNDING)


@pytest.mark.parametrize("substrate", [1, 1.52, 0.13 + 3.8j])
@pytest.mark.parametrize("index", [1.33, 0.7, 1.7 + 0.05j, 0.8 + 6j])
@pytest.mark.parametrize("thickness_m", [5 * NM, 220 * NM, 3000 * NM])
def test_one_film_is_airy(index, substrate, thickness_m):
    # At cosine 0 Airy's formula has the quotient 0 / 0 for a substrate of air.
    found = reflectance([index, substrate], [thickness_m])[:, 1:]
    # The phase of 3 micrometres is 1e2 rad, rounded to 1e-14, and Airy's denominator is at least 1e-2.
    assert found == pytest.approx(airy(index, thickness_m, substrate)[:, 1:], abs=1e-11)


@pytest.mark.parametrize("pairs", [1, 4, 10])
@pytest.mark.parametrize("high, low, substrate", [(2.3, 1.38, 1.52), (1.7, 1.6, 1.56)])
def test_a_quarter_wave_stack(high, low, substrate, pairs):
    """At the normal the admittance is n_s (n_H / n_L)^2p (Born and Wolf 1.6.5)."""
    wavelength = 550 * NM
    thicknesses = [wavelength / 4 / high, wavelength / 4 / low] * pairs
    admittance = substrate * (high / low) ** (2 * pairs)
    found = reflectance(
        [high, low] * pairs + [substrate], thicknesses, wavelengths=np.array([wavelength]), cosines=np.ones(1)
    )
    assert found[0, 0] == pytest.approx(((1 - admittance) / (1 + admittance)) ** 2, abs=ROUNDING)


@pytest.mark.parametrize("cosine", [1.0, 0.6])
def test_a_half_wave_film_is_absent(cosine):
    wavelength, index = 500 * NM, 2.0
    thickness = wavelength / 2 / np.sqrt(index**2 - 1 + cosine**2)
    found = reflectance([index, 1.52], [thickness], wavelengths=np.array([wavelength]), cosines=np.array([cosine]))
    assert found[0, 0] == pytest.approx(fresnel_reflectance(np.array(cosine), 1.52), abs=ROUNDING)


def test_at_the_brewster_angle_only_s_reflects():
    """There the reflectance of s is ((n^2 - 1) / (n^2 + 1))^2, and unpolarised light reflects half of it."""
    index = 1.56
    cosine = 1 / np.sqrt(1 + index**2)
    found = reflectance([index], cosines=np.array([cosine]))
    assert found[:, 0] == pytest.approx(((index**2 - 1) / (index**2 + 1)) ** 2 / 2, abs=ROUNDING)


@pytest.mark.parametrize("index", [1.5 + 0.5j, 0.8 + 9j])
def test_a_thick_absorbing_layer_hides_what_is_below(index):
    # Light returns through 10 micrometres with at most exp(-4 pi 0.5 10 / 0.78) = 1e-35 of its power.
    assert reflectance([index, 2.4, 1], [10e-6, 100 * NM]) == pytest.approx(reflectance([index]), abs=ROUNDING)


def test_two_layers_of_one_matter_are_one_layer():
    two = reflectance([1.7 + 0.1j, 1.7 + 0.1j, 1.4], [70 * NM, 130 * NM])
    assert two == pytest.approx(reflectance([1.7 + 0.1j, 1.4], [200 * NM]), abs=ROUNDING)


def test_layers_of_one_thickness_keep_their_indices():
    """The function computes equal layers once."""
    equal = reflectance([1.7, 1.4, 1.6 + 0.1j, 1.5], [100 * NM, 100 * NM, 100 * NM])
    unequal = reflectance([1.7, 1.4, 1.6 + 0.1j, 1.5], [100 * NM, 100.000001 * NM, 100.000002 * NM])
    # The change of a phase of 3 rad by 2e-8 of it.
    assert equal == pytest.approx(unequal, abs=1e-6)
    assert np.abs(equal - reflectance([1.7] * 3 + [1.5], [100 * NM] * 3)).max() > 0.01


def test_a_layer_of_air_on_the_outside_is_absent():
    assert reflectance([1, 1.7, 1.4], [500 * NM, 90 * NM]) == pytest.approx(
        reflectance([1.7, 1.4], [90 * NM]), abs=ROUNDING
    )


def test_grazing_light_is_reflected():
    for indices, thicknesses in (([1.56], []), ([1.7, 1.0], [100 * NM]), ([1], []), ([0.2 + 3j], [])):
        assert np.all(reflectance(indices, thicknesses)[:, 0] == 1)
    # Near the horizon 1 - R grows as cos ti times 2 / sqrt(n^2 - 1) + 2 n^2 / sqrt(n^2 - 1): 5.7 for n = 1.56.
    near = reflectance([1.56], cosines=np.array([1e-7]))
    assert near == pytest.approx(1 - 5.7e-7, abs=1e-8)


def test_air_reflects_nothing_down_to_the_horizon():
    # q is exactly the cosine.
    assert np.all(reflectance([1, 1], [300 * NM], cosines=np.array([1e-9, 1e-3, 1])) < 1e-25)


def test_the_critical_angle_of_a_layer_is_regular():
    """There q = 0 in the layer. The reflectance is between those of the angles beside it."""
    cosine = 0.42999999999999994
    index = np.sqrt(1 - cosine**2)
    assert index**2 - 1 + cosine**2 == 0
    beside = 1e-9
    found = reflectance([index, 1.5], [300 * NM], cosines=np.array([cosine - beside, cosine, cosine + beside]))
    assert np.all(np.isfinite(found))
    # The reflectance has no kink there; over 2e-9 it is a straight line to 1e-15, up to the rounding of q near 0.
    assert found[:, 1] == pytest.approx((found[:, 0] + found[:, 2]) / 2, abs=ROUNDING)


LAYERS = st.lists(
    st.tuples(st.floats(0.01, 10), st.one_of(st.just(0.0), st.floats(0, 10)), st.floats(1e-3, 1e4)), max_size=40
)
SUBSTRATES = st.tuples(st.floats(0.01, 10), st.one_of(st.just(0.0), st.floats(0, 10)))


@given(LAYERS, SUBSTRATES)
def test_no_stack_reflects_more_than_it_receives(layers, substrate):
    indices = np.array([n + 1j * k for n, k, _ in layers] + [complex(*substrate)])[:, None, None]
    k0 = 2 * np.pi / WAVELENGTHS[:, None]
    found = _reflectance(k0, COSINES[1:], indices**2, thicknesses_m=[nm * NM for _, _, nm in layers])
    assert np.all(found >= 0)
    # A layer adds some 1e-15 per unit of its phase, which is at most 1.6e3 rad.
    assert np.all(found <= 1 + 1e-10)


def test_an_extinction_coefficient_of_minus_zero_is_zero():
    films = [reflectance([complex(0.5, k), 1.5], [900 * NM]) for k in (0.0, -0.0)]
    assert np.array_equal(*films)


def test_two_hundred_extreme_layers_do_not_overflow():
    found = reflectance([0.01, 10] * 100 + [0.01], [10e-6] * 200)
    assert np.all((found >= 0) & (found <= 1))


def test_many_wavelengths_are_as_single_ones():
    """The function divides its work into steps."""
    wavelengths, cosines = np.linspace(380e-9, 780e-9, 50), np.linspace(0, 1, 300)
    indices, thicknesses = np.stack([np.linspace(1.7, 1.6, 50), np.linspace(1.4, 1.5, 50)]), [120 * NM]
    whole = stack_reflectance(wavelengths, cosines, indices, thicknesses_m=thicknesses)
    for i in (0, 13, 14, 49):
        one = stack_reflectance(wavelengths[[i]], cosines, indices[:, [i]], thicknesses_m=thicknesses)
        assert whole[i] == pytest.approx(one[0], abs=ROUNDING)
