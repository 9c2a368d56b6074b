# SPDX-License-Identifier: GPL-3.0-or-later
"""A purge of the file removes all that a deleted material was made of, shaders' texts included."""

import bpy
import pytest


@pytest.fixture
def osl(scene, grating):
    """The scene with Cycles and Open Shading Language."""
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.cycles.shading_system = True
    bpy.data.batch_remove(list(bpy.data.texts))
    yield
    scene.cycles.shading_system = False


@pytest.mark.skipif(not bpy.app.build_options.cycles_osl, reason="this Blender has no Open Shading Language")
@pytest.mark.parametrize("make", [bpy.ops.grating.assign, lambda: bpy.ops.grating.osl_reference(method="DIRECT")])
def test_no_text_outlives_its_material(scene, osl, make):
    """Before Blender 5.1 a material with shadows has a script."""
    assert make() == {"FINISHED"}
    assert bpy.data.materials
    scene.natural_gratings.items.clear()
    bpy.data.batch_remove(list(bpy.data.materials))
    bpy.ops.outliner.orphans_purge(do_recursive=True)
    assert [text.name for text in bpy.data.texts] == []
    assert not bpy.data.node_groups and not bpy.data.images
