# SPDX-License-Identifier: GPL-3.0-or-later
"""Illuminants by their names, black bodies and daylight: their spectra, whites and weights."""

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.colour.illuminants import (
    ILLUMINANTS,
    LAMPS,
    canonical,
    has_bands,
    illuminant_of,
    is_illuminant,
    line_of,
    named,
    spectrum,
)
from precompute.colour.observer import (
    _cie_table,
    drawn_weight,
    is_white,
    mirror_xyz,
    observer,
    spectral_weights,
    wavelength_quantiles,
    wavelengths,
    white_xyz,
)
from precompute.colour.spaces import RGB_SPACES, lamp_rgb, rgb_from_xyz

NM = np.arange(380.0, 781.0)
WHITE = [*named(), "1000K", "1850K", "2700K", "25000K", "D4000", "D6500", "D25000"]
# LEDs of one colour, as a file may hold them: wavelengths of the peak and standard deviations.
COLOURED = {"blue": (450, 10), "green": (525, 15), "amber": (595, 7), "red": (660, 3)}


def led(peak_nm, sigma_nm):
    """The text of a Gaussian spectrum."""
    power = np.exp(-(((NM - peak_nm) / sigma_nm) ** 2) / 2)
    return " ".join(f"{nm:g}:{each:.5g}" for nm, each in zip(NM, power, strict=True) if each > 1e-9)


@pytest.mark.parametrize("name", [name for name in named() if name not in ILLUMINANTS])
def test_the_spectra_are_those_of_colour_science(science, name):
    """The tables exactly; A, D50, D55 and D75, which are computed, to the printed digits."""
    judge = science.SDS_ILLUMINANTS[name]
    nm, power = spectrum(name)
    expected = np.interp(nm, judge.wavelengths, judge.values)
    assert nm[0] == 380 and nm[-1] == 780
    scale = expected[nm == 560] / power[nm == 560]
    # A has values at each nanometre, its table at each fifth.
    own = nm % 5 == 0
    np.testing.assert_allclose((scale * power)[own], expected[own], atol=0.006 if name[0] in "AD" else 1e-6)


@pytest.mark.parametrize("name", [name for name in named() if name not in ILLUMINANTS])
def test_the_whites_are_those_of_colour_science(science, name):
    """By its sum at 1 nm over the same linear interpolation. Between 1 nm and 5 nm lie bends of the product of two
    linear functions: a sum at 1 nm is off by the product of the slopes over 6, up to 3e-4 on the mercury lines."""
    nm, power = spectrum(name)
    judge = science.SpectralDistribution(dict(zip(NM, np.interp(NM, nm, power), strict=True)))
    cmfs = science.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(science.SpectralShape(380, 780, 1))
    expected = science.sd_to_XYZ(judge, cmfs, science.sd_ones(science.SpectralShape(380, 780, 1)), method="Integration")
    np.testing.assert_allclose(white_xyz(name), expected / expected[1], atol=1e-3)


@pytest.mark.parametrize("kelvins", [1000, 2000, 2856, 6504, 25000])
def test_a_black_body_is_planck_s(kelvins):
    """The ratio of two wavelengths in closed form, with Planck's, Boltzmann's and light's constants of the SI."""
    h, c, k = 6.62607015e-34, 299792458.0, 1.380649e-23
    nm, power = spectrum(f"{kelvins}K")

    def radiance(metres):
        return 2 * h * c**2 / metres**5 / (np.exp(h * c / (metres * k * kelvins)) - 1)

    np.testing.assert_allclose(power, radiance(nm * 1e-9) / radiance(560e-9), rtol=1e-8)


@pytest.mark.parametrize("kelvins", [4000, 5500, 6999, 7000, 7001, 10000, 25000])
def test_daylight_has_its_colour_temperature(science, kelvins):
    """The white lies on the CIE's locus: to 2e-3, since the table's components are rounded and end at 780 nm."""
    x, y = science.temperature.CCT_to_xy_CIE_D(kelvins)
    xyz = white_xyz(f"D{kelvins}")
    np.testing.assert_allclose(xyz[:2] / xyz.sum(), [x, y], atol=2e-3)
    assert (spectrum(f"D{kelvins}")[1] > 0).all()


