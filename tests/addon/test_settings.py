# SPDX-License-Identifier: GPL-3.0-or-later
"""What is set on a grating reaches its materials without another press of a button."""

import bpy
import pytest


@pytest.fixture
def nodes(scene, grating):
    """The nodes of the grating's group after Blender has evaluated the scene, as the panel has it do."""
    assert bpy.ops.grating.assign() == {"FINISHED"}

    def found():
        scene.update_tag()
        bpy.context.view_layer.update()
        return [node.as_pointer() for node in grating.group.nodes]

    return found


@pytest.mark.parametrize(("name", "value"), [("footprint", False), ("shadows", False)])
def test_a_setting_reaches_the_material_at_the_next_change(grating, nodes, name, value):
    """What is set already makes no nodes again."""
    before = nodes()
    assert nodes() == before
    setattr(grating, name, value)
    without = nodes()
    assert without != before and nodes() == without
    bpy.ops.grating.assign()
    assert nodes() == without


def test_the_footprint_is_made_where_it_is_set(grating, nodes):
    def has_bumps():
        nodes()
        return any(node.type == "BUMP" for node in grating.group.nodes)

    assert has_bumps()
    grating.footprint = False
    assert not has_bumps()
