# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes whose tables hold the reflectance of their matter, against the reference."""

from dataclasses import replace

import numpy as np
import pytest

from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.colour.observer import spectral_weights, wavelengths
from precompute.measure.errors import cosine_weighted, measure
from precompute.measure.truths import truths
from precompute.optics.brdf import fresnel_reflectance
from precompute.optics.mirror_image import mirror_kernel
from precompute.optics.plate import inside_plate
from precompute.reference.reference import reference_xyz
from precompute.reflectance.matter import parse
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.surface.samples.discs import cd
from precompute.surface.samples.reptiles import elaphe
from precompute.surface.samples.ruled_gratings import blazed, flat
from precompute.table import atlas
from precompute.table.radiance import Skin, reflected_xyz

COHERENCE_M = 4e-6
MATTERS = {
    "gold": "gold",
    "film": "2/120nm, 1.56",
    "layers": "6x(1.68/80nm, 1.56/90nm), 1.56",
}


def part_of(sample, side_m):
    """A square of a sample, which does not wrap."""
    whole = sample()
    rows, columns = (round(side_m / pixel) for pixel in whole.pixel_size_m)
    return HeightMap(np.ascontiguousarray(whole.height_m[:rows, :columns]), whole.pixel_size_m, "part")


SURFACES = {
    "blaze": lambda: blazed(periods=2, rows=64),
    "disc": lambda: part_of(cd, 7.5e-6),
    "skin": lambda: part_of(elaphe, 7.5e-6),
}


@pytest.mark.short("film-disc")
@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("matter", MATTERS)
def test_a_bake_looks_like_the_reference(surface, matter):
    """To the requested dE00, at directions that the bake does not know.

    Three values of w are the low, middle and high part of their distribution; one in a hundred pairs of each may exceed
    the requested error by its own spread. The same reference without the reflectance has errors several times as large
    as the request, so the test fails if the table lacks the reflectance or has another."""
    relief, asked = prepare(SURFACES[surface]()), parse(MATTERS[matter])
    table = atlas.unpack(*atlas.pack(bake(relief, BakeRequest(coherence_length_m=COHERENCE_M, matter=asked))))
    white = truths(relief, table.sigma_b, 3, pairs_each=300, step_m=40e-9, seed=4)
    truth = [reflected(relief, one, table, asked) for one in white]
    errors = measure(truth, table.candidate, ratio_ior=table.ratio_ior)
    assert errors.p99 <= 1
    assert errors.zero_order_dy < 2e-3
    assert measure(white, table.candidate, ratio_ior=table.ratio_ior).p99 > 3


def reflected(relief, white, table, matter):
    """The truth of a matter at the pairs of a mirror's truth, divided as the table's light is."""
    u, v = white.pairs.u, white.pairs.v
    colours = reference_xyz(relief, (u, v), w=white.w, sigma_b=table.sigma_b, step_m=5e-9, matter=matter)
    scattered, zero_order = (each / table.largest_albedo for each in colours)
    return replace(white, scattered_xyz=scattered, zero_order_xyz=zero_order)


@pytest.mark.short("disc")
@pytest.mark.parametrize("surface", ["blaze", "disc"])
def test_a_relief_under_a_plate(surface):
    """Against the reference of the relief itself, at the wavelength inside the plate.

    Light of the directions wi' and wr' inside has the phase of n (cos(ti') + cos(tr')) times the height, and its orders
    stay at (u, v) of the directions above. In Stam's form a mirror reflects T T (1 + wi'.wr')^2 cos(ti) / (cos(ti')
    cos(tr')) PSD / w'^2, here over the largest albedo. The bake is good to a dE00 of 1, 1 % of the light, at 99 % of
    the directions; the reference sums every 20 nm, which moves no order by more than half of this kernel."""
    ior = 1.585
    relief = prepare(SURFACES[surface](), plate_ior=ior)
    table = bake(relief, BakeRequest(coherence_length_m=COHERENCE_M, matter=parse(f"plate {ior}, mirror")))
    # The kernel above is that of the same bake without a plate.
    sigma_b = table.sigma_b * ior
    assert sigma_b == pytest.approx(bake(relief, BakeRequest(coherence_length_m=COHERENCE_M, delta_e=10)).sigma_b)
    wi, wr = cosine_weighted(1.3, 400, np.random.default_rng(3))
    inner_i, inner_r = inside_plate(wi, ior), inside_plate(wr, ior)
    # The reference takes one w at a time: the pairs whose w inside is that of the first.
    w = 1.75
    near = np.abs(inner_i[:, 2] + inner_r[:, 2] - w) < 0.02
    wi, wr, inner_i, inner_r = (each[near] for each in (wi, wr, inner_i, inner_r))
    moved = w - inner_r[:, 2]
    inner_i = np.column_stack([inner_i[:, :2] * np.sqrt((1 - moved**2) / (1 - inner_i[:, 2] ** 2))[:, None], moved])
    wi = np.column_stack([inner_i[:, :2] * ior, np.sqrt(1 - (1 - moved**2) * ior**2)])
    u, v = (wi + wr)[:, :2].T
    scattered, zero_order = reference_xyz(relief, (u, v), w=ior * w, sigma_b=sigma_b, step_m=20e-9)
    passed = (1 - fresnel_reflectance(wi[:, 2], ior)) * (1 - fresnel_reflectance(wr[:, 2], ior))
    kernel = mirror_kernel(wi, wr, variance=sigma_b**2)
    cosines = wi[:, 2] / (inner_i[:, 2] * inner_r[:, 2])
    obliquity = (1 + np.sum(inner_i * inner_r, axis=1)) ** 2 * cosines / w**2
    expected = (passed * obliquity)[:, None] * scattered + (passed * kernel)[:, None] * zero_order
    found = reflected_xyz(table, wi, wr, variance=table.kernel_variance, stam=True)
    assert len(wi) > 20
    expected /= table.largest_albedo
    np.testing.assert_allclose(found, expected, rtol=0.02, atol=0.01 * expected.max())


