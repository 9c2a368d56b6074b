# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.optics.brdf import (
    KERATIN_IOR,
    RATIO_IOR,
    RATIO_IOR_MAX,
    fresnel_reflectance,
    half_angle_cosine,
    obliquity_times_cosine_and_w2,
    scattering_factor,
    small_slope_reflectance,
)

pairs = settings(deadline=None, max_examples=100)
polar = st.floats(0, np.radians(89.5))
azimuth = st.floats(0, 2 * np.pi)
indices = st.floats(1.01, 4)


def direction(theta, phi):
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


@pairs
@given(indices)
def test_normal_incidence(n):
    """Equal to ((n - 1) / (n + 1))^2, whose numerator loses at most two digits, at n = 1.01."""
    assert fresnel_reflectance(1.0, n) == pytest.approx(((n - 1) / (n + 1)) ** 2, rel=1e-12)


@pairs
@given(indices)
def test_grazing_incidence_reflects_all(n):
    assert fresnel_reflectance(0.0, n) == 1


@pairs
@given(indices)
def test_brewster_leaves_one_polarisation(n):
    """At tan t = n the parallel part is not reflected, and ((n^2 - 1) / (n^2 + 1))^2 of the other part is."""
    cosine = 1 / np.sqrt(1 + n**2)
    assert fresnel_reflectance(cosine, n) == pytest.approx(0.5 * ((n**2 - 1) / (n**2 + 1)) ** 2, rel=1e-12)


@pairs
@given(polar, indices)
def test_fresnel_follows_from_snells_law(theta, n):
    """Equal to the textbook's form in sines and tangents. That form loses digits near normal incidence, so the test
    starts at 0.5 degrees, where the squares of angle differences of 0.01 keep 12 digits."""
    theta = max(theta, np.radians(0.5))
    refracted = np.arcsin(np.sin(theta) / n)
    perpendicular = (np.sin(theta - refracted) / np.sin(theta + refracted)) ** 2
    parallel = (np.tan(theta - refracted) / np.tan(theta + refracted)) ** 2
    expected = 0.5 * (perpendicular + parallel)
    assert fresnel_reflectance(np.cos(theta), n) == pytest.approx(expected, rel=1e-9, abs=1e-15)


def test_fresnel_is_a_share_of_the_light():
    cosines = np.linspace(-0.01, 1.01, 200)
    reflectance = fresnel_reflectance(cosines)
    assert ((reflectance > 0) & (reflectance <= 1)).all()
    assert (np.diff(reflectance) <= 1e-15).all()
    assert reflectance[-1] == pytest.approx(((KERATIN_IOR - 1) / (KERATIN_IOR + 1)) ** 2, rel=1e-12)


@pairs
@given(polar, azimuth, polar, azimuth)
def test_half_angle(theta_i, phi_i, theta_r, phi_r):
    """Equal to the value from the half vector. Near pi / 2 the square root turns a rounding of 2e-16 into 1e-8."""
    wi, wr = direction(theta_i, phi_i), direction(theta_r, phi_r)
    half = (wi + wr) / np.linalg.norm(wi + wr)
    assert half_angle_cosine(wi, wr) == pytest.approx(wi @ half, abs=1e-7)
    assert half_angle_cosine(wi, wr) == pytest.approx(half_angle_cosine(wr, wi), abs=1e-15)


def test_half_angle_of_roundings_stays_real():
    d = direction(0.7, 0.3) * (1 + 1e-15)
    assert half_angle_cosine(d, d) == pytest.approx(1)
    assert half_angle_cosine(d, -d) == pytest.approx(0)


def stam(wi, wr):
    """The obliquity O as written in docs/theory.md."""
    ci, cr = wi[2], wr[2]
    return (1 + wi @ wr) ** 2 / (ci * cr * (ci + cr) ** 2)


@pairs
@given(polar, azimuth, polar, azimuth)
def test_obliquity_is_stams(theta_i, phi_i, theta_r, phi_r):
    wi, wr = direction(theta_i, phi_i), direction(theta_r, phi_r)
    expected = stam(wi, wr) * wi[2] * (wi[2] + wr[2]) ** 2
    # A dozen roundings. Where light and view are opposite 1 + wi.wr is small, but its rounding is that of 1.
    assert obliquity_times_cosine_and_w2(wi, wr) == pytest.approx(expected, rel=1e-13, abs=1e-13 / wr[2])


@pairs
@given(polar, azimuth, polar, azimuth, indices)
def test_reciprocity_of_fresnel_times_obliquity(theta_i, phi_i, theta_r, phi_r, n):
    """R O stays the same when light and view are exchanged. The function's factor cos(ti) changes, so it is divided
    out. Rounding as above."""
    wi, wr = direction(theta_i, phi_i), direction(theta_r, phi_r)
    forth, back = (
        fresnel_reflectance(half_angle_cosine(a, b), n) * obliquity_times_cosine_and_w2(a, b) / a[2]
        for a, b in ((wi, wr), (wr, wi))
    )
    assert forth == pytest.approx(back, rel=1e-12, abs=1e-12 / (wi[2] * wr[2]))


@pairs
@given(polar, azimuth)
def test_obliquity_of_a_mirror_is_one(theta, phi):
    """Thus O cos(ti) w^2 = 4 cos^3. At 89.5 degrees 1 + wi.wr = 2 cos^2 is 1e-4 and keeps 12 digits."""
    wi, wr = direction(theta, phi), direction(theta, phi + np.pi)
    assert obliquity_times_cosine_and_w2(wi, wr) == pytest.approx(4 * np.cos(theta) ** 3, rel=1e-10)


def test_the_limit_of_the_horizon_is_finite():
    wi = direction(np.radians(30), 0.0)
    horizon = np.array([[1.0, 0, 0], [0, 1.0, 0], [-1.0, 0, 0]])
    assert np.isfinite(obliquity_times_cosine_and_w2(wi, horizon)).all()


def test_arrays_broadcast():
    wi = direction(0.4, 0.1)
    wr = np.stack([[direction(0.1 * i, 0.2 * j) for i in range(4)] for j in range(3)])
    picture = obliquity_times_cosine_and_w2(wi, wr)
    assert picture.shape == half_angle_cosine(wi, wr).shape == (3, 4)
    assert picture[2, 1] == pytest.approx(obliquity_times_cosine_and_w2(wi, wr[2, 1]), rel=1e-15)


@pairs
@given(polar, azimuth, polar, azimuth, st.floats(RATIO_IOR, RATIO_IOR_MAX))
def test_a_held_reflectance_has_the_ratio_form(theta_i, phi_i, theta_r, phi_r, ior):
    """4 cos(ti)^2 cos(tr) Q / F. Over cos(ti) it is reciprocal, and Q / F is 1 in the mirror image."""
    wi, wr = direction(theta_i, phi_i), direction(theta_r, phi_r)
    over = fresnel_reflectance(half_angle_cosine(wi, wr), ior)
    expected = 4 * wi[2] ** 2 * wr[2] * small_slope_reflectance(wi, wr, ior) / over
    assert scattering_factor(wi, wr, ratio_ior=ior) == pytest.approx(expected, rel=1e-12)
    assert scattering_factor(wr, wi, ratio_ior=ior) * wi[2] == pytest.approx(expected * wr[2], rel=1e-9)
    mirrored = wi * (-1, -1, 1)
    assert scattering_factor(wi, mirrored, ratio_ior=ior) == pytest.approx(4 * wi[2] ** 3, rel=1e-6)
    assert scattering_factor(wi, wr, ratio_ior=ior, stam=True) == obliquity_times_cosine_and_w2(wi, wr)
