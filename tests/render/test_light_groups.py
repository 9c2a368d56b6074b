# SPDX-License-Identifier: GPL-3.0-or-later
"""Cycles' light groups: diffraction is in the group of its object, and all groups together are the picture."""

import bpy
import numpy as np

from .conftest import read_channels
from .lamp_scenes import BEFORE, build


def test_the_groups_are_the_picture_once_the_object_has_one(stage, baked, capsys):
    path, _ = baked
    plane = build(stage, path, BEFORE)
    layer = stage.scene.view_layers[0]
    for name in ("Lamps", "Diffraction"):
        layer.lightgroups.add(name=name)
    for name in BEFORE:
        stage.scene.objects[name].lightgroup = "Lamps"
    stage.render(pixels=8)
    (told,) = stage.addon.material.outside_light_groups(stage.scene)
    assert f"Natural Gratings: {told}\n" in capsys.readouterr().err, "a render in background"
    assert told.startswith("No light group has the diffraction of Plane; give the object a light group of its own")
    assert told in stage.addon.lighting.warnings_about(stage.scene, bpy.context.evaluated_depsgraph_get())
    assert _missing(stage) > 0.1
    plane.lightgroup = "Diffraction"
    assert stage.addon.material.outside_light_groups(stage.scene) == []
    assert abs(_missing(stage)) < 1e-3  # passes may be half floats


def _missing(stage):
    """The share of the picture's light that is in no light group."""
    settings = stage.scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type, settings.use_exr_interleave = "MULTI_LAYER_IMAGE", True
    settings.file_format = "OPEN_EXR_MULTILAYER"
    bpy.ops.render.render(write_still=True)
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    channels = read_channels(stage.folder / "picture.exr")
    parts = [np.sum([channels[f"Combined_{group}.{c}"] for c in "RGB"]) for group in ("Lamps", "Diffraction")]
    return 1 - sum(parts) / np.sum([channels[c] for c in "RGB"])
