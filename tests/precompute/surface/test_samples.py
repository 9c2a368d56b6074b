# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.surface.height_map import level_plane
from precompute.surface.quality import describe
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.samples.catalogue import SAMPLES, make_sample
from precompute.surface.samples.ruled_gratings import binary, blazed, sinusoidal

NAMES = ["flat", "sinusoidal", "binary", "blazed", "elaphe", "xenopeltis", "cd", "dvd", "bluray"]
GRATINGS = [sinusoidal, binary, blazed]
# The disc standards in metres: track pitch, pit width, shortest pit, longest pit, pit depth.
DISCS = {
    "cd": (1.6e-6, 0.5e-6, 0.83e-6, 3.05e-6, 110e-9),
    "dvd": (0.74e-6, 0.32e-6, 0.40e-6, 1.87e-6, 105e-9),
    "bluray": (0.32e-6, 0.13e-6, 0.15e-6, 0.69e-6, 65e-9),
}


@pytest.fixture(scope="module", params=NAMES)
def sample(request):
    return make_sample(request.param)


def test_all_names_are_there():
    assert list(SAMPLES) == NAMES


@pytest.mark.night("test_a_disc_has_the_pits_of_its_standard")
def test_a_sample_is_whole_and_says_what_it_is(sample):
    assert sample.periodic
    assert sample.source.removeprefix("sample:") in NAMES
    assert np.isfinite(sample.height_m).all()
    assert sample.pixel_size_m[0] == sample.pixel_size_m[1]
    # |u| up to 2 at 380 nm needs pixels of at most lambda / 4.
    assert sample.pixel_size_m[0] < 95e-9 or sample.source == "sample:flat"


@pytest.mark.night("test_a_disc_has_the_pits_of_its_standard")
def test_a_sample_is_the_same_every_time(sample):
    again = read_height_map(sample.source)
    np.testing.assert_array_equal(sample.height_m, again.height_m)


def test_a_sample_wraps(sample):
    for axis in (0, 1):
        inside = np.abs(np.diff(sample.height_m, axis=axis)).max()
        over_the_edge = np.abs(np.take(sample.height_m, 0, axis) - np.take(sample.height_m, -1, axis)).max()
        assert over_the_edge <= inside


@pytest.mark.parametrize("make", GRATINGS)
def test_a_grating_has_its_period_exactly(make):
    hm = make()
    assert (hm.rows, hm.cols) == (832, 832)
    assert hm.size_m[1] == pytest.approx(65e-6, rel=1e-15)
    np.testing.assert_array_equal(hm.height_m, np.roll(hm.height_m, 32, axis=1))
    np.testing.assert_array_equal(hm.height_m, hm.height_m[:1].repeat(832, axis=0))


@pytest.mark.parametrize("make", GRATINGS)
def test_a_grating_takes_its_sizes(make):
    hm = make(1e-6, 50e-9, periods=3, samples_per_period=20, rows=1)
    assert hm.height_m.shape == (1, 60)
    assert hm.pixel_size_m == (1e-6 / 20, 1e-6 / 20)


def test_sinusoidal_runs_from_trough_to_crest():
    assert np.ptp(sinusoidal().height_m) == pytest.approx(200e-9, rel=1e-15)


def test_binary_is_ridge_and_floor_in_its_duty():
    np.testing.assert_array_equal(binary(rows=1, periods=1).height_m[0], np.repeat([140e-9, 0.0], 16))
    assert np.count_nonzero(binary(rows=1, periods=1, duty=0.25).height_m) == 8


def test_blazed_rises_along_the_columns_and_drops_between_two():
    period = blazed(rows=1, periods=2).height_m[0]
    step = 246.23e-9 / 32
    # Products and differences of numbers below 2.5e-7 round by a few times 2.6e-23.
    np.testing.assert_allclose(np.diff(period)[:31], step, rtol=0, atol=1e-22)
    assert period[32] - period[31] == pytest.approx(-31 * step, rel=1e-14)


@pytest.mark.parametrize(("name", "relief"), [("elaphe", 375e-9), ("xenopeltis", 818.69e-9)])
def test_a_skin_has_its_relief(name, relief):
    hm = make_sample(name)
    assert np.ptp(hm.height_m) == pytest.approx(relief, rel=1e-12)
    # With a whole number of periods the side is close to the thesis's 65 um, but not equal.
    assert hm.size_m == pytest.approx((65e-6, 65e-6), rel=0.005)


