# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes, links, sockets and properties deleted from a Diffraction group: noticed, and restored by Mend Materials."""

import bpy
import pytest

from tests.hostile import lies_edits
from tests.hostile.lying_scene import Skin

# Edits that remove something.
NOTICED = ("has no nodes", "has no links", "lost every third node", "has no sockets", "lost its first socket",
           "has renamed sockets", "has colours for sockets")  # fmt: skip


@pytest.fixture
def skin(scene, grating, addon):
    grating.shadows = False
    assert bpy.ops.grating.assign() == {"FINISHED"}
    return Skin(addon)


def counts(group):
    trees = [group, *(node.node_tree for node in group.nodes if node.type == "GROUP")]
    return [(len(tree.nodes), len(tree.links), len(tree.interface.items_tree)) for tree in trees]


@pytest.mark.short("no links", "third node-the Diffraction", "third node-the response to", "renamed")
@pytest.mark.parametrize("tree", ["the Diffraction group", "the response", "the response to the world"])
@pytest.mark.parametrize("edit", NOTICED)
def test_edited_nodes_are_noticed_and_mended(skin, tree, edit):
    whole = counts(skin.group)
    assert skin.addon.lost_parts.lost([skin.group]) == []
    lies_edits.of_trees()[f"{tree} {edit}"](skin)
    (line,) = skin.addon.lost_parts.lost([skin.group])
    assert "press Mend Materials" in line
    assert bpy.ops.grating.mend() == {"FINISHED"}
    assert skin.addon.lost_parts.lost([skin.group]) == [] and counts(skin.group) == whole
    (node,) = skin.addon.material.diffraction_nodes(skin.material)
    assert node.outputs["Shader"].is_linked or edit in NOTICED[3:]


@pytest.mark.parametrize("name", ["Lamp Irradiance", "Footprint", "Mirror Image"])
def test_an_edited_shared_group_is_made_anew(skin, name):
    bpy.data.node_groups[name].links.clear()
    (line,) = skin.addon.lost_parts.lost([skin.group])
    assert f"were deleted in {name}; press Mend Materials" in line
    bpy.ops.grating.mend()
    assert skin.addon.lost_parts.lost([skin.group]) == []


def test_renamed_sockets_keep_what_an_artist_set(skin):
    (node,) = skin.addon.material.diffraction_nodes(skin.material)
    node.inputs["Rotation"].default_value = 0.5
    lies_edits.of_trees()["the Diffraction group has renamed sockets"](skin)
    bpy.ops.grating.mend()
    assert node.inputs["Rotation"].default_value == 0.5 and node.outputs["Shader"].is_linked


def test_a_group_that_lost_its_properties_is_still_one(skin):
    group = skin.group
    lies_edits.of_trees()["the Diffraction group lost its properties"](skin)
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert skin.first.group == group and skin.addon.skin.is_diffraction(group)
    assert len(skin.addon.material.diffraction_nodes(skin.material)) == 1
