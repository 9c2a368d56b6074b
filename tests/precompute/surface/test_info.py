# SPDX-License-Identifier: GPL-3.0-or-later
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.surface.height_map import HeightMap
from precompute.surface.quality import describe
from precompute.surface.readers.reader_registry import read_height_map

KEYS = [
    "rows",
    "cols",
    "pixel_size_m",
    "height_range_m",
    "height_rms_m",
    "source_range_m",
    "periods_m",
    "period_angles_deg",
    "gratings",
    "waviness",
    "fine",
    "line_noise",
    "quality",
    "channels",
]
# A single wave is found exactly. The lobe of its negative frequency, 12 bins away and below 1 / 12^3 of its own, shifts
# the result by 0.001 bins, as does the plane that is removed from the wave.
MISSED_BINS = 0.002


def wave(shape, pixel, period, angle_deg, amplitude=50e-9):
    """A sine whose grating vector points angle_deg from T towards B; rows run along -B."""
    y, x = -np.arange(shape[0])[:, None] * pixel[0], np.arange(shape[1]) * pixel[1]
    angle = np.radians(angle_deg)
    return amplitude * np.sin(2 * np.pi * (x * np.cos(angle) + y * np.sin(angle)) / period + 0.4)


def described(height, pixel):
    return describe(HeightMap(height, pixel, "test"))


@settings(max_examples=40, deadline=None)
@given(angle=st.floats(-89, 90), repeats=st.floats(8, 30), stretch=st.floats(0.8, 1.25))
def test_a_wave_is_found_where_it_is(angle, repeats, stretch):
    shape, pixel = (128, 128), (100e-9, 100e-9 * stretch)
    side = min(shape[0] * pixel[0], shape[1] * pixel[1])
    period = side / repeats
    y, x = np.indices(shape)
    figures = described(wave(shape, pixel, period, angle) + 1e-9 * x - 2e-9 * y + 1e-6, pixel)
    # Both axes have an error of MISSED_BINS. A bin is widest along the shorter side, 1 / repeats of the wave's
    # frequency.
    miss = MISSED_BINS * np.sqrt(2) / repeats
    assert figures.periods_m[0] == pytest.approx(period, rel=miss)
    turned = (figures.period_angles_deg[0] - angle + 90) % 180 - 90
    assert abs(turned) <= np.degrees(miss)
    assert -90 < figures.period_angles_deg[0] <= 90


def test_two_waves_come_strongest_first_with_their_own_angles():
    pixel = (60e-9, 60e-9)
    height = wave((256, 256), pixel, 1200e-9, 30, 40e-9) + wave((256, 256), pixel, 900e-9, -70, 20e-9)
    figures = described(height, pixel)
    assert figures.periods_m == pytest.approx((1200e-9, 900e-9), rel=0.003)
    assert figures.period_angles_deg == pytest.approx((30, -70), abs=0.2)


def test_a_stronger_wave_comes_first_though_a_slower_one_is_higher():
    """Waviness 400 nm high, like a real skin's, repeats only twice in the scan."""
    pixel = (50e-9, 50e-9)
    height = wave((256, 256), pixel, 1000e-9, 0, 40e-9) + wave((256, 256), pixel, 6400e-9, 70, 200e-9)
    assert described(height, pixel).periods_m == pytest.approx((1000e-9,), rel=0.005)


@pytest.mark.parametrize("angle", [0, 90])
def test_the_flank_of_slow_waves_is_no_period(angle):
    """A wave that fits 2.4 times has a lobe that reaches well into the periods that fit three times."""
    pixel = (50e-9, 50e-9)
    found = described(wave((256, 256), pixel, 256 * 50e-9 / 2.4, angle), pixel).waves
    assert found.gratings == () and found.waviness is None


@pytest.mark.parametrize("rows", range(100, 112))
def test_straight_up_is_90_degrees_and_never_minus_90(rows):
    pixel = (20e-9, 20e-9)
    assert described(wave((rows, 1), pixel, 400e-9, 90), pixel).period_angles_deg == (90,)


