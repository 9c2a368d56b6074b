# SPDX-License-Identifier: GPL-3.0-or-later
"""What is set on a grating reaches its materials without another press of a button."""

import bpy
import pytest


@pytest.mark.parametrize("name", ["footprint", "shadows"])
def test_a_setting_reaches_the_material_at_the_next_change(scene, grating, addon, name):
    """As the panel does, which tells Blender that the scene has changed. What is set already makes no nodes again."""
    assert bpy.ops.grating.assign() == {"FINISHED"}

    def nodes():
        scene.update_tag()
        bpy.context.view_layer.update()
        return [node.as_pointer() for node in grating.group.nodes]

    before = nodes()
    assert nodes() == before
    setattr(grating, name, False)
    without = nodes()
    assert without != before and nodes() == without
    if name == "footprint":
        assert len(without) < len(before)
        assert not any(node.type == "BUMP" for node in grating.group.nodes)
    bpy.ops.grating.assign()
    assert nodes() == without