@pytest.mark.parametrize("name", [*WHITE, *(led(*each) for each in COLOURED.values())])
@pytest.mark.parametrize("space", RGB_SPACES)
def test_a_mirror_is_white_or_its_lamp_is_coloured(name, space):
    matrix = rgb_from_xyz(space, name)
    assert np.abs(np.linalg.inv(matrix)).max() < 100
    if is_white(name):
        np.testing.assert_allclose(matrix @ white_xyz(name), 1, rtol=1e-10)
    else:
        np.testing.assert_array_equal(white_xyz(name), white_xyz("D65"))
        np.testing.assert_allclose(matrix, rgb_from_xyz(space), rtol=1e-12)


def test_which_lamps_are_white():
    assert all(map(is_white, WHITE))
    assert not any(is_white(led(*each)) for each in COLOURED.values()) and not is_white("532nm")


@pytest.mark.parametrize("space", RGB_SPACES)
@pytest.mark.parametrize("name", ["2000K", "2700K", "10000K", "D7500", "LED-B1", "LED-RGB1", "FL2", "FL11", "A"])
def test_a_lamp_of_its_colour_shows_the_true_colours(name, space):
    """The bake's colour times the lamp's is the light's own beside daylight, signed, for any colour; a candle, beside
    Rec.709's edge, keeps 97 % of its colour. 2000 K has 0.0199 in Rec.709, so it keeps all but 2e-4."""
    assert np.abs(lamp_rgb(space, name)[:, None] * rgb_from_xyz(space, name) - rgb_from_xyz(space)).max() < 1e-3


@pytest.mark.parametrize("name", ["1000K", "1850K", "HP1"])
def test_a_lamp_beside_a_space_s_edge_keeps_its_luminance(name):
    lamp = lamp_rgb("Rec.709", name)
    luminance = np.linalg.inv(rgb_from_xyz("Rec.709"))[1]
    assert lamp.min() == pytest.approx(0.02) and luminance @ lamp == pytest.approx(1, rel=1e-6)
    # So does every colour: the picture's luminance is that of the light.
    np.testing.assert_allclose(luminance @ (lamp[:, None] * rgb_from_xyz("Rec.709", name)), [0, 1, 0], atol=1e-12)


@pytest.mark.parametrize("name", ["2700K", "D5500", "LED-B1", "FL11", "HP1", led(595, 7), "400:0 589:0 589.3:1 590:0"])
@pytest.mark.parametrize("step_nm", [0.5, 1, 3, 7.3, 100])
def test_weights_integrate_any_steps(name, step_nm):
    """A constant spectrum gives the mirror's colour, and a smooth hill from 400 to 760 nm its integral, as a sum in
    steps of 0.01 nm finds it: Keys's convolution is off by the step's third power."""

    def hill(nm):
        return np.where((nm > 400) & (nm < 760), ((nm - 400) * (760 - nm)) ** 2, 0.0) / 1e9

    lambdas = wavelengths(step_nm * 1e-9)
    weights = spectral_weights(lambdas, name)
    np.testing.assert_allclose(weights.sum(axis=0), mirror_xyz(name), rtol=1e-11)
    fine = np.arange(380, 780, 0.01) + 0.005
    slope = observer(fine * 1e-9, name) * 1e-11
    # Midpoints of 0.01 nm follow the bends of the tables, which lie at multiples of it; 589.3 too.
    if step_nm <= 3:
        np.testing.assert_allclose(hill(lambdas * 1e9) @ weights, hill(fine) @ slope, rtol=2e-4, atol=2e-4)


@pytest.mark.parametrize("name", ["FL11", "LED-B1", "400:0 589:0 589.3:1 590:0"])
def test_half_an_order_s_width_resolves_bands(name):
    """A Gaussian order, at each place in the spectrum, in steps of half its standard deviation: 0.4 % of the brightest
    (Keys's convolution of a Gaussian), against a sum in steps of 0.05 nm. The trapezoid rule is off by ten times as
    much."""
    sigma = 0.004
    lambdas = np.geomspace(380e-9, 780e-9, round(np.log(780 / 380) / (sigma / 2)) + 1)
    fine = (np.arange(380, 780, 0.05) + 0.025) * 1e-9
    places = np.linspace(np.log(400e-9), np.log(700e-9), 301)

    def order(at):
        return np.exp(-(((np.log(at) - places[:, None]) / sigma) ** 2) / 2)

    true = order(fine) @ (observer(fine, name) * 0.05e-9)
    found = order(lambdas) @ spectral_weights(lambdas, name)
    plain = order(lambdas) @ (observer(lambdas, name) * np.gradient(lambdas)[:, None])
    worst, of_plain = (np.abs(each - true).max() / true.max() for each in (found, plain))
    print(f"{name:.8}: {worst:.2%}, by the trapezoid rule {of_plain:.2%}")
    assert worst < 4.5e-3