def test_one_row_and_one_column():
    pixel = (20e-9, 20e-9)
    along_t = described(wave((1, 200), pixel, 400e-9, 0), pixel)
    along_b = described(wave((200, 1), pixel, 400e-9, 90), pixel)
    for figures, angle in ((along_t, 0), (along_b, 90)):
        assert figures.periods_m == pytest.approx((400e-9,), rel=MISSED_BINS / 10)
        assert figures.period_angles_deg == (angle,)


@pytest.mark.parametrize("shape", [(1, 1), (2, 2), (3, 1), (32, 32)])
def test_a_plane_has_no_relief_and_no_period(shape):
    y, x = np.indices(shape)
    figures = described(1e-6 + 3e-9 * x - 2e-9 * y, (20e-9, 20e-9))
    # The rounding of heights near 1 um.
    assert figures.height_range_m < 1e-20
    assert figures.height_rms_m < 1e-20
    assert figures.periods_m == figures.period_angles_deg == ()


@pytest.mark.parametrize("seed", range(20))
def test_noise_has_no_period(seed):
    height = 1e-9 * np.random.default_rng(seed).standard_normal((128, 128))
    assert described(height, (20e-9, 20e-9)).periods_m == ()


def test_holes_change_no_figure_by_more_than_their_share():
    pixel = (20e-9, 20e-9)
    height = wave((128, 128), pixel, 400e-9, 20)
    whole = described(height, pixel)
    height[40:44, 50:54] = np.nan
    holed = described(height, pixel)
    assert holed.height_rms_m == pytest.approx(whole.height_rms_m, rel=1e-3)
    assert holed.periods_m[0] == pytest.approx(whole.periods_m[0], rel=1e-3)


def test_relief_is_that_of_the_levelled_heights():
    """A wave of 16 whole periods and a plane: the range is twice the amplitude, the rms is amplitude / sqrt(2). A plane
    fitted to 16 whole periods of a sine rises over the scan by at most 6 / (pi 16) amplitudes."""
    pixel = (20e-9, 20e-9)
    y, x = np.indices((128, 128))
    height = wave((128, 128), pixel, 160e-9, 0, 10e-9) + 5e-9 * x + 7e-9 * y
    figures = described(height, pixel)
    assert figures.source_range_m == np.ptp(height)
    assert figures.height_range_m == pytest.approx(20e-9, rel=0.12)
    assert figures.height_rms_m == pytest.approx(10e-9 / np.sqrt(2), rel=0.02)


def test_figures_are_plain_json_in_their_order():
    hm = HeightMap(np.eye(4), (1e-9, 2e-9), "test", "a", ("a", "b"))
    figures = json.loads(json.dumps(describe(hm).as_dict()))
    assert list(figures) == KEYS
    assert figures["pixel_size_m"] == [1e-9, 2e-9]
    assert figures["channels"] == ["a", "b"]


def test_both_files_of_the_real_grid_agree(shared_data):
    paths = (str(shared_data / "nanosurf" / name) for name in ("grid.nid", "grid.gwy"))
    nid, gwy = (describe(read_height_map(path)) for path in paths)
    for key in KEYS[:8]:
        np.testing.assert_allclose(getattr(nid, key), getattr(gwy, key), rtol=1e-6)
    assert nid.periods_m[0] == pytest.approx(316e-9, abs=1e-9)
    assert nid.period_angles_deg[0] == pytest.approx(45, abs=1)


def test_real_skin_shows_the_period_of_the_thesis(shared_data):
    """The thesis found 1144 nm in a smaller patch. The lobe is 15 % wide, and its top is speckle."""
    scan = read_height_map(str(shared_data / "snake" / "elaphe_65um.png"), size_um=65, height_nm=375)
    figures = describe(scan)
    assert figures.periods_m[0] == pytest.approx(1144e-9, rel=0.05)
    assert figures.period_angles_deg[0] == pytest.approx(0, abs=1)


def test_the_real_skin_of_xenopeltis_shows_the_period_of_its_rows(shared_data):
    """Its waviness of 18 um is higher, and its fingers 0.53 and 0.58 um apart have more power times frequency."""
    scan = read_height_map(str(shared_data / "snake" / "xenopeltis_65um.png"), size_um=65, height_nm=818.69)
    figures = describe(scan)
    # The scan has 43 rows, which are not straight: half a bin of the spectrum is 1.2 %.
    assert figures.periods_m[0] == pytest.approx(1.5e-6, rel=0.012)
    assert figures.period_angles_deg[0] == pytest.approx(87.5, abs=1)
    assert figures.waves.waviness.period_m == pytest.approx(18e-6, rel=0.1)
    relief, grating, waviness = figures.in_words()
    assert grating.startswith("grating: 1501 nm at 87 deg, 43.3 repeats in the scan; it sends out the most light")
    assert waviness.startswith("waviness: 18.5 um") and "wider" not in waviness and "than the sun is wide" in waviness


