# SPDX-License-Identifier: GPL-3.0-or-later
"""Directional albedo and the energy-conserving form (docs/theory.md, section "BRDF")."""

import numpy as np
import pytest

from benchmarks.albedo import directional_albedo, no_bound, surface_of
from precompute.bake import excess_albedo
from precompute.bake.ensemble import bake
from precompute.bake.excess_albedo import albedo_times_cosine, continuum_albedo
from precompute.bake.request import BakeRequest
from precompute.maths import bspline
from precompute.optics.brdf import obliquity_times_cosine_and_w2
from precompute.study import brdf_map
from precompute.surface.relief import prepare
from precompute.surface.samples.gratings import binary, blazed, flat, sinusoidal
from precompute.table import atlas
from precompute.table.albedo_bound import BOUND_COLUMNS, BOUND_ROWS, albedo_bound, texel_directions
from precompute.table.table import Table

COHERENCE_M = 12e-6
SURFACES = {
    "sinusoidal": sinusoidal(periods=8, rows=1),
    "blazed": blazed(periods=8, rows=1),
    "binary": binary(periods=8, rows=1),
    "flat": flat(),
}


def toward(theta_deg, azimuth_deg=0.0):
    """The unit vector at an angle from the normal and an azimuth, both in degrees."""
    theta, azimuth = np.radians(theta_deg), np.radians(azimuth_deg)
    return np.stack([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)], axis=-1)


@pytest.fixture(scope="module")
def bakes():
    """Bakes as their files hold them, and the exact surfaces, by name."""
    found = {}
    for name, height_map in SURFACES.items():
        relief = prepare(height_map)
        baked = atlas.unpack(*atlas.pack(bake(relief, BakeRequest(delta_e=10, coherence_length_m=COHERENCE_M))))
        found[name] = baked, surface_of(relief, baked.sigma_b)
    return found


@pytest.mark.parametrize("name", ["sinusoidal", "blazed"])
def test_no_more_is_reflected_than_received(bakes, name):
    """At most 1.001, where Stam's form reflects more than 10 times as much.

    The albedo is measured by a quadrature that shares nothing with that of the table."""
    baked, surface = bakes[name]
    greatest = np.max(
        [
            directional_albedo(surface, toward(theta, azimuth), lam, [no_bound, baked.albedo_bound_at], 1 << 14)
            for theta in (0, 30, 60, 75, 85, 89, 89.9)
            for azimuth in (0, 37, 90, 180)
            for lam in np.linspace(390e-9, 770e-9, 5)
        ],
        axis=0,
    )
    assert greatest[0] > 10
    assert greatest[1] <= 1.001


def test_the_albedo_is_that_of_the_quadrature(bakes):
    """A / cos(t) against the benchmark's quadrature, to 1 % of it.

    Where an order stands across the horizon, two cosines stand for the part of the kernel above it. At the normal no
    order does, and 1e-3 is kept."""
    _, surface = bakes["sinusoidal"]
    lambdas = np.array([420e-9, 610e-9])
    for theta, tolerance in ((0, 1e-3), (45, 1e-2), (75, 1e-2)):
        wi = toward(theta, 20)
        found = albedo_times_cosine(surface.series, surface.sigma_b, wi[None, None], lambdas=lambdas)[0, 0] / wi[2]
        exact = [directional_albedo(surface, wi, lam, [no_bound], 1 << 16)[0] for lam in lambdas]
        np.testing.assert_allclose(found, exact, rtol=tolerance)


def test_a_mirror_has_albedo_one_and_no_excess(bakes):
    """The albedo is 1 to 1e-6, as near to the horizon as the kernel's reach of five sigma_b allows.

    The bound darkens the mirror nowhere."""
    baked, surface = bakes["flat"]
    theta = np.degrees(np.arcsin(1 - 5.5 * surface.sigma_b))
    for angle in (0, 30, theta):
        assert directional_albedo(surface, toward(angle), 550e-9, [no_bound])[0] == pytest.approx(1, abs=1e-6)
    np.testing.assert_allclose(baked.excess_albedo * 1e3, 0, atol=1e-3)
    assert baked.albedo_bound_at(toward(80)) == pytest.approx(1, abs=1e-5)


def test_the_table_is_read_at_its_texels():
    """At a texel two thirds of it and a sixth of each neighbour are read, along each axis.

    There is no seam around the azimuth. At the horizon and at the normal the rows are mirrored."""
    rng = np.random.default_rng(4)
    table = rng.random((8, 13)).astype(np.float32)
    table[:, -1] = table[:, 0]
    directions = texel_directions(8, 13)
    excess = (albedo_bound(table, directions) - 1) * np.maximum(directions[..., 2], 1e-6)
    around = np.pad(np.pad(table[:, :-1], ((1, 1), (0, 0)), mode="reflect"), ((0, 0), (1, 2)), mode="wrap")
    for axis in (0, 1):
        around = (np.roll(around, 1, axis) + 4 * around + np.roll(around, -1, axis)) / 6
    # The normal has no azimuth, so its row is read in one column only and is left out here.
    np.testing.assert_allclose(excess[:-1], around[1:-2, 1:-1], atol=1e-6)
    # The texel at an azimuth of 180 degrees, approached from both sides.
    near = albedo_bound(table, np.array([toward(60, 180 - 1e-9), toward(60, -180 + 1e-9)]))
    assert near[0] == pytest.approx(near[1], rel=1e-6)
    assert np.all(np.isfinite(albedo_bound(table, np.array([[0, 0, 1.0], [1.0, 0, 0], [0, 1.0, -1e-9]]))))


