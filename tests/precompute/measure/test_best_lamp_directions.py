# SPDX-License-Identifier: GPL-3.0-or-later
"""The best directions of light, against the grating equation."""

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from precompute.bake.ensemble import bake
from precompute.bake.needs import Needs
from precompute.bake.request import BakeRequest
from precompute.measure.best_lamp_directions import (
    AZIMUTH_APART,
    CANDIDATES,
    Lamp,
    Seen,
    are_apart,
    colour_of,
    colours_at,
    covering,
    fibonacci_sphere,
    two_best,
)
from precompute.optics.region import Region
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare
from precompute.table.radiance import Skin, lamp_radiance

PERIOD = 1.6e-6
# A candidate's cell, as a disc, has the radius sqrt(4 / CANDIDATES). The winner may lie that far outside an order.
SPACING = math.sqrt(4 / CANDIDATES)
VISIBLE = 380e-9, 720e-9
SUN = Lamp(irradiance=math.pi, variance=7.6e-5)
# Views of a plane from the normal and from the side.
VIEWS = [(0.0, 0.0, 1.0), (0.0, -0.6, 0.8), (0.5, -0.5, math.sqrt(0.5))]


def ideal(wi, wr, irradiance, variance, *, period=PERIOD):
    """Both first orders of a grating along T, with red at the longest wavelength, then green and blue."""
    u, v, _ = (wi + wr).T
    spread = 0.02**2 + variance
    wavelength = np.abs(u)[:, None] * period
    colour = np.exp(-(((wavelength - (640e-9, 540e-9, 440e-9)) / 50e-9) ** 2))
    return (irradiance * np.exp(-(v**2) / (2 * spread)))[:, None] * colour


@pytest.fixture(scope="module")
def blazed():
    """What a baked blaze of 1.6 um shows."""
    relief = prepare(read_height_map("grating:blazed?period_um=1.6&depth_nm=246"))
    table = bake(relief, BakeRequest(coherence_length_m=10e-6))

    def radiance(wi, wr, irradiance, variance, skin):
        return lamp_radiance(table, wi, wr, irradiance=irradiance[:, None], variance=variance, skin=skin)

    return radiance


def plane(to_view, radiance, normal=(0.0, 0.0, 1.0)):
    """Places on a plane whose T is +X, from which the viewer is far away."""
    t = np.array([1.0, 0.0, 0.0])
    frame = np.stack([t, np.cross(normal, t), normal])
    points = np.random.default_rng(0).uniform(-1, 1, (20, 3)) * (1, 1, 0)
    return Seen(points, np.tile(to_view, (20, 1)), np.tile(frame, (20, 1, 1)), np.arange(20), radiance)


def disc(to_view, radiance):
    """Places on a disc whose T points away from its middle."""
    turn = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    t = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    n = np.tile((0.0, 0.0, 1.0), (90, 1))
    return Seen(t, np.tile(to_view, (90, 1)), np.stack([t, np.cross(n, t), n], axis=1), np.arange(90), radiance)


def evenly(directions):
    return np.ones(len(directions))


def is_coloured(u, v, period=PERIOD, *, orders=(1,), spacing=SPACING):
    """Whether an order sends a visible wavelength to the viewer, to within the candidates' spacing."""
    reached = [VISIBLE[0] / period * m - spacing <= abs(u) <= VISIBLE[1] / period * m + spacing for m in orders]
    # The order is spread along v by its kernel, of at most 0.03 here: 3 standard deviations.
    return any(reached) and abs(v) <= 0.09 + spacing