def test_elaphe_is_as_rough_as_the_real_skin(shared_data):
    """The first order along T (45 to 70 periods in 65 um), which makes the colour, has the rms of a real scan's. The
    lobe has some 40 independent bins of speckle, so between scans its power varies by 1 / sqrt(40) = 16 % and its rms
    by 8 %. The test allows three times that."""
    scan = read_height_map(str(shared_data / "snake" / "elaphe_65um.png"), size_um=65, height_nm=375)
    assert _first_order_rms(make_sample("elaphe")) == pytest.approx(_first_order_rms(scan), rel=0.24)


def _first_order_rms(hm):
    height = level_plane(hm).height_m
    window = np.outer(np.hanning(hm.rows), np.hanning(hm.cols))
    power = np.abs(np.fft.fft2(height * window)) ** 2 / (height.size * (window**2).sum())
    y, x = (np.abs(np.fft.fftfreq(n, side)) for n, side in zip(height.shape, hm.pixel_size_m, strict=True))
    order = (x > 45 / 65e-6) & (x < 70 / 65e-6) & (y[:, None] < 10 / 65e-6)
    return float(np.sqrt(power[order].sum()))


@pytest.mark.parametrize("name", DISCS)
def test_a_disc_has_the_pits_of_its_standard(name):
    pitch, width, shortest, longest, depth = DISCS[name]
    hm = make_sample(name)
    pixel = hm.pixel_size_m[0]
    tracks = hm.cols * pixel / pitch
    assert tracks == pytest.approx(round(tracks), rel=1e-12)
    assert hm.height_m.max() == 0
    assert hm.height_m.min() == pytest.approx(-depth, rel=1e-12)
    spacing = round(pitch / pixel)
    # Across the track, the area of a section is width x depth, to half a pixel.
    row, col = np.unravel_index(np.argmin(hm.height_m), hm.height_m.shape)
    middle = spacing * round(col / spacing)
    section = np.roll(hm.height_m[row], spacing // 2 - middle)[:spacing]
    assert -section.sum() * pixel / depth == pytest.approx(width, abs=pixel / 2)
    # Along the track, the length of a pit is that of the pixels below half the depth, to one pixel. To close the track,
    # runs are stretched by less than half a channel bit in hundreds, 0.3 %.
    pits = -hm.height_m[:, ::spacing].T > depth / 2
    for inside in (pits, ~pits):
        runs = np.concatenate([_runs(track) for track in inside]) * pixel
        assert runs.min() == pytest.approx(shortest, abs=pixel + 0.003 * shortest)
        assert runs.max() == pytest.approx(longest, abs=pixel + 0.003 * longest)


def _runs(inside):
    """The lengths of the runs of True in a ring."""
    straight = np.roll(inside, -np.flatnonzero(~inside)[0]).astype(int)
    last, first = np.diff(straight, append=0) < 0, np.diff(straight, prepend=0) > 0
    return np.flatnonzero(last) - np.flatnonzero(first) + 1


@pytest.mark.parametrize(
    ("name", "period", "angle"),
    [
        ("sinusoidal", 2500e-9, 0),
        ("binary", 2500e-9, 0),
        ("blazed", 2500e-9, 0),
        ("elaphe", 1144e-9, 0),
        ("xenopeltis", 1552e-9, 90),
        ("cd", 1600e-9, 0),
        ("dvd", 740e-9, 0),
        ("bluray", 320e-9, 0),
    ],
)
def test_the_strongest_period_is_the_one_told(name, period, angle):
    """To half a bin of the spectrum, which is 1 / 65 um wide (1 / 32 um for Blu-ray), the uncertainty of the skins'
    lobes. An error of half a bin sideways turns the direction by half divided by the number of periods in the scan."""
    hm = make_sample(name)
    figures = describe(hm)
    repeats = hm.size_m[1] / period
    assert figures.periods_m[0] == pytest.approx(period, rel=0.5 / repeats)
    turned = (figures.period_angles_deg[0] - angle + 90) % 180 - 90
    assert abs(turned) <= np.degrees(0.5 / repeats)


def test_flat_has_no_period_and_no_relief():
    figures = describe(make_sample("flat"))
    assert figures.periods_m == ()
    assert figures.height_range_m == figures.height_rms_m == 0


def test_an_unknown_sample_lists_those_there_are():
    with pytest.raises(GratingError, match="^sample:nacre: .*; choose one of .*elaphe"):
        make_sample("nacre")
