# SPDX-License-Identifier: GPL-3.0-or-later
"""Illuminants with a single line: lasers."""

import numpy as np
import pytest

from precompute.colour.illuminants import ILLUMINANTS, is_illuminant, line_of
from precompute.colour.observer import (
    drawn_weight,
    mirror_xyz,
    seen_wavelengths,
    spectral_weights,
    wavelength_quantiles,
    white_xyz,
)
from precompute.colour.spaces import RGB_SPACES, rgb_from_xyz


def test_a_line_is_named_by_its_wavelength():
    assert (line_of("400nm"), line_of("532nm"), line_of("700nm")) == pytest.approx((400e-9, 532e-9, 700e-9))
    for name in ("399nm", "701nm", "0532nm", "532", "532 nm", "532NM", "532.5nm", "-532nm", "532nm\n", "D65", ""):
        assert line_of(name) is None
    assert all(map(is_illuminant, (*ILLUMINANTS, "633nm")))
    assert not any(map(is_illuminant, ("F11", "800nm", None, 532, ["D65"], {})))


def test_a_mirror_has_the_lines_own_colour():
    """CIE 1931, 2 degrees, at 530 nm: x 0.1655, y 0.862, z 0.04216."""
    np.testing.assert_allclose(mirror_xyz("530nm"), np.array([0.1655, 0.862, 0.04216]) / 0.862, rtol=1e-6)
    assert mirror_xyz("700nm")[2] == 0  # the observer's blue ends before 700 nm
    for illuminant in ILLUMINANTS:
        np.testing.assert_array_equal(mirror_xyz(illuminant), white_xyz(illuminant))


def test_a_mirror_is_green_under_a_green_laser():
    """White stays D65, so the colour is not adapted away."""
    np.testing.assert_array_equal(white_xyz("532nm"), white_xyz("D65"))
    for space in RGB_SPACES:
        matrix = rgb_from_xyz(space, "532nm")
        np.testing.assert_array_equal(matrix, rgb_from_xyz(space, "D65"))
        r, g, b = matrix @ mirror_xyz("532nm")
        assert g > 1 and g > 3 * max(r, b)
        r, g, b = matrix @ mirror_xyz("650nm")
        assert r > 1 and r > 3 * max(g, b)


def test_weights_are_of_the_one_wavelength():
    lambdas = seen_wavelengths(np.linspace(380e-9, 780e-9, 81), "532nm")
    np.testing.assert_allclose(lambdas, [532e-9], rtol=1e-15)
    np.testing.assert_array_equal(spectral_weights(lambdas, "532nm"), [mirror_xyz("532nm")])
    with pytest.raises(ValueError, match="2 wavelengths under 532nm"):
        spectral_weights(np.array([532e-9, 540e-9]), "532nm")
    every = np.linspace(380e-9, 780e-9, 81)
    np.testing.assert_array_equal(seen_wavelengths(every, "D65"), every)


def test_every_draw_is_the_line():
    np.testing.assert_allclose(wavelength_quantiles(7, "633nm"), 633e-9, rtol=1e-15)
    assert drawn_weight("633nm") == pytest.approx(mirror_xyz("633nm").sum())
