# SPDX-License-Identifier: GPL-3.0-or-later
import shutil

import numpy as np
import pytest

from tests.addon.worlds.made import world_with


@pytest.fixture
def world(scene):
    """A world with a picture, a mapping, a ramp, a group and an object that turns it."""
    import bpy

    world, background = world_with("ShaderNodeTexEnvironment")
    tree = world.node_tree
    environment = background.inputs["Color"].links[0].from_node
    environment.image = bpy.data.images.new("sky", 8, 4, float_buffer=True)
    mapping, place = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    place.object = bpy.data.objects.new("turn", None)
    scene.collection.objects.link(place.object)
    tree.links.new(place.outputs["Object"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], environment.inputs["Vector"])
    group = tree.nodes.new("ShaderNodeGroup")
    group.node_tree = bpy.data.node_groups.new("inner", "ShaderNodeTree")
    group.node_tree.nodes.new("ShaderNodeValue").name = "inner"
    tree.nodes.new("ShaderNodeValToRGB")
    tree.nodes.new("ShaderNodeRGBCurve")
    tree.nodes.new("ShaderNodeTexSky")
    return world


def node(world, kind):
    return next(node for node in world.node_tree.nodes if node.bl_idname == kind)


def repaint(world):
    image = node(world, "ShaderNodeTexEnvironment").image
    image.pack()
    assert not image.is_dirty


CHANGES = {
    "strength": lambda world: setattr(node(world, "ShaderNodeBackground").inputs["Strength"], "default_value", 2),
    "mapping": lambda world: setattr(node(world, "ShaderNodeMapping").inputs["Rotation"], "default_value", (0, 0, 1)),
    "texture mapping": lambda world: setattr(
        node(world, "ShaderNodeTexEnvironment").texture_mapping, "rotation", (0, 0, 1)
    ),
    "link": lambda world: world.node_tree.links.remove(node(world, "ShaderNodeBackground").inputs["Color"].links[0]),
    "mute": lambda world: setattr(node(world, "ShaderNodeMapping"), "mute", True),
    "a node": lambda world: world.node_tree.nodes.new("ShaderNodeValue"),
    "in a group": lambda world: setattr(
        node(world, "ShaderNodeGroup").node_tree.nodes["inner"].outputs[0], "default_value", 3
    ),
    "ramp": lambda world: setattr(node(world, "ShaderNodeValToRGB").color_ramp.elements[0], "position", 0.3),
    "curve": lambda world: setattr(node(world, "ShaderNodeRGBCurve").mapping.curves[0].points[0], "location", (0, 0.5)),
    "sun": lambda world: setattr(node(world, "ShaderNodeTexSky"), "sun_elevation", 0.7),
    "object": lambda world: setattr(node(world, "ShaderNodeTexCoord").object.matrix_world, "translation", (1, 0, 0)),
    "projection": lambda world: setattr(node(world, "ShaderNodeTexEnvironment"), "projection", "MIRROR_BALL"),
    "path": lambda world: setattr(node(world, "ShaderNodeTexEnvironment").image, "filepath", "/nowhere.exr"),
    "name": lambda world: setattr(node(world, "ShaderNodeTexEnvironment").image, "name", "other"),
    "painted": repaint,
    "size": lambda world: node(world, "ShaderNodeTexEnvironment").image.scale(16, 8),
    "glossy": lambda world: setattr(world.cycles_visibility, "glossy", False),
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_what_changes_the_light_changes_the_fingerprint(addon, world, change):
    image = node(world, "ShaderNodeTexEnvironment").image
    image.pixels[0] = 1.0
    before = addon.world_changes.fingerprint(world)
    assert addon.world_changes.fingerprint(world) == before
    change(world)
    assert addon.world_changes.fingerprint(world) != before


def test_each_stroke_on_a_painted_picture_changes_the_fingerprint(addon, world):
    image = node(world, "ShaderNodeTexEnvironment").image
    found = set()
    for value in (1.0, 2.0, 3.0):
        image.pixels[-4] = value
        found.add(addon.world_changes.fingerprint(world))
    assert len(found) == 3


@pytest.mark.parametrize("packed", [True, False])
def test_a_picture_with_other_pixels_in_a_file_of_the_same_size(addon, world, tmp_path, packed):
    """Uncompressed, so that the size stays."""
    import bpy

    found, sizes = set(), set()
    for value in (0, 1):
        path = tmp_path / "sky.bmp"
        image = bpy.data.images.new("Sky", 64, 32)
        image.pixels.foreach_set(np.tile(np.float32([value, 0, 0, 1]), 64 * 32))
        image.filepath_raw, image.file_format = str(path), "BMP"
        image.save()
        bpy.data.images.remove(image)
        image = node(world, "ShaderNodeTexEnvironment").image = bpy.data.images.load(str(path))
        image.name = "Picture"
        if packed:
            image.pack()
        sizes.add(image.packed_file.size if packed else path.stat().st_size)
        found.add(addon.world_changes.fingerprint(world))
        bpy.data.images.remove(image)
    assert len(sizes) == 1 and len(found) == 2


def test_what_does_not_change_the_light_does_not(addon, world, scene):
    before = addon.world_changes.fingerprint(world)
    background = node(world, "ShaderNodeBackground")
    background.location, background.select, background.hide = (77, 5), True, True
    scene.frame_set(scene.frame_current + 3)
    assert addon.world_changes.fingerprint(world) == before
    scene.frame_set(1)


def test_a_file_that_is_moved_keeps_it(addon, world, scene, tmp_path):
    """A render farm has the same files at other paths."""
    import bpy

    picture = node(world, "ShaderNodeTexEnvironment").image
    picture.filepath_raw, picture.file_format = str(tmp_path / "sky.exr"), "OPEN_EXR"
    picture.save()
    scene.world = world
    found = [addon.world_changes.fingerprint(world)]
    for folder in ("here", "there"):  # saving makes paths relative
        (tmp_path / folder).mkdir()
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / folder / "shot.blend"))
        found.append(addon.world_changes.fingerprint(world))
    shutil.copy(tmp_path / "sky.exr", tmp_path / "there" / "sky.exr")
    picture.filepath = "//sky.exr"
    assert {*found, addon.world_changes.fingerprint(world)} == {found[0]}
    picture.scale(16, 8)
    picture.save()
    assert addon.world_changes.fingerprint(world) != found[0]


def test_a_driver_changes_it_with_the_frame(addon, world, scene):
    strength = node(world, "ShaderNodeBackground").inputs["Strength"]
    strength.driver_add("default_value").driver.expression = "frame * 2"
    scene.world = world
    scene.frame_set(4)
    before = addon.world_changes.fingerprint(world)
    scene.frame_set(5)
    assert addon.world_changes.fingerprint(world) != before
    scene.frame_set(1)