@pytest.mark.parametrize("view", VIEWS)
def test_the_best_directions_satisfy_the_grating_equation(view):
    first, second = two_best([plane(view, ideal)], SUN, evenly)
    for each in (first, second):
        assert np.linalg.norm(each.direction) == pytest.approx(1)
        u, v, _ = each.direction + view
        assert is_coloured(u, v)
        assert each.colour > 0.1
    turn = np.diff([math.atan2(each.direction[1], each.direction[0]) for each in (first, second)])[0]
    # Each may move within its cell after it was chosen.
    away = 1.5 * SPACING / min(math.hypot(*each.direction[:2]) for each in (first, second))
    assert abs((turn + np.pi) % (2 * np.pi) - np.pi) >= AZIMUTH_APART - 2 * away


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("period_scale", [1.0, 2.0])
def test_a_bake_is_lit_by_the_grating_equation(blazed, view, period_scale):
    radiance = partial(blazed, skin=Skin(period_scale=period_scale))
    first, _ = two_best([plane(view, radiance)], SUN, evenly)
    u, v, _ = first.direction + view
    assert is_coloured(u, v, PERIOD * period_scale, orders=(1, 2, 3))


@pytest.mark.parametrize("view", VIEWS)
def test_a_disc_is_lit_by_the_grating_equation(view):
    """The orders of a disc lie where T is along the tangential part of the sum of both directions."""
    first, _ = two_best([disc(view, ideal)], SUN, evenly)
    assert is_coloured(np.linalg.norm((first.direction + view)[:2]), 0.0)


@pytest.mark.parametrize("side", [1, -1])
def test_a_bake_of_one_side_is_lit_from_there(side):
    """Outside of its region the bake is black, as in the material."""
    region = Region((0.1, 1.0), (-0.2, 0.2)) if side > 0 else Region((-1.0, -0.1), (-0.2, 0.2))
    relief = prepare(read_height_map("grating:sinusoidal?period_um=1.6&depth_nm=246"))
    table = bake(relief, BakeRequest(coherence_length_m=10e-6, needs=Needs(region)))

    def radiance(wi, wr, irradiance, variance):
        return lamp_radiance(table, wi, wr, irradiance=irradiance[:, None], variance=variance)

    first, second = two_best([plane((0.0, 0.0, 1.0), radiance)], SUN, evenly)
    assert first.direction[0] * side > 0.1
    # The mirror image of a sinusoid is coloured too.
    assert second.colour == 0 or second.direction[0] * side > -SPACING


def test_a_near_lamp_shines_from_its_place():
    """A small plane, 1 away from the middle, under a lamp at a distance of 2."""
    seen = plane((0.0, 0.0, 1.0), ideal)
    aside = Seen(seen.points * 1e-3 + (1.0, 0.0, 0.0), seen.to_view, seen.frames, seen.patches, ideal)
    first, _ = two_best([aside], Lamp(math.pi, distance=2.0), evenly)
    to_lamp = 2.0 * first.direction - (1.0, 0.0, 0.0)
    u, v, _ = to_lamp / np.linalg.norm(to_lamp)
    # Seen from the plane, which may be half as far from the lamp, a cell is up to twice as wide.
    assert is_coloured(u, v, spacing=2 * SPACING)


def test_a_far_lamp_is_a_sun():
    seen = [plane(VIEWS[1], ideal)]
    directions = fibonacci_sphere(CANDIDATES)
    far = Lamp(SUN.irradiance, SUN.variance, distance=1e6)
    # Directions and distances differ by 1e-6. The colours change by at most 50 times as much, over the kernel's 0.02.
    np.testing.assert_allclose(colours_at(seen, directions, far), colours_at(seen, directions, SUN), atol=1e-4)


def test_light_from_below_only_for_what_nothing_else_lights():
    below = plane((0.0, 0.0, -1.0), ideal, normal=(0.0, 0.0, -1.0))
    first, _ = two_best([below], SUN, evenly)
    assert first.direction[2] < 0
    above = plane((0.0, 0.0, 1.0), ideal)
    first, second = two_best([above, below], SUN, evenly)
    assert min(first.direction[2], second.direction[2]) > 0


def test_a_preference_decides_between_equals():
    """Both first orders of a plane are equal."""
    for side in (1, -1):
        first, second = two_best([plane((0.0, 0.0, 1.0), ideal)], SUN, lambda d, side=side: 0.6 + 0.4 * side * d[:, 0])
        assert first.direction[0] * side > 0 > second.direction[0] * side