@pytest.mark.parametrize("name", ["2700K", "FL11", "HP1", led(595, 7)])
def test_draws_follow_any_light(name):
    """The mean of colours over their probability is the mirror's colour: 4,096 draws of a density that bends at the
    tables' wavelengths are off by less than a thousandth."""
    drawn = wavelength_quantiles(4096, name)
    density = observer(drawn, name)
    assert (density.sum(axis=1) > 0).all()
    found = (density / density.sum(axis=1, keepdims=True)).mean(axis=0) * drawn_weight(name)
    np.testing.assert_allclose(found, mirror_xyz(name), atol=1e-3)


def test_names_are_forgiving_and_canonical():
    assert canonical(" led-b1 ") == "LED-B1" and canonical("2700k") == "2700K" and canonical("d5500") == "D5500"
    assert canonical("d65") == "D65" and canonical("Tungsten") == "2700K" and canonical("532NM") == "532nm"
    for name in [*WHITE, "532nm", led(525, 15)]:
        assert canonical(name) == name and is_illuminant(name)
    for name, (illuminant, _) in LAMPS.items():
        assert illuminant_of(name) == illuminant and is_illuminant(illuminant) and not is_illuminant(name)


@pytest.mark.parametrize(("bad", "told"), [
    ("0K", "0K: is out of range; give 1000K to 25000K"), ("999K", "1000K"), ("25001K", "25000K"), ("9" * 99 + "k", "K"),
    ("D3999", "D4000 to D25000"), ("399nm", "400nm to 700nm"), ("moon", "give 2700K, D5500"), ("", "give 2700K"),
    ("LED-B9", "did you mean LED-B"), ("tungstan", "did you mean tungsten"), ("-5K", "a known"), ("nan", "a known"),
    ("400:1 300:2", "a known"), ("400:1 500:2", "a known"), ("400:1", "a known"), ("400:0 500:0", "a known"),
    ("400:nan 500:1", "a known"), ("1:1 2:1", "a known"), ("\x1b[31mD65", "a known"),
])  # fmt: skip
def test_names_that_are_none(bad, told):
    with pytest.raises(GratingError) as error:
        canonical(bad)
    assert told in str(error.value) and "\n" not in str(error.value) and len(str(error.value)) < 250
    assert not is_illuminant(bad)


def test_what_is_no_text():
    assert not any(map(is_illuminant, (None, 65, ["D65"], {}, "D65\n", "d65", "tungsten", "lamp.csv", "1:" * 10**6)))


def test_which_lights_need_fine_steps():
    assert not any(map(has_bands, (*ILLUMINANTS, "A", "C", "D50", "2700K", "D5500", "532nm")))
    assert all(map(has_bands, ("FL2", "LED-B1", "HP1", led(525, 15))))


def test_the_first_illuminants_keep_their_weights():
    """To the last bit: bakes of D65, E and a line are the same bytes as before."""
    nm = _cie_table()[:, 0]
    lambdas = np.geomspace(380e-9, 780e-9, 97)
    steps = np.diff(lambdas)
    trapezoid = 0.5 * (np.concatenate([[0], steps]) + np.concatenate([steps, [0]]))
    for name in ILLUMINANTS:
        power = _cie_table()[:, 4] if name == "D65" else np.ones(401)
        table = _cie_table()[:, 1:4] * power[:, None]
        unit = np.diff(nm * 1e-9)
        norm = 0.5 * (np.concatenate([[0], unit]) + np.concatenate([unit, [0]]))
        table = table / (norm @ table[:, 1])
        weights = np.stack([np.interp(lambdas * 1e9, nm, each, left=0, right=0) for each in table.T], axis=-1)
        weights = weights * trapezoid[:, None]
        # Both sums of the white run over wavelengths in metres, as they always did.
        exact = np.stack([np.interp(nm * 1e-9 * 1e9, nm, each, left=0, right=0) for each in table.T], axis=-1)
        np.testing.assert_array_equal(spectral_weights(lambdas, name), weights * ((norm @ exact) / weights.sum(axis=0)))
    assert line_of("532nm") == 532 * 1e-9
