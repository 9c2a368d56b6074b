# SPDX-License-Identifier: GPL-3.0-or-later
"""Which wave is the grating: the track instead of its harmonic, and never the microscope's line noise."""

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.height_map import HeightMap
from precompute.surface.quality import describe
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.steps.pipeline import level, parse_steps

PIXEL = 40e-9
COUNT = 256
TRACKS = 1542e-9
Y, X = np.indices((COUNT, COUNT))


def described(height, pixel=PIXEL):
    return describe(HeightMap(height, (pixel, pixel), "test"))


def pits(seed):
    """A pressed disc: pits of random lengths in tracks, 120 nm deep, with 1 nm of noise; the scan holds 6.6 tracks."""
    rng = np.random.default_rng(seed)
    track, place = np.divmod(X[0] * PIXEL, TRACKS)
    in_pit = np.zeros((COUNT, COUNT))
    for each in np.unique(track):
        edges = np.cumsum(rng.uniform(0.8e-6, 3.3e-6, 20)) - rng.uniform(0, 5e-6)
        in_pit[:, track == each] = (np.searchsorted(edges, Y[:, 0] * PIXEL) % 2)[:, None]
    profile = np.exp(-(((place - TRACKS / 2) / 250e-9) ** 2))
    return -120e-9 * in_pit * profile + 1e-9 * rng.standard_normal((COUNT, COUNT))


def shifted_rows(seed, count=COUNT):
    """Rows shifted at random by 1 nm, with 0.3 nm of noise."""
    rng = np.random.default_rng(seed)
    return 1e-9 * rng.standard_normal((count, 1)) + 0.3e-9 * rng.standard_normal((count, count))


@pytest.mark.parametrize("seed", [0, 4])
def test_pits_in_tracks_have_the_period_of_the_tracks(seed):
    """Around the tracks' frequency the pits scatter so much that half the period stands out more, but it sends out less
    light. They move the tracks' peak by less than a tenth of a bin (1 / 6.6 of the period)."""
    tracks, half, *_ = described(pits(seed)).waves.gratings
    assert tracks.period_m == pytest.approx(TRACKS, rel=0.1 / 6.6)
    assert half.period_m == pytest.approx(TRACKS / 2, rel=0.1 / 6.6)
    assert tracks.contrast < 50 < half.contrast and tracks.light > 5 * half.light


def test_tracks_are_calibrated_by_the_tracks():
    scan = HeightMap(pits(0), (PIXEL, PIXEL), "scan")
    calibrated = level(scan, parse_steps("plane,calibrate:1600")).height_map
    assert describe(calibrated).periods_m[0] == pytest.approx(1600e-9, rel=1e-6)
    with pytest.raises(GratingError, match="its grating measures 15.. nm, far from 740 nm"):
        level(scan, parse_steps("plane,calibrate:740"))


def test_rough_ground_makes_no_longer_period_of_a_grating():
    """Ground whose power falls as q^-3 is strongest at twice the length, and more so at three times."""
    q = np.hypot(np.fft.fftfreq(COUNT)[:, None], np.fft.rfftfreq(COUNT))
    for seed in range(10):
        rough = np.fft.rfft2(np.random.default_rng(seed).standard_normal((COUNT, COUNT)))
        ground = np.fft.irfft2(rough / np.maximum(q, 1 / COUNT) ** 1.5)
        height = 10e-9 * np.sin(2 * np.pi * X * PIXEL / 800e-9) + 20e-9 * ground / ground.std()
        assert described(height).periods_m[0] == pytest.approx(800e-9, rel=0.005)


@pytest.mark.parametrize("kind", ["jumps", "drift", "slopes"])
def test_line_noise_is_no_grating(kind):
    """Some chance peak is always hundreds of times stronger than the waves of similar length."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        height = shifted_rows(seed)
        if kind == "drift":
            height += np.cumsum(0.3e-9 * rng.standard_normal((COUNT, 1)), axis=0)
        elif kind == "slopes":
            height += 1e-9 * rng.standard_normal((COUNT, 1)) * np.linspace(-1, 1, COUNT)
        figures = described(height)
        if kind != "drift":
            assert figures.waves.gratings == ()
            assert abs(figures.waves.noise.angle_deg) > 80 and figures.waves.noise.contrast > 200
        # A drift that rises and falls four times may be a wave, and is called a guess.
        assert all(wave.repeats < 5 for wave in figures.waves.gratings)
        assert next(each.light for each in figures.quality.findings if each.topic == "period") == "poor"


def test_line_noise_is_told_with_its_remedy():
    figures = described(shifted_rows(0))
    (noise,) = [line for line in figures.in_words() if line.startswith("line noise")]
    period = next(each for each in figures.quality.findings if each.topic == "period")
    assert "not taken for a grating" in noise and noise.endswith("turn it by 90 deg and scan it again")
    assert period.light == "poor" and "may be line noise of the microscope" in period.sentence
    assert period.sentence.endswith("turn the sample by 90 deg and scan it again")


@pytest.mark.parametrize("repeats", [5.3, 12.4, 30])
def test_a_grating_along_the_rows_is_no_line_noise(repeats):
    """The grating has five times the shifts' deviation; three tenths of a row in 256 are negligible."""
    for seed in range(3):
        height = 5e-9 * np.sin(2 * np.pi * Y * repeats / COUNT) + shifted_rows(seed)
        waves = described(height).waves
        assert waves.gratings[0].repeats == pytest.approx(repeats, abs=0.3) and waves.noise is None


@pytest.mark.parametrize("count", [96, 256])
def test_a_blaze_along_the_rows_is_no_line_noise(count):
    """Its harmonics are as close together as the bins of the spectrum."""
    for repeats in (3.84, 4.95, 7.54, 11.3):
        phase = np.arange(count)[:, None] * repeats / count + np.zeros(count)
        height = 100e-9 * (phase % 1) + 1e-9 * np.random.default_rng(1).standard_normal((count, count))
        waves = described(height, 60e-9).waves
        assert waves.noise is None
        if (period := count * 60e-9 / repeats) < 3.3e-6:  # for longer periods a harmonic may come first
            assert waves.gratings[0].period_m == pytest.approx(period, rel=0.02)


def test_a_grating_under_stronger_line_noise_is_found():
    height = 0.5e-9 * np.sin(2 * np.pi * X * PIXEL / 800e-9) + 10 * shifted_rows(0) / 3
    waves = described(height).waves
    assert waves.gratings[0].period_m == pytest.approx(800e-9, rel=0.01) and abs(waves.gratings[0].angle_deg) < 1
    assert waves.noise.light > waves.gratings[0].light
    found = next(each for each in described(height).quality.findings if each.topic == "period")
    assert found.sentence.endswith("may be line noise of the microscope, and is left out")


def test_a_surface_that_was_made_has_no_line_noise():
    made = HeightMap(shifted_rows(0), (PIXEL, PIXEL), "test", periodic=True)
    assert describe(made).waves.gratings and describe(made).waves.noise is None


def test_the_real_skin_turned_along_the_rows_keeps_its_grating(shared_data):
    scan = read_height_map(str(shared_data / "snake" / "elaphe_65um.png"), size_um=65, height_nm=375)
    waves = describe(level(scan, parse_steps("rotate:90")).height_map).waves
    assert waves.noise is None
    assert [wave.in_words() for wave in waves.gratings] == ["1130 nm at 90 deg", "917.7 nm at 88 deg"]
