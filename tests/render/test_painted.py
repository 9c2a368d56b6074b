# SPDX-License-Identifier: GPL-3.0-or-later
"""A painted strength in a picture: bright where it is white, dark where it is black."""

import bpy
import numpy as np
import pytest

from .test_variation import PIXELS, TOLERANCE, answering, plane

__all__ = ["plane"]


@pytest.mark.parametrize("engine", ["cycles", "eevee"])
@pytest.mark.parametrize("by", ["attribute", "texture"])
def test_the_mask_scales_the_strength(stage, plane, engine, by):  # noqa: F811
    """From 0 at the left edge of the plane of 4 m to 1 at the right; the picture shows the middle 2 m."""
    addon = stage.addon
    material, tree = stage.material("Painted")
    plane.data.materials.append(material)
    white = answering(addon, "white", lambda tree, _: tree.vector(1.0, 1.0, 1.0))
    group = addon.skin.group_around("painted", white, shadows=False, lights="LAMPS")
    tree.node("ShaderNodeOutputMaterial", tree.group(group, {"Base Blend": 0.0})["Shader"])
    node = next(each for each in material.node_tree.nodes if each.type == "GROUP")
    if by == "attribute":
        mask = "mask"
        colours = plane.data.color_attributes.new(mask, "FLOAT_COLOR", "POINT")
        for vertex, colour in zip(plane.data.vertices, colours.data, strict=True):
            colour.color = (*(vertex.co.x / 4 + 0.5,) * 3, 1.0)
    else:
        mask = bpy.data.images.new("mask", PIXELS, 1, is_data=True, float_buffer=True)
        row = (np.arange(PIXELS) + 0.5) / PIXELS
        mask.pixels.foreach_set(np.stack([row, row, row, np.ones(PIXELS)], axis=-1).astype(np.float32).ravel())
        mask.pack()
    addon.group_properties.put_paint(node.inputs["Strength"], mask)
    addon.lighting.update_all_lamps()
    picture = stage.rgb(engine, PIXELS)
    x = (np.arange(PIXELS) + 0.5) / PIXELS
    # The texture is linear between its pixels, and both are linear in x.
    np.testing.assert_allclose(picture.mean(axis=(0, 2)), 0.25 + x / 2, atol=2 * TOLERANCE)
