# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.maths.chebyshev import bessel_j
from precompute.spectra.series import spectrum_series
from precompute.spectra.spectrum import FrequencyGrid, frequency_grid, scattered_spectrum, zero_order_amplitude
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import binary, blazed, flat, sinusoidal

few = settings(deadline=None, max_examples=40)
PERIODS, SAMPLES, PERIOD, DEPTH = 4, 32, 2.5e-6, 200e-9
WAVELENGTH, W = 520e-9, 1.7
S = W / WAVELENGTH


def rough(seed, shape=(13, 18), pixel=(40e-9, 30e-9), periodic=False, scale=80e-9):
    heights = scale * np.random.default_rng(seed).standard_normal(shape)
    return prepare(HeightMap(heights, pixel, "test", periodic=periodic))


def every_bin(relief, refine=1):
    """All bins of a transform of `refine` times the relief's size along each axis."""
    shape = tuple(refine * n for n in relief.height_m.shape)
    q = (np.sort(np.fft.fftfreq(n, d)) for n, d in zip(shape, relief.pixel_size_m, strict=True))
    return FrequencyGrid(*q, shape)


def grating(make, depth=DEPTH, along_b=False, **options):
    made = make(PERIOD, depth, periods=PERIODS, samples_per_period=SAMPLES, rows=8, **options)
    # Heights that rise along +T in the columns rise along +B in the rows, whose index runs along -B.
    heights = made.height_m.T[::-1] if along_b else made.height_m
    return prepare(HeightMap(heights, made.pixel_size_m, "test", periodic=True))


def orders(relief, s, along_b=False):
    """The efficiencies {m: efficiency} of a grating's orders; fails if light lies beside the orders."""
    grid = every_bin(relief)
    power, zero = scattered_spectrum(relief, s, grid)
    q = grid.q_y if along_b else grid.q_x
    line = power.sum(axis=1 if along_b else 0)
    m = np.rint(q * PERIOD).astype(int)
    on_order = np.abs(q * PERIOD - m) < 1e-9
    # Elsewhere there is only the square of a rounding.
    across = power[:, grid.q_x != 0] if along_b else power[grid.q_y != 0]
    assert line[~on_order].sum() + across.sum() < 1e-25
    found = dict(zip(m[on_order].tolist(), line[on_order].tolist(), strict=True))
    found[0] += zero
    return found


@few
@given(
    st.integers(0, 2**32), st.integers(1, 17), st.integers(1, 17), st.booleans(), st.floats(0, 6e6), st.integers(1, 3)
)
def test_parseval(seed, rows, cols, periodic, s, refine):
    relief = rough(seed, (rows, cols), periodic=periodic)
    power, zero = scattered_spectrum(relief, s, every_bin(relief, refine))
    assert (power >= 0).all()
    assert power.sum() + zero == pytest.approx(1, abs=1e-12)


def test_padding_refines_the_bins_and_not_the_energy():
    """The finer bins include every bin of the unpadded transform. Their power is less, as there are more of them."""
    relief = rough(0, (18, 24))
    plain, fine = every_bin(relief), every_bin(relief, 3)
    coarse_power, _ = scattered_spectrum(relief, S, plain)
    fine_power, _ = scattered_spectrum(relief, S, fine)
    np.testing.assert_allclose(fine.q_y[::3], plain.q_y, rtol=1e-12)
    np.testing.assert_allclose(fine.q_x[::3], plain.q_x, rtol=1e-12)
    np.testing.assert_allclose(9 * fine_power[::3, ::3], coarse_power, atol=1e-15)


def test_a_mirror_scatters_nothing():
    relief = prepare(flat())
    for s in (0.0, 1e5, S, 5.2e6):
        power, zero = scattered_spectrum(relief, s, frequency_grid(relief, 5e6, 1e6))
        assert zero == 1
        assert power.max() == 0


def test_nothing_is_scattered_at_the_horizon():
    """The scattered part grows as s^2; the next term is (2 pi s h)^2 times smaller. At s = 0 the mean phasor is off
    by a few roundings of 1e-16."""
    relief = rough(0)
    grid = every_bin(relief)
    assert scattered_spectrum(relief, 0.0, grid)[0].max() <= 1e-30
    one, ten = (scattered_spectrum(relief, s, grid)[0].sum() for s in (1e2, 1e3))
    assert ten / one == pytest.approx(100, rel=1e-3)


