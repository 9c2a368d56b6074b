# SPDX-License-Identifier: GPL-3.0-or-later
"""The Diffraction Lamp: a lamp that emits the light diffracted by a patch of a grating, so that a screen shows the
spectrum.

Rays from the screen hit a grating and then its lamp only by chance. Every point of the screen samples all lamps, so a
Diffraction Lamp shows the spectrum without noise. It is an area lamp with the position and size of the patch. A surface
element dA at the angle t from its normal emits the intensity

    L cos(t) dA,

as an area lamp of radiance L does. L is the response's answer Lo (response.py) to one of the scene's lamps, evaluated
by the lamp's own nodes. A lamp without *Normalize* and with the strength pi has the radiance of its nodes' emission,
because Blender divides the strength by pi. The lamp shines along its own -Z, which is the normal N of the patch; its X
axis is the direction T of the scan's x axis. It is dark behind the patch.

The lamp's object holds four properties of the lamp that lights the patch (lamps/lamp_drivers.py). Drivers write
them, so the Diffraction Lamp follows that lamp without this extension."""

import math
from collections.abc import Mapping

import bpy

from ..blender import compat
from ..lamps.brightest_lamps import DIFFRACTION_LAMP
from ..lamps.drivers import Drivers
from ..lamps.lamp_drivers import drive_properties
from ..lamps.lamp_group import light_of_object
from ..lamps.lamp_spectrum import is_coloured
from ..nodes.builder import Tree
from ..nodes.interface import Socket, arrange
from .response import IRRADIANCE, NORMAL, SPECTRUM, TANGENT, TO_LIGHT, VARIANCE, ZERO_ORDER, Response

# Ray visibility to switch off: these rays would also see the grating, whose material shows the same light.
_UNSEEN_BY = ("visible_camera", "visible_glossy", "visible_transmission")
# EEVEE ignores a lamp's nodes. These factors switch off the white light that it would emit instead.
_EEVEE_FACTORS = ("diffuse_factor", "specular_factor", "transmission_factor", "volume_factor")


def new_diffraction_lamp(
    scene: bpy.types.Scene, response: Response, lamp: bpy.types.Object, *,
    size_m: float, strength: float, settings: Mapping[Socket, float],
) -> bpy.types.Object:  # fmt: skip
    """A new Diffraction Lamp, not yet in a collection: a square patch of a grating, lit by a lamp of the scene.
    `settings` has a value for each of the response's SETTINGS. `strength` scales the light; 1 is physically correct."""
    data = bpy.data.lights.new("Diffraction Lamp", "AREA")
    data[DIFFRACTION_LAMP] = 1
    data.size, data.normalize, data.energy, data.spread = size_m, False, math.pi, math.pi
    for factor in _EEVEE_FACTORS:
        setattr(data, factor, 0.0)
    _add_nodes(data, response, strength, settings, coloured=is_coloured(lamp.data))
    diffraction_lamp = bpy.data.objects.new(data.name, data)
    for kind in _UNSEEN_BY:
        setattr(diffraction_lamp, kind, False)
    drive_properties(Drivers(scene, diffraction_lamp), 0, lamp)
    return diffraction_lamp


def _add_nodes(
    data: bpy.types.Light, response: Response, strength: float, settings: Mapping[Socket, float], *, coloured: bool
) -> None:
    compat.enable_nodes(data)
    data.node_tree.nodes.clear()
    tree = Tree(data.node_tree)
    n, along = (tree.normalize(tree.from_object(axis)) for axis in ((0.0, 0.0, -1.0), (1.0, 0.0, 0.0)))
    t = tree.normalize(along - n * tree.dot(n, along))
    light = light_of_object(tree, coloured=coloured and response.is_spectral)
    asked = {NORMAL: n, TANGENT: t, TO_LIGHT: light.direction, IRRADIANCE: light.irradiance, VARIANCE: light.variance}
    if light.spectrum is not None:
        asked[SPECTRUM] = light.spectrum
    radiance = response.to_lamp(tree, {**asked, ZERO_ORDER: 1.0, **settings})
    power = tree.dot(light.irradiance, (1.0, 1.0, 1.0))
    lit = tree.math("GREATER_THAN", tree.minimum(tree.dot(light.direction, n), power), 0.0)
    tree.node("ShaderNodeOutputLight", tree.emission(radiance, lit * strength))
    arrange(data.node_tree)
