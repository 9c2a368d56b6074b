# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of heights, spectrum and colours show what they are said to show, at the right place."""

import numpy as np
import pytest

from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.maps import brdf_map as chart
from precompute.maps import pictures as spectrum
from precompute.maps.pictures import GROUND, SIDE, height_picture, round_below
from precompute.surface.height_map import HeightMap
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare


def waves(period_m=1e-6, *, angle_deg=0.0, cols=400, rows=400, pixel_m=50e-9):
    """A sinusoid, 100 nm deep, with its grating vector at an angle from +x, counterclockwise."""
    x, y = np.meshgrid((np.arange(cols) + 0.5) * pixel_m, -(np.arange(rows) + 0.5) * pixel_m)
    along = x * np.cos(np.radians(angle_deg)) + y * np.sin(np.radians(angle_deg))
    return HeightMap(50e-9 * np.cos(2 * np.pi * along / period_m), (pixel_m, pixel_m), "test")


def test_high_is_bright_and_missing_is_red():
    heights = np.zeros((64, 64))
    heights[:, 32:] = 100e-9
    heights[:16, :16] = np.nan
    picture = height_picture(HeightMap(heights, (1e-7, 1e-7), "test"))
    assert picture.shape == (SIDE, SIDE, 3)
    # The map is 456 pixels wide, in the middle of 512: from 28 on.
    assert tuple(picture[300, 100]) == (0, 0, 0) and tuple(picture[300, 400]) == (255, 255, 255)
    assert tuple(picture[50, 60]) == (230, 26, 26)


@pytest.mark.parametrize("shape", [(8, 400), (400, 8), (1400, 1400)])
def test_every_shape_fits(shape):
    rng = np.random.default_rng(1)
    picture = height_picture(HeightMap(rng.normal(0, 1e-8, shape), (1e-7, 1e-7), "test"))
    assert picture.shape == (SIDE, SIDE, 3)
    assert spectrum.spectrum_picture(HeightMap(rng.normal(0, 1e-8, shape), (1e-7, 1e-7), "test")).shape[0] == SIDE


@pytest.mark.parametrize("angle_deg", [0, 30, 90, -45])
@pytest.mark.parametrize("period_m", [0.8e-6, 2e-6])
def test_a_wave_stands_at_its_lines_per_millimetre(period_m, angle_deg):
    """Its brightest pixel is at the distance and the angle of its grating vector."""
    scan = waves(period_m, angle_deg=angle_deg)
    found = spectrum.waves_of(scan).gratings[0]
    reach = spectrum._reach(found)
    plot = spectrum._spectrum_greys(spectrum.spectrum_of(scan), reach)[..., 0]
    rows, cols = np.nonzero(plot == plot.max())
    pitch = 2 * reach / len(plot)
    right = (cols + 0.5) * pitch - reach
    up = reach - (rows + 0.5) * pitch
    lines = 1e-3 / period_m
    expected = lines * np.cos(np.radians(angle_deg)), lines * np.sin(np.radians(angle_deg))
    # A bin of this scan, 20 um wide, is 50 lines/mm wide. Along each axis the wave is at most half a bin from its bin,
    # and the bin at most half a bin and half a pixel from a pixel that shows it.
    near = np.minimum(np.hypot(right - expected[0], up - expected[1]), np.hypot(right + expected[0], up + expected[1]))
    assert near.max() <= (50 + pitch / 2) * np.sqrt(2)


def test_waves_without_colours_are_dimmed():
    """A waviness of 20 um, ten times as high, is coarser than the ring: it is grey, and does not set the brightness."""
    fine = waves(1e-6)
    coarse = HeightMap(fine.height_m + 10 * waves(20e-6).height_m, fine.pixel_size_m, "test")
    plot = spectrum._spectrum_greys(spectrum.spectrum_of(coarse), 3500)[..., 0]
    lines = (np.arange(len(plot)) + 0.5) * 7000 / len(plot) - 3500
    within = np.hypot(lines[:, None], lines) < spectrum._RINGS[0]
    assert plot[within].max() == pytest.approx(255 * 0.4, abs=1)
    bright = np.abs(lines[np.nonzero(plot == 255)[1]])
    # 1000 lines/mm, to a bin of 50 and a pixel.
    assert bright.min() >= 940 and bright.max() <= 1060


def test_a_flat_surface_has_pictures_too():
    flat = read_height_map("sample:flat")
    assert height_picture(flat).shape == spectrum.spectrum_picture(flat).shape == (SIDE, SIDE, 3)


@pytest.fixture(scope="module")
def table():
    """A sinusoid of 1 um along x."""
    relief = prepare(read_height_map("grating:sinusoidal?period_um=1&depth_nm=150"))
    return bake(relief, BakeRequest(delta_e=6.0, coherence_length_m=10e-6))


def test_the_chart_has_each_colour_where_the_grating_equation_puts_it(table):
    """Light at 45 degrees from the left, period 1 um: first order at sin t = sin 45 - lambda / d. At t = 9 degrees that
    is 550 nm, green; at 5 degrees 620 nm, red; at 14.5 degrees 457 nm, blue. The strip has 448 pixels for 180
    degrees."""
    picture = chart.view_chart(table, 45.0).astype(int)
    strip = picture[chart._STRIP_TOP + 12, (SIDE - chart._STRIP) // 2 :][: chart._STRIP]

    def at(degrees):
        return strip[round((degrees + 90) / 180 * chart._STRIP - 0.5)]

    assert [int(np.argmax(at(t))) for t in (5.0, 9.0, 14.5)] == [0, 1, 2]
    assert at(45.0).min() == 255  # the mirror image


def test_the_chart_s_disc_is_the_brdf_map(table):
    """The mirror image of light at 30 degrees is at half of the radius, to the right; outside the disc is ground."""
    picture = chart.view_chart(table, 30.0)
    radius = chart._DISC // 2
    x, y = chart._LEFT + radius + radius // 2, chart._TOP + radius
    assert picture[y - 6 : y + 6, x - 8 : x + 8].max(axis=(0, 1)).min() == 255
    assert tuple(picture[chart._TOP + 2, chart._LEFT + chart._DISC - 3]) == GROUND


def test_a_chart_of_a_flat_surface_is_a_mirror_image(table):
    flat = bake(prepare(read_height_map("sample:flat")), BakeRequest(delta_e=6.0, coherence_length_m=10e-6))
    assert chart.view_chart(flat, 0.0).shape == chart.view_chart(flat, 89.0).shape == (SIDE, SIDE, 3)


@pytest.mark.parametrize(("value", "below"), [(1.0, 1), (1.99, 1), (2.0, 2), (4.9, 2), (7, 5), (0.3, 0.2), (1e3, 1e3)])
def test_round_numbers(value, below):
    assert round_below(value) == pytest.approx(below)