@pytest.mark.parametrize("along_b", [False, True])
def test_a_facet_sends_light_down_its_slope(along_b):
    """A facet h = a x, a > 0, sends light to u = -a w: at depth * s = 1 all light goes to the order m = -1."""
    relief = grating(blazed, DEPTH, along_b)
    s = 1 / DEPTH
    grid = every_bin(relief)
    power, zero = scattered_spectrum(relief, s, grid)
    row, col = np.unravel_index(np.argmax(power), power.shape)
    assert power[row, col] == pytest.approx(1, abs=1e-12)
    lam = 400e-9
    u, v = lam * grid.q_x[col], lam * grid.q_y[row]
    slope, w = DEPTH / PERIOD, s * lam
    assert (v if along_b else u) == pytest.approx(-slope * w, rel=1e-12)
    assert (u if along_b else v) == 0
    assert zero < 1e-24


@pytest.mark.parametrize("turn", [20.0, 110.0, -75.0])
def test_a_turned_blaze_sends_light_where_its_facets_look(turn):
    """On a scan that does not wrap, the order is in the bin nearest to q = -(cos, sin) of the turn over the period."""
    angle = np.radians(turn)
    count, pixel, period = 96, 50e-9, 1.0e-6
    x = np.arange(count) * pixel
    along = x[None, :] * np.cos(angle) + x[:, None] * np.sin(angle)
    heights = DEPTH * ((along / period) % 1)
    relief = prepare(HeightMap(heights[::-1], (pixel, pixel), "test"))
    # Levelling removes a part of the slope, since there are few facets; nine tenths of the light stay in the order.
    grid = every_bin(relief)
    power, _ = scattered_spectrum(relief, 1 / DEPTH, grid)
    row, col = np.unravel_index(np.argmax(power), power.shape)
    bin_q = 1 / (count * pixel)
    assert grid.q_x[col] == pytest.approx(-np.cos(angle) / period, abs=bin_q)
    assert grid.q_y[row] == pytest.approx(-np.sin(angle) / period, abs=bin_q)


@pytest.mark.parametrize("along_b", [False, True])
@pytest.mark.parametrize("depth", [20e-9, 200e-9, 700e-9])
def test_sinusoidal_orders_are_bessel_functions(depth, along_b):
    """The efficiency of order m is J_m(pi s depth)^2. With 32 samples to a period the orders m +- 32 are added to it;
    their amplitude is J_17(7.2) = 5e-4 at worst for |m| < 16, and below 2e-12 for |m| <= 4."""
    z = np.pi * S * depth
    j = bessel_j(z, 64)
    found = orders(grating(sinusoidal, depth, along_b), S, along_b)
    for m in range(-15, 16):
        folded = 2 * abs(j[abs(m)] * j[32 - abs(m)]) + j[32 - abs(m)] ** 2
        assert found[m] == pytest.approx(j[abs(m)] ** 2, abs=folded + 1e-13)
    for m in range(-4, 5):
        assert found[m] == pytest.approx(j[abs(m)] ** 2, abs=1e-11)


@pytest.mark.parametrize("duty", [0.25, 0.5])
def test_binary_orders(duty):
    """With phi = 2 pi s depth and duty D, order m has |1 - exp(-i phi)|^2 (sin(pi m D) / (pi m))^2, and order 0 has
    D^2 + (1 - D)^2 + 2 D (1 - D) cos(phi). With N samples to a period, 1 / (pi m) becomes 1 / (N sin(pi m / N)), which
    is the exact sum over all orders that sampling adds together."""
    phi = 2 * np.pi * S * DEPTH
    found = orders(grating(binary, duty=duty), S)
    zero = duty**2 + (1 - duty) ** 2 + 2 * duty * (1 - duty) * np.cos(phi)
    assert found[0] == pytest.approx(zero, abs=1e-13)
    for m in [*range(-15, 0), *range(1, 16)]:
        analytic = 4 * np.sin(phi / 2) ** 2 * (np.sin(np.pi * m * duty) / (np.pi * m)) ** 2
        x = np.pi * m / SAMPLES
        assert found[m] == pytest.approx(analytic * (x / np.sin(x)) ** 2, abs=1e-13)
    # So the first order is that of the continuous profile to x^2 / 3 = 0.3 %.
    analytic = 4 * np.sin(phi / 2) ** 2 * (np.sin(np.pi * duty) / np.pi) ** 2
    assert found[1] == pytest.approx(analytic, rel=0.0033)


