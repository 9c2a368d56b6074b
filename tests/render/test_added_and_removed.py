# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding diffraction to an artist's own material and removing it again leaves the material as it was."""

import bpy

from .lamp_scenes import AFTER, add_grating, add_lamps, add_plane


def dump(material) -> list[str]:
    """Everything that an artist set in a material, except the positions of its nodes."""
    tree = material.node_tree
    lines = [f"emission_sampling {material.cycles.emission_sampling}", f"own {sorted(material.keys())}"]
    for node in tree.nodes:
        lines.append(f"{node.bl_idname} {node.name!r} {node.label!r} mute {node.mute}")
        for socket in (*node.inputs, *node.outputs):
            if hasattr(socket, "default_value"):
                value = socket.default_value
                value = tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
                lines.append(f"{node.name} {socket.identifier} {value} {socket.hide} {socket.is_output}")
    ends = ((link.from_socket, link.to_socket) for link in tree.links)
    lines += [f"{a.node.name}.{a.identifier} -> {b.node.name}.{b.identifier}" for a, b in ends]
    return sorted(lines)


def artists_material(addon):
    """A material with two outputs, a bump, an artist's own group, and values other than the defaults."""
    material = bpy.data.materials.new("Artist's")
    addon.compat.enable_nodes(material)
    material.node_tree.nodes.clear()
    nodes, links = material.node_tree.nodes, material.node_tree.links
    principled = nodes.new("ShaderNodeBsdfPrincipled")
    principled.name, principled.label = "Mine", "Paint"
    principled.inputs["Base Color"].default_value = (0.3, 0.1, 0.05, 1)
    principled.inputs["Roughness"].default_value = 0.37
    noise, bump = nodes.new("ShaderNodeTexNoise"), nodes.new("ShaderNodeBump")
    links.new(noise.outputs[0], bump.inputs["Height"])
    links.new(bump.outputs[0], principled.inputs["Normal"])
    own = nodes.new("ShaderNodeGroup")
    own.node_tree = bpy.data.node_groups.new("Own", "ShaderNodeTree")
    for target in ("CYCLES", "EEVEE"):
        output = nodes.new("ShaderNodeOutputMaterial")
        output.target = target
        output.location = (300, 0)
        links.new(principled.outputs[0], output.inputs["Surface"])
    links.new(noise.outputs[0], output.inputs["Displacement"])
    material.cycles.emission_sampling = "FRONT"
    return material


def on_a_plane(stage, path, material):
    plane = add_plane()
    plane.data.materials.append(material)
    add_lamps(stage, AFTER)
    return add_grating(stage, path)


def test_diffraction_added_swapped_and_removed_leaves_a_material_as_it_was(stage, baked, addon):
    material = artists_material(addon)
    first = on_a_plane(stage, baked[0], material)
    before = dump(material)
    places = {n.name: tuple(n.location) for n in material.node_tree.nodes}
    assert bpy.ops.grating.add_diffraction() == {"FINISHED"}
    assert material.cycles.emission_sampling == "NONE"
    nodes = addon.material.diffraction_nodes(material)
    assert len(nodes) == 2
    nodes[0].inputs["Rotation"].default_value = 0.3

    second = add_grating(stage, baked[0], "second")
    assert bpy.ops.grating.add_diffraction() == {"FINISHED"}
    nodes = addon.material.diffraction_nodes(material)
    assert {n.node_tree for n in nodes} == {second.group} != {stage.scene.natural_gratings.items[0].group}
    assert first is not second
    assert sorted(round(n.inputs["Rotation"].default_value, 6) for n in nodes) == [0.0, 0.3]
    assert all(n.inputs["Base"].is_linked and n.inputs["Normal"].is_linked for n in nodes)

    assert bpy.ops.grating.remove_diffraction() == {"FINISHED"}
    assert dump(material) == before
    assert {n.name: tuple(n.location) for n in material.node_tree.nodes} == places


def test_diffraction_over_an_output_without_a_shader_is_removed_whole(stage, baked, addon):
    material = artists_material(addon)
    tree = material.node_tree
    for link in list(tree.links):
        tree.links.remove(link)
    on_a_plane(stage, baked[0], material)
    before = dump(material)
    bpy.ops.grating.add_diffraction()
    bpy.ops.grating.remove_diffraction()
    assert dump(material) == before


def test_a_diffraction_node_deleted_by_hand_does_not_lose_the_artists_setting(stage, baked, addon):
    material = artists_material(addon)
    on_a_plane(stage, baked[0], material)
    bpy.ops.grating.add_diffraction()
    for node in addon.material.diffraction_nodes(material):
        material.node_tree.nodes.remove(node)
    bpy.ops.grating.add_diffraction()
    bpy.ops.grating.remove_diffraction()
    assert material.cycles.emission_sampling == "FRONT"
