# SPDX-License-Identifier: GPL-3.0-or-later
"""A CD's spectrum on a wall, thrown by a Diffraction Lamp: a laser's spots follow the grating equation."""

import bpy
import numpy as np
import pytest

from precompute.cli import parser
from precompute.colour.observer import mirror_xyz
from precompute.colour.spaces import rgb_from_xyz, shown_rgb
from sample_scenes import wall

from .lamp_scenes import add_grating

PITCH_M, LINE_M = 1.6e-6, 532e-9
PIXELS, WIDTH_M = 160, 0.8
MIDDLE = np.array([0.0, 0.2])


@pytest.fixture(scope="module")
def laser(tmp_path_factory):
    """The CD's bake under a green laser."""
    folder = tmp_path_factory.mktemp("laser")
    assert parser.main(["bake", "sample:cd", "--illuminant", "532nm", "-o", str(folder), "--progress", "none"]) == 0
    return folder / "cd.exr"


def spot_on_wall(order):
    """x and z where an order meets the wall: u = m lambda / d along the table, and v = 0 across it."""
    start = np.array([0, 0, wall.CARRIER_HEIGHT_M])
    wi = np.array(wall.SPOT_LOCATION_M) - start
    wi /= np.linalg.norm(wi)
    x, y = order * LINE_M / PITCH_M - wi[0], -wi[1]
    wo = np.array([x, y, np.sqrt(1 - x * x - y * y)])
    return (start + wo * (wall.WALL_M / y))[[0, 2]]


@pytest.fixture
def picture(stage, laser):
    """The wall's radiance (n, n, 3), seen straight on."""
    wall.build_wall(stage.scene)
    stage.scene.world = None
    stage.scene.cycles.max_bounces = 0  # the carrier's own skin also lights the wall
    add_grating(stage, laser)
    carrier = bpy.data.objects["Carrier"]
    bpy.context.view_layer.objects.active = carrier
    carrier.select_set(True)
    assert bpy.ops.grating.lights(lights="LAMPS") == {"FINISHED"}
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert bpy.ops.grating.add_diffraction_lamp(size_mm=2.0, lamp="Spot") == {"FINISHED"}
    stage.camera((MIDDLE[0], 0.1, MIDDLE[1]), (MIDDLE[0], wall.WALL_M, MIDDLE[1]), ortho=WIDTH_M)
    stage.filter = "BOX", 1.0  # the mirror image is smaller than a pixel
    return stage.rgb(pixels=PIXELS, samples=16)


def test_a_lasers_orders_lie_where_the_grating_equation_says(picture):
    """The mirror image, and two orders to either side."""
    along = ((np.arange(PIXELS) + 0.5) / PIXELS - 0.5) * WIDTH_M
    x, z = np.meshgrid(MIDDLE[0] + along, MIDDLE[1] - along)
    green = picture[..., 1]
    for order in (-2, -1, 0, 1, 2):
        wanted = spot_on_wall(order)
        near = np.hypot(x - wanted[0], z - wanted[1]) < 0.04
        weight = green * near
        found = np.array([(x * weight).sum(), (z * weight).sum()]) / weight.sum()
        # A pixel is 5 mm, of which half a millimetre may be lost in sums over a spot. The second order leaves 14
        # degrees above the table. Its spot has a standard deviation of 9 mm, is bent (0.8 mm), and is brighter below,
        # as Stam's obliquity goes as 1 / cos(tr) (0.8 mm).
        assert np.hypot(*(found - wanted)) < 2.5e-3, order
        peak = np.unravel_index(np.argmax(weight), weight.shape)
        assert np.hypot(x[peak] - wanted[0], z[peak] - wanted[1]) < 7.1e-3, order


def test_it_is_the_colour_of_the_laser(picture):
    bright = picture[picture[..., 1] > 0.01 * picture[..., 1].max()]
    wanted = shown_rgb(mirror_xyz("532nm"), rgb_from_xyz())
    # Half floats hold each component of XYZ to 5e-4; the matrix's largest entry is 3.2.
    np.testing.assert_allclose(bright / bright[:, 1:2], np.broadcast_to(wanted / wanted[1], bright.shape), atol=5e-3)
