# SPDX-License-Identifier: GPL-3.0-or-later
"""Exported files hold a material's base and nothing of a bake; the scene is left as it was."""

import json

import bpy
import pytest

from tests.addon.colourful import node_of


@pytest.fixture
def textured(watched):
    """A plane with a grating, whose base has a colour of its own."""
    node_of(watched).inputs["Base"].links[0].from_node.inputs["Base Color"].default_value = (0.5, 0.25, 0.125, 1)
    return watched


def test_gltf_has_the_base_and_no_light(textured, tmp_path, capfd):
    import addon_utils  # importable only after bpy

    addon_utils.enable("io_scene_gltf2", default_set=True)
    bpy.ops.export_scene.gltf(filepath=str(tmp_path / "plane.gltf"), export_format="GLTF_SEPARATE")
    file = json.loads((tmp_path / "plane.gltf").read_text())
    (material,) = file["materials"]
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx((0.5, 0.25, 0.125, 1))
    assert not {"images", "textures"} & file.keys()
    assert not [key for key in material if key.startswith("emissive")]
    assert not node_of(textured).mute
    assert "Diffraction stays in Blender. The file has the base material of Diffraction waves" in capfd.readouterr().out


def test_failed_gltf_shows_the_diffraction_again(textured, addon, monkeypatch, tmp_path):
    """At once by a timer, or in background, where no timer may wait, before the next save or render. A node that the
    artist muted stays muted."""
    later, scene = [], bpy.context.scene
    monkeypatch.setattr(bpy.app.timers, "register", later.append)
    for in_window, shows_again in (
        (True, lambda: later.pop()()),
        (False, lambda: bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"), copy=True)),
        (False, lambda: addon.handlers.show_what_renders(scene)),
    ):
        monkeypatch.setattr(addon.exporting, "has_window", lambda in_window=in_window: in_window)
        addon.exporting.GltfExport().pre_export_hook({})
        assert node_of(textured).mute and bool(later) == in_window
        shows_again()
        assert not node_of(textured).mute and not node_of(textured).keys()
    node_of(textured).mute = True
    addon.exporting.GltfExport().pre_export_hook({})
    addon.exporting.show_again()
    assert node_of(textured).mute


def test_usd_has_no_network_of_the_diffraction(textured, tmp_path):
    if not hasattr(bpy.types, "USDHook"):
        pytest.skip("this Blender was built without USD")
    bpy.ops.wm.usd_export(filepath=str(tmp_path / "plane.usda"), generate_materialx_network=True)
    text = (tmp_path / "plane.usda").read_text()
    assert "UsdPreviewSurface" in text and "(0.5, 0.25, 0.125)" in text
    assert "ND_" not in text and "mtlx:surface" not in text
