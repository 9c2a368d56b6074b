# SPDX-License-Identifier: GPL-3.0-or-later
"""The ensemble reference, Stam's form, the rainbow (GEM), the bake as a method, and maps."""

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.cli.parser import main
from precompute.colour.spaces import rgb_from_xyz
from precompute.maps import brdf_map
from precompute.methods import gem
from precompute.methods.baked import Baked
from precompute.methods.method import Settings, spectral_sum
from precompute.methods.method_registry import METHODS
from precompute.optics.coherence import kernel_sigma
from precompute.reference.reference import reference_xyz
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed, sinusoidal
from precompute.table.table import Table

LENGTH = 8e-6


@pytest.fixture(scope="module")
def grating():
    return prepare(blazed(periods=4, rows=24))


def places(count=80, seed=2):
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.2, 1.2, count), rng.normal(0, 0.01, count), rng.uniform(0.3, 2, count)


@pytest.mark.parametrize("name", [name for name in METHODS if name != "bake"])
def test_all_methods_have_one_shape(name, grating):
    method = METHODS[name](grating, Settings(coherence_length_m=LENGTH, step_m=50e-9))
    u, v, w = places(5)
    assert method.name == name
    assert method.coherence in ("patch", "ensemble")
    assert method.xyz(u, v, w).shape == (5, 3)
    assert np.all(np.isfinite(method.xyz(u, v, 1.5)))
    if name != "gem":
        assert method.density(u, v, w, wavelength_m=500e-9).shape == (5,)
        assert np.all(method.density(u, v, w, wavelength_m=500e-9) >= 0)


def test_the_ensemble_is_the_core_reference():
    relief = prepare(sinusoidal(2e-6, 200e-9, periods=4, rows=16))
    u, v, _ = places(30)
    method = METHODS["reference"](relief, Settings(coherence_length_m=LENGTH, step_m=10e-9))
    sigma = kernel_sigma(LENGTH)
    scattered, zero = reference_xyz(relief, (u, v), w=1.4, sigma_b=sigma, step_m=10e-9)
    kernel = np.exp(-(u**2 + v**2) / (2 * sigma**2)) / (2 * np.pi * sigma**2)
    assert method.xyz(u, v, 1.4) == pytest.approx(scattered + kernel[:, None] * zero, rel=1e-9, abs=1e-12)


def test_stam_knows_a_true_grating_exactly(grating):
    """Stam's form is exact for a line grating: the reference's density, order by order, up to its kernel's reach of 7
    sigma (2e-11) and this one's of 8."""
    settings = Settings(coherence_length_m=LENGTH)
    u, v, w = places()
    for lam in (420e-9, 650e-9):
        truth = METHODS["reference"](grating, settings).density(u, v, w, wavelength_m=lam)
        got = METHODS["stam"](grating, settings).density(u, v, w, wavelength_m=lam)
        assert np.abs(got - truth).max() <= 1e-9 * truth.max()


def test_stam_orders_of_a_sine_are_bessel_functions():
    from precompute.maths.chebyshev import bessel_j

    stam = METHODS["stam"](prepare(sinusoidal(3e-6, 180e-9, samples_per_period=64, periods=2, rows=4)), Settings())
    s = np.array([1.2e6, 4.1e6])
    for k, one in enumerate(s):
        expected = bessel_j(2 * np.pi * one * 90e-9, 6) ** 2
        for order in range(-5, 6):
            assert stam.efficiency(order, s)[k] == pytest.approx(expected[abs(order)], abs=1e-12)


def test_stam_colours_are_the_integral_of_his_density(grating):
    """Stam's sum takes the orders as lines in u. It equals the integral if the kernel changes no colour: here it is 1
    to 2 nm wide in wavelength."""
    settings = Settings(coherence_length_m=600e-6, step_m=0.25e-9)
    stam = METHODS["stam"](grating, settings)
    u, w = np.array([-0.9, -0.5, -0.21, 0.22, 0.44]), np.linspace(1.2, 1.9, 5)
    integral = spectral_sum(stam.density, u, 0 * u, w=w, settings=settings)
    assert stam.xyz(u, 0 * u, w) == pytest.approx(integral, rel=5e-3, abs=1e-4 * integral.max())


