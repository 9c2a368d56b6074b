# SPDX-License-Identifier: GPL-3.0-or-later
"""The channels of a bake for several lamps: their weights, the matrix of each lamp, and the texts that name them."""

import numpy as np
import pytest

from devtools.tables import generate_channel_table
from precompute.base.failure import GratingError
from precompute.colour.channels import (
    channel_count,
    channel_weights,
    correlation_root,
    lamp_curves,
    lamp_matrix,
    scene_matrix,
)
from precompute.colour.illuminants import (
    canonical,
    first_of,
    has_bands,
    illuminant_of,
    is_illuminant,
    line_of,
    parts_of,
)
from precompute.colour.observer import mirror_xyz, spectral_weights, wavelengths
from precompute.colour.spaces import RGB_SPACES, lamp_rgb, rgb_from_xyz

SEVERAL = ("D65+smooth", "D65+led", "D65+FL11", "D65+led+FL11+532nm", "D65+smooth+400:0 589:0 589.3:1 590:0")
LAMPS = ("D65", "E", "A", "1850K", "2700K", "25000K", "D5500", "LED-B1", "LED-RGB1", "FL11", "HP1", "532nm")
# The weight of the constant spectrum in the least squares is 1000, so its error is a millionth of the curves' own.
# Their products with a reflectance of at most 1 are of the size of 1.
OF_CONSTANT = 1e-6


@pytest.mark.parametrize("illuminant", SEVERAL)
@pytest.mark.parametrize("step_nm", [0.5, 3.3, 5, 20])
def test_a_grey_mirror_has_each_lamp_s_colour(illuminant, step_nm):
    """A constant spectrum gives the lamp's own colour, at any wavelengths: exactly for the parts of the illuminant."""
    grey = channel_weights(wavelengths(step_nm * 1e-9), illuminant).sum(axis=0)
    assert len(grey) == channel_count(illuminant) == lamp_matrix(illuminant, "2700K").shape[1]
    for lamp in LAMPS:
        exact = lamp in parts_of(illuminant)
        atol = 1e-12 if exact else OF_CONSTANT
        np.testing.assert_allclose(lamp_matrix(illuminant, lamp) @ grey, mirror_xyz(lamp), rtol=0, atol=atol)


@pytest.mark.parametrize("space", RGB_SPACES)
@pytest.mark.parametrize("illuminant", ["D65+smooth", "D65+led+FL11"])
def test_a_mirror_is_white_beside_each_lamp(space, illuminant):
    """So a scene's lamp, whose colour multiplies it, shows its own colour. The division by the lamp's least component,
    0.02, and the matrix's entries, up to 3.2, multiply the error."""
    grey = channel_weights(wavelengths(5e-9), illuminant).sum(axis=0)
    for lamp in ("D65", "2700K", "HP1", "LED-B1", "FL11"):
        rtol = 1e-11 if lamp in parts_of(illuminant) else 160 * OF_CONSTANT
        np.testing.assert_allclose(scene_matrix(space, illuminant, lamp) @ grey, 1, rtol=rtol)


def test_the_matrices_of_the_parts_select():
    """The first three channels are XYZ under D65, and a lamp with its own colours has three channels."""
    illuminant, lambdas = "D65+led+FL11+532nm", wavelengths(3e-9)
    weights = channel_weights(lambdas, illuminant)
    for number, part in ((0, "D65"), (3, "FL11"), (4, "532nm")):
        matrix = lamp_matrix(illuminant, part)
        np.testing.assert_array_equal(matrix, np.eye(3, 15, 3 * number))
        if part != "532nm":
            # Wavelengths in nanometres are rounded, where the curves are steep.
            np.testing.assert_allclose(weights @ matrix.T, spectral_weights(lambdas, part), rtol=1e-11)
    np.testing.assert_array_equal(lamp_matrix("D65", "D65"), np.eye(3))
    np.testing.assert_array_equal(scene_matrix("ACEScg", illuminant, "D65")[:, :3], rgb_from_xyz("ACEScg"))


@pytest.mark.parametrize("step_nm", [3, 5, 7.3])
@pytest.mark.parametrize("line", ["401nm", "532nm", "589nm", "699nm"])
def test_a_line_s_channels_are_the_spectrum_there(line, step_nm):
    """By Keys's cubic convolution, which is Hermite's cubic with slopes of central differences."""
    lambdas = wavelengths(step_nm * 1e-9)
    spectrum = 1 + np.sin(np.arange(len(lambdas)) ** 1.5)
    place = np.interp(line_of(line), lambdas, np.arange(len(lambdas)))
    k = int(place)
    t, (before, low, high, after) = place - k, spectrum[k - 1 : k + 3]
    at_line = (
        (2 * t**3 - 3 * t**2 + 1) * low + (t**3 - 2 * t**2 + t) * (high - before) / 2
        + (3 * t**2 - 2 * t**3) * high + (t**3 - t**2) * (after - low) / 2
    )  # fmt: skip
    found = spectrum @ channel_weights(lambdas, f"D65+{line}")[:, 3:]
    np.testing.assert_allclose(found, at_line * mirror_xyz(line), rtol=1e-10)


def test_three_channels_are_multiplied_by_the_lamp_s_colour():
    """In linear Rec.709, as a renderer does."""
    found = rgb_from_xyz() @ lamp_matrix("D65", "2700K") @ np.linalg.inv(rgb_from_xyz())
    np.testing.assert_allclose(found, np.diag(lamp_rgb("Rec.709", "2700K")), atol=1e-12)
    np.testing.assert_allclose(scene_matrix("Rec.709", "D65", "2700K"), rgb_from_xyz(), atol=1e-12)


