# SPDX-License-Identifier: GPL-3.0-or-later
"""Height Scale against a bake of the shallower relief: the light that a map of views receives."""

import numpy as np
import pytest

from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.maps.brdf_map import light_from, view_hemisphere
from precompute.reflectance.matter import parse
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed
from precompute.table.radiance import Skin, reflected_xyz

ANGLES_DEG = (0, 45, 70, 80)


def light_at(scale, matter, *, stored):
    """The light (angles,) of a blazed grating of 1.5 um and 275 nm in a map, for light from each of ANGLES_DEG: with a
    Height Scale, or with `stored` the heights scaled before the bake."""
    surface = blazed(1.5e-6, 275e-9, periods=3, rows=8)
    heights = surface.height_m * (scale if stored else 1.0)
    request = BakeRequest(delta_e=2, coherence_length_m=6e-6, matter=parse(matter))
    table = bake(prepare(HeightMap(heights, surface.pixel_size_m, "test", periodic=True)), request)
    wr, inside = view_hemisphere(40)
    skin = Skin() if stored else Skin(height_scale=scale)
    views = wr[inside]
    return np.array([
        reflected_xyz(table, np.broadcast_to(light_from(np.radians(angle)), views.shape), views, skin=skin)[:, 1].sum()
        for angle in ANGLES_DEG
    ])  # fmt: skip


@pytest.mark.parametrize("scale", [0.4, 0.7])
def test_of_a_dielectric_it_is_a_bake_of_the_shallower_relief(scale):
    """Both hold functions of the same range of s = c w / lambda. The bakes' colour error of 2 is about 2 % in Y for one
    direction in a hundred, and much less in a sum."""
    ratio = light_at(scale, "dielectric", stored=False) / light_at(scale, "dielectric", stored=True)
    np.testing.assert_allclose(ratio, 1, atol=2e-3)


def test_of_a_metal_it_keeps_the_largest_albedo_as_baked():
    """So all directions are darker by one number, that of the shallower relief over that of the steeper one. The bakes'
    colour error of 2 is about 2 % in Y for one direction in a hundred, and much less in a sum."""
    ratio = light_at(0.7, "aluminium", stored=False) / light_at(0.7, "aluminium", stored=True)
    np.testing.assert_allclose(ratio, ratio.mean(), rtol=5e-3)
    assert 0.8 < ratio.mean() < 1
