# SPDX-License-Identifier: GPL-3.0-or-later
"""The reflectance of matters by name, and stacks of animals."""

import numpy as np
import pytest

from precompute.optics.brdf import NO_RATIO, RATIO_IOR, RATIO_IOR_MAX, fresnel_reflectance
from precompute.reflectance.films import metal_index
from precompute.reflectance.matter import DIELECTRIC, Matter, parse

WAVELENGTHS = np.linspace(380e-9, 780e-9, 5)
COSINES = np.linspace(0, 1, 9)


def test_a_mirror_reflects_all_light():
    assert np.array_equal(parse("mirror").reflectance(WAVELENGTHS, COSINES), np.ones((5, 9)))


def test_a_dielectric_has_no_reflectance_of_its_own():
    assert not parse("dielectric").baked
    assert parse("1.56").baked
    with pytest.raises(ValueError, match="index of refraction in the scene"):
        Matter(DIELECTRIC).reflectance(WAVELENGTHS, COSINES)


def test_the_substrate_has_the_index_of_the_ratio_form():
    assert parse("dielectric").ratio_ior == NO_RATIO
    assert parse("mirror").ratio_ior == parse("1.56/120nm, air").ratio_ior == RATIO_IOR
    assert parse("2.4").ratio_ior == parse("1.5/80nm, 2.4").ratio_ior == 2.4
    gold = abs(metal_index("gold", np.array([550e-9]))[0])
    assert parse("gold").ratio_ior == gold < RATIO_IOR_MAX
    assert parse("plate 1.5, gold").ratio_ior == pytest.approx(gold / 1.5, rel=1e-12)
    assert parse("aluminium").ratio_ior == RATIO_IOR_MAX


def test_a_fixed_index_is_fresnel():
    found = parse("1.56").reflectance(WAVELENGTHS, COSINES)
    # Rounding.
    assert found == pytest.approx(np.tile(fresnel_reflectance(COSINES, 1.56), (5, 1)), abs=1e-12)


def test_an_index_under_a_plate_is_fresnel_at_the_relative_index():
    found = parse("plate 1.5, 2.1").reflectance(WAVELENGTHS, COSINES)
    assert found == pytest.approx(np.tile(fresnel_reflectance(COSINES, 2.1 / 1.5), (5, 1)), abs=1e-12)  # rounding


def test_a_plate_is_a_thick_layer_without_its_front_face():
    """A film under a plate reflects what its own formula gives at the angle inside: n sin(t) is kept, and a layer of
    the plate's index changes only the phase."""
    bare = parse("plate 1.5, 2.3/120nm, gold").reflectance(WAVELENGTHS, COSINES)
    thick = parse("plate 1.5, 1.5/700nm, 2.3/120nm, gold").reflectance(WAVELENGTHS, COSINES)
    assert thick == pytest.approx(bare, abs=1e-12)  # rounding
    assert np.abs(bare - parse("2.3/120nm, gold").reflectance(WAVELENGTHS, COSINES)).max() > 0.1


def test_a_repeat_is_the_layers_written_out():
    short = parse("3x(1.68/80nm, gold/2nm), 1.56").reflectance(WAVELENGTHS, COSINES)
    long = parse("1.68/80nm, gold/2nm, " * 3 + "1.56").reflectance(WAVELENGTHS, COSINES)
    assert np.array_equal(short, long)


def test_layers_stand_from_the_outside_inwards():
    """A soap film on a metal shows the metal; under a thick metal it is hidden."""
    hidden = parse("gold/900nm, 1.33/300nm, air").reflectance(WAVELENGTHS, COSINES)
    # Light returns through 900 nm of gold with less than exp(-8 pi 900 1.77 / 490) = 1e-35 of its power.
    assert hidden == pytest.approx(parse("gold").reflectance(WAVELENGTHS, COSINES), abs=1e-12)
    assert np.ptp(parse("1.33/300nm, gold").reflectance(WAVELENGTHS, COSINES) - hidden) > 0.05


def half_width(wavelengths_nm, spectrum):
    """The width of the part of a spectrum that is above half its maximum."""
    return np.ptp(wavelengths_nm[spectrum > spectrum.max() / 2])


@pytest.mark.parametrize("high, low", [(1.7, 1.6), (1.68, 1.55)])
@pytest.mark.parametrize("layers, peak_nm", [(12, 700), (16, 530)])
def test_a_beetle(high, low, layers, peak_nm):
    """The jewel beetle Chrysochroa fulgidissima has 12 layers in its purple stripes and 16 in its green parts.

    They reflect 700 and 530 nm at the normal, in bands of 100 to 150 nm, and shorter waves at an angle. Models have
    indices between 1.6 and 1.7 (Stavenga, Wilts, Leertouwer and Hariyama, Phil. Trans. R. Soc. B 366, 709, 2011), and
    measurements of a relative 1.68 and 1.55 (Noyes, Vukusic and Hooper, Opt. Express 15, 4351, 2007). The thicknesses
    here follow from the wavelength by Bragg's law, half of each period's path for each layer."""
    thin, thick = peak_nm / 4 / high, peak_nm / 4 / low
    matter = parse(f"{layers // 2}x(dark {high}/{thin}nm, pale {low}/{thick}nm), 1.56")
    wavelengths_nm, sine = np.arange(380, 781), np.sin(np.radians(60))
    normal, slanted = matter.reflectance(wavelengths_nm * 1e-9, np.array([1, 0.5])).T
    # One step of the wavelengths.
    assert wavelengths_nm[normal.argmax()] == pytest.approx(peak_nm, abs=1)
    bragg_nm = 2 * (thin * np.sqrt(high**2 - sine**2) + thick * np.sqrt(low**2 - sine**2))
    # At an angle the halves of the path are unequal and the air's reflection has another phase: 1 nm at 16 layers.
    assert wavelengths_nm[slanted.argmax()] == pytest.approx(bragg_nm, abs=2)
    if layers == 12:
        assert 100 <= half_width(wavelengths_nm, normal) <= 150


def test_sixteen_equal_periods_reflect_a_narrower_band_than_the_green_beetle():
    """The beetle's band is 100 to 150 nm wide; the layers of its green parts are not all alike."""
    wavelengths_nm = np.arange(380, 781)
    spectrum = parse("8x(1.7/77.94nm, 1.6/82.81nm), 1.56").reflectance(wavelengths_nm * 1e-9, np.ones(1))[:, 0]
    # 62 nm: a uniform stack's band is lambda / pairs, 530 / 8 = 66 nm.
    assert half_width(wavelengths_nm, spectrum) == pytest.approx(66, abs=6)