@pytest.mark.parametrize("depth", [100e-9, 246.23e-9, 640e-9])
def test_blazed_orders(depth):
    """Order m has sinc^2(y) with y = s depth + m, so the strongest order is m = -s depth. With N samples to a period it
    is sin^2(pi y) / (N sin(pi y / N))^2, which differs from sinc^2 by (pi y / N)^2 / 3."""
    found = orders(grating(blazed, depth), S)
    for m in range(-12, 13):
        y = S * depth + m
        sampled = (np.sin(np.pi * y) / (SAMPLES * np.sin(np.pi * y / SAMPLES))) ** 2
        assert found[m] == pytest.approx(sampled, abs=1e-13)
        if abs(y) <= 2:
            assert found[m] == pytest.approx(np.sinc(y) ** 2, rel=(np.pi * y / SAMPLES) ** 2 / 2, abs=1e-13)
    assert max(found, key=found.get) == -round(S * depth)


def test_white_noise_heights_spread_evenly():
    """With independent heights each of 4096 bins has (1 - zero) / 4096 on average. The power of a bin is exponentially
    distributed, so the mean of n bins has a relative deviation of 1 / sqrt(n); the test allows four."""
    relief = rough(5, (64, 64), periodic=True)
    power, zero = scattered_spectrum(relief, S, every_bin(relief))
    for band in (power[:32], power[32:], power[:, :32], power[:, 32:]):
        assert band.mean() == pytest.approx((1 - zero) / 4096, rel=4 / np.sqrt(band.size))


@few
@given(st.integers(0, 2**32), st.integers(0, 12), st.integers(0, 17))
def test_a_surface_that_wraps_may_start_anywhere(seed, down, right):
    heights = 80e-9 * np.random.default_rng(seed).standard_normal((13, 18))
    both = (heights, np.roll(heights, (down, right), axis=(0, 1)))
    reliefs = [prepare(HeightMap(h, (40e-9, 30e-9), "test", periodic=True)) for h in both]
    grid = every_bin(reliefs[0])
    (one, zero), (other, other_zero) = (scattered_spectrum(relief, S, grid) for relief in reliefs)
    np.testing.assert_allclose(one, other, atol=1e-15)
    assert zero == pytest.approx(other_zero, abs=1e-14)


def test_a_surface_twice_as_wide_scatters_to_half_the_frequencies():
    heights = 80e-9 * np.random.default_rng(0).standard_normal((12, 16))
    narrow, wide = (prepare(HeightMap(heights, (d, 1.5 * d), "test")) for d in (30e-9, 60e-9))
    (a, _), (b, _) = (scattered_spectrum(r, S, every_bin(r)) for r in (narrow, wide))
    np.testing.assert_allclose(a, b, atol=1e-15)
    np.testing.assert_allclose(every_bin(wide).q_x * 2, every_bin(narrow).q_x, rtol=1e-12)
    np.testing.assert_allclose(every_bin(wide).q_y * 2, every_bin(narrow).q_y, rtol=1e-12)


def test_height_offset_and_sign():
    heights = 80e-9 * np.random.default_rng(0).standard_normal((13, 17))
    up, moved, down = (
        prepare(HeightMap(h, (30e-9, 30e-9), "test", periodic=True)) for h in (heights, heights + 1e-6, -heights)
    )
    grid = every_bin(up)
    power = scattered_spectrum(up, S, grid)[0]
    np.testing.assert_allclose(scattered_spectrum(moved, S, grid)[0], power, atol=1e-15)
    np.testing.assert_allclose(scattered_spectrum(down, S, grid)[0], power[::-1, ::-1], atol=1e-15)


