# SPDX-License-Identifier: GPL-3.0-or-later
"""Coupled waves under films that follow the relief: flat films, energy, another solver, and the limit of no depth."""

import numpy as np
import pytest

from laboratory.benchmarks import rcwa
from laboratory.benchmarks.rcwa import Grating, fresnel
from laboratory.benchmarks.rcwa_layers import reflected, slices
from laboratory.benchmarks.rcwa_orders_rows import (
    FACTORS,
    FILMS,
    METALS,
    directions,
    films_of,
    is_of,
    reflectance,
    rigorous_orders,
    small_slope_reflectance,
    spectrum,
)
from laboratory.study.efficiency import PROFILES

STACKS = {name: films_of(name)[1] for name in FILMS}  # at 550 nm


@pytest.mark.parametrize("name", FILMS)
@pytest.mark.parametrize("theta_deg", [0.0, 40.0, 75.0, 85.0])
def test_flat_films_are_those_of_the_bakes(name, theta_deg):
    """precompute/reflectance/films.py has the same reflectance. A relief of 1e-9 wavelengths is flat to 1e-9."""
    index, films = STACKS[name]
    powers = reflected(Grating("binary", 1.5, 1e-9, theta_deg, index=index, films=films))
    expected = reflectance(np.cos(np.radians(theta_deg)), index, films)
    assert powers[:, :-1].sum(axis=1).mean() == pytest.approx(expected, abs=1e-9)


def test_without_films_each_polarisation_is_fresnels():
    powers = reflected(Grating("binary", 1.5, 1e-9, 60.0, index=METALS["gold"]))
    assert powers[:, :-1].sum(axis=1) == pytest.approx(fresnel(60.0, METALS["gold"]), abs=1e-9)


@pytest.mark.parametrize("kind", PROFILES)
@pytest.mark.parametrize("name", [name for name in FILMS if not STACKS[name][0].imag])
def test_no_light_is_lost_without_absorption(name, kind):
    """Rounding, as the sum over up to 200 slices."""
    index, films = STACKS[name]
    powers = reflected(Grating(kind, 1.5, 0.2, 60.0, index=index, films=films), parts=16)
    assert powers.sum(axis=1) == pytest.approx([1, 1], abs=1e-9)


@pytest.mark.parametrize("kind", PROFILES)
def test_light_in_aluminium_is_lost(kind):
    index, films = STACKS["film on aluminium"]
    powers = reflected(Grating(kind, 2.5, 0.2, 60.0, index=index, films=films))
    assert np.all(powers[:, :-1].sum(axis=1) < 1)


@pytest.mark.night("test_no_light_is_lost_without_absorption")
@pytest.mark.parametrize("kind", PROFILES)
@pytest.mark.parametrize("index", [1.56, *METALS.values()])
def test_another_solver_has_the_same_orders(kind, index):
    """Inkstone has the same series and factorisation, so only rounding is left."""
    pytest.importorskip("inkstone", reason="the rigorous solver (inkstone) is in the environment py311-bpy45 only")
    case = Grating(kind, 1.5, 0.2, 60.0, index=index)
    assert reflected(case)[:, :-1] == pytest.approx(rcwa.reflected(case)[:, :-1], abs=1e-9)


def test_travelling_waves_of_a_long_period_are_told_from_decaying_ones():
    """The modes of this grating have rounding of either sign in the imaginary part of q."""
    powers = reflected(Grating("sinusoidal", 8.5, 0.1, 75.0))
    assert powers.sum(axis=1) == pytest.approx([1, 1], abs=1e-9)


def test_a_film_of_the_substrates_index_is_the_substrate():
    bare = Grating("blazed", 1.5, 0.2, 40.0)
    filmed = Grating("blazed", 1.5, 0.2, 40.0, films=((1.56, 0.3), (1.56, 0.05)))
    assert reflected(filmed) == pytest.approx(reflected(bare), abs=1e-9)


def test_a_film_of_air_is_absent():
    bare = Grating("sinusoidal", 1.5, 0.2, 40.0)
    filmed = Grating("sinusoidal", 1.5, 0.2, 40.0, films=((1, 0.3),))
    assert reflected(filmed) == pytest.approx(reflected(bare), abs=1e-9)


def test_films_have_the_same_thickness_in_every_column():
    case = Grating("sinusoidal", 1.5, 0.2, films=((1.4, 0.05), (1.7, 0.31)))
    found = slices(case, 16)
    for index, thickness in case.films:
        columns = sum(part * (permittivities == index**2) for part, permittivities in found)
        assert columns == pytest.approx(np.full(16, thickness), abs=1e-9)


@pytest.mark.night("test_no_light_is_lost_without_absorption")
@pytest.mark.parametrize("name", list(FILMS)[:2])
@pytest.mark.parametrize("kind", PROFILES)
def test_finer_steps_and_more_orders_change_little(name, kind):
    """The largest change of a first order is 4.4 % over aluminium (a sinusoid), and 0.3 % over a dielectric. `./dev
    bench rcwa_orders` prints the same for twelve layers, in a minute."""
    index, films = STACKS[name]
    case = Grating(kind, 1.5, 0.1, 40.0, index=index, films=films)
    usual = rigorous_orders(case, 1, extra=20)
    for finer in (rigorous_orders(case, 1, extra=40), rigorous_orders(case, 1, extra=20, parts=64)):
        assert finer == pytest.approx(usual, rel=0.05 if index.imag else 0.005)


@pytest.mark.night("test_the_form_of_films_is_that_of_the_bare_surface_where_films_change_nothing")
@pytest.mark.parametrize("name", FILMS)
@pytest.mark.parametrize("theta_deg", [0.0, 40.0])
def test_shallow_films_have_the_first_order_in_the_heights(name, theta_deg):
    """All faces rise together. 32 parts of a period lower a first order by 0.3 %, and the walls of the staircase in
    aluminium, in TM light, lower it by 0.6 %."""
    index, films = STACKS[name]
    case = Grating("sinusoidal", 1.5, 0.002, theta_deg, index=index, films=films)
    wi, wr = directions(case, -1)
    expected = FACTORS["small slope"](wi, wr, index, films) * spectrum(case, -1, wi[2] + wr[2])
    assert expected == pytest.approx(rigorous_orders(case, 1, extra=20)[0], rel=8e-3)


def test_the_form_of_films_is_that_of_the_bare_surface_where_films_change_nothing():
    wi, wr = directions(Grating("binary", 1.5, 0.1, 40.0), -1)
    for index in (1.56, METALS["gold"]):
        expected = small_slope_reflectance(wi, wr, index)
        # Rounding, at the loss of light in 0.1 wavelengths of gold.
        assert small_slope_reflectance(wi, wr, index, ((1, 0.3), (index, 0.1))) == pytest.approx(expected, rel=1e-9)


def test_in_the_mirror_image_the_form_of_films_is_their_reflectance():
    for name, (index, films) in STACKS.items():
        wi, wr = directions(Grating("binary", 1.5, 0.1, 40.0), 0)
        expected = reflectance(wi[2], index, films)
        assert small_slope_reflectance(wi, wr, index, films) == pytest.approx(expected, rel=1e-9), name


def test_each_film_is_known_by_its_name():
    for name in FILMS:
        cases = [Grating("binary", 1.5, 0.1, index=index, films=films) for index, films in films_of(name)]
        assert len(set(cases)) == 3
        assert all(is_of(case, name) for case in cases)
        assert not any(is_of(case, other) for case in cases for other in (*METALS, *FILMS) if other != name)