@pytest.mark.parametrize("matter", MATTERS.values())
def test_the_zero_order_is_the_reflectance_at_half_of_w(matter):
    """The half vector of the zero order is the normal's, so the cosine is w / 2. A flat surface reflects nothing else:
    its curve is the colour of R(lambda, w / 2)."""
    asked = parse(matter)
    table = bake(prepare(flat()), BakeRequest(delta_e=10, coherence_length_m=COHERENCE_M, matter=asked))
    w = np.linspace(0, 2, 41)
    expected = asked.reflectance(wavelengths(1e-9), w / 2).T @ spectral_weights(wavelengths(1e-9), "D65")
    # R falls from 1 at w = 0 by 0.012 of the white within a step of the curve. The B-spline of the curve's samples is a
    # sixth of the step off where the curve ends.
    np.testing.assert_allclose(table.zero_order_xyz(w), expected, rtol=0, atol=3e-3)
    assert np.ptp(expected[:, 1]) > 0.05


@pytest.mark.night("test_the_index_of_the_material_does_not_count")
def test_an_index_is_a_dielectric_in_stams_form():
    """The table with matter 1.56 holds R, a dielectric's radiance multiplies by R: both are R O S.

    The two bakes have their own terms, texels and half floats, each good to a dE00 of 0.5 at most of the directions.
    That is 1 % of the light (dE00 38 per unit of luminance); for the sum of both, 3 % of the largest value."""
    relief = prepare(blazed(periods=2, rows=64))
    request = BakeRequest(delta_e=0.5, coherence_length_m=COHERENCE_M)
    dielectric, holding = (bake(relief, replace(request, matter=parse(text))) for text in ("dielectric", "1.56"))
    rng = np.random.default_rng(2)
    wi, wr = cosine_weighted(1.5, 500, rng)
    for w in (0.4, 1.0, 1.9):
        more = cosine_weighted(w, 500, rng)
        wi, wr = np.concatenate([wi, more[0]]), np.concatenate([wr, more[1]])
    skin = Skin(ior=1.56)
    expected, found = (reflected_xyz(table, wi, wr, skin=skin, stam=True) for table in (dielectric, holding))
    # The obliquity (1 + wi.wr)^2 / cos(tr) diverges at the horizon and would make one pair the largest.
    scale = (wi[:, 2] * wr[:, 2])[:, None]
    assert np.abs(scale * (found - expected)).max() <= 0.03 * np.abs(scale * expected).max()
    # R changes from 0.05 to 1, so the wrong half angle would show.
    cosine = np.linalg.norm(wi + wr, axis=1) / 2
    assert np.ptp(fresnel_reflectance(cosine, 1.56)) > 0.2


def test_the_index_of_the_material_does_not_count():
    request = BakeRequest(delta_e=5, coherence_length_m=2e-6, matter=parse("5"))
    table = bake(prepare(blazed(periods=2, rows=64)), request)
    wi, wr = cosine_weighted(1.4, 50, np.random.default_rng(0))
    one, other = (reflected_xyz(table, wi, wr, skin=Skin(ior=ior)) for ior in (1.1, 3.0))
    np.testing.assert_array_equal(one, other)
    assert one.max() > 0.01


def test_the_reference_of_an_index_is_that_of_a_mirror_times_fresnel():
    """An index has the same R at each wavelength, so its colour is the mirror's times R at the half angle."""
    relief = prepare(blazed(periods=1, rows=32))
    u, v = np.random.default_rng(0).uniform(-0.5, 0.5, (2, 20))
    white, found = (
        reference_xyz(relief, (u, v), w=1.3, sigma_b=0.05, step_m=40e-9, matter=parse(text)) for text in ("mirror", "5")
    )
    r = fresnel_reflectance(np.sqrt(u**2 + v**2 + 1.3**2) / 2, 5.0)
    np.testing.assert_allclose(found[0], white[0] * r[:, None], rtol=1e-9)
    np.testing.assert_allclose(found[1], white[1] * fresnel_reflectance(np.array(0.65), 5.0), rtol=1e-9)