def test_raised_values_are_not_under_a_parabola():
    """A reading of the raised values of a concave quadric gives the quadric, and no more, wherever it is read."""
    row, column = np.mgrid[:9, :9].astype(float)
    values = 50 - (row - 4) ** 2 - 0.5 * (column - 4) ** 2
    raised = excess_albedo.raised(values)
    y, x = np.random.default_rng(0).uniform(3, 5, (2, 100))
    np.testing.assert_allclose(bspline.read_grid(raised, y, x), 50 - (y - 4) ** 2 - 0.5 * (x - 4) ** 2, rtol=1e-12)


def test_raised_values_are_not_under_what_bends():
    """Whatever the values, a reading of them raised is not below their own parabolas.

    Between two texels, the second difference of the parabola changes linearly from that of one texel to that of the
    other."""
    rng = np.random.default_rng(1)
    values = np.cumsum(rng.standard_normal(64))
    bend = np.maximum(2 * values - np.roll(values, 1) - np.roll(values, -1), 0)
    raised = excess_albedo.raised(np.tile(values, (9, 1)))
    x = rng.uniform(2, 61, 500)
    i, f = x.astype(int), x % 1
    truth = (1 - f) * values[i] + f * values[i + 1] + f * (1 - f) / 2 * ((1 - f) * bend[i] + f * bend[i + 1])
    assert np.all(bspline.read_grid(raised, np.full(500, 4.0), x) >= truth - 1e-12)


def test_the_atlas_never_rounds_the_bound_down(bakes):
    """A half float is at least the value, and at most two of its steps, 2^-11 each, above it."""
    rng = np.random.default_rng(5)
    values = rng.random((16, 17)).astype(np.float32)
    half = atlas.half_above(values).astype(np.float32)
    assert np.all(half >= values)
    assert np.all(half <= values * (1 + 2**-9) + 1e-7)
    assert bakes["binary"][0].excess_albedo.shape == (BOUND_ROWS, BOUND_COLUMNS)


@pytest.mark.parametrize("conserving", [False, True])
def test_reciprocity_in_both_forms(bakes, conserving):
    """f(wi, wr) = f(wr, wi): O and M are symmetric, and the table is read at the same (u, v, w)."""
    baked, _ = bakes["blazed"]
    rng = np.random.default_rng(6)
    z = rng.uniform(0.05, 1, (2, 200))
    turn = rng.uniform(-np.pi, np.pi, (2, 200))
    sine = np.sqrt(1 - z**2)
    wi, wr = np.stack([sine * np.cos(turn), sine * np.sin(turn) * 0.01, z], axis=-1)
    wi, wr = (d / np.linalg.norm(d, axis=1, keepdims=True) for d in (wi, wr))

    def brdf(wi, wr):
        u, v, w = (wi + wr).T
        factor = obliquity_times_cosine_and_w2(wi, wr) / wi[:, 2]
        bound = np.maximum(baked.albedo_bound_at(wi), baked.albedo_bound_at(wr)) if conserving else np.ones(len(wi))
        zero_order = baked.zero_order_xyz(w) * baked.kernel(u, v)[:, None]
        return (factor[:, None] * baked.scattered_over_w2(u, v, w) + zero_order) / bound[:, None]

    assert np.abs(brdf(wi, wr)).max() > 0.1
    np.testing.assert_allclose(brdf(wi, wr), brdf(wr, wi), rtol=1e-9, atol=1e-12)


def test_maps_in_both_forms(bakes):
    """The conserving map is Stam's, divided by the larger bound of the light's and the view's direction."""
    baked, _ = bakes["binary"]
    theta = np.radians(75)
    stam, conserving = (brdf_map.from_bake(baked, 32, theta, conserving=form) for form in (False, True))
    wi, wr, inside = brdf_map.view_hemisphere(32, theta)
    bound = np.maximum(baked.albedo_bound_at(wi), baked.albedo_bound_at(wr[inside]))
    assert bound.max() > 1.2
    np.testing.assert_allclose(conserving[inside] * bound[:, None], stam[inside], rtol=1e-12, atol=1e-12)
    bare = Table(baked.terms, baked.zero_order, baked.sigma_b, baked.texel, baked.illuminant)
    np.testing.assert_array_equal(brdf_map.from_bake(bare, 32, theta)[inside], stam[inside])


def test_turned_light_is_as_good_as_its_own_factors():
    """The picture is in single precision, and a turn changes the order of its sums."""
    relief = prepare(blazed(periods=4, rows=128))
    series = surface_of(relief, 0.02).series
    directions = texel_directions(4, 9)[:, :-1]
    orders, lambdas = np.empty(0, int), np.array([400e-9, 700e-9])
    truth = continuum_albedo(series, orders, 0.02, directions=directions, lambdas=lambdas)
    found = continuum_albedo(series, orders, 0.02, directions=directions[:, :2], lambdas=lambdas, turns=4)
    assert np.ptp(truth[0, :, 0]) > 0.1 * truth.max()
    np.testing.assert_allclose(found, truth, atol=1e-5 * truth.max())
