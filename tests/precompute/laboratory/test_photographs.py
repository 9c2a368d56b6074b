# SPDX-License-Identifier: GPL-3.0-or-later
"""The places of hues in photographs of diffracted beams: on pictures with known places, and on the thesis's own."""

import colorsys

import numpy as np
import pytest

from laboratory.benchmarks import photographs
from laboratory.benchmarks.photographs_compared import ELAPHE, XENOPELTIS, read
from laboratory.benchmarks.photographs_hues import HUES, Band, beam_centre, distances, linear, luminances, parting
from laboratory.benchmarks.photographs_screen import Laboratory, picture
from laboratory.speed.surfaces import skin
from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare

BEAM, SHAPE = (60, 40), (121, 320)
BAND = Band("first", 60, 260, 30)
# The hue falls by as many degrees a pixel, from 240 at this distance from the beam.
FALL, VIOLET_AT = 1.2, 70
# Pixels by which the spectrum leans, for each row.
LEAN = 0.1


def rainbow(*, noise=0.0, gain=0.9):
    """A photograph (rows, columns, 3) of 8 bits, as linear light: a burnt beam, and a spectrum to the right, brightest
    in the beam's row."""
    rows, columns = np.indices(SHAPE)
    across, along = rows - BEAM[0], columns - BEAM[1]
    hue = 240 - FALL * (along - VIOLET_AT - LEAN * across)
    shade = np.vectorize(lambda degrees: colorsys.hsv_to_rgb(degrees / 360, 1.0, 1.0))
    value = gain * np.exp(-((across / 40) ** 2)) * ((hue >= 0) & (hue <= 240))
    encoded = np.stack(shade(np.clip(hue, 0, 240)), axis=-1) * value[..., None]
    encoded += noise * np.random.default_rng(5).standard_normal(encoded.shape)
    encoded[np.hypot(across, along) < 9] = 1
    return linear(np.rint(np.clip(encoded, 0, 1) * 255) / 255)


def wanted(hue, count):
    """Where the hue lies in slabs of three rows around the beam."""
    middles = 3 * (np.arange(count) - (count - 1) / 2)
    # The last row of an odd band that three does not divide is left out.
    middles -= (2 * BAND.reach + 1 - 3 * count) / 2
    return VIOLET_AT + (240 - HUES[hue]) / FALL + LEAN * middles


@pytest.mark.parametrize("axis", ["right", "up", "down"])
def test_a_known_rainbow_is_measured(axis):
    light = rainbow()
    assert beam_centre(light, slice(0, 60)) == BEAM
    beam = BEAM
    if axis != "right":
        light, beam = light.swapaxes(0, 1), BEAM[::-1]
    if axis == "up":
        light, beam = light[::-1], (len(light) - 1 - beam[0], beam[1])
    found = distances(light, beam, Band("first", BAND.near, BAND.far, BAND.reach, axis))
    for hue, places in found.items():
        # The picture's steps of 1 / 255 are 0.5 degrees of hue where a channel is 0.51, the least here. 0.5 degrees are
        # 0.4 pixels.
        np.testing.assert_allclose(places, wanted(hue, len(places)), atol=0.4, err_msg=hue)


def test_noise_does_not_move_a_hue():
    found = distances(rainbow(noise=0.02), BEAM, BAND)
    for hue, places in found.items():
        # Noise of 0.02 is 2 degrees where a channel is 0.51, 1.2 in the mean of three rows, a pixel. A place is wrong
        # by about as much, and a mean of 20 by 0.25: 0.8 are three standard deviations.
        assert abs(np.mean(places - wanted(hue, len(places)))) < 0.8, hue


def test_burnt_and_dark_rows_are_left_out():
    light = rainbow(gain=1.0)
    burnt = distances(light, BEAM, BAND)["yellow"]
    # 255 exp(-(y / 40)^2) reaches 0.97 * 255 within 7 rows of the beam, so within 3 slabs of the middle one.
    assert np.isnan(burnt[8:12]).all() and np.isfinite(burnt[[0, 5, 14, 19]]).all()
    light[:, BEAM[1] + 150 :] *= 0.01
    assert np.isnan(distances(light, BEAM, BAND)["orange"]).all()
    assert np.isfinite(distances(light, BEAM, BAND)["azure"]).any()


def test_a_stretch_of_one_hue_counts_as_its_middle():
    strip = np.array([[0, 0, 1.0]] * 10 + [[0, 1.0, 0]] * 21 + [[1.0, 0, 0]] * 10)
    assert parting(strip, HUES["green"]) == 20
    assert parting(strip, HUES["cyan"]) == pytest.approx(9.5)
    assert np.isnan(parting(strip[::-1], HUES["green"])) and np.isnan(parting(strip[:5], HUES["green"]))