def _weighted(lamp):
    """A lamp's curves (401, 3), weighted by the correlation of reflectances."""
    return correlation_root() @ lamp_curves(lamp)


@pytest.mark.parametrize("illuminant", ["D65+smooth", "D65+led", "D65+FL11"])
@pytest.mark.parametrize("lamp", ["2000K", "3100K", "D7000", "LED-B2", "FL2"])
def test_no_other_matrix_misses_less(illuminant, lamp):
    """For random reflectances of the correlation, that are exact where constant: the residual is orthogonal to every
    change of the matrix that keeps the constant spectrum. The rounding is that of a matrix of condition 1e5 at most."""
    nm = wavelengths(1e-9)
    weights = channel_weights(nm, illuminant)
    held, grey = correlation_root() @ weights, weights.sum(axis=0)
    missed = held @ lamp_matrix(illuminant, lamp).T - _weighted(lamp)
    free = np.eye(len(grey)) - np.outer(grey, grey) / (grey @ grey)
    changes = held @ free
    sizes = np.linalg.norm(changes, axis=0)[:, None] * np.linalg.norm(_weighted(lamp), axis=0)
    assert np.abs(changes.T @ missed / sizes).max() < 1e-5
    assert np.linalg.norm(missed) < np.linalg.norm(_weighted("D65") - _weighted(lamp))


def test_the_shipped_curves_are_the_generator_s():
    """The file has six digits, which are off by at most 5e-6 of a value. Linear algebra on another machine may round a
    thousandth of the last digit of the largest, 0.0098, differently."""
    shipped = np.loadtxt(generate_channel_table.TABLE, delimiter=",")
    np.testing.assert_allclose(shipped, generate_channel_table.table(), rtol=5.01e-6, atol=1e-11)


def test_texts_are_canonical(tmp_path, monkeypatch):
    for text, expected in (
        ("smooth", "D65+smooth"), (" LED ", "D65+led"), ("led+tube", "D65+led+FL11"),
        ("tungsten+fl11", "D65+2700K+FL11"), ("FL11 + smooth", "D65+smooth+FL11"),
        ("overcast+smooth", "D65+smooth"), ("d65+532NM", "D65+532nm"),
        ("e+smooth", "D65+smooth+E"), ("400:0 500:1+led", "D65+led+400:0 500:1"),
    ):  # fmt: skip
        assert canonical(text) == illuminant_of(text) == expected and is_illuminant(expected)
        assert first_of(expected) == "D65" and not is_illuminant(text)
    monkeypatch.chdir(tmp_path)
    for name in ("lamp.csv", "my+lamp.csv"):
        (tmp_path / name).write_text("400, 0\n500, 2\n")
    assert illuminant_of("smooth+lamp.csv") == "D65+smooth+400:0 500:1"
    assert illuminant_of("my+lamp.csv") == "400:0 500:1"


@pytest.mark.parametrize(("bad", "told"), [
    ("smooth+led", "names smooth and led; give one of them"), ("led+smooth+FL11", "names led and smooth"),
    ("FL11+FL11", "FL11+FL11: names a part twice"), ("tube+FL11", "tube+FL11: names a part twice"),
    ("smooth+smooth", "twice"), ("D65+D65", "twice"), ("2700K+tungsten+led", "twice"), ("sun+smooth+D55", "twice"),
    ("2000K+3000K+4000K+5000K+6000K", "has 5 lamps with their own colours; give at most 4"),
    ("led+2000K+3000K+4000K+5000K+6000K+7000K", "has 6 lamps with their own"), ("smooth+", "smooth+: has an empty"),
    ("+", "has an empty part; give D65+led+FL11"), ("+led", "empty"), ("D65++led", "empty"), ("D65+ +led", "empty"),
    ("smooth+nosuch", "nosuch: is not a known illuminant"), ("D65+smoth", "did you mean smooth"),
    ("smooth led", "not a known"),
    ("D65+0K", "give 1000K to 25000K"), ("smooth+399nm", "give 400nm to 700nm"), ("led+400:1 300:2", "not a known"),
    ("led+\x1b[31m", "not a known"), ("led+" + "x" * 9999, "not a known"), ("+".join(["led"] * 9999), "twice"),
    ("smooth\n+led", "names smooth and led"),
])  # fmt: skip
def test_texts_that_name_no_lamps(bad, told):
    for read in (canonical, illuminant_of):
        with pytest.raises(GratingError) as error:
            read(bad)
        assert told in str(error.value) and str(error.value).isprintable() and len(str(error.value)) < 250
    assert not is_illuminant(bad)


@pytest.mark.parametrize("bad", ["smooth+no.csv", "no/such.csv+led", "led+.", "FL11+../no", "smooth+no\\such"])
def test_parts_that_are_no_file(bad, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(GratingError, match=r": (cannot be read|is not a file)") as error:
        illuminant_of(bad)
    assert str(error.value).isprintable()


def test_which_parts_need_fine_steps():
    """Lines too, as a line's channels read the spectrum at one wavelength."""
    assert not any(map(has_bands, ("D65+smooth", "D65+2700K", "D65+smooth+D5500")))
    assert all(map(has_bands, ("D65+led", "D65+FL11", "D65+532nm", "D65+smooth+LED-B1")))