@few
@given(st.integers(1, 40), st.integers(1, 40), st.floats(1e4, 3e7), st.booleans())
def test_kept_bins_are_those_of_the_whole_transform(rows, cols, q_max, periodic):
    relief = rough(1, (rows, cols), periodic=periodic)
    kept, whole = (frequency_grid(relief, most, 5e5) for most in (q_max, np.inf))
    assert kept.transform_shape == whole.transform_shape
    assert all(n >= m for n, m in zip(kept.transform_shape, (rows, cols), strict=True))
    all_power, part = (scattered_spectrum(relief, S, grid)[0] for grid in (whole, kept))
    rows_kept, cols_kept = (np.abs(q) <= q_max for q in (whole.q_y, whole.q_x))
    np.testing.assert_array_equal(kept.q_y, whole.q_y[rows_kept])
    np.testing.assert_array_equal(kept.q_x, whole.q_x[cols_kept])
    np.testing.assert_array_equal(part, all_power[np.ix_(rows_kept, cols_kept)])
    for q, n, d in zip((whole.q_y, whole.q_x), whole.transform_shape, relief.pixel_size_m, strict=True):
        np.testing.assert_array_equal(q, np.sort(np.fft.fftfreq(n, d)))


def test_orders_of_a_surface_that_wraps_are_not_refined():
    relief = grating(sinusoidal)
    grid = frequency_grid(relief, 5e6, 1e-3 / relief.size_m[1])
    assert grid.transform_shape == relief.height_m.shape


def test_a_single_row_is_a_profile():
    """A scan of one row counts as constant along B. Its light stays in the plane v = 0, as that of the same profile
    repeated over many rows does, even if the bins along T need refining."""
    heights = 80e-9 * np.random.default_rng(2).standard_normal((1, 64))
    profile = prepare(HeightMap(heights, (40e-9, 40e-9), "test"))
    grid = frequency_grid(profile, np.inf, 2e4)
    power, zero = scattered_spectrum(profile, S, grid)
    assert power[grid.q_y == 0].sum() + zero == pytest.approx(1, abs=1e-12)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("scale", [20e-9, 150e-9, 400e-9])
def test_the_series_is_the_spectrum(scale, tolerance):
    """At random s, with an error relative to the largest value. The power is exact to 1e-16, and the first node divides
    it by an s^2 up to 1e6 times smaller than the last node's."""
    relief = rough(7, scale=scale)
    grid = every_bin(relief)
    s_max = 2 / 380e-9
    series = spectrum_series(relief, grid, s_max, tolerance=tolerance)
    largest = series.scattered_over_s2.max()
    worst = worst_zero = 0.0
    for s in np.random.default_rng(0).uniform(1e3, s_max, 40):
        power, zero = scattered_spectrum(relief, s, grid)
        answer = np.tensordot(series.weights(s), series.scattered_over_s2, axes=1)
        worst = max(worst, np.abs(answer - power / s**2).max())
        worst_zero = max(worst_zero, abs(series.zero_order(s) - zero))
    assert worst <= tolerance * largest
    # The amplitude is as accurate, and its modulus is at most 1, so its square has at most twice the tolerance as
    # error.
    assert worst_zero <= 2 * tolerance


def test_the_series_takes_arrays_of_s():
    relief = rough(7)
    grid = every_bin(relief)
    s_max = 2 / 380e-9
    done = []
    series = spectrum_series(
        relief, grid, s_max, tolerance=1e-4, progress=lambda stage, fraction: done.append((stage, fraction))
    )
    assert done == [("transforms", (k + 1) / len(done)) for k in range(len(series.amplitude))]
    s = np.linspace(1e5, s_max, 6).reshape(2, 3)
    assert series.weights(s).shape == (2, 3, len(done))
    assert series.zero_order(s).shape == (2, 3)
    exact = np.abs([[zero_order_amplitude(relief, each) for each in row] for row in s]) ** 2
    np.testing.assert_allclose(series.zero_order(s), exact, atol=2e-4)


def test_a_deeper_relief_takes_a_longer_series():
    counts = [
        len(spectrum_series(rough(7, scale=h), every_bin(rough(7)), 5e6, tolerance=1e-4).amplitude)
        for h in (1e-9, 1e-7, 4e-7)
    ]
    assert counts == sorted(counts) and counts[0] >= 4 and counts[2] > 20
