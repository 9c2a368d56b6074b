# SPDX-License-Identifier: GPL-3.0-or-later
"""EEVEE's limit for a material's constants: the add-on counts them, and leaves out sources that exceed it."""

import subprocess
import sys

import bpy
import numpy as np
import pytest

from devtools import ROOT
from precompute.world_sources.sources import Source

from .test_variation import answering
from .world_scenes import add_ball, add_soft_boxes, assign, look_at_ball


@pytest.mark.night("tests/addon/nodes/test_eevee_constants.py")
def test_the_count_is_never_below_blenders_own(tmp_path):
    """A material that is counted to fit must not be magenta. The count includes 1 to 8 % that Blender does without."""
    command = [sys.executable, "-m", "tests.render.eevee_constants", str(tmp_path)]
    told = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    counted, *blender = map(int, told.splitlines()[-1].split())
    if not blender:
        pytest.skip("this driver does not write shaders to files")
    assert blender[0] <= counted <= 1.1 * blender[0]


@pytest.mark.night("tests/addon/nodes/test_eevee_constants.py")
def test_sources_without_room_are_the_closures(stage, skin, monkeypatch):
    """A world's light is complete, and nothing is counted twice, if its dimmest source is left to the closures."""
    path, _ = skin
    add_soft_boxes(stage)
    add_ball()
    look_at_ball(stage)
    group, made = assign(stage, path, "REST").group, stage.addon.skin
    monkeypatch.setattr(made, "ROOM", group["ng_constants"] - 1 + made._LEFT)
    made.refill(group, made.responses_in(group))
    assert group["ng_sources_read"] == group["ng_sources"] - 1
    fewer = stage.rgb("cycles", 48, 96)[9:-9, 9:-9]
    # The same samples as where the world has this source no more: only single precision differs.
    monkeypatch.undo()
    for what in ("place", "power"):
        del stage.scene[f"ng_world_{group['ng_sources'] - 1}_{what}"]
    stage.scene.update_tag()
    made.refill(group, made.responses_in(group))
    assert group["ng_sources_read"] == group["ng_sources"]
    dropped = stage.rgb("cycles", 48, 96)[9:-9, 9:-9]
    np.testing.assert_allclose(fewer, dropped, rtol=1e-3, atol=1e-4 * fewer.max())
    stage.addon.sky.forget_sources(stage.scene)
    none = stage.rgb("cycles", 48, 96)[9:-9, 9:-9]
    assert np.abs(fewer - none).max() > 0.05 * none.max()
    # The other source is a Gaussian instead of a disc, and sends light below the horizon: 1.2, 1.4 and 2.1 % of red,
    # green and blue, as a mean over 1600 samples a pixel. The noise of 96 is 0.5 %.
    np.testing.assert_allclose(fewer.mean(axis=(0, 1)), none.mean(axis=(0, 1)), rtol=0.03)


@pytest.mark.night("tests/addon/nodes/test_eevee_constants.py")
def test_eevee_shows_as_many_sources_as_it_has_room_for(stage):
    """A response with 60 KB of constants, under a sun and eight sources overhead: each source that is read adds 0.1 to
    the picture. With all of them the material would be magenta. Without loops, 10 KB for each source do the same."""
    made, contract = stage.addon, stage.addon.response
    nodes = 770 if made.compat.HAS_LOOPS else 110

    def answer(tree, _):
        shown = tree.dot(tree.value(tree.node("ShaderNodeNewGeometry").outputs["Position"]), (0.0, 0.0, 1.0))
        for _ in range(nodes):
            ranged = tree.node("ShaderNodeMapRange", shown, 0.0, 1.0, 0.0, 1.0, clamp=False)
            shown = tree.value(ranged.outputs["Result"])
        shown = tree.minimum(tree.maximum(shown, 0.1), 0.1)
        return tree.vector(shown, shown, shown)

    world = bpy.data.node_groups.new("dark", "ShaderNodeTree")
    made.interface.add_interface(world, contract.WORLD_QUESTION, contract.WORLD_ANSWER)
    dark, up = (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    made.builder.Tree(world).output((*dark, 1.0), 0.0, (*dark, 1.0), up, 0.0, up)
    response = contract.Response(answering(made, "large", answer).group, world)
    bpy.ops.mesh.primitive_plane_add(size=4)
    stage.camera((0, 0, 3), ortho=2.0).rotation_euler = (0, 0, 0)
    stage.lamp("SUN", to=(0, 0, 1), energy=1.0, angle=0.0)
    made.follow.follow_lamps(stage.scene)
    source = Source(np.array(up), np.ones(3), 0.0)
    made.sky.hold_sources(stage.scene, [source] * 8, fingerprint="", missed=0.0)
    group = made.skin.group_around("large", response, shadows=False)
    read = group["ng_sources_read"]
    assert 2 < read < 8
    material, tree = stage.material("Large")
    tree.node("ShaderNodeOutputMaterial", tree.group(group, {"Base Blend": 0.0})["Shader"])
    bpy.context.object.data.materials.append(material)
    # EEVEE renders to half floats, of eleven bits.
    np.testing.assert_allclose(stage.rgb("eevee", 8), 0.1 * (1 + read), rtol=2e-3)
