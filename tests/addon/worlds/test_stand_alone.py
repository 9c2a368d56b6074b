# SPDX-License-Identifier: GPL-3.0-or-later
import bpy
import pytest

from tests.addon.worlds.made import world_with


@pytest.fixture
def world(scene):
    """A world that refers to an object by a node of a group, by a driver and by its own property."""
    world, background = world_with("ShaderNodeTexEnvironment")
    place = bpy.data.objects.new("place", None)
    place.location = (1, 2, 3)
    scene.collection.objects.link(place)
    bpy.context.view_layer.update()
    group = bpy.data.node_groups.new("inner", "ShaderNodeTree")
    group.nodes.new("ShaderNodeTexCoord").object = place
    value = group.nodes.new("ShaderNodeValue")
    value.outputs[0].keyframe_insert("default_value")
    for _ in range(2):
        world.node_tree.nodes.new("ShaderNodeGroup").node_tree = group
    variable = background.inputs["Strength"].driver_add("default_value").driver.variables.new()
    variable.targets[0].id = place
    world["place"], world["number"] = place, 5
    return world


def test_the_copy_refers_to_no_object_and_says_where_it_did(addon, world):
    group = bpy.data.node_groups["inner"]
    with addon.second_blender.stand_alone(world) as alone:
        tree = alone.world.node_tree
        inner = {node.node_tree for node in tree.nodes if node.type == "GROUP"}
        [copied] = inner
        assert copied != group and copied.animation_data is None and tree.animation_data is None
        assert all(node.object is None for node in copied.nodes if node.type == "TEX_COORD")
        [reference] = alone.objects
        assert [row[3] for row in reference["matrix"]] == [1, 2, 3, 1]
        assert bpy.data.node_groups[reference["tree"]].nodes[reference["node"]].type == "TEX_COORD"
        assert reference["property"] == "object"
        assert "place" not in alone.world and alone.world["number"] == 5
    assert list(bpy.data.node_groups) == [group]
    assert world["place"] and group.animation_data and world.node_tree.animation_data


def test_the_copy_goes_also_where_its_use_fails(addon, world):
    count = len(bpy.data.worlds)
    with pytest.raises(ZeroDivisionError), addon.second_blender.stand_alone(world):
        assert len(bpy.data.worlds) == count + 1
        1 / 0  # noqa: B018
    assert len(bpy.data.worlds) == count


def test_only_pictures_with_strokes_are_painted(addon, world):
    node = next(node for node in world.node_tree.nodes if node.type == "TEX_ENVIRONMENT")
    node.image = bpy.data.images.new("plain", 4, 4)
    with addon.second_blender.stand_alone(world) as alone:
        assert alone.painted() == []
        node.image.pixels[0] = 0.5
        assert alone.painted() == [node.image]


def test_even_worlds(addon, world):
    assert not addon.second_blender.is_even(world)
    even, _ = world_with("ShaderNodeRGB")
    assert addon.second_blender.is_even(even)
    even.node_tree.nodes.new("ShaderNodeTexGradient")
    assert not addon.second_blender.is_even(even)
    if bpy.app.version < (5, 0, 0):
        even.use_nodes = False
        assert addon.second_blender.is_even(even)
