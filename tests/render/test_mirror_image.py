# SPDX-License-Identifier: GPL-3.0-or-later
"""The mirror image of a sun in a flat surface is the sun's disc, in both engines and by each choice of lights."""

import bpy
import numpy as np
import pytest

from precompute.colour.working_space import rgb_from_xyz
from precompute.optics.fresnel import KERATIN_IOR, fresnel_reflectance

from .conftest import clear
from .lamp_scenes import ENGINES
from .world_scenes import assign

PIXELS = 48
ANGLE = np.radians(30)
LUMINANCE = np.linalg.inv(rgb_from_xyz("Rec.709"))[1]


def sun_seen_in_a_plane(stage, diameter):
    """Build a plane and a sun; the camera looks at the sun's image, a third of the picture wide."""
    bpy.ops.mesh.primitive_plane_add(size=2)
    stage.lamp("SUN", to=(np.sin(ANGLE), 0, np.cos(ANGLE)), energy=1.0, angle=diameter)
    stage.camera((-np.sin(ANGLE), 0, np.cos(ANGLE)), angle=3 * diameter)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("lights", ["LAMPS", "REST"])
def test_a_flat_surface_mirrors_the_disc_of_a_sun(stage, flat, engine, lights):
    """Its rms radius and its peak. A pixel is a sixteenth of the disc's diameter. EEVEE."""
    for degrees in (0.5, 1.5, 5):
        clear(stage.addon, stage.scene)
        sun_seen_in_a_plane(stage, np.radians(degrees))
        assign(stage, flat[0], lights)
        image = stage.rgb(engine, PIXELS) @ LUMINANCE
        radius = np.radians(degrees / 2)
        place = (np.arange(PIXELS) + 0.5 - PIXELS / 2) * 6 * radius / PIXELS
        rms = np.sqrt((image * (place**2 + place[:, None] ** 2)).sum() / image.sum())
        peak = fresnel_reflectance(np.cos(ANGLE), KERATIN_IOR) / (np.pi * radius**2)
        print(engine, lights, degrees, rms / (radius / np.sqrt(2)), image.max() / peak, np.median(image[20:28,20:28])/peak, image.sum()*(6*radius/PIXELS)**2/fresnel_reflectance(np.cos(ANGLE), KERATIN_IOR))
