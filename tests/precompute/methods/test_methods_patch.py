# SPDX-License-Identifier: GPL-3.0-or-later
"""The patch model: its reference, FLSS over Taylor and Chebyshev images, PQ, NMM."""

import numpy as np
import pytest

from laboratory.study.terms import SERIES
from precompute.base.failure import GratingError
from precompute.colour.observer import S_MAX, observer
from precompute.methods import chebyshev_series, exact, flss, pq
from precompute.methods.method import Settings
from precompute.methods.method_registry import METHODS
from precompute.methods.windowed_images import left_out
from precompute.reference.reference import PatchReference
from precompute.spectra.spectrum import PatchWindow
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed, sinusoidal

PIXEL = 80e-9
EXACT = {"dtype": np.float64, "tolerance": 1e-12}


def skin(periodic=True, shape=(60, 72), seed=3, depth=300e-9):
    """An irregular relief over 4.8 x 5.8 um."""
    rng = np.random.default_rng(seed)
    y, x = (np.arange(n) / n for n in shape)
    waves = sum(np.cos(2 * np.pi * (m * x + n * y[:, None]) + rng.uniform(0, 6)) for m, n in [(1, 1), (0, 2), (4, -1)])
    return prepare(HeightMap(depth / 6 * waves, (PIXEL, PIXEL), "test", periodic=periodic))


def places(count=60, seed=1):
    rng = np.random.default_rng(seed)
    u, v = rng.uniform(-1.5, 1.5, (2, count))
    return u, v, rng.uniform(0.2, 2, count), rng.uniform(380e-9, 780e-9, count)


def length_of(relief):
    """The coherence length that equals one patch, as in the thesis."""
    return relief.size_m[1]


def partial_sum(expansion, height):
    """The expansion at s = 1."""
    coefficients = expansion.coefficients(np.ones(1))[0]
    return sum(c * f for c, f in zip(coefficients, expansion.fields(height), strict=True))