def test_the_rainbow():
    assert gem.bump(np.array([-2, -1, 0, 0.5, 1])) == pytest.approx([0, 0, 1, 0.75, 0])
    rainbow = gem.Gem(1e-6, Settings())
    # u d = 0.75 um is y = 0.5, the middle of green, in the first order; the other orders are under 0.5 um.
    rgb = rainbow.xyz(np.array([0.75, -0.75]), np.zeros(2), np.ones(2)) @ rgb_from_xyz().T
    assert rgb[0] == pytest.approx([0, 1, 0], abs=1e-9)
    assert rgb[1] == pytest.approx(rgb[0])
    assert rainbow.xyz(np.zeros(1), np.zeros(1), np.ones(1))[0, 1] == pytest.approx(1)


def test_colours_without_a_spectrum_say_so():
    table = Table(np.ones((2, 16, 16, 3), np.float32), np.ones((8, 3)), 0.1, 0.25, "D65")
    for method in (gem.Gem(1e-6, Settings()), Baked(table, Settings())):
        with pytest.raises(GratingError, match=f"{method.name}: it h"):
            method.density(np.zeros(1), np.zeros(1), 1.0, wavelength_m=5e-7)


def test_the_bake_as_a_method():
    table = Table(np.random.default_rng(0).random((3, 16, 16, 3)).astype(np.float32), np.ones((8, 3)), 0.1, 0.25, "D65")
    u, v, w = places(20)
    scattered, zero = table.candidate(u, v, w)
    expected = scattered * w[:, None] ** 2 + zero * table.kernel(u, v)[:, None]
    assert Baked(table, Settings()).xyz(u, v, w) == pytest.approx(expected)


def test_a_map_by_a_method_is_the_map_by_the_reference():
    relief = prepare(sinusoidal(2e-6, 150e-9, periods=4, rows=16))
    settings = Settings(coherence_length_m=LENGTH, step_m=40e-9)
    wi = brdf_map.light_from(0.3)
    got = brdf_map.from_method(METHODS["reference"](relief, settings), 16, wi)
    truth = brdf_map.from_reference(
        relief, kernel_sigma(LENGTH), 16, wi=wi, seen=brdf_map.seen_colour(40e-9), stam=True
    )
    assert np.array_equal(np.isnan(got), np.isnan(truth))
    # Near the zero order one form multiplies its kernel by O = 1, the other by Stam's O at the pixel.
    far = np.abs(brdf_map.view_hemisphere(16)[0][..., 0] - np.sin(0.3)) > 8 * kernel_sigma(LENGTH)
    near = np.nanmax(truth)
    assert np.nanmax(np.abs(got - truth)[far]) <= 1e-6 * near


@pytest.mark.parametrize("method", ["flss", "chebyshev", "nmm", "nmm-jacobian", "pq", "pq-printed", "stam", "gem"])
def test_map_verb(method, tmp_path):
    path = tmp_path / "map.png"
    arguments = ["map", "sample:flat", "-o", str(path), "--method", method, "--period-nm", "2500", "--size", "24"]
    assert main([*arguments, "--terms", "4", "--progress", "none", "--step-nm", "20"]) == 0
    assert path.stat().st_size > 100


@pytest.mark.parametrize(("options", "message", "status"), [
    (["--method", "flss", "--terms", "0"], "--terms: '0': give", 2),
    (["--method", "nmm", "--period-nm", "1"], "--period-nm: '1': give", 2),
    (["--method", "nmm"], "no period", 1),
])  # fmt: skip
def test_map_verb_says_what_is_wrong(options, message, status, refused, tmp_path):
    arguments = ("map", "sample:flat", "-o", tmp_path / "map.png", *options, "--progress", "none")
    assert message in refused(*arguments, status=status)


def test_map_verb_refuses_taylor_for_deep_reliefs(tmp_path, capsys):
    path = tmp_path / "map.png"
    assert main(["map", "sample:xenopeltis", "-o", str(path), "--method", "flss", "--progress", "none"]) == 1
    assert "cannot converge in float32" in capsys.readouterr().err