def test_colours_that_mix_in_a_patch_do_not_count():
    """Half of the places show red and half show cyan: alone they are coloured, and together grey."""

    def radiance(wi, *_):
        red = np.arange(len(wi)) % 2 == 0
        return np.where(red[:, None], (1.0, 0.0, 0.0), (0.0, 1.0, 1.0))

    apart = plane((0.0, 0.0, 1.0), radiance)
    mixed = replace(apart, patches=apart.patches // 2)
    up = np.array([[0.0, 0.0, 1.0]])
    assert (colours_at([apart], up, SUN) > 0.5).all()
    np.testing.assert_allclose(colours_at([mixed], up, SUN), np.zeros((1, 10)), atol=1e-12)


def test_no_colour_no_direction():
    black = plane((0.0, 0.0, 1.0), lambda wi, *_: np.zeros(wi.shape))
    white = plane((0.0, 0.0, 1.0), lambda wi, *_: np.full(wi.shape, 5.0))
    behind = plane((0.0, 0.0, -1.0), ideal)
    for seen in (black, white, behind):
        assert two_best([seen], SUN, evenly) is None


def test_one_coloured_direction_has_its_second_at_its_other_side():
    """Only a cap of 20 degrees around (1, 0, 1) shows colour."""
    axis = np.array([1.0, 0.0, 1.0]) / math.sqrt(2)

    def cap(wi, *_):
        return (wi @ axis > math.cos(math.radians(20)))[:, None] * np.array([1.0, 0.2, 0.0])

    first, second = two_best([plane((0.0, 0.0, 1.0), cap)], SUN, evenly)
    np.testing.assert_allclose(second.direction, first.direction * (-1, -1, 1))
    assert second.colour == 0
    assert are_apart(second.direction[None], first.direction)[0]


def test_colour_fades_to_white():
    """Pure red is best near the middle of the exposure. Grey has no colour, and burnt white takes away."""
    red, pale, grey, burnt = colour_of(np.array([[1, 0, 0], [1, 0.6, 0.6], [0.4] * 3, [8.0] * 3]))
    assert 1 > red > pale > grey == 0 > burnt
    # Brighter light of the same hue is paler once it burns out.
    ratios = np.array([1.0, 0.5, 0.3])
    dim, bright = colour_of(np.stack([ratios, 3 * ratios]))
    assert dim > bright


def tilted(radiance, degrees, **more):
    """Places on a plane that is tilted about Y, seen from above."""
    sine, cosine = math.sin(math.radians(degrees)), math.cos(math.radians(degrees))
    frame = np.array([(cosine, 0, -sine), (0, 1, 0), (sine, 0, cosine)])
    count = 20
    return Seen(
        np.zeros((count, 3)), np.tile((0.0, 0.0, 1.0), (count, 1)), np.tile(frame, (count, 1, 1)), np.arange(count),
        radiance, **more,
    )  # fmt: skip


def test_several_lamps_cover_surfaces_that_one_leaves_without_colour():
    """Two planes, 70 degrees apart: the u of one lamp differs by more than an order's width of 0.21 between them."""
    planes = [tilted(ideal, 35), tilted(ideal, -35)]
    found = covering(planes, SUN, evenly, most=3, factors=(1.0,))
    lit = np.stack([colours_at(planes, chosen.direction[None], SUN)[0] for chosen, _ in found]) > 0.02
    assert lit.any(axis=0).all()
    assert not lit[0].all()


def test_the_strength_is_what_the_colours_need():
    """A faint order gets the strongest lamp. On a surface as white as paper the weakest: a stronger one would burn the
    paper out, pi * 0.9 / pi = 0.9 at a factor of 1."""
    faint = covering([tilted(lambda *given: 0.01 * ideal(*given), 0)], SUN, evenly, most=1, factors=(1.0, 2.0, 4.0))
    paper = covering([tilted(ideal, 0, under=0.9)], SUN, evenly, most=1, factors=(1.0, 2.0, 4.0))
    assert (faint[0][1], paper[0][1]) == (4.0, 1.0)


def test_no_lamp_where_nothing_shows_colour():
    assert covering([tilted(lambda wi, wr, *_: np.zeros(wi.shape), 0)], SUN, evenly, most=3, factors=(1.0,)) == []