@pytest.mark.parametrize("periodic", [True, False])
def test_the_reference_is_the_written_out_sum(periodic):
    relief = skin(periodic, (9, 12))
    sigma = 0.7e-6
    patch = exact.Patch(PatchWindow(relief, sigma), Settings())
    u, v, w, lam = places(8)
    rows, cols = relief.height_m.shape
    y, x = np.mgrid[-12 * rows : 12 * rows, -12 * cols : 12 * cols]
    g = np.exp(-(x**2 + y**2) * PIXEL**2 / (2 * sigma**2))
    t = relief.apodisation[(y + rows // 2) % rows, (x + cols // 2) % cols]
    h = relief.height_m[(y + rows // 2) % rows, (x + cols // 2) % cols]
    for k in range(8):
        path = (u[k] * x + v[k] * y) * PIXEL + w[k] * h
        amplitude = np.sum(g * t * np.exp(-2j * np.pi / lam[k] * path))
        expected = PIXEL**2 * abs(amplitude) ** 2 / np.sum((g * t) ** 2) / lam[k] ** 2
        assert patch.density(u[k : k + 1], v[k : k + 1], w[k], wavelength_m=lam[k]) == pytest.approx(
            expected, rel=1e-9, abs=1e-12
        )


def test_the_power_over_the_nyquist_cell_is_one():
    relief = skin(False, (10, 12))
    patch = exact.Patch(PatchWindow(relief, 0.4e-6), Settings())
    lam = 500e-9
    q = (np.arange(96) + 0.5) / 96 / PIXEL - 0.5 / PIXEL
    u, v = (c.ravel() * lam for c in np.meshgrid(q, q))
    step = lam / 96 / PIXEL
    assert patch.density(u, v, 1.4, wavelength_m=lam).sum() * step**2 == pytest.approx(1, abs=1e-12)


def test_a_line_grating_takes_the_short_way_to_the_same_end():
    relief = prepare(blazed(periods=2, rows=40))
    reference = PatchReference(exact.build_patch(relief, Settings(coherence_length_m=4e-6)).window)
    u, v, w, lam = places(20)
    args = v / lam, u / lam, w / lam
    long = reference._sums(*args)
    assert np.abs(reference._line_sums(*args) - long).max() <= 1e-11 * np.abs(long).max()


@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize("name", ["flss", "chebyshev"])
def test_all_texels_and_terms_give_the_reference(name, periodic):
    """15 texels of 2 / pi bins leave out exp(-7.5^2 / 2 / 0.64^2) = 1e-30; the phasor is exact to 1e-12, its rounding
    to 1e-16 * e^z = 2e-12 (z = 10 here); the reference's window ends at 6e-13 of its peak."""
    relief = skin(periodic)
    settings = Settings(coherence_length_m=length_of(relief), texels=15, **EXACT)
    u, v, w, lam = places()
    truth = exact.build_patch(relief, settings).density(u, v, w, wavelength_m=lam)
    peak = exact.build_patch(relief, settings).density(np.zeros(1), np.zeros(1), 0.0, wavelength_m=500e-9)[0]
    got = METHODS[name](relief, settings).density(u, v, w, wavelength_m=lam)
    assert np.abs(np.sqrt(got) - np.sqrt(truth)).max() <= 1e-10 * np.sqrt(peak)


def test_three_texels_stay_within_their_bound():
    """|F_n sum| loses at most max |F| times the omitted weights: (S + L)^2 - S^2 over both axes, with S the most that
    three texels weigh and L the bound of the rest. Rows and columns have their own number of bins."""
    relief = skin()
    settings = Settings(coherence_length_m=length_of(relief), **EXACT)
    method = METHODS["flss"](relief, settings)
    u, v, w, lam = places(400)
    truth = exact.build_patch(relief, settings).density(u, v, w, wavelength_m=lam)
    difference = (
        np.abs(np.sqrt(method.density(u, v, w, wavelength_m=lam)) - np.sqrt(truth)) * lam / np.sqrt(method.scale)
    )
    sigma = [length * method.sigma_f for length in relief.size_m]
    rest = [left_out(3, s) for s in sigma]
    kept = [1 + 2 * np.exp(-0.5 / s**2) for s in sigma]
    bound = np.prod(np.add(kept, rest)) - np.prod(kept)
    largest = max(np.abs(np.fft.fft2(np.exp(2j * np.pi * s * relief.height_m))).max() for s in w / lam)
    assert difference.max() <= bound * largest / relief.height_m.size
    # The bound is not idle: three texels lose a visible amount.
    assert difference.max() > 1e-3 * largest / relief.height_m.size
    assert left_out(3, 2 / np.pi) == pytest.approx(0.070, abs=5e-4)


@pytest.mark.parametrize("centred", [True, False])
def test_chebyshev_is_flss(centred):
    relief = prepare(sinusoidal(2e-6, 350e-9, periods=3, rows=96))
    u, v, w, lam = places()
    common = {"coherence_length_m": 6e-6, "centred": centred}
    methods = [METHODS[name](relief, Settings(**common, **EXACT)) for name in ("flss", "chebyshev")]
    one, other = (m.density(u, v, w, wavelength_m=lam) for m in methods)
    assert np.abs(one - other).max() <= 1e-10 * one.max()
    assert methods[1].images.terms.shape[-1] < methods[0].images.terms.shape[-1]


def test_a_number_for_w_is_as_good_as_an_array():
    method = METHODS["chebyshev"](skin(), Settings())
    u, v, _, _ = places()
    assert np.array_equal(
        method.density(u, v, 1.2, wavelength_m=5e-7), method.density(u, v, np.full(len(u), 1.2), wavelength_m=5e-7)
    )


@pytest.mark.parametrize("z", [0.3, 4.0, 12.4, 33.0, 66.0])
def test_the_automatic_terms_keep_their_promise(z):
    t = np.linspace(-1, 1, 401)
    for tolerance in (1e-2, 1e-4, 1e-8):
        taylor, cheb = flss.terms_needed(z, tolerance), chebyshev_series.terms_needed(z, tolerance)
        assert flss.truncation_error(z, taylor) <= tolerance < flss.truncation_error(z, taylor - 1) or taylor <= z + 2
        scale = z / (2 * np.pi)
        exact_phasor = np.exp(-1j * z * t)
        partial = partial_sum(chebyshev_series.Chebyshev(cheb, 0.0, scale), t * scale)
        assert np.abs(partial - exact_phasor).max() <= tolerance
        if z < 13:
            partial = partial_sum(flss.Taylor(taylor, 0.0, scale), t * scale)
            assert np.abs(partial - exact_phasor).max() <= tolerance + 1e-16 * np.exp(z)


@pytest.mark.parametrize(("relief_nm", "terms"), [(150, 8), (400, 13), (1000, 25), (2000, 43)])
def test_chebyshev_terms_of_the_design(relief_nm, terms):
    """docs/theory.md counts the highest order: 7, 12, 24, 42 for an rms error of 1e-3 at 380 nm."""
    errors = SERIES[2].curve(relief_nm * 1e-9, np.float32)
    assert int(np.argmax(errors <= 1e-3)) + 1 == terms
    assert errors[-1] < 1e-7


def test_taylor_dies_in_float32_where_it_is_said_to():
    for relief_nm, least, most in [(150, 0, 1e-6), (400, 5e-4, 5e-3), (1000, 1, np.inf)]:
        error = SERIES[0].curve(relief_nm * 1e-9, np.float32)[-1]
        loss = flss.expected_loss(2 * np.pi * S_MAX * relief_nm * 1e-9, np.float32)
        assert least <= error <= most
        assert error <= loss <= 10 * error
    assert SERIES[0].curve(400e-9, np.float64)[-1] < 1e-10


@pytest.mark.parametrize("centred", [True, False])
def test_a_taylor_run_that_cannot_converge_is_refused_with_the_number(centred):
    deep = prepare(sinusoidal(2e-6, 1000e-9, periods=3, rows=8))
    with pytest.raises(GratingError, match=r"1000 nm of relief cannot converge in float32.*error of [0-9.e+]+"):
        METHODS["flss"](deep, Settings(centred=centred))
    METHODS["chebyshev"](deep, Settings())


def test_thesis_depths_are_not_refused_but_its_xenopeltis_is():
    for depth, fine in [(246e-9, True), (375e-9, True), (819e-9, False)]:
        relief = prepare(sinusoidal(2e-6, depth, periods=1, rows=4))
        if fine:
            METHODS["flss"](relief, Settings())
        else:
            with pytest.raises(GratingError):
                METHODS["flss"](relief, Settings())
            METHODS["flss"](relief, Settings(centred=True))


def test_too_few_terms_are_taken_as_asked():
    relief = skin()
    u, v, w, lam = places()
    settings = Settings(coherence_length_m=length_of(relief), terms=3)
    truth = exact.build_patch(relief, settings).density(u, v, w, wavelength_m=lam)
    got = METHODS["flss"](relief, settings).density(u, v, w, wavelength_m=lam)
    assert np.abs(got - truth).max() > truth.max()


@pytest.mark.parametrize("copies", [1, 2, 7, 26])
def test_copies_add_up(copies):
    phase = np.concatenate([np.linspace(-20, 20, 301), 2 * np.pi * np.arange(-3, 4), [2e-10, 2 * np.pi + 1e-12]])
    expected = np.exp(-1j * np.arange(copies) * phase[:, None]).sum(axis=1)
    assert np.abs(pq.copies_sum(phase, copies) - expected).max() < 1e-8


def test_one_copy_is_the_single_patch():
    """At the bins of the patch, where the sinc interpolation changes nothing."""
    relief = skin()
    settings = Settings(coherence_length_m=PIXEL, **EXACT)
    method = METHODS["pq"](relief, settings)
    assert method.copies == (1, 1)
    lam, s = 500e-9, 1.5 / 500e-9
    k_y, k_x = (k.ravel() for k in np.mgrid[-8:9, -10:11])
    v, u = (k * lam / length for k, length in zip((k_y, k_x), relief.size_m, strict=True))
    transform = np.fft.fft2(np.exp(-2j * np.pi * s * relief.height_m))[k_y, k_x]
    expected = PIXEL**2 * np.abs(transform) ** 2 / relief.height_m.size / lam**2
    assert np.abs(method.density(u, v, 1.5, wavelength_m=lam) - expected).max() <= 1e-9 * expected.max()


def test_copies_of_a_cell_are_the_grating():
    """26 copies of one period against the sum over all pixels of all copies, along u (where orders are) at v = 0."""
    relief = prepare(blazed(periods=4, rows=32))
    settings = Settings(coherence_length_m=10e-6, texels=31, **EXACT)
    method = METHODS["pq"](relief, settings)
    assert method.copies == (4, 4)
    assert method.images.size_m == pytest.approx((2.5e-6, 2.5e-6))
    lam, w = 550e-9, 1.7
    u = np.linspace(-0.6, 0.6, 101)
    x = np.arange(128) * relief.pixel_size_m[1]
    p = np.exp(-2j * np.pi * w / lam * relief.height_m[0])
    amplitude = np.exp(-2j * np.pi * u[:, None] / lam * x) @ p
    # PSD of 128 x 128 pixels: dA |sum|^2 / count, with a sum over rows of 128 at v = 0.
    expected = relief.pixel_size_m[1] ** 2 * np.abs(amplitude) ** 2 / lam**2
    # Between the bins a truncated sinc has an error of some 1 / (pi texels).
    assert np.abs(method.density(u, 0 * u, w, wavelength_m=lam) - expected).max() <= 0.05 * expected.max()
    orders = np.arange(-2, 3) * lam / 2.5e-6
    at_orders = np.abs(np.exp(-2j * np.pi * orders[:, None] / lam * x) @ p) ** 2 * relief.pixel_size_m[1] ** 2 / lam**2
    assert method.density(orders, 0 * orders, w, wavelength_m=lam) == pytest.approx(
        at_orders, rel=1e-6, abs=1e-9 * at_orders.max()
    )


def test_the_printed_product_is_wrong():
    first, second = np.array([0.3 + 0.4j]), np.array([0.1 - 0.9j])
    assert pq.printed_product(first, second) == pytest.approx(0.39 + 1j * (0.03 - 0.36))
    assert pq.printed_product(first, second) != pytest.approx(first * second)
    relief = prepare(blazed(periods=4, rows=32))
    u, v, w, lam = places()
    methods = [METHODS[name](relief, Settings(coherence_length_m=10e-6)) for name in ("pq", "pq-printed")]
    right, printed = (m.density(u, v / 20, w, wavelength_m=lam) for m in methods)
    assert np.abs(printed - right).max() > 0.1 * right.max()


def test_nmm_picks_the_wavelengths_of_the_grating_equation():
    # 2.5 um, u = 0.6: 1500 nm / n, n = 2 (750 nm), 3 (500 nm); n = 1 and n = 4 (375 nm) lie outside 380 to 780 nm.
    relief = prepare(blazed(periods=4))
    method = METHODS["nmm"](relief, Settings(coherence_length_m=10e-6))
    assert method.period_m == pytest.approx(2.5e-6)
    u, v = np.full(81, -0.6), np.full(81, 1e-4)
    lit = [method.density(u[:1], v[:1], 1.8, wavelength_m=lam)[0] > 0 for lam in np.arange(380, 781, 5) * 1e-9]
    assert np.flatnonzero(lit).tolist() == [(500 - 380) // 5, (750 - 380) // 5]


def test_the_jacobian_makes_nmm_agree_with_flss():
    """For a true grating whose orders are narrow against the observer's curves: 400 um of coherence make them 0.3 to
    3 nm wide, which FLSS resolves with steps of a quarter; within 0.5 % of all light."""
    relief = prepare(blazed(periods=4, rows=32))
    rng = np.random.default_rng(5)
    u = np.concatenate([rng.uniform(-0.8, -0.2, 40), rng.uniform(0.2, 0.8, 40)])
    v, w = np.zeros(80), rng.uniform(1, 2, 80)
    settings = Settings(step_m=0.25e-9, coherence_length_m=400e-6)
    full = METHODS["flss"](relief, settings).xyz(u, v, w)
    fixed = METHODS["nmm-jacobian"](relief, settings).xyz(u, v, w)
    assert np.abs(fixed - full).sum() / full.sum() < 0.005
    printed = METHODS["nmm"](relief, settings).xyz(u, v, w)
    # As printed, violet weighs too much: Z against X, of all light together.
    assert printed[:, 2].sum() / printed[:, 0].sum() > 1.2 * full[:, 2].sum() / full[:, 0].sum()


def test_nmm_weighs_a_single_wavelength_by_its_spacing():
    relief = prepare(blazed(periods=4))
    u, v, w = np.array([-0.2]), np.array([0.0]), np.array([1.9])
    methods = [METHODS[name](relief, Settings(coherence_length_m=10e-6)) for name in ("nmm", "nmm-jacobian")]
    printed, fixed = (m.xyz(u, v, w)[0] for m in methods)
    spacing = np.sqrt(np.pi) / (2 * np.pi * 2.5e-6) * 500e-9**2 / 0.2
    assert fixed / printed == pytest.approx(np.full(3, spacing / 5e-9))
    expected = methods[0].full.density(u, v, w, wavelength_m=500e-9) * 5e-9 * observer(np.array([500e-9]))[0]
    assert printed == pytest.approx(expected)


def test_no_period_is_said():
    flat = prepare(HeightMap(np.zeros((16, 16)), (PIXEL, PIXEL), "flat", periodic=True))
    for name in ("nmm", "stam", "gem"):
        with pytest.raises(GratingError, match="no period"):
            METHODS[name](flat, Settings())
        METHODS[name](flat, Settings(period_m=1e-6))
