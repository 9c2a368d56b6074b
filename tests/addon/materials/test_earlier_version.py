# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffraction groups that an earlier version of the extension saved: shown as saved, and renewed by a new bake."""

import bpy
import pytest

from tests.addon.conftest import reports

OLD = "Energy Conserving"


def add_old_input(tree):
    """Add the input that earlier versions had."""
    socket = tree.interface.new_socket(OLD, in_out="INPUT", socket_type="NodeSocketFloat")
    socket.default_value = 1.0


@pytest.fixture
def skin(scene, grating, addon):
    """A grating's group as an earlier version saved it, and its node in the material, with the input at 0.25."""
    grating.shadows = False
    bpy.ops.grating.assign()
    group = grating.group
    response = addon.response.response_in(group)
    for tree in (group, response.group, response.world):
        add_old_input(tree)
    given = next(node for node in group.nodes if node.type == "GROUP_INPUT").outputs[OLD]
    for node in answers(group):
        group.links.new(given, node.inputs[OLD])
    addon.interface.note_parts(group)
    (node,) = addon.material.diffraction_nodes(grating.material)
    node.inputs[OLD].default_value = 0.25
    return group, node


def answers(group):
    return [node for node in group.nodes if node.label.endswith("Response")]


def is_as_saved(skin):
    group, node = skin
    linked = [answer.inputs[OLD].links for answer in answers(group)]
    return node.inputs[OLD].default_value == 0.25 and all(
        links and links[0].from_socket.name == OLD and links[0].from_node.type == "GROUP_INPUT" for links in linked
    )


def add_lamp(scene):
    scene.collection.objects.link(bpy.data.objects.new("Spot", bpy.data.lights.new("Spot", "SPOT")))
    bpy.context.view_layer.update()


@pytest.mark.parametrize("button", ["assign", "lights"])
def test_it_stays_as_saved_and_one_line_says_how_to_renew_it(scene, addon, skin, button, capfd):
    group, _ = skin
    line = (
        "Diffraction waves: made by an earlier version of this extension, and shown as saved; "
        "to renew it, press Bake Grating, then Assign to Selected"
    )
    assert addon.lost_parts.lost([group]) == [line]
    assert line in addon.data_pictures.wrong_colours(scene)
    with pytest.raises(RuntimeError, match=line):
        bpy.ops.grating.mend()
    assert is_as_saved(skin)
    settings = {"lights": "LAMPS"} if button == "lights" else {}
    assert reports(lambda: getattr(bpy.ops.grating, button)(**settings), capfd).count(line) == 1
    before = len(answers(group))
    add_lamp(scene)
    assert len(answers(group)) == before + 1 and is_as_saved(skin)
    addon.handlers.HANDLERS["load_post"]()
    assert is_as_saved(skin) and addon.lost_parts.lost([group]) == [line]


def test_lost_nodes_are_mended_and_the_response_stays(addon, skin):
    group, _ = skin
    group.nodes.remove(group.nodes["Group Output"])
    (line,) = addon.lost_parts.lost([group])
    assert "press Mend Materials" in line
    bpy.ops.grating.mend()
    assert is_as_saved(skin) and "earlier version" in addon.lost_parts.lost([group])[0]


def test_a_lost_response_needs_a_bake(addon, skin):
    group, _ = skin
    bpy.data.node_groups.remove(addon.response.response_in(group).group)
    (line,) = addon.lost_parts.lost([group])
    assert line.endswith("was deleted; to renew it, press Bake Grating, then Assign to Selected")


def test_a_new_bake_renews_it(addon, grating, skin):
    group, node = skin
    addon.making_materials.refresh_group(grating)  # as a finished bake does
    assert OLD not in node.inputs and not any(OLD in answer.inputs for answer in answers(group))
    assert addon.lost_parts.lost([group]) == []
    assert bpy.ops.grating.assign() == {"FINISHED"}
