# SPDX-License-Identifier: GPL-3.0-or-later
"""The metals' tables, and the reflectance that follows from them against other publications."""

import numpy as np
import pytest

from precompute.reflectance.films import METALS, metal_index
from precompute.reflectance.matter import parse

NM = 1e-9


def normal_reflectance(metal, wavelengths_nm):
    return parse(metal).reflectance(np.array(wavelengths_nm) * NM, np.ones(1))[:, 0]


@pytest.mark.parametrize("metal", METALS)
def test_every_table_covers_visible_light(metal):
    index = metal_index(metal, np.linspace(380, 780, 401) * NM)
    assert index.shape == (401,)
    assert np.all((index.real > 0) & (index.imag > 1))
    # No value of a table is misplaced: n and k change by less than 0.2 from one nanometre to the next.
    assert np.all(np.abs(np.diff(index)) < 0.2)


@pytest.mark.parametrize("wavelength_nm", [300, 900, np.nan])
def test_outside_the_table_nothing_is_guessed(wavelength_nm):
    with pytest.raises(ValueError, match="gold: give wavelengths from 370 to 790 nm"):
        metal_index("gold", np.array([550, wavelength_nm]) * NM)


# One row of each publication that the header of metals.csv names, copied from the refractiveindex.info database.
ROWS = {
    "aluminium": (550, 0.789405353 + 5.851936501j),
    "silver": (650, 0.05091337 + 4.460223332j),
    "gold": (450, 1.538326354 + 1.910745397j),
    "copper": (650, 0.104232496 + 3.775693898j),
    "chromium": (549, 3.18 + 3.33j),
    "nickel": (549, 1.92 + 3.61j),
    "titanium": (549, 2.54 + 3.43j),
}


@pytest.mark.parametrize("metal", METALS)
def test_published_values_are_kept(metal):
    wavelength_nm, expected = ROWS[metal]
    # One part in 1e15 of a wavelength, at a slope of at most 0.2 per nanometre.
    assert metal_index(metal, np.array([wavelength_nm * NM]))[0] == pytest.approx(expected, abs=1e-12)


def test_values_between_are_linear():
    between = metal_index("gold", np.array([450, 453, 460]) * NM)
    # Rounding.
    assert between[1] == pytest.approx(0.7 * between[0] + 0.3 * between[2], abs=1e-12)


# n + ik at 450, 550 and 650 nm by other authors, from the refractiveindex.info database.
OTHERS = {
    # R. L. Olmon et al., Phys. Rev. B 86, 235147 (2012), evaporated gold.
    "gold": (1.472 + 1.855j, 0.3256 + 2.507j, 0.1546 + 3.647j),
    # H. U. Yang et al., Phys. Rev. B 91, 235137 (2015).
    "silver": (0.0527 + 2.6099j, 0.0533 + 3.4848j, 0.0606 + 4.2838j),
    # S. Babar and J. H. Weaver, Appl. Opt. 54, 477-481 (2015), interpolated linearly.
    "copper": (1.1588 + 2.331j, 0.7692 + 2.4117j, 0.0883 + 3.7301j),
    # A. D. Rakic et al., Appl. Opt. 37, 5271-5283 (1998), interpolated linearly.
    "nickel": (1.621 + 2.6933j, 1.8179 + 3.2741j, 2.0592 + 3.7574j),
}


@pytest.mark.parametrize("metal", OTHERS)
def test_other_authors_measured_nearly_the_same(metal):
    index = np.array(OTHERS[metal])
    expected = np.abs((index - 1) / (index + 1)) ** 2
    # Films by different authors differ by up to 0.05; that of gold by 0.01, of silver by 0.007.
    tolerance = {"gold": 0.011, "silver": 0.008}.get(metal, 0.055)
    assert normal_reflectance(metal, [450, 550, 650]) == pytest.approx(expected, abs=tolerance)


def test_aluminium_is_a_mirror_of_91_per_cent():
    """Rocky Mountain Instrument gives 91.8, 91.5 and 91.1 % for bare aluminium at 500, 550 and 600 nm.

    The table of A. D. Rakic, Appl. Opt. 34, 4755-4767 (1995), gives 91.5 % at 550 nm."""
    # The maker gives three digits; mirrors differ by about half a percent.
    assert normal_reflectance("aluminium", [500, 550, 600]) == pytest.approx([0.918, 0.915, 0.911], abs=0.003)


def test_gold_and_copper_are_coloured_and_silver_is_white():
    blue, _, red = normal_reflectance("gold", [450, 550, 650])
    assert red > 2 * blue
    blue, _, red = normal_reflectance("copper", [450, 550, 650])
    assert red > 1.5 * blue
    assert np.ptp(normal_reflectance("silver", np.arange(450, 781, 10))) < 0.02


def test_chromium_is_darker_than_in_another_table():
    """A. D. Rakic et al., Appl. Opt. 37, 5271-5283 (1998), interpolated linearly."""
    index = np.array([2.0246 + 3.8586j, 2.7891 + 4.1976j, 3.4256 + 4.273j])
    difference = np.abs((index - 1) / (index + 1)) ** 2 - normal_reflectance("chromium", [450, 550, 650])
    assert np.all((difference > 0.08) & (difference < 0.11))