def test_luminance_is_read_where_a_hue_is():
    light = np.zeros((*SHAPE, 3))
    light[:, BEAM[1] + 100] = 0.25
    found = luminances(light, BEAM, BAND, np.where(np.arange(20) == 3, np.nan, 100.2))
    assert np.isnan(found[3]) and found[[0, 19]] == pytest.approx(0.25)


@pytest.mark.parametrize("along_b", [False, True])
@pytest.mark.parametrize("turn_deg", [0.0, 10.0])
def test_the_screen_shows_a_laser_where_the_grating_equation_says(along_b, turn_deg):
    """A sinusoidal grating, its first order's spot beside the beam, on an upright and on a turned screen."""
    surface = read_height_map("grating:sinusoidal?period_um=1.25&depth_nm=100")
    turned = type(surface)(np.rot90(surface.height_m).copy(), surface.pixel_size_m[::-1], "turned")
    relief = prepare(turned if along_b else surface)
    table = bake(relief, BakeRequest(delta_e=6, illuminant="532nm"))
    light = picture(
        table, Laboratory(along_b=along_b, turn_deg=turn_deg), (41, 320), beam=(20, 20), mm_per_pixel=0.2
    ).sum(axis=-1)
    light[:, :60] = 0
    angle = np.radians(45) - np.arcsin(np.sin(np.radians(45)) - 0.532 / 1.25)
    # The sine rule in the triangle of skin, beam and spot.
    there = 60 * np.sin(angle) / np.cos(angle + np.radians(turn_deg)) / 0.2
    rows, columns = np.indices(light.shape)
    found = [(light * place).sum() / light.sum() for place in (rows - 20, columns - 20)]
    # Half a pixel, and of 170 pixels the 1 % by which the kernel's far side is farther and the light weaker.
    assert found == pytest.approx([0, there], abs=2.2)


def test_without_photographs_the_benchmark_says_so(tmp_path, capsys):
    photographs.main(["--shared", str(tmp_path)])
    assert capsys.readouterr().out == f"skipped: {tmp_path} lacks the photographs or the scans\n"


@pytest.fixture(scope="module")
def compared(shared_data):
    """For a skin, its comparisons both ways in a laboratory."""
    if not (shared_data / "thesis_figures" / f"{ELAPHE.name}.png").is_file():
        pytest.skip("no photographs: ../shared/data/thesis_figures has none")
    skins = {one.skin: bake(prepare(skin(shared_data, one.skin))) for one in (ELAPHE, XENOPELTIS)}
    return lambda one, *laboratory: photographs.both_ways(
        skins[one.skin], read(shared_data / "thesis_figures", one), one, laboratory or photographs.DRAWN
    )


@pytest.mark.night("test_the_screen_shows_a_laser_where_the_grating_equation_says")
def test_the_orders_of_xenopeltis_are_apart_as_photographed(compared):
    """Second over first orders, within 2 %: the better of the two ways that the skin can lie. A turned screen is
    worse."""
    upright, turned = (
        min(photographs.rms_of(way, XENOPELTIS) for way in compared(XENOPELTIS, *laboratory))
        for laboratory in (photographs.DRAWN, (45.0, 10.0))
    )
    assert upright < 0.02 < turned


@pytest.mark.night("test_the_screen_shows_a_laser_where_the_grating_equation_says")
def test_the_first_order_of_elaphe_is_as_long_as_photographed(compared):
    """Each hue over yellow within 3 %, the better way: azure's place moves by 2 % with the camera's white balance, and
    the places in single slabs have a standard deviation of 2.5 to 3.7 %."""
    ratios = [ratio for ratio in ELAPHE.ratios if ratio[0][0] == "along"]
    worst = [max(abs(np.log(ours / theirs)) for theirs, ours in map(way.ratio, ratios)) for way in compared(ELAPHE)]
    assert min(worst) < 0.03


@pytest.mark.night("test_the_screen_shows_a_laser_where_the_grating_equation_says")
def test_the_orders_across_elaphe_fit_at_a_smaller_angle(compared):
    """Orders across over orders along the fan: within 2 % at 40 degrees of incidence, but not at 45."""
    drawn, smaller = (
        min(photographs.rms_of(way, ELAPHE) for way in compared(ELAPHE, *laboratory))
        for laboratory in (photographs.DRAWN, (40.0, 0.0))
    )
    assert smaller < 0.02 < drawn
