# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffraction groups saved by another version of Blender. tests/package/test_other_version.py renders such files."""

import bpy
import pytest

from tests.addon.conftest import reports


class Unknown(bpy.types.ShaderNodeCustomGroup):
    """A kind of node that Blender lacks once it is unregistered."""

    bl_idname, bl_label = "ShaderNodeUnknown", "Unknown"


def saved_by_newer(group):
    """Add a node of a kind that this Blender lacks, as 4.5 lacks the Raycast node."""
    bpy.utils.register_class(Unknown)
    group.nodes.new(Unknown.bl_idname)
    bpy.utils.unregister_class(Unknown)


def saved_by_older(group):
    """Remove the Raycast node."""
    for node in [node for node in group.nodes if node.bl_idname == "ShaderNodeRaycast"]:
        group.nodes.remove(node)


SAVED = [saved_by_newer, *([saved_by_older] if bpy.app.version >= (5, 1, 0) else [])]


@pytest.fixture
def group(scene, grating):
    bpy.ops.grating.assign()
    return grating.group


def kinds(group):
    return {node.bl_idname for node in group.nodes}


@pytest.mark.parametrize("saved", SAVED)
def test_it_is_made_anew_when_the_file_is_opened(addon, group, saved, capfd):
    before = kinds(group)
    saved(group)
    assert addon.lost_parts.lost([group]) == [
        "Diffraction waves: another version of Blender saved its nodes; press Mend Materials"
    ]
    addon.handlers.HANDLERS["load_post"]()
    assert kinds(group) == before and addon.lost_parts.lost([group]) == []
    assert "Diffraction waves: nodes rebuilt" in capfd.readouterr().err
    addon.handlers.HANDLERS["load_post"]()
    assert capfd.readouterr().err == "", "it was not made again"


@pytest.mark.parametrize("saved", SAVED)
@pytest.mark.parametrize("button", ["assign", "mend"])
def test_buttons_make_it_anew(group, saved, button, capfd):
    before = kinds(group)
    saved(group)
    assert "another version" not in reports(getattr(bpy.ops.grating, button), capfd)
    assert kinds(group) == before


def test_a_linked_group_says_what_to_do(scene, addon, group, tmp_path):
    """An appended group is rebuilt at once."""
    saved_by_newer(group)
    path = tmp_path / "newer.blend"
    bpy.data.libraries.write(str(path), {group})
    bpy.data.node_groups.remove(group)
    for link in (True, False):
        bring = bpy.ops.wm.link if link else bpy.ops.wm.append
        bring(directory=f"{path}/NodeTree/", filename="Diffraction waves")
        (made,) = filter(addon.skin.is_diffraction, bpy.data.node_groups)
        assert ("NodeUndefined" in kinds(made)) == link
        told = "".join(addon.lost_parts.lost([made]))
        assert ("another version of Blender saved its nodes; make it local" in told) == link
        bpy.data.node_groups.remove(made)
