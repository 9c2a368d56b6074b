# SPDX-License-Identifier: GPL-3.0-or-later
"""Add to Materials with a grating that has a look, as a preset gives it: what new Diffraction nodes begin with."""

import json

import bpy
import pytest

from tests.addon.conftest import select


@pytest.fixture
def painted(scene, addon):
    """Two planes with a material of their own each: one half as high as wide, one twice as high."""
    wide = bpy.context.object
    tall = bpy.data.objects.new("Tall", wide.data.copy())
    scene.collection.objects.link(tall)
    for thing, height in ((wide, 0.5), (tall, 2.0)):
        thing.scale.y = height
        material = bpy.data.materials.new(f"Paint of {thing.name}")
        addon.compat.enable_nodes(material)
        thing.data.materials.append(material)
    select(wide, tall)
    bpy.context.view_layer.update()
    return wide, tall


def diffraction(material, addon):
    (node,) = addon.material.diffraction_nodes(material)
    return node


def hologram(material, addon):
    """The pattern before the material's Diffraction node, or None."""
    return addon.hologram_nodes.hologram_of(diffraction(material, addon))


def test_new_nodes_begin_with_the_hologram(painted, grating, addon):
    """The cells follow the shape of the mesh that shows the material."""
    grating.look.hologram = json.dumps({"pattern": "crystal", "inputs": {"Shards": 5}})
    assert bpy.ops.grating.add_diffraction() == {"FINISHED"}
    for plane in painted:
        pattern = hologram(plane.active_material, addon)
        assert addon.hologram_nodes.pattern_of(pattern.node_tree) == "CRYSTAL"
        assert pattern.inputs["Shards"].default_value == 5
        # The UV map's square fills the plane, so its shape is the plane's, to single precision.
        assert pattern.inputs["Aspect"].default_value == pytest.approx(plane.scale.y, rel=1e-5)
    assert bpy.ops.grating.remove_diffraction() == {"FINISHED"}
    assert not any(addon.material.diffraction_nodes(plane.active_material) for plane in painted)
    # Before Blender 5.0 a replaced group is only emptied (compat.remove_replaced).
    assert not [group for group in bpy.data.node_groups if "Hologram" in group.name and group.nodes]


def test_new_nodes_begin_with_the_values(painted, grating, addon):
    """The hologram takes over what it changes."""
    grating.look.inputs = json.dumps({"Roughness": 0.25, "Rotation": 0.5})
    grating.look.hologram = json.dumps({"pattern": "crystal"})
    bpy.ops.grating.add_diffraction()
    for plane in painted:
        node = diffraction(plane.active_material, addon)
        assert node.inputs["Roughness"].default_value == 0.25
        assert hologram(plane.active_material, addon).inputs["Rotation"].default_value == 0.5


def test_a_second_add_leaves_what_an_artist_made_of_it(painted, grating, addon):
    grating.look.hologram = json.dumps({"pattern": "crystal", "inputs": {"Shards": 5}})
    bpy.ops.grating.add_diffraction()
    first, second = (plane.active_material for plane in painted)
    hologram(first, addon).inputs["Shards"].default_value = 9
    hologram(first, addon).inputs["Aspect"].default_value = 3
    addon.hologram_nodes.remove_hologram(diffraction(second, addon))
    bpy.ops.grating.add_diffraction()
    kept = hologram(first, addon).inputs
    assert (kept["Shards"].default_value, kept["Aspect"].default_value) == (9, 3)
    assert hologram(second, addon) is None


def test_materials_that_had_diffraction_get_no_hologram(painted, grating, addon):
    """Neither where the Diffraction node is there, nor where its group was deleted."""
    bpy.ops.grating.add_diffraction()
    bpy.data.node_groups.remove(grating.group)
    grating.look.hologram = json.dumps({"pattern": "crystal"})
    for _ in range(2):
        assert bpy.ops.grating.add_diffraction() == {"FINISHED"}
        assert [hologram(plane.active_material, addon) for plane in painted] == [None, None]


def test_a_damaged_look_changes_nothing(painted, grating, addon):
    grating.look.hologram = json.dumps({"pattern": "stars"})
    with pytest.raises(RuntimeError, match="waves: hologram: pattern: cannot be 'stars'"):
        bpy.ops.grating.add_diffraction()
    assert not any(addon.material.diffraction_nodes(plane.active_material) for plane in painted)
    assert grating.group is None and not bpy.data.node_groups