def test_waviness_is_told_and_is_no_grating():
    """A wave of 9 um sends out red and green 6.9 mrad apart, and the sun is 9.3 mrad wide."""
    pixel = (250e-9, 250e-9)
    height = wave((256, 256), pixel, 1500e-9, 90, 20e-9) + wave((256, 256), pixel, 9e-6, 0, 60e-9)
    figures = described(height, pixel)
    assert figures.periods_m == pytest.approx((1500e-9,), rel=0.005)
    assert figures.waves.waviness.period_m == pytest.approx(9e-6, rel=0.02)
    assert figures.waves.waviness.amplitude_m == pytest.approx(60e-9, rel=0.05)
    assert figures.waves.waviness.light == 0
    assert [line.split(":")[0] for line in figures.in_words()] == ["relief", "grating", "waviness"]


def test_what_is_finer_than_light_is_no_grating():
    """At 150 nm the path difference is below the shortest wavelength, 380 nm, even from one horizon to the other."""
    pixel = (20e-9, 20e-9)
    figures = described(wave((256, 256), pixel, 150e-9, 30), pixel)
    assert figures.periods_m == ()
    assert figures.waves.fine.period_m == pytest.approx(150e-9, rel=0.01)
    assert [line.split(":")[0] for line in figures.in_words()] == ["relief", "grating", "finer than light"]
    assert "grating: none" in figures.in_words()[1]


def test_a_wave_too_faint_to_see_is_no_grating():
    """At 20 pm, 200 such orders together are as bright as a hundredth of white paper."""
    pixel = (50e-9, 50e-9)
    assert described(wave((256, 256), pixel, 1000e-9, 0, 20e-12), pixel).periods_m == ()
    assert described(wave((256, 256), pixel, 1000e-9, 0, 1e-9), pixel).periods_m == pytest.approx((1000e-9,), rel=0.005)


def test_a_rough_ground_has_no_grating_of_its_own():
    """The power of random ground falls with the third power of the frequency, as for many natural surfaces."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        q = np.hypot(np.fft.fftfreq(256)[:, None], np.fft.rfftfreq(256))
        spectrum = np.fft.rfft2(rng.standard_normal((256, 256))) / np.maximum(q, 1 / 256) ** 1.5
        height = np.fft.irfft2(spectrum)
        height *= 100e-9 / height.std()
        assert described(height, (100e-9, 100e-9)).periods_m == ()


def test_the_relief_is_told_before_and_after_levelling():
    """A picture declared 375 nm high may be higher once its tilt is removed."""
    pixel = (50e-9, 50e-9)
    flat = described(np.array([[0, 1e-9], [1e-9, 0]]), pixel)
    assert flat.relief_in_words() == "1 nm"
    y, x = np.indices((64, 64))
    tilted = described(wave((64, 64), pixel, 400e-9, 0, 10e-9) + 5e-9 * x, pixel)
    assert tilted.relief_in_words().endswith(f" nm levelled ({tilted.source_range_m * 1e9:.0f} nm as scanned)")


def test_of_a_large_scan_the_middle_tells_the_periods():
    """The middle has its own mean and plane, which do not affect the periods."""
    pixel = (100e-9, 100e-9)
    figures = described(wave((300, 3000), pixel, 1500e-9, 20) + 1e-9 * np.arange(3000), pixel)
    grating = figures.waves.gratings[0]
    assert grating.period_m == pytest.approx(1500e-9, rel=0.01)
    assert grating.angle_deg == pytest.approx(20, abs=0.5)
    assert grating.repeats == pytest.approx(
        np.hypot(300e-6 * np.cos(np.radians(20)), 30e-6 * np.sin(np.radians(20))) / 1.5e-6, rel=0.01
    )
    assert (figures.rows, figures.cols) == (300, 3000)
